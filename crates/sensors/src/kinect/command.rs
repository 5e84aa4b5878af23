//! Control messages of the Kinect's camera: a header of 8 bytes, little-endian words behind it.
//!
//! They go out as vendor control transfers (request type 0x40, request 0) and the reply is fetched
//! (0xc0, 0) until it is there. Bytes: `GM`, payload length in 16-bit words, command, tag; the reply
//! begins with `RB` and repeats command and tag; its payload begins with a status word, 0 for done.

use crate::{Error, Result};

/// Length to ask for when fetching a reply.
pub const REPLY_BYTES: usize = 512;

const HEADER: usize = 8;
const DEVICE: &str = "Kinect camera";

/// One command to the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraCommand {
    /// Read a register.
    Read(u16),
    /// Write a register.
    Write(u16, u16),
    /// The factory's fixed parameters.
    FixedParameters,
    /// Parameters of the firmware's algorithms: 0 is the constant shift, 0x40 the registration,
    /// 0x41 the padding; for a format, a resolution and a rate as the registers say them.
    Algorithm {
        /// Which parameters.
        id: u16,
        /// Value of the format register.
        format: u16,
        /// Value of the resolution register.
        resolution: u16,
        /// Frames per second.
        rate_hz: u16,
    },
    /// Read a register of the colour sensor.
    ReadSensor(u16),
    /// Write a register of the colour sensor.
    WriteSensor(u16, u16),
}

impl CameraCommand {
    /// The command's number.
    pub const fn code(&self) -> u16 {
        match self {
            Self::Read(_) => 0x02,
            Self::Write(..) => 0x03,
            Self::FixedParameters => 0x04,
            Self::Algorithm { .. } => 0x16,
            Self::ReadSensor(_) | Self::WriteSensor(..) => 0x95,
        }
    }

    fn words(&self) -> Vec<u16> {
        match *self {
            Self::Read(register) => vec![register],
            Self::Write(register, value) => vec![register, value],
            Self::FixedParameters => vec![0; 5],
            Self::Algorithm {
                id,
                format,
                resolution,
                rate_hz,
            } => {
                vec![id, format, resolution, rate_hz, 0]
            }
            Self::ReadSensor(register) => vec![1, register & 0x7fff, 0],
            Self::WriteSensor(register, value) => vec![1, register | 0x8000, value],
        }
    }

    /// The message's bytes.
    pub fn to_bytes(&self, tag: u16) -> Vec<u8> {
        let words = self.words();
        let head = [words.len() as u16, self.code(), tag];
        let body = head
            .iter()
            .chain(&words)
            .flat_map(|word| word.to_le_bytes());
        b"GM".iter().copied().chain(body).collect()
    }
}

/// What a fetch of a reply gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply<'a> {
    /// Nothing yet, a reply to an earlier command, or the junk of full length that some hosts
    /// deliver instead of nothing: fetch again.
    NotReady,
    /// Payload after the status word.
    Payload(&'a [u8]),
}

/// The reply to command `code` with `tag`.
///
/// # Errors
/// [`Error::Protocol`] where the bytes are no reply, or its status is not 0.
pub fn parse_reply(bytes: &[u8], code: u16, tag: u16) -> Result<Reply<'_>> {
    if bytes.is_empty() || bytes.len() == REPLY_BYTES {
        return Ok(Reply::NotReady);
    }
    let refuse = |expected: String, found: String| {
        Err(Error::protocol(
            DEVICE,
            format!("reply to command {code:#04x}"),
            expected,
            found,
        ))
    };
    let Some((head, payload)) = bytes.split_first_chunk::<HEADER>() else {
        return refuse(
            format!("{HEADER} bytes or more"),
            format!("{} bytes", bytes.len()),
        );
    };
    let word = |i: usize| u16::from_le_bytes([head[i], head[i + 1]]);
    if head[..2] != *b"RB" {
        return refuse(
            "magic 52 42".into(),
            format!("{:02x} {:02x}", head[0], head[1]),
        );
    }
    if word(6) != tag {
        return Ok(Reply::NotReady);
    }
    if word(4) != code {
        return refuse(format!("command {code:#04x}"), format!("{:#04x}", word(4)));
    }
    if payload.len() != 2 * usize::from(word(2)) {
        let expected = format!("a payload of {} bytes", 2 * word(2) as usize);
        return refuse(expected, format!("{}", payload.len()));
    }
    match payload.split_first_chunk::<2>() {
        Some(([0, 0], rest)) => Ok(Reply::Payload(rest)),
        Some((status, _)) => refuse(
            "status 0".into(),
            format!("status {}", u16::from_le_bytes(*status)),
        ),
        None => refuse("a status word".into(), "none".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn write_of_the_depth_register_has_the_known_bytes() {
        let bytes = CameraCommand::Write(6, 2).to_bytes(0);
        assert_eq!(bytes, [0x47, 0x4d, 2, 0, 3, 0, 0, 0, 6, 0, 2, 0]);
        let reply = [0x52, 0x42, 1, 0, 3, 0, 0, 0, 0, 0];
        assert_eq!(parse_reply(&reply, 3, 0).unwrap(), Reply::Payload(&[]));
    }

    #[test]
    fn replies_that_are_not_there_yet_are_fetched_again() {
        assert_eq!(parse_reply(&[], 3, 0).unwrap(), Reply::NotReady);
        assert_eq!(parse_reply(&[0x5a; 512], 3, 0).unwrap(), Reply::NotReady);
        let stale = [0x52, 0x42, 1, 0, 3, 0, 6, 0, 0, 0];
        assert_eq!(parse_reply(&stale, 3, 7).unwrap(), Reply::NotReady);
    }

    #[test]
    fn replies_that_are_wrong_say_what_is_wrong() {
        let good = [0x52, 0x42, 1, 0, 3, 0, 0, 0, 0, 0];
        for (at, value, part) in [
            (0, 0, "magic"),
            (2, 2, "payload"),
            (4, 2, "command"),
            (8, 5, "status 5"),
        ] {
            let mut bad = good;
            bad[at] = value;
            let text = parse_reply(&bad, 3, 0).unwrap_err().to_string();
            assert!(text.contains(part), "{text}");
        }
        assert!(parse_reply(&good[..7], 3, 0).is_err());
    }
}
