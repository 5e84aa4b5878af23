//! Packets whose two halves came out of phase: the header stands in the middle of a USB packet.
//!
//! A USB packet of the Kinect is two transactions of up to 960 bytes. On some hosts they are paired
//! wrongly: each USB packet then holds the second half of one image packet and the first half of the
//! next.

use crate::usb_packet::Header;

/// Most bytes of one transaction: the first half of a packet has as many.
const TRANSACTION: usize = 960;

/// Puts image packets together from USB packets; holds at most one half.
#[derive(Clone, Debug, Default)]
pub(super) struct Halves {
    held: Vec<u8>,
    joined: Vec<u8>,
}

/// What became of a USB packet.
pub(super) enum Joined<'a> {
    /// It is an image packet as it stands.
    Whole(Header),
    /// It completed an image packet, which is here.
    Completed(Header, &'a [u8]),
    /// It is the first half of one.
    Half,
    /// It is neither.
    Malformed,
}

impl Halves {
    pub(super) fn push(&mut self, packet: &[u8]) -> Joined<'_> {
        if let Some(header) = Header::parse(packet) {
            self.held.clear();
            if header.length == packet.len() {
                return Joined::Whole(header);
            }
            if header.length > packet.len() && packet.len() <= TRANSACTION {
                self.held.extend_from_slice(packet);
                return Joined::Half;
            }
            return Joined::Malformed;
        }
        let (second, next) = packet.split_at(self.split(packet.len()));
        let next = if Header::parse(next).is_some() {
            next
        } else {
            &[]
        };
        self.join(second, next)
    }

    /// Where a packet without a header at its begin is to be cut: behind what the held half lacks.
    fn split(&self, length: usize) -> usize {
        match Header::parse(&self.held) {
            Some(header) => header.length.saturating_sub(self.held.len()).min(length),
            None => TRANSACTION.min(length),
        }
    }

    fn join(&mut self, second: &[u8], next: &[u8]) -> Joined<'_> {
        std::mem::swap(&mut self.held, &mut self.joined);
        self.held.clear();
        self.held
            .extend_from_slice(&next[..next.len().min(TRANSACTION)]);
        let begun = !self.joined.is_empty();
        self.joined
            .extend_from_slice(&second[..second.len().min(TRANSACTION)]);
        match Header::parse(&self.joined) {
            Some(header) if begun && header.length == self.joined.len() => {
                Joined::Completed(header, &self.joined)
            }
            _ if !self.held.is_empty() => Joined::Half,
            _ => Joined::Malformed,
        }
    }
}
