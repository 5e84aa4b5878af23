//! Packets of the PS1080 to frames, from isochronous packets or from a bulk stream.

use crate::PacketFaults;
use crate::usb_packet::{HEADER_BYTES, Header, MAGIC, Place};

/// Most bytes that a frame is let grow to: 1280x1024 pixels of two bytes.
pub const LARGEST_FRAME: usize = 1280 * 1024 * 2;

/// Largest packet that a bulk stream is believed to hold, bytes; a longer one is taken for a magic
/// number inside pixels. Transfers of the device are 16 KiB.
const LARGEST_PACKET: usize = 16 * 1024;

/// A frame as it was sent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RawFrame {
    /// Bytes of its packets, up to the first gap.
    pub data: Vec<u8>,
    /// Device ticks at 60 MHz of its last packet; `None` where that one is missing.
    pub ticks: Option<u32>,
    /// Ticks of its first packet: padding, with the firmware that does so.
    pub start_ticks: u32,
    /// Whether every packet came.
    pub complete: bool,
}

/// Frames of one stream from its packets. Holds one frame; the bytes after a gap are not kept, as
/// compressed ones mean nothing without those before.
#[derive(Clone, Debug)]
pub struct FrameAssembler {
    stream: u8,
    frame: Option<RawFrame>,
    awaited: Option<u16>,
    faults: PacketFaults,
}

impl FrameAssembler {
    /// For the packets of `stream`.
    pub fn new(stream: u8) -> Self {
        Self {
            stream,
            frame: None,
            awaited: None,
            faults: PacketFaults::default(),
        }
    }

    /// What went wrong so far.
    pub fn faults(&self) -> PacketFaults {
        self.faults
    }

    /// One packet with its header; empty ones are ignored. The frame that it ends, if it does.
    pub fn push(&mut self, packet: &[u8]) -> Option<RawFrame> {
        if packet.is_empty() {
            return None;
        }
        let header = Header::parse(packet)
            .filter(|header| header.length == packet.len() && header.stream == self.stream);
        let Some(header) = header else {
            self.faults.malformed += 1;
            return None;
        };
        self.follow(u16::from_le_bytes(header.sequence));
        let before = if header.place == Place::Start {
            self.begin(&header)
        } else {
            None
        };
        let Some(frame) = &mut self.frame else {
            self.faults.unsynchronised += 1;
            return before;
        };
        self.faults.packets += 1;
        let data = &packet[HEADER_BYTES..];
        if frame.data.len() + data.len() > LARGEST_FRAME {
            self.faults.resyncs += 1;
            self.frame = None;
            return before;
        }
        if frame.complete {
            frame.data.extend_from_slice(data);
        }
        if header.place == Place::End {
            frame.ticks = Some(header.ticks);
            return self.finish();
        }
        before
    }

    /// Counts the packets missing before this one.
    fn follow(&mut self, sequence: u16) {
        let gap = self
            .awaited
            .map_or(0, |awaited| sequence.wrapping_sub(awaited));
        if gap != 0 {
            // a packet from before is no loss of 65 000 others
            if gap < u16::MAX / 2 {
                self.faults.lost += u64::from(gap);
            } else {
                self.faults.resyncs += 1;
            }
            if let Some(frame) = &mut self.frame {
                frame.complete = false;
            }
        }
        self.awaited = Some(sequence.wrapping_add(1));
    }

    /// Begins a frame; returns the one before where its end is missing.
    fn begin(&mut self, header: &Header) -> Option<RawFrame> {
        if let Some(frame) = &mut self.frame {
            frame.complete = false;
        }
        let before = self.finish();
        self.frame = Some(RawFrame {
            start_ticks: header.ticks,
            complete: true,
            ..RawFrame::default()
        });
        before
    }

    fn finish(&mut self) -> Option<RawFrame> {
        let frame = self.frame.take()?;
        if frame.complete {
            self.faults.complete_frames += 1;
        } else {
            self.faults.incomplete_frames += 1;
        }
        Some(frame)
    }
}

/// Cuts a bulk stream into packets: they may begin and end anywhere in a transfer.
#[derive(Clone, Debug, Default)]
pub struct BulkSplitter {
    held: Vec<u8>,
    skipped_bytes: u64,
}

impl BulkSplitter {
    /// Bytes passed over so far to find a packet.
    pub fn skipped_bytes(&self) -> u64 {
        self.skipped_bytes
    }

    /// Bytes of a transfer; calls `packet` with each whole packet. Holds less than one packet.
    pub fn push(&mut self, bytes: &[u8], mut packet: impl FnMut(&[u8])) {
        for chunk in bytes.chunks(LARGEST_PACKET) {
            self.held.extend_from_slice(chunk);
            let done = self.split(&mut packet);
            self.held.drain(..done);
        }
    }

    /// Bytes of `held` that are done with.
    fn split(&mut self, packet: &mut impl FnMut(&[u8])) -> usize {
        let mut at = 0;
        loop {
            let rest = &self.held[at..];
            if rest.len() < HEADER_BYTES {
                return at;
            }
            match Header::parse(rest).filter(|header| header.length <= LARGEST_PACKET) {
                Some(header) if header.length > rest.len() => return at,
                Some(header) => {
                    packet(&rest[..header.length]);
                    at += header.length;
                }
                None => {
                    let next = rest[1..].windows(2).position(|pair| pair == MAGIC);
                    // the last byte may be the first one of a magic number
                    let step = next.map_or(rest.len() - 1, |i| i + 1);
                    self.skipped_bytes += step as u64;
                    at += step;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
