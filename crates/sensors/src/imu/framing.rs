//! Messages in a stream of bytes: how all decoders find them again after garbage.

use super::Reading;
use crate::MessageFaults;

/// What bytes begin with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// The begin of a message whose end has not come.
    Incomplete,
    /// No message: the next one may begin one byte on.
    Nothing,
    /// The form of a message, but its checksum is another: the next one may begin this many bytes on.
    BadChecksum(usize),
    /// A message of so many bytes that holds no reading for us.
    Other(usize),
    /// A message of so many bytes whose content makes no sense.
    Malformed(usize),
    /// A message of so many bytes.
    Message(usize, Reading),
}

/// Bytes held while a message is incomplete: more than the longest message of any decoder.
const LARGEST_HELD: usize = 4096;

/// A protocol's messages.
pub trait Protocol {
    /// What `bytes`, not empty, begin with. Must not answer [`Step::Incomplete`] to more bytes than
    /// its longest message.
    fn step(&mut self, bytes: &[u8]) -> Step;

    /// Messages between the last two by their counter, and whether it stepped back.
    fn gap(&mut self) -> (u64, bool);
}

/// Readings from a stream of bytes of one protocol. Holds less than one message.
#[derive(Clone, Debug)]
pub struct Decoder<P> {
    protocol: P,
    held: Vec<u8>,
    faults: MessageFaults,
}

impl<P: Protocol> Decoder<P> {
    /// With nothing read yet.
    pub(super) fn with(protocol: P) -> Self {
        Self {
            protocol,
            held: Vec::new(),
            faults: MessageFaults::default(),
        }
    }

    /// What went wrong so far.
    pub fn faults(&self) -> MessageFaults {
        self.faults
    }

    /// Bytes as they come, in pieces of any size; calls `reading` with each reading.
    pub fn push(&mut self, bytes: &[u8], mut reading: impl FnMut(Reading)) {
        for piece in bytes.chunks(LARGEST_HELD) {
            self.held.extend_from_slice(piece);
            let done = self.scan(&mut reading);
            self.held.drain(..done);
        }
    }

    /// Bytes of `held` that are done with.
    fn scan(&mut self, reading: &mut impl FnMut(Reading)) -> usize {
        let mut at = 0;
        while at < self.held.len() {
            let rest = &self.held[at..];
            match self.protocol.step(rest) {
                Step::Incomplete if rest.len() < LARGEST_HELD => break,
                Step::Incomplete | Step::Nothing => {
                    self.faults.skipped_bytes += 1;
                    at += 1;
                }
                Step::BadChecksum(step) => {
                    self.faults.bad_checksums += 1;
                    self.faults.skipped_bytes += step as u64;
                    at += step.max(1);
                }
                Step::Other(length) => at += length.max(1),
                Step::Malformed(length) => {
                    self.faults.malformed += 1;
                    at += length.max(1);
                }
                Step::Message(length, message) => {
                    at += length.max(1);
                    self.count();
                    reading(message);
                }
            }
        }
        at.min(self.held.len())
    }

    fn count(&mut self) {
        let (lost, back) = self.protocol.gap();
        self.faults.messages += 1;
        self.faults.lost += lost;
        self.faults.steps_back += u64::from(back);
    }
}
