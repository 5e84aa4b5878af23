//! The 12-byte header of image packets, common to the Kinect v1 and the PS1080.
//!
//! Bytes: `52 42`, 0, stream and flag, 2 bytes of sequence, big-endian length with the header,
//! little-endian device ticks. The Kinect counts packets in the second byte of the sequence, the
//! PS1080 in both.

/// Length of the header, bytes.
pub const HEADER_BYTES: usize = 12;

/// First bytes of a packet.
pub const MAGIC: [u8; 2] = [0x52, 0x42];

/// Where in its frame a packet stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The first packet.
    Start,
    /// Neither the first nor the last.
    Middle,
    /// The last packet: its ticks are the frame's.
    End,
}

/// A packet's header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Which stream: 0x70 for depth, 0x80 for images.
    pub stream: u8,
    /// Where in its frame the packet stands.
    pub place: Place,
    /// Bytes 4 and 5, as they are.
    pub sequence: [u8; 2],
    /// Length of the whole packet, bytes.
    pub length: usize,
    /// Device ticks at 60 MHz.
    pub ticks: u32,
}

impl Header {
    /// The header that `bytes` begin with; `None` where they begin with none.
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; HEADER_BYTES] = bytes.first_chunk()?;
        let place = match bytes[3] & 0x0f {
            1 => Place::Start,
            2 => Place::Middle,
            5 => Place::End,
            _ => return None,
        };
        let length = usize::from(u16::from_be_bytes([bytes[6], bytes[7]]));
        let known = bytes[..2] == MAGIC && bytes[2] == 0 && length >= HEADER_BYTES;
        known.then_some(Self {
            stream: bytes[3] & 0xf0,
            place,
            sequence: [bytes[4], bytes[5]],
            length,
            ticks: u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]),
        })
    }

    /// The header's bytes.
    pub fn to_bytes(self) -> [u8; HEADER_BYTES] {
        let place = match self.place {
            Place::Start => 1,
            Place::Middle => 2,
            Place::End => 5,
        };
        let [l0, l1] = (self.length.min(usize::from(u16::MAX)) as u16).to_be_bytes();
        let [t0, t1, t2, t3] = self.ticks.to_le_bytes();
        let [s0, s1] = self.sequence;
        [
            MAGIC[0],
            MAGIC[1],
            0,
            self.stream | place,
            s0,
            s1,
            l0,
            l1,
            t0,
            t1,
            t2,
            t3,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_of_a_depth_packet_is_read_and_written_back() {
        let bytes = [
            0x52, 0x42, 0, 0x75, 0, 9, 0x04, 0x78, 0x78, 0x56, 0x34, 0x12,
        ];
        let header = Header::parse(&bytes).unwrap();
        assert_eq!((header.stream, header.place), (0x70, Place::End));
        assert_eq!(
            (header.length, header.ticks, header.sequence[1]),
            (1144, 0x1234_5678, 9)
        );
        assert_eq!(header.to_bytes(), bytes);
    }

    #[test]
    fn header_that_is_none_is_refused() {
        let good = [0x52, 0x42, 0, 0x72, 0, 0, 0x06, 0xe0, 0, 0, 0, 0];
        assert!(Header::parse(&good).is_some());
        assert!(Header::parse(&good[..11]).is_none());
        for (at, value) in [(0, 0x53), (1, 0), (2, 1), (3, 0x73), (6, 0)] {
            let mut bad = good;
            bad[at] = value;
            if at == 6 {
                bad[7] = 11; // shorter than the header itself
            }
            assert!(Header::parse(&bad).is_none(), "byte {at}");
        }
    }
}
