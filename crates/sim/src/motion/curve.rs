//! A function of time with its exact first and second derivatives.

use std::f64::consts::TAU;

/// `offset + rate t + sum of amplitude sin(angular_rate t + phase)`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Constant part.
    pub offset: f64,
    /// Slope of the linear part, per second.
    pub rate: f64,
    /// The sines.
    pub waves: Vec<Wave>,
}

/// `amplitude sin(angular_rate t + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Amplitude, in the unit of the curve.
    pub amplitude: f64,
    /// Radians of phase per second.
    pub angular_rate: f64,
    /// Phase at time 0, radians.
    pub phase: f64,
}

impl Wave {
    /// From a frequency in hertz.
    pub fn hz(amplitude: f64, frequency_hz: f64, phase: f64) -> Self {
        Self {
            amplitude,
            angular_rate: TAU * frequency_hz,
            phase,
        }
    }
}

impl Curve {
    /// A constant.
    pub fn constant(offset: f64) -> Self {
        Self {
            offset,
            ..Self::default()
        }
    }

    /// A constant and sines.
    pub fn waves(offset: f64, waves: impl IntoIterator<Item = Wave>) -> Self {
        Self {
            offset,
            rate: 0.0,
            waves: waves.into_iter().collect(),
        }
    }

    /// Value, first and second derivative at `t_s`.
    pub fn at(&self, t_s: f64) -> [f64; 3] {
        let mut value = [self.offset + self.rate * t_s, self.rate, 0.0];
        for wave in &self.waves {
            let (sin, cos) = (wave.angular_rate * t_s + wave.phase).sin_cos();
            value[0] += wave.amplitude * sin;
            value[1] += wave.amplitude * wave.angular_rate * cos;
            value[2] -= wave.amplitude * wave.angular_rate.powi(2) * sin;
        }
        value
    }

    /// Mean square of the first derivative over all time (frequencies all different).
    pub(super) fn mean_square_rate(&self) -> f64 {
        let sines: f64 = self
            .waves
            .iter()
            .map(|w| 0.5 * (w.amplitude * w.angular_rate).powi(2))
            .sum();
        self.rate.powi(2) + sines
    }
}
