//! Image packets of the Kinect to whole frames; what is missing is marked, never patched.

use super::halves::{Halves, Joined};
use super::{Mode, NO_READING, PixelFormat};
use crate::PacketFaults;
use crate::bits::unpack;
use crate::usb_packet::{HEADER_BYTES, Header, Place};
use sphereflow_core::Plane;

/// A packet this many places behind the newest, or fewer, that is missing so far came late. A larger
/// step back is a gap of the 8-bit counter: more packets than this are lost in a burst sooner than
/// they overtake each other.
const LATE: u8 = 8;

/// A frame as it was sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawFrame {
    /// What its bytes mean.
    pub mode: Mode,
    /// [`Mode::frame_bytes`] bytes; those of missing packets are 0xff, which is "no reading" in
    /// a depth image.
    pub data: Vec<u8>,
    /// Device ticks of the frame's last packet; `None` where that one is missing.
    pub ticks: Option<u32>,
    /// Ranges of missing bytes, ascending; empty in a complete frame.
    pub missing: Vec<std::ops::Range<usize>>,
}

impl RawFrame {
    /// Whether every packet came.
    pub fn is_complete(&self) -> bool {
        self.missing.is_empty()
    }

    /// Pixels of a packed format (disparity, infrared), unpacked; `None` of a format with bytes.
    /// A missing or absent 10-bit disparity (1023) is told as [`NO_READING`] too.
    pub fn unpacked(&self) -> Option<Plane<u16>> {
        let mut pixels = vec![0; self.mode.width * self.mode.height];
        match self.mode.format {
            PixelFormat::Disparity { .. } | PixelFormat::Infrared => {
                unpack(self.mode.bits() as u32, &self.data, &mut pixels);
            }
            PixelFormat::Bayer | PixelFormat::Uyvy => return None,
        }
        if self.mode.format == (PixelFormat::Disparity { bits: 10 }) {
            for pixel in pixels.iter_mut().filter(|pixel| **pixel == 1023) {
                *pixel = NO_READING;
            }
        }
        Plane::from_vec(self.mode.width, self.mode.height, pixels).ok()
    }
}

/// Frames of one stream from its USB packets. Holds one frame.
#[derive(Clone, Debug)]
pub struct FrameAssembler {
    mode: Mode,
    halves: Halves,
    data: Vec<u8>,
    came: Vec<bool>,
    ticks: Option<u32>,
    /// Place in its frame, and sequence number, of the packet awaited; `None` before a first start.
    awaited: Option<(usize, u8)>,
    faults: PacketFaults,
}

impl FrameAssembler {
    /// For frames of `mode`.
    pub fn new(mode: Mode) -> Self {
        Self {
            mode,
            halves: Halves::default(),
            data: vec![0xff; mode.frame_bytes()],
            came: vec![false; mode.packets()],
            ticks: None,
            awaited: None,
            faults: PacketFaults::default(),
        }
    }

    /// What went wrong so far.
    pub fn faults(&self) -> PacketFaults {
        self.faults
    }

    /// One USB packet, empty ones included; calls `frame` with each frame that it ends.
    pub fn push(&mut self, packet: &[u8], mut frame: impl FnMut(RawFrame)) {
        if packet.is_empty() {
            return;
        }
        let mut halves = std::mem::take(&mut self.halves);
        halves.push(packet, |joined| match joined {
            Joined::Whole(header, image) => self.place(&header, &image[HEADER_BYTES..], &mut frame),
            Joined::Completed(header, image) => {
                self.faults.misaligned += 1;
                self.place(&header, &image[HEADER_BYTES..], &mut frame);
            }
            Joined::Malformed => self.faults.malformed += 1,
        });
        self.halves = halves;
    }

    fn place(&mut self, header: &Header, data: &[u8], frame: &mut impl FnMut(RawFrame)) {
        if header.stream != self.mode.stream() {
            self.faults.malformed += 1;
            return;
        }
        let sequence = header.sequence[1];
        let Some((mut index, late)) = self.index_of(header.place, sequence, frame) else {
            return;
        };
        if !self.fits(header.place, index) {
            // numbers and flags contradict each other: a loss of more than the counter holds
            self.faults.resyncs += 1;
            self.finish(frame);
            self.awaited = None;
            if header.place != Place::Start {
                self.faults.unsynchronised += 1;
                return;
            }
            index = 0;
        }
        if data.len() != self.mode.data_of(index) {
            self.faults.malformed += 1;
            return;
        }
        let begin = index * self.mode.packet_data();
        self.data[begin..begin + data.len()].copy_from_slice(data);
        self.came[index] = true;
        self.faults.packets += 1;
        if header.place == Place::End {
            self.ticks = Some(header.ticks);
        }
        if !late {
            self.advance(index, sequence, frame);
        }
    }

    /// Place in its frame of a packet, by its number, and whether it came late; frames that ended
    /// in a gap before it come out.
    fn index_of(
        &mut self,
        place: Place,
        sequence: u8,
        frame: &mut impl FnMut(RawFrame),
    ) -> Option<(usize, bool)> {
        let Some((awaited, number)) = self.awaited else {
            if place == Place::Start {
                return Some((0, false));
            }
            self.faults.unsynchronised += 1;
            return None;
        };
        let behind = number.wrapping_sub(sequence);
        if (1..=LATE).contains(&behind) {
            let index = awaited.checked_sub(usize::from(behind));
            let Some(index) = index.filter(|i| !self.came[*i] && self.fits(place, *i)) else {
                self.faults.unsynchronised += 1; // it was there already, or its frame is gone
                return None;
            };
            self.faults.late += 1;
            return Some((index, true));
        }
        let mut index = awaited + usize::from(sequence.wrapping_sub(number));
        while index >= self.mode.packets() {
            index -= self.mode.packets();
            if !self.came.contains(&true) {
                self.faults.lost += self.mode.packets() as u64;
            }
            self.finish(frame);
        }
        Some((index, false))
    }

    fn fits(&self, place: Place, index: usize) -> bool {
        let expected = match index {
            0 => Place::Start,
            i if i + 1 == self.mode.packets() => Place::End,
            _ => Place::Middle,
        };
        place == expected
    }

    fn advance(&mut self, index: usize, sequence: u8, frame: &mut impl FnMut(RawFrame)) {
        self.awaited = Some((index + 1, sequence.wrapping_add(1)));
        if index + 1 == self.mode.packets() {
            self.finish(frame);
            self.awaited = Some((0, sequence.wrapping_add(1)));
        }
    }

    /// The frame as it is, where any of it came; the next one begins.
    fn finish(&mut self, frame: &mut impl FnMut(RawFrame)) {
        let missing = self.came.iter().filter(|came| !**came).count();
        if missing == self.came.len() {
            return;
        }
        self.faults.lost += missing as u64;
        if missing == 0 {
            self.faults.complete_frames += 1;
        } else {
            self.faults.incomplete_frames += 1;
        }
        let missing = self.missing();
        let data = std::mem::replace(&mut self.data, vec![0xff; self.mode.frame_bytes()]);
        self.came.fill(false);
        let ticks = self.ticks.take();
        frame(RawFrame {
            mode: self.mode,
            data,
            ticks,
            missing,
        });
    }

    fn missing(&self) -> Vec<std::ops::Range<usize>> {
        let mut ranges: Vec<std::ops::Range<usize>> = Vec::new();
        for index in (0..self.came.len()).filter(|index| !self.came[*index]) {
            let begin = index * self.mode.packet_data();
            let end = begin + self.mode.data_of(index);
            match ranges.last_mut() {
                Some(last) if last.end == begin => last.end = end,
                _ => ranges.push(begin..end),
            }
        }
        ranges
    }
}
