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
}

/// What a USB packet gave.
pub(super) enum Joined<'a> {
    /// An image packet as it stands.
    Whole(Header, &'a [u8]),
    /// An image packet out of halves.
    Completed(Header, &'a [u8]),
    /// Bytes that belong to no image packet.
    Malformed,
}

impl Halves {
    /// One USB packet; calls `image` with what it gives: at most two image packets.
    pub(super) fn push(&mut self, packet: &[u8], mut image: impl FnMut(Joined<'_>)) {
        if let Some(header) = Header::parse(packet) {
            self.held.clear();
            if header.length == packet.len() {
                image(Joined::Whole(header, packet));
            } else if header.length > packet.len() && packet.len() <= TRANSACTION {
                self.held.extend_from_slice(packet);
            } else {
                image(Joined::Malformed);
            }
            return;
        }
        let (second, next) = packet.split_at(self.split(packet.len()));
        let next = if Header::parse(next).is_some() {
            next
        } else {
            &[]
        };
        self.join(second, next, image);
    }

    /// Where a packet without a header at its begin is to be cut: behind what the held half lacks.
    fn split(&self, length: usize) -> usize {
        match Header::parse(&self.held) {
            Some(header) => header.length.saturating_sub(self.held.len()).min(length),
            None => TRANSACTION.min(length),
        }
    }

    fn join(&mut self, second: &[u8], next: &[u8], mut image: impl FnMut(Joined<'_>)) {
        let begun = !self.held.is_empty();
        self.held
            .extend_from_slice(&second[..second.len().min(TRANSACTION)]);
        match Header::parse(&self.held) {
            Some(header) if begun && header.length == self.held.len() => {
                image(Joined::Completed(header, &self.held));
            }
            _ if next.is_empty() => image(Joined::Malformed),
            _ => {}
        }
        self.held.clear();
        match Header::parse(next) {
            Some(header) if header.length == next.len() => image(Joined::Completed(header, next)),
            Some(_) => self
                .held
                .extend_from_slice(&next[..next.len().min(TRANSACTION)]),
            None => {}
        }
    }
}
