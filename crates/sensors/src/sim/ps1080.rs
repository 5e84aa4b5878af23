//! A PS1080 in the same process: the real control messages and bulk streams, of any pictures.

use super::Picture;
use crate::bits::pack;
use crate::colour::{Order, yuv422_from_rgb};
use crate::disparity::DisparityModel;
use crate::ps1080::camera::{DEPTH_ENDPOINT, IMAGE_ENDPOINT};
use crate::ps1080::{DEPTH_STREAM, IMAGE_STREAM, compress_depth, compress_yuv};
use crate::usb::{Request, UsbLink};
use crate::usb_packet::{HEADER_BYTES, Header, Place};
use crate::{Error, Result};
use sphereflow_core::Stamp;
use std::collections::{HashMap, VecDeque};
use std::time::Duration;

/// Bytes of a packet after its header.
const PACKET_DATA: usize = 3000;
/// Bytes of a transfer: packets begin and end anywhere in it.
const TRANSFER: usize = 4096;

#[derive(Default)]
struct Stream {
    submitted: bool,
    frame: usize,
    sent: u16,
}

/// The device: firmware 5.8.22, depth packed with 11 bits or compressed, colour as YUV.
pub struct Ps1080Simulator {
    parameters: HashMap<u16, u16>,
    replies: VecDeque<Vec<u8>>,
    streams: [Stream; 2],
    lose_every: u16,
    started: Stamp,
    picture: Box<dyn FnMut(usize) -> Picture + Send>,
}

impl Ps1080Simulator {
    /// A device that sees `picture(i)`, 640x480, in frame `i`; every `lose_every`th packet is lost, none
    /// with 0.
    pub fn new(
        lose_every: u16,
        started: Stamp,
        picture: impl FnMut(usize) -> Picture + Send + 'static,
    ) -> Self {
        Self {
            parameters: HashMap::new(),
            replies: VecDeque::new(),
            streams: Default::default(),
            lose_every,
            started,
            picture: Box::new(picture),
        }
    }

    fn get(&self, parameter: u16) -> u16 {
        self.parameters.get(&parameter).copied().unwrap_or(0)
    }

    fn reply(&self, opcode: u16, payload: &[u16]) -> Vec<u8> {
        let model = DisparityModel::TYPICAL;
        match opcode {
            0 => vec![8, 5, 0x22, 0, 0x20, 0x20, 0x20, 0, 0, 0, 0, 0],
            4 => {
                let mut fixed = vec![0; 168];
                let lengths = [
                    model.baseline_cm,
                    model.colour_baseline_cm,
                    model.reference_cm,
                    model.pixel_cm,
                ];
                for (i, length) in lengths.iter().enumerate() {
                    fixed[92 + 4 * i..96 + 4 * i].copy_from_slice(&(*length as f32).to_le_bytes());
                }
                // in pages of 100 bytes
                let begin = 4 * usize::from(payload.first().copied().unwrap_or(0));
                fixed.into_iter().skip(begin).take(100).collect()
            }
            22 => model.shift.to_le_bytes().to_vec(),
            _ => Vec::new(),
        }
    }

    fn data(&mut self, which: usize) -> Vec<u8> {
        let (disparity, colour) = (self.picture)(self.streams[which].frame);
        match (which, self.get(18), self.get(12)) {
            (0, 1, _) => compress_depth(disparity.data()),
            (0, ..) => pack(11, disparity.data()),
            (_, _, 1) => compress_yuv(&yuv422_from_rgb(&colour, Order::Uyvy), colour.width()),
            _ => yuv422_from_rgb(&colour, Order::Uyvy),
        }
    }

    /// Bytes of one frame's packets, without those that are lost.
    fn frame(&mut self, which: usize) -> Vec<u8> {
        let data = self.data(which);
        let pieces = data.len().div_ceil(PACKET_DATA).max(2);
        let size = data.len().div_ceil(pieces);
        let stream = &mut self.streams[which];
        let mut bytes = Vec::new();
        for (i, piece) in data.chunks(size).enumerate() {
            let place = match i {
                0 => Place::Start,
                i if i + 1 == pieces => Place::End,
                _ => Place::Middle,
            };
            let ticks = if i == 0 {
                0
            } else {
                2_000_000 * (stream.frame as u32 + 1)
            };
            let header = Header {
                stream: [DEPTH_STREAM, IMAGE_STREAM][which],
                place,
                sequence: stream.sent.to_le_bytes(),
                length: HEADER_BYTES + piece.len(),
                ticks,
            };
            stream.sent = stream.sent.wrapping_add(1);
            if self.lose_every == 0 || !stream.sent.is_multiple_of(self.lose_every) {
                bytes.extend(header.to_bytes());
                bytes.extend(piece);
            }
        }
        stream.frame += 1;
        bytes
    }
}

impl UsbLink for Ps1080Simulator {
    fn name(&self) -> String {
        "sim:ps1080".into()
    }

    fn control_out(&mut self, request: Request, data: &[u8]) -> Result<()> {
        let words: Vec<u16> = data
            .chunks_exact(2)
            .map(|b| u16::from_le_bytes([b[0], b[1]]))
            .collect();
        let [_, _, opcode, id, payload @ ..] = &words[..] else {
            let found = format!("{request:?} with {} bytes", data.len());
            return Err(Error::protocol(
                self.name(),
                "control transfer",
                "a message",
                found,
            ));
        };
        if let (3, [parameter, value]) = (*opcode, payload) {
            self.parameters.insert(*parameter, *value);
        }
        let mut body = vec![0, 0]; // no error
        body.extend(self.reply(*opcode, payload));
        let head = [(body.len() / 2) as u16, *opcode, *id];
        let head = head.iter().flat_map(|word| word.to_le_bytes());
        let message = b"RB".iter().copied().chain(head).chain(body).collect();
        self.replies.extend([Vec::new(), message]); // the first fetch comes too early
        Ok(())
    }

    fn control_in(&mut self, _request: Request, length: usize) -> Result<Vec<u8>> {
        let mut reply = self.replies.pop_front().unwrap_or_default();
        reply.truncate(length);
        Ok(reply)
    }

    fn submit(&mut self, endpoint: u8) -> Result<()> {
        self.streams[usize::from(endpoint != DEPTH_ENDPOINT)].submitted = true;
        Ok(())
    }

    fn drain(&mut self, endpoint: u8) -> Result<()> {
        self.streams[usize::from(endpoint != DEPTH_ENDPOINT)].submitted = false;
        Ok(())
    }

    fn packets(
        &mut self,
        timeout: Duration,
        packet: &mut dyn FnMut(u8, &[u8], Stamp),
    ) -> Result<usize> {
        let mut count = 0;
        // parameters 6 and 5 start depth and images
        for (which, endpoint, started) in [(0, DEPTH_ENDPOINT, 6), (1, IMAGE_ENDPOINT, 5)] {
            if !self.streams[which].submitted || self.get(started) == 0 {
                continue;
            }
            let bytes = self.frame(which);
            let arrived = self
                .started
                .plus_seconds(self.streams[which].frame as f64 / 30.0);
            for transfer in bytes.chunks(TRANSFER) {
                packet(endpoint, transfer, arrived);
                count += 1;
            }
        }
        if count == 0 {
            std::thread::sleep(timeout.min(Duration::from_millis(1)));
        }
        Ok(count)
    }
}
