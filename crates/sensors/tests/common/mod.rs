//! Packets as a Kinect sends them, and where the recordings are.
#![allow(dead_code, clippy::unwrap_used)] // each test program uses a part; tests may unwrap

use sphereflow_sensors::kinect::Mode;
use sphereflow_sensors::usb_packet::{HEADER_BYTES, Header, Place};
use std::path::PathBuf;

/// The recordings' folder, or `None` with a message where it is not set.
pub fn recordings(folder: &str) -> Option<PathBuf> {
    match std::env::var_os("SPHEREFLOW_DATA") {
        Some(root) => Some(PathBuf::from(root).join(folder)),
        None => {
            eprintln!("skipped: SPHEREFLOW_DATA is not set");
            None
        }
    }
}

/// Pixels' bytes of frame `index`: every byte differs from its neighbours and from frame to frame.
pub fn frame_data(mode: &Mode, index: usize) -> Vec<u8> {
    (0..mode.frame_bytes())
        .map(|i| (i * 7 + i / 251 + 31 * index) as u8)
        .collect()
}

/// The packets of a frame whose first one has number `first`.
pub fn packets_of(mode: &Mode, data: &[u8], first: usize, ticks: u32) -> Vec<Vec<u8>> {
    let count = mode.packets();
    let packet = |i: usize| {
        let place = match i {
            0 => Place::Start,
            i if i + 1 == count => Place::End,
            _ => Place::Middle,
        };
        let begin = i * mode.packet_data();
        let data = &data[begin..begin + mode.data_of(i)];
        let header = Header {
            stream: mode.stream(),
            place,
            sequence: [0, (first + i) as u8],
            length: HEADER_BYTES + data.len(),
            ticks: if i == 0 { 0 } else { ticks },
        };
        header.to_bytes().iter().chain(data).copied().collect()
    };
    (0..count).map(packet).collect()
}

/// The packets of some frames in a row, 1/30 s apart.
pub fn packets(mode: &Mode, frames: usize) -> Vec<Vec<u8>> {
    let frame = |i: usize| {
        let ticks = 2_000_000 * (i as u32 + 1);
        packets_of(mode, &frame_data(mode, i), i * mode.packets(), ticks)
    };
    (0..frames).flat_map(frame).collect()
}
