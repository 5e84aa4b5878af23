//! Control messages of a simulated Kinect: registers and factory parameters.

use crate::disparity::DisparityModel;
use std::collections::{HashMap, VecDeque};

/// Registers, and replies that have not been fetched.
#[derive(Clone, Debug, Default)]
pub(super) struct Registers {
    values: HashMap<u16, u16>,
    replies: VecDeque<Vec<u8>>,
}

impl Registers {
    /// Value of a register.
    pub(super) fn get(&self, register: u16) -> u16 {
        self.values.get(&register).copied().unwrap_or(0)
    }

    /// A message from the host; `false` where it is none.
    pub(super) fn receive(&mut self, bytes: &[u8]) -> bool {
        let words: Vec<u16> = bytes
            .chunks_exact(2)
            .map(|b| u16::from_le_bytes([b[0], b[1]]))
            .collect();
        let [magic, length, command, tag, payload @ ..] = &words[..] else {
            return false;
        };
        if *magic != u16::from_le_bytes(*b"GM") || usize::from(*length) != payload.len() {
            return false;
        }
        let word = |i: usize| payload.get(i).copied().unwrap_or(0);
        let mut reply = vec![0_u8; 2]; // status
        match *command {
            0x02 => reply.extend(self.get(word(0)).to_le_bytes()),
            0x03 => {
                self.values.insert(word(0), word(1));
            }
            0x04 => reply.extend(fixed_parameters()),
            0x16 => reply.extend(match word(0) {
                0x40 => vec![0; 116],
                0x41 => vec![0; 6],
                _ => DisparityModel::TYPICAL.shift.to_le_bytes().to_vec(),
            }),
            _ => reply[0] = 1,
        }
        let head = [(reply.len() / 2) as u16, *command, *tag];
        let head = head.iter().flat_map(|word| word.to_le_bytes());
        let message = b"RB".iter().copied().chain(head).chain(reply).collect();
        // the first fetch comes too early, the second one is answered by a host's junk
        self.replies.extend([Vec::new(), vec![0x5a; 512], message]);
        true
    }

    /// The answer to a fetch.
    pub(super) fn fetch(&mut self) -> Vec<u8> {
        self.replies.pop_front().unwrap_or_default()
    }
}

/// Payload of the fixed parameters, of the length that a 1414 has, without its status.
fn fixed_parameters() -> Vec<u8> {
    let mut payload = vec![0; 320];
    let model = DisparityModel::TYPICAL;
    let lengths = [
        model.baseline_cm,
        model.colour_baseline_cm,
        model.reference_cm,
        model.pixel_cm,
    ];
    for (i, length) in lengths.iter().enumerate() {
        payload[92 + 4 * i..96 + 4 * i].copy_from_slice(&(*length as f32).to_le_bytes());
    }
    payload
}
