//! Small angles by their series, to rounding: what changes from one sample to the next is small, and
//! the functions of the standard library are what a step would wait for.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use sphereflow_sphere::lie::so3;

/// Sines below this are inverted by the series: its first term left out is 3e-17 of the sine.
const SMALL_SINE: f64 = 0.125;
/// Half angles below this, squared, take the series of sine and cosine.
const SMALL_HALF_2: f64 = 0.01;

/// The rotation of a rotation vector.
#[inline]
pub fn turn(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let h2 = 0.25 * vector.norm_squared();
    if h2 > SMALL_HALF_2 {
        return large_turn(vector);
    }
    let (sinc, cos) = sinc_cos(h2);
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cos, vector * (0.5 * sinc)))
}

#[cold]
fn large_turn(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    so3::exp(vector)
}

#[cold]
fn large_angle(sin: f64, cos: f64) -> f64 {
    sin.atan2(cos)
}

#[cold]
fn far_from_unit(q: Quaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(q)
}

/// `sin(h) / h` and `cos(h)` from `h^2` up to 0.01.
#[inline]
fn sinc_cos(h2: f64) -> (f64, f64) {
    let h4 = h2 * h2;
    // Pairs of terms: shorter to wait for than Horner's scheme.
    let sinc = (1.0 - h2 / 6.0) + h4 * ((1.0 / 120.0 - h2 / 5040.0) + h4 / 362_880.0);
    let cos = (1.0 - h2 / 2.0) + h4 * ((1.0 / 24.0 - h2 / 720.0) + h4 / 40_320.0);
    (sinc, cos)
}

/// The angle of the unit vector (cos, sin), rad, -pi to pi.
#[inline]
pub fn angle(sin: f64, cos: f64) -> f64 {
    if cos <= 0.0 || sin.abs() > SMALL_SINE {
        return large_angle(sin, cos);
    }
    let s2 = sin * sin;
    let s4 = s2 * s2;
    let low = (1.0 + s2 / 6.0) + s4 * (3.0 / 40.0 + s2 * (5.0 / 112.0));
    let high =
        (35.0 / 1152.0 + s2 * (63.0 / 2816.0)) + s4 * (231.0 / 13_312.0 + s2 * (143.0 / 10_240.0));
    sin * (low + s4 * s4 * high)
}

/// One Newton step for the norm, which stays within rounding of 1.
#[inline]
pub fn renormalised(q: Quaternion<f64>) -> UnitQuaternion<f64> {
    let square = q.norm_squared();
    if (square - 1.0).abs() < 1e-4 {
        UnitQuaternion::new_unchecked(q * (1.5 - 0.5 * square))
    } else {
        far_from_unit(q)
    }
}

/// An angle that is turned by small steps, kept as cosine and sine of its half.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heading {
    cos: f64,
    sin: f64,
}

impl Heading {
    /// Zero.
    pub fn new() -> Self {
        Self { cos: 1.0, sin: 0.0 }
    }

    /// The rotation about z by the heading, times another.
    #[inline]
    pub fn after(&self, q: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let (c, s) = (self.cos, self.sin);
        renormalised(Quaternion::new(
            c * q.w - s * q.k,
            c * q.i - s * q.j,
            c * q.j + s * q.i,
            c * q.k + s * q.w,
        ))
    }

    /// By how much the direction (x, y) of length `length`, turned by the heading, is off north (y):
    /// rad, positive where the heading has to grow.
    #[inline]
    pub fn off_north(&self, x: f64, y: f64, length: f64) -> f64 {
        let (c, s) = (
            self.cos * self.cos - self.sin * self.sin,
            2.0 * self.cos * self.sin,
        );
        let scale = 1.0 / length;
        angle((x * c - y * s) * scale, (y * c + x * s) * scale)
    }

    /// Turned on by an angle, rad.
    #[inline]
    pub fn turn(&mut self, by: f64) {
        let half = 0.5 * by;
        let (sin, cos) = if half * half > SMALL_HALF_2 {
            half.sin_cos()
        } else {
            let (sinc, cos) = sinc_cos(half * half);
            (half * sinc, cos)
        };
        let (c, s) = (
            self.cos * cos - self.sin * sin,
            self.sin * cos + self.cos * sin,
        );
        let scale = 1.5 - 0.5 * (c * c + s * s);
        (self.cos, self.sin) = (c * scale, s * scale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angle_of_sine_and_cosine_is_that_of_the_library() {
        for i in -2000..=2000 {
            let expected = f64::from(i) * 1.5e-3;
            let (sin, cos) = expected.sin_cos();
            let off = angle(sin, cos) - expected;
            assert!(
                off.abs() <= 4e-16 * (1.0 + expected.abs()),
                "{expected}: {off:e}"
            );
        }
    }

    #[test]
    fn turn_of_a_vector_is_that_of_the_library() {
        let axis = Vector3::new(0.6, -0.48, 0.64);
        for i in 0..400 {
            let vector = axis * (f64::from(i) * 1e-3);
            let off = turn(&vector).coords - so3::exp(&vector).coords;
            assert!(off.amax() <= 4e-16, "{i}: {off:?}");
        }
    }

    #[test]
    fn heading_turned_by_many_steps_is_their_sum() {
        let mut heading = Heading::new();
        for i in 0..100_000 {
            heading.turn(if i % 7 == 0 { 0.3 } else { -0.01 });
        }
        let sum = 14_286.0 * 0.3 - 85_714.0 * 0.01;
        let z = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), sum);
        let q = heading.after(&UnitQuaternion::identity());
        assert!(q.angle_to(&z) < 1e-9, "{}", q.angle_to(&z));
        assert!((q.norm() - 1.0).abs() < 1e-15);
        // A field that points north is off by minus the heading.
        let mut east = Heading::new();
        east.turn(0.2);
        assert!((east.off_north(0.0, 2.0, 2.0) + 0.2).abs() < 1e-15);
    }
}
