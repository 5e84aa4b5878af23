//! One entry per decoder for fuzzers and mutation tests: any bytes, no panic, bounded memory.
//!
//! The bytes are cut into packets as a fuzzer likes: each packet is preceded by two bytes that say
//! its length.

use crate::imu::epson::{BurstFormat, Counter, MODELS, Setup, burst_decoder};
use crate::imu::{text, vectornav, xsens};
use crate::kinect::{self, FrameAssembler, Mode};
use crate::ps1080::{self, BulkSplitter, DepthFormat, ImageFormat, Opcode};

/// A decoder's entry: its name and what eats the bytes.
pub type Entry = (&'static str, fn(&[u8]));

/// All entries.
pub const ENTRIES: [Entry; 8] = [
    ("kinect_depth_packets", kinect_depth_packets),
    ("kinect_video_packets", kinect_video_packets),
    ("ps1080_packets", ps1080_packets),
    ("control_replies", control_replies),
    ("epson", epson),
    ("xsens", xsens),
    ("vectornav", vectornav),
    ("text_lines", text_lines),
];

/// Packets of the bytes: two bytes of length, then as many bytes as there are.
pub fn packets(mut data: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || {
        let (length, rest) = data.split_first_chunk::<2>()?;
        let length = usize::from(u16::from_le_bytes(*length) & 0x0fff).min(rest.len());
        let (packet, rest) = rest.split_at(length);
        data = rest;
        Some(packet)
    })
}

/// The inverse of [`packets`].
pub fn join<'a>(packets: impl IntoIterator<Item = &'a [u8]>) -> Vec<u8> {
    let mut data = Vec::new();
    for packet in packets {
        data.extend((packet.len() as u16).to_le_bytes());
        data.extend(packet);
    }
    data
}

fn kinect_packets(mode: Mode, data: &[u8]) {
    let mut assembler = FrameAssembler::new(mode);
    for packet in packets(data) {
        assembler.push(packet, |frame| {
            assert_eq!(frame.data.len(), mode.frame_bytes());
            std::hint::black_box(frame.is_complete());
        });
    }
}

/// Depth packets of a Kinect.
pub fn kinect_depth_packets(data: &[u8]) {
    kinect_packets(Mode::DEPTH_11, data);
}

/// Colour packets of a Kinect.
pub fn kinect_video_packets(data: &[u8]) {
    kinect_packets(Mode::BAYER, data);
}

/// A PS1080's bulk stream, its frames in every format.
pub fn ps1080_packets(data: &[u8]) {
    let mut splitter = BulkSplitter::default();
    let mut assembler = ps1080::FrameAssembler::new(ps1080::DEPTH_STREAM);
    splitter.push(data, |packet| {
        if let Some(frame) = assembler.push(packet) {
            let padding = ps1080::padding_of(frame.start_ticks);
            for format in [
                DepthFormat::Raw16,
                DepthFormat::Compressed,
                DepthFormat::Packed12,
            ] {
                std::hint::black_box(ps1080::decode_depth(format, (80, 60), padding, &frame.data));
            }
        }
    });
    for format in [
        ImageFormat::CompressedBayer,
        ImageFormat::CompressedYuv,
        ImageFormat::Uyvy,
    ] {
        std::hint::black_box(ps1080::decode_image(format, (16, 8), data));
    }
}

/// Replies to control messages, and the parameters in them.
pub fn control_replies(data: &[u8]) {
    for packet in packets(data) {
        let _ = kinect::parse_reply(packet, 4, 0);
        let _ = ps1080::parse_reply(packet, Opcode::Algorithm, 0);
        let _ = kinect::parse_fixed_parameters(packet, 200).map(|model| model.table());
        let _ = kinect::parse_registration(packet);
        let _ = kinect::parse_shift(packet);
        let _ = kinect::parse_padding(packet);
        let _ = kinect::parse_motor_state(packet);
        let _ = ps1080::parse_version(packet);
    }
}

/// Burst messages, and answers during configuration, of an Epson unit.
pub fn epson(data: &[u8]) {
    for format in [BurstFormat::STANDARD, BurstFormat::WIDE] {
        let counter = Counter::Messages {
            period_ns: 8_000_000,
        };
        burst_decoder(MODELS[0], format, counter).push(data, |reading| {
            std::hint::black_box(reading);
        });
    }
    if let Ok(mut setup) = Setup::new(BurstFormat::STANDARD, 125.0) {
        for bytes in data.chunks(4) {
            setup.next();
            if setup.answer(bytes).is_err() {
                break;
            }
        }
    }
}

/// Messages of an Xsens unit.
pub fn xsens(data: &[u8]) {
    xsens::mtdata2_decoder().push(data, |reading| {
        std::hint::black_box(reading);
    });
}

/// Messages of a VectorNav unit.
pub fn vectornav(data: &[u8]) {
    vectornav::binary_decoder().push(data, |reading| {
        std::hint::black_box(reading);
    });
}

/// Lines of a board.
pub fn text_lines(data: &[u8]) {
    text::line_decoder().push(data, |reading| {
        std::hint::black_box(reading);
    });
}
