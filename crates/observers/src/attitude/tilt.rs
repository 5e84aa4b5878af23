//! The smallest rotation that brings a direction upright.

use super::small_angle::renormalised;
use nalgebra::{Quaternion, UnitQuaternion};

/// The rotation: a quaternion without z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilt {
    w: f64,
    x: f64,
    y: f64,
}

/// Squared sines below this take the series: its first term left out is 1e-16.
const SMALL_SINE_2: f64 = 3e-4;

impl Tilt {
    /// That carries `up` to z, and the length of `up`; `None` where there is none to speak of.
    #[inline]
    pub fn to_up(up: &[f64; 3]) -> Option<(Self, f64)> {
        let [x, y, z] = *up;
        let flat2 = x * x + y * y;
        let norm = (flat2 + z * z).sqrt();
        if norm <= 1e-9 {
            return None;
        }
        let scale = 1.0 / norm;
        // sin^2 of the angle
        let s2 = flat2 * (scale * scale);
        if z < 0.0 || s2 > SMALL_SINE_2 {
            return Some((Self::large(x, y, z, norm), norm));
        }
        // sin = 2 sin(half) cos(half): the series of cos(half) and of 1 / (2 cos(half)) in sin^2
        let w = 1.0 - s2 * (0.125 + s2 * (5.0 / 128.0 + s2 * (21.0 / 1024.0)));
        let part = scale * (0.5 + s2 * (1.0 / 16.0 + s2 * (7.0 / 256.0 + s2 * (33.0 / 2048.0))));
        let tilt = Self {
            w,
            x: y * part,
            y: -x * part,
        };
        Some((tilt, norm))
    }

    #[cold]
    fn large(x: f64, y: f64, z: f64, norm: f64) -> Self {
        let scalar = norm + z;
        if scalar <= 1e-6 * norm {
            return Self {
                w: 0.0,
                x: 1.0,
                y: 0.0,
            };
        }
        let scale = 1.0 / (2.0 * norm * scalar).sqrt();
        Self {
            w: scalar * scale,
            x: y * scale,
            y: -x * scale,
        }
    }

    /// This rotation after another.
    #[inline]
    pub fn after(&self, q: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let Self { w, x, y } = *self;
        renormalised(Quaternion::new(
            w * q.w - x * q.i - y * q.j,
            w * q.i + x * q.w + y * q.k,
            w * q.j + y * q.w - x * q.k,
            w * q.k + x * q.j - y * q.i,
        ))
    }

    /// A vector turned.
    #[inline]
    pub fn turned(&self, [a, b, c]: [f64; 3]) -> [f64; 3] {
        let Self { w, x, y } = *self;
        // v + 2 w (u x v) + 2 u x (u x v), u = (x, y, 0)
        let (p, q, r) = (2.0 * y * c, -2.0 * x * c, 2.0 * (x * b - y * a));
        [
            a + w * p + y * r,
            b + w * q - x * r,
            c + w * r + x * q - y * p,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn tilt_brings_up_upright_and_turns_vectors_as_its_quaternion_does() {
        for up in [
            [0.3, -0.2, 9.7],
            [0.1, -0.12, 9.8],
            [1e-9, 2e-9, 9.8],
            [1.0, 2.0, -3.0],
            [0.0, 0.0, 2.0],
            [0.0, 0.0, -2.0],
        ] {
            let (tilt, norm) = Tilt::to_up(&up).unwrap();
            let q = tilt.after(&UnitQuaternion::identity());
            let upright = q * Vector3::from(up);
            assert!(
                (upright - Vector3::z() * norm).norm() < 1e-14 * norm,
                "{up:?}"
            );
            let v = [0.4, -1.2, 2.5];
            let off = Vector3::from(tilt.turned(v)) - q * Vector3::from(v);
            assert!(off.norm() < 1e-14, "{up:?}: {off:?}");
            let other = UnitQuaternion::from_euler_angles(0.3, -0.8, 2.0);
            assert!(tilt.after(&other).angle_to(&(q * other)) < 1e-14);
        }
        assert_eq!(Tilt::to_up(&[0.0; 3]), None);
    }
}
