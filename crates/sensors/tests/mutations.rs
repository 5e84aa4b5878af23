//! Every decoder on millions of damaged streams: no panic, no unbounded memory.
//!
//! `SPHEREFLOW_MUTATIONS` sets the inputs for each decoder; a few hundred without it.

mod common;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sphereflow_sensors::fuzz::{ENTRIES, join};
use sphereflow_sensors::imu::{epson::BurstFormat, vectornav, xsens};
use sphereflow_sensors::kinect::{CameraCommand, Mode};

/// Inputs for each decoder where nothing else is said: a second in all.
const INPUTS: usize = 300;

/// A stream that the decoder named can read.
fn good(name: &str) -> Vec<u8> {
    match name {
        "kinect_depth_packets" => joined(&Mode::DEPTH_11),
        "kinect_video_packets" => joined(&Mode::BAYER),
        "ps1080_packets" => common::packets(&Mode::DEPTH_11, 1)[..20].concat(),
        "control_replies" => {
            let reply: Vec<u8> = [b"RB", &[161, 0, 4, 0, 0, 0, 0, 0][..], &[60; 320]].concat();
            join([&reply[..], &CameraCommand::Read(3).to_bytes(1)])
        }
        "epson" => (0..8)
            .flat_map(|i| BurstFormat::STANDARD.encode(0.0, [1.0; 3], [2.0; 3], i))
            .collect(),
        "xsens" => xsens::frame(&[0x10, 0x20, 2, 0, 1, 0xc0, 0x20, 2, 9, 9]).repeat(8),
        "vectornav" => vectornav::frame(5, &[0x21, 0x100], &[1; 32]).repeat(8),
        _ => b"1000,1,2,3,4,5,6*31\n2000,1,2,3,4,5,6,7,8,9\n".repeat(4),
    }
}

/// Few packets of two frames: their begins and their ends.
fn joined(mode: &Mode) -> Vec<u8> {
    let all = common::packets(mode, 2);
    let (begin, end) = (
        all[..6].iter(),
        all[mode.packets() - 4..mode.packets() + 6].iter(),
    );
    join(begin.chain(end).map(Vec::as_slice))
}

fn mutate(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(1..8) {
        if bytes.is_empty() {
            return;
        }
        let at = rng.random_range(0..bytes.len());
        match rng.random_range(0..5) {
            0 => bytes[at] = rng.random(),
            1 => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => bytes.truncate(at),
            3 => {
                let end = (at + rng.random_range(1..40)).min(bytes.len());
                bytes.drain(at..end);
            }
            _ => {
                let end = (at + rng.random_range(1..40)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
}

#[test]
fn decoders_of_damaged_streams_do_not_panic() {
    let inputs = std::env::var("SPHEREFLOW_MUTATIONS").ok();
    let inputs = inputs.map_or(INPUTS, |text| text.parse().unwrap());
    for (name, entry) in ENTRIES {
        let good = good(name);
        let mut rng = ChaCha8Rng::seed_from_u64(26);
        for _ in 0..inputs {
            let mut bytes = good.clone();
            mutate(&mut bytes, &mut rng);
            entry(&bytes);
        }
    }
}
