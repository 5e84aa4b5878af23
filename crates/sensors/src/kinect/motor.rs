//! Motor, LED and accelerometer of a Kinect 1414: control transfers of their own USB device.

use crate::{Error, Result};

/// Counts per g of the accelerometer (Kionix KXSD9).
const COUNTS_PER_G: f64 = 819.0;
/// Standard gravity, m/s^2.
const G: f64 = 9.80665;
/// Largest tilt that is asked for, degrees either way.
const LARGEST_TILT_DEG: f64 = 31.0;
const STATE_BYTES: usize = 10;

/// Colours of the LED.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Led {
    /// Dark.
    Off = 0,
    /// Green.
    Green = 1,
    /// Red.
    Red = 2,
    /// Yellow.
    Yellow = 3,
    /// Blinking green.
    BlinkGreen = 4,
    /// Blinking red and yellow.
    BlinkRedYellow = 6,
}

/// What the motor does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorStatus {
    /// It stands.
    Stopped,
    /// It stands at an end of its range.
    AtLimit,
    /// It moves.
    Moving,
}

/// A reading of the accelerometer and of the motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorState {
    /// Specific force in the base's axes, m/s^2: norm 9.81 at rest. A check of gravity, no IMU.
    pub accel_m_s2: [f64; 3],
    /// Angle of the head, degrees; `None` while the motor moves.
    pub tilt_deg: Option<f64>,
    /// What the motor does.
    pub status: MotorStatus,
}

/// `(request type, request, value)` of the transfer that asks for a tilt.
///
/// # Errors
/// Where the angle is outside -31 to 31 degrees.
pub fn tilt_request(tilt_deg: f64) -> Result<(u8, u8, u16)> {
    let range = -LARGEST_TILT_DEG..=LARGEST_TILT_DEG;
    sphereflow_core::checks::within("tilt_deg", tilt_deg, range)?;
    Ok((0x40, 0x31, (2.0 * tilt_deg).round() as i16 as u16))
}

/// `(request type, request, value)` of the transfer that sets the LED.
pub fn led_request(led: Led) -> (u8, u8, u16) {
    (0x40, 0x06, led as u16)
}

/// The reading in the answer (request type 0xc0, request 0x32, 10 bytes).
///
/// # Errors
/// Where bytes are missing or the status is unknown.
pub fn parse_motor_state(bytes: &[u8]) -> Result<MotorState> {
    let refuse =
        |expected: &str, found: String| Error::protocol("Kinect motor", "state", expected, found);
    let b: &[u8; STATE_BYTES] = bytes
        .first_chunk()
        .ok_or_else(|| refuse("10 bytes", format!("{} bytes", bytes.len())))?;
    let counts = [2, 4, 6].map(|i| i16::from_be_bytes([b[i], b[i + 1]]));
    let status = match b[9] {
        0 => MotorStatus::Stopped,
        1 => MotorStatus::AtLimit,
        4 => MotorStatus::Moving,
        other => return Err(refuse("status 0, 1 or 4", other.to_string())),
    };
    Ok(MotorState {
        accel_m_s2: counts.map(|count| f64::from(count) / COUNTS_PER_G * G),
        tilt_deg: (status != MotorStatus::Moving).then(|| f64::from(b[8] as i8) / 2.0),
        status,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn state_of_a_level_device_reads_one_g() {
        let state = parse_motor_state(&[0, 0, 0, 26, 3, 40, 0, 183, 0xf6, 0]).unwrap();
        let norm = state.accel_m_s2.iter().map(|a| a * a).sum::<f64>().sqrt() / G;
        assert!((norm - 1.012).abs() < 0.001, "{norm}"); // (26, 808, 183) / 819
        assert_eq!(
            (state.tilt_deg, state.status),
            (Some(-5.0), MotorStatus::Stopped)
        );
    }

    #[test]
    fn state_while_moving_tells_no_tilt() {
        let state = parse_motor_state(&[0, 0, 0, 0, 3, 51, 0, 0, 0x80, 4]).unwrap();
        assert_eq!((state.tilt_deg, state.status), (None, MotorStatus::Moving));
        assert!(parse_motor_state(&[0; 9]).is_err());
        assert!(parse_motor_state(&[0, 0, 0, 0, 0, 0, 0, 0, 0, 9]).is_err());
    }

    #[test]
    fn tilt_request_is_twice_the_angle_and_refuses_the_impossible() {
        assert_eq!(tilt_request(-10.0).unwrap(), (0x40, 0x31, 0xffec));
        assert!(tilt_request(32.0).is_err() && tilt_request(f64::NAN).is_err());
        assert_eq!(led_request(Led::BlinkRedYellow), (0x40, 0x06, 6));
    }
}
