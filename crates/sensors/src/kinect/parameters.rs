//! The factory's parameters as the camera tells them: baselines, reference plane, registration.

use crate::disparity::DisparityModel;
use crate::registration::{COEFFICIENTS, RegistrationParameters};
use crate::{Error, Result};

/// Where the four geometry numbers begin, after the status word: the same as in a PS1080.
const GEOMETRY_AT: usize = 92;

/// What the IR camera's baseline to the colour camera is taken for where the device says 2.3 cm, as
/// OpenNI's tables for it were made with 2.4.
const COLOUR_BASELINE_CM: f64 = 2.4;

fn short(what: &str, expected: usize, found: usize) -> Error {
    let (expected, found) = (
        format!("{expected} bytes or more"),
        format!("{found} bytes"),
    );
    Error::protocol("depth camera", what, expected, found)
}

/// Geometry from the payload of the fixed parameters (after the status word); `shift` is that of
/// [`parse_shift`]. Bytes beyond the known ones are ignored: models differ in their number.
///
/// # Errors
/// Where bytes are missing, or a number is none that a camera has.
pub fn parse_fixed_parameters(payload: &[u8], shift: u16) -> Result<DisparityModel> {
    let end = GEOMETRY_AT + 16;
    let bytes = payload
        .get(GEOMETRY_AT..end)
        .ok_or_else(|| short("fixed parameters", end, payload.len()))?;
    let number = |i: usize| {
        f64::from(f32::from_le_bytes([
            bytes[i],
            bytes[i + 1],
            bytes[i + 2],
            bytes[i + 3],
        ]))
    };
    let colour = number(4);
    let model = DisparityModel {
        baseline_cm: number(0),
        colour_baseline_cm: if (colour - 2.3).abs() < 1e-6 {
            COLOUR_BASELINE_CM
        } else {
            colour
        },
        reference_cm: number(8),
        pixel_cm: number(12),
        shift,
    };
    model.check()?;
    Ok(model)
}

/// The constant shift (algorithm parameters, id 0).
///
/// # Errors
/// Where bytes are missing.
pub fn parse_shift(payload: &[u8]) -> Result<u16> {
    let bytes = payload
        .first_chunk()
        .ok_or_else(|| short("constant shift", 2, payload.len()))?;
    Ok(u16::from_le_bytes(*bytes))
}

/// The registration's coefficients (algorithm parameters, id 0x40 of a Kinect, 2 of a PS1080).
///
/// # Errors
/// Where bytes are missing.
pub fn parse_registration(payload: &[u8]) -> Result<RegistrationParameters> {
    let bytes = payload
        .get(..4 * COEFFICIENTS)
        .ok_or_else(|| short("registration parameters", 4 * COEFFICIENTS, payload.len()))?;
    let mut values = [0; COEFFICIENTS];
    for (value, bytes) in values.iter_mut().zip(bytes.chunks_exact(4)) {
        *value = i32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    }
    Ok(RegistrationParameters::from_values(&values))
}

/// Lines at the start, at the end, and those cut off (algorithm parameters, id 0x41 or 3).
///
/// # Errors
/// Where bytes are missing.
pub fn parse_padding(payload: &[u8]) -> Result<[u16; 3]> {
    let b: &[u8; 6] = payload
        .first_chunk()
        .ok_or_else(|| short("padding", 6, payload.len()))?;
    Ok([0, 2, 4].map(|i| u16::from_le_bytes([b[i], b[i + 1]])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn payload(values: [f32; 4]) -> Vec<u8> {
        let mut payload = vec![0; 320];
        for (i, value) in values.iter().enumerate() {
            payload[GEOMETRY_AT + 4 * i..][..4].copy_from_slice(&value.to_le_bytes());
        }
        payload
    }

    #[test]
    fn fixed_parameters_of_a_device_are_read() {
        let model = parse_fixed_parameters(&payload([7.5, 2.3, 120.0, 0.1042]), 200).unwrap();
        assert_eq!(
            (model.baseline_cm, model.reference_cm, model.shift),
            (7.5, 120.0, 200)
        );
        assert!((model.pixel_cm - 0.1042).abs() < 1e-8); // as a 32-bit number holds it
    }

    #[test]
    fn fixed_parameters_that_are_none_are_refused() {
        for values in [
            [0.0; 4],
            [7.5, 2.3, f32::NAN, 0.1042],
            [7.5, 2.3, -120.0, 0.1042],
        ] {
            assert!(
                parse_fixed_parameters(&payload(values), 200).is_err(),
                "{values:?}"
            );
        }
        assert!(parse_fixed_parameters(&[0; 107], 200).is_err());
        assert!(parse_shift(&[1]).is_err() && parse_padding(&[0; 5]).is_err());
        assert!(parse_registration(&[0; 115]).is_err());
    }
}
