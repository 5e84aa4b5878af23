//! What a stream of the Kinect can be set to, and how its frames are cut into packets.

/// Stream number of depth packets.
pub const DEPTH_STREAM: u8 = 0x70;
/// Stream number of colour and infrared packets.
pub const VIDEO_STREAM: u8 = 0x80;

/// Bytes of a full depth packet after its header.
const DEPTH_DATA: usize = 1748;
/// Bytes of a full video packet after its header.
const VIDEO_DATA: usize = 1908;

/// What a pixel is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelFormat {
    /// Raw disparity, packed.
    Disparity {
        /// 11 or 10.
        bits: u32,
    },
    /// 8-bit Bayer mosaic, rows G R and B G.
    Bayer,
    /// YUV 4:2:2, bytes U Y V Y.
    Uyvy,
    /// Infrared brightness, packed with 10 bits.
    Infrared,
}

/// A mode of one stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// What a pixel is.
    pub format: PixelFormat,
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Nominal frames per second.
    pub rate_hz: u16,
    /// Value of the resolution register.
    pub(crate) resolution: u16,
}

impl Mode {
    /// Depth with 11 bits, 640x480, 30 Hz.
    pub const DEPTH_11: Self = Self::vga(PixelFormat::Disparity { bits: 11 }, 480, 30);
    /// Depth with 10 bits, 640x480, 30 Hz.
    pub const DEPTH_10: Self = Self::vga(PixelFormat::Disparity { bits: 10 }, 480, 30);
    /// Colour as a Bayer mosaic, 640x480, 30 Hz.
    pub const BAYER: Self = Self::vga(PixelFormat::Bayer, 480, 30);
    /// Colour as YUV 4:2:2, 640x480, 15 Hz.
    pub const UYVY: Self = Self::vga(PixelFormat::Uyvy, 480, 15);
    /// Infrared, 640x488, 30 Hz.
    pub const INFRARED: Self = Self::vga(PixelFormat::Infrared, 488, 30);
    /// Colour as a Bayer mosaic, 1280x1024, nominally 15 Hz (about 10 are seen).
    pub const BAYER_LARGE: Self = Self {
        format: PixelFormat::Bayer,
        width: 1280,
        height: 1024,
        rate_hz: 15,
        resolution: 2,
    };

    const fn vga(format: PixelFormat, height: usize, rate_hz: u16) -> Self {
        Self {
            format,
            width: 640,
            height,
            rate_hz,
            resolution: 1,
        }
    }

    /// Bits of a pixel as it is sent.
    pub const fn bits(&self) -> usize {
        match self.format {
            PixelFormat::Disparity { bits } => bits as usize,
            PixelFormat::Bayer => 8,
            PixelFormat::Uyvy => 16,
            PixelFormat::Infrared => 10,
        }
    }

    /// Bytes of a whole frame.
    pub const fn frame_bytes(&self) -> usize {
        self.width * self.height * self.bits() / 8
    }

    /// Number of the stream that its packets carry.
    pub const fn stream(&self) -> u8 {
        match self.format {
            PixelFormat::Disparity { .. } => DEPTH_STREAM,
            _ => VIDEO_STREAM,
        }
    }

    /// Bytes of a full packet after its header.
    pub const fn packet_data(&self) -> usize {
        match self.format {
            PixelFormat::Disparity { .. } => DEPTH_DATA,
            _ => VIDEO_DATA,
        }
    }

    /// Packets of a frame.
    pub const fn packets(&self) -> usize {
        self.frame_bytes().div_ceil(self.packet_data())
    }

    /// Bytes of packet `index` of a frame, after its header.
    pub const fn data_of(&self, index: usize) -> usize {
        let begin = index * self.packet_data();
        let left = self.frame_bytes().saturating_sub(begin);
        if left < self.packet_data() {
            left
        } else {
            self.packet_data()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_have_the_packets_that_the_device_sends() {
        let table = [
            (Mode::DEPTH_11, 422_400, 242, 1132),
            (Mode::DEPTH_10, 384_000, 220, 1188),
            (Mode::BAYER, 307_200, 162, 12),
            (Mode::INFRARED, 390_400, 205, 1168),
        ];
        for (mode, bytes, packets, last) in table {
            assert_eq!(
                (mode.frame_bytes(), mode.packets()),
                (bytes, packets),
                "{mode:?}"
            );
            assert_eq!(mode.data_of(packets - 1), last, "{mode:?}");
            assert_eq!(mode.data_of(packets), 0);
        }
    }
}
