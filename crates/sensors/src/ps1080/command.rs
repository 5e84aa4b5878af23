//! Control messages of the PS1080 (firmware from 1.2 on): the Kinect's framing with other numbers.

use crate::{Error, Result};

const HEADER: usize = 8;
const DEVICE: &str = "PS1080";
/// Error code of "not ready": ask again after a second.
const NOT_READY: u16 = 13;

/// What is asked of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Opcode {
    /// Versions of firmware, chip and board.
    Version = 0,
    /// Nothing: the connection is tried.
    KeepAlive = 1,
    /// Read a parameter.
    GetParameter = 2,
    /// Write a parameter.
    SetParameter = 3,
    /// The factory's fixed parameters, from an offset in 32-bit words on.
    FixedParameters = 4,
    /// Parameters of the firmware's algorithms.
    Algorithm = 22,
    /// The serial number.
    Serial = 37,
}

/// The message's bytes: `GM`, words of payload, opcode, number, payload.
pub fn request(opcode: Opcode, id: u16, words: &[u16]) -> Vec<u8> {
    let head = [words.len() as u16, opcode as u16, id];
    let body = head.iter().chain(words).flat_map(|word| word.to_le_bytes());
    b"GM".iter().copied().chain(body).collect()
}

/// What a fetch of a reply gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply<'a> {
    /// Nothing yet, or a reply to an earlier message: fetch again.
    NotReady,
    /// The device is not ready yet: send the message again after a second.
    Busy,
    /// The payload after the error code.
    Payload(&'a [u8]),
}

/// The reply to a message.
///
/// # Errors
/// [`Error::Protocol`] where the bytes are no reply, or it tells an error.
pub fn parse_reply(bytes: &[u8], opcode: Opcode, id: u16) -> Result<Reply<'_>> {
    if bytes.is_empty() {
        return Ok(Reply::NotReady);
    }
    let refuse = |expected: String, found: String| {
        Err(Error::protocol(
            DEVICE,
            format!("reply to {opcode:?}"),
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
    if word(6) != id {
        return Ok(Reply::NotReady);
    }
    if word(4) != opcode as u16 {
        return refuse(format!("opcode {}", opcode as u16), word(4).to_string());
    }
    let length = 2 * usize::from(word(2));
    // a bulk or padded reply may be longer than its message
    let Some((code, rest)) = payload
        .get(..length)
        .and_then(|p| p.split_first_chunk::<2>())
    else {
        return refuse(
            format!("an error code in {length} bytes"),
            payload.len().to_string(),
        );
    };
    match u16::from_le_bytes(*code) {
        0 => Ok(Reply::Payload(rest)),
        NOT_READY => Ok(Reply::Busy),
        code => refuse(
            "error code 0".into(),
            format!("error code {code}{}", meaning(code)),
        ),
    }
}

fn meaning(code: u16) -> &'static str {
    match code {
        1 => " (unknown)",
        5 => " (bad parameters)",
        16 => " (the file system is locked)",
        _ => "",
    }
}

/// Versions of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// Major number of the firmware.
    pub major: u8,
    /// Minor number.
    pub minor: u8,
    /// Build number.
    pub build: u16,
}

impl Version {
    /// Alternate setting of the interface with bulk endpoints.
    pub fn bulk_setting(&self) -> u8 {
        if self.major > 5 || (self.major == 5 && self.minor >= 5) {
            0
        } else {
            1
        }
    }

    /// Alternate setting of the interface with isochronous endpoints.
    pub fn isochronous_setting(&self) -> u8 {
        1 - self.bulk_setting()
    }

    /// Whether the ticks of a depth frame's first packet mean pixels of padding instead.
    pub fn pads_depth(&self) -> bool {
        (self.major, self.minor) >= (5, 1)
    }
}

/// The firmware's version from the reply to [`Opcode::Version`]: minor, major, build, whose
/// hexadecimal digits are the decimal number from major 5 on.
///
/// # Errors
/// Where bytes are missing.
pub fn parse_version(payload: &[u8]) -> Result<Version> {
    let b: &[u8; 4] = payload.first_chunk().ok_or_else(|| {
        Error::protocol(
            DEVICE,
            "version",
            "4 bytes or more",
            format!("{} bytes", payload.len()),
        )
    })?;
    let (minor, major) = (b[0], b[1]);
    let build = u16::from_le_bytes([b[2], b[3]]);
    let digits = [12, 8, 4, 0]
        .iter()
        .fold(0, |n, shift| 10 * n + (build >> shift & 0xf));
    let build = if major >= 5 { digits } else { build };
    Ok(Version {
        major,
        minor,
        build,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn request_and_reply_have_the_known_framing() {
        let bytes = request(Opcode::SetParameter, 7, &[6, 2]);
        assert_eq!(bytes, [0x47, 0x4d, 2, 0, 3, 0, 7, 0, 6, 0, 2, 0]);
        let reply = [0x52, 0x42, 1, 0, 3, 0, 7, 0, 0, 0];
        assert_eq!(
            parse_reply(&reply, Opcode::SetParameter, 7).unwrap(),
            Reply::Payload(&[])
        );
        assert_eq!(
            parse_reply(&reply, Opcode::SetParameter, 8).unwrap(),
            Reply::NotReady
        );
    }

    #[test]
    fn reply_with_an_error_names_it() {
        let mut reply = [0x52, 0x42, 1, 0, 3, 0, 7, 0, 5, 0];
        let text = parse_reply(&reply, Opcode::SetParameter, 7)
            .unwrap_err()
            .to_string();
        assert!(text.contains("bad parameters"), "{text}");
        reply[8] = 13;
        assert_eq!(
            parse_reply(&reply, Opcode::SetParameter, 7).unwrap(),
            Reply::Busy
        );
        reply[2] = 9;
        assert!(parse_reply(&reply, Opcode::SetParameter, 7).is_err());
    }

    #[test]
    fn version_of_a_late_firmware_reads_hexadecimal_digits_as_decimal() {
        let version = parse_version(&[8, 5, 0x22, 0]).unwrap();
        assert_eq!(
            version,
            Version {
                major: 5,
                minor: 8,
                build: 22
            }
        );
        assert_eq!(
            (version.bulk_setting(), version.isochronous_setting()),
            (0, 1)
        );
        let old = Version {
            major: 5,
            minor: 2,
            build: 0,
        };
        assert_eq!((old.bulk_setting(), old.isochronous_setting()), (1, 0));
        assert!(parse_version(&[1, 2, 3]).is_err());
    }
}
