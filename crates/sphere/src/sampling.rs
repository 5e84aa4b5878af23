//! Values and slopes of an image between its pixels.
//!
//! Unknown (NaN) pixels are never mixed in: a sample that needs one is NaN. Nothing is
//! extrapolated: outside the centres of the outermost pixels a sample is NaN too.

use nalgebra::Vector2;
use sphereflow_core::Plane;

/// A sample and its slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The value.
    pub value: f32,
    /// Its derivative by the pixel coordinates x and y.
    pub slope: Vector2<f32>,
}

impl Sample {
    /// No value.
    pub const UNKNOWN: Self = Self {
        value: f32::NAN,
        slope: Vector2::new(f32::NAN, f32::NAN),
    };
}

/// Reads an image at pixel coordinates (centres at integers).
///
/// Bilinear samples of the inverse depth 1/Z of a pinhole camera are exact on planes, where 1/Z is
/// affine in the pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler<'a> {
    plane: &'a Plane<f32>,
    wraps: bool,
}

impl<'a> Sampler<'a> {
    /// Of an image with four borders.
    pub fn new(plane: &'a Plane<f32>) -> Self {
        Self {
            plane,
            wraps: false,
        }
    }

    /// Of an image of the whole sphere: it goes on beyond its left and right borders, and beyond a
    /// pole on the opposite meridian (where an even width has a column for it).
    pub fn wrapping(plane: &'a Plane<f32>) -> Self {
        Self { plane, wraps: true }
    }

    /// The bilinear value; NaN where a pixel of weight above zero is unknown or outside.
    pub fn bilinear(&self, pixel: &Vector2<f64>) -> f32 {
        let Some((x, y, u, v)) = split(pixel) else {
            return f32::NAN;
        };
        // On a pixel centre (u or v zero) the far neighbour has no weight and need not exist.
        let row = |y| match u {
            0.0 => self.at(x, y),
            _ => (1.0 - u) * self.at(x, y) + u * self.at(x + 1, y),
        };
        match v {
            0.0 => row(y),
            _ => (1.0 - v) * row(y) + v * row(y + 1),
        }
    }

    /// [`Sampler::bilinear`] with its slope (discontinuous at pixel centres, where it is that of
    /// the following cell); NaN where one of the cell's four pixels is unknown or outside.
    pub fn bilinear_with_slope(&self, pixel: &Vector2<f64>) -> Sample {
        let Some((x, y, u, v)) = split(pixel) else {
            return Sample::UNKNOWN;
        };
        let (a, b) = (self.at(x, y), self.at(x + 1, y));
        let (c, d) = (self.at(x, y + 1), self.at(x + 1, y + 1));
        let (top, bottom) = (a + u * (b - a), c + u * (d - c));
        let sample = Sample {
            value: top + v * (bottom - top),
            slope: Vector2::new((1.0 - v) * (b - a) + v * (d - c), bottom - top),
        };
        if sample.value.is_nan() {
            Sample::UNKNOWN
        } else {
            sample
        }
    }

    /// The bicubic value (Catmull-Rom: interpolating, with continuous slopes, third order) with
    /// its slope. Where one of the sixteen pixels is unknown or outside: the bilinear sample.
    pub fn bicubic_with_slope(&self, pixel: &Vector2<f64>) -> Sample {
        let Some((x, y, u, v)) = split(pixel) else {
            return Sample::UNKNOWN;
        };
        let (across, by_u) = catmull_rom(u);
        let (down, by_v) = catmull_rom(v);
        let mut sample = Sample {
            value: 0.0,
            slope: Vector2::zeros(),
        };
        for j in 0..4 {
            let row: [f32; 4] =
                std::array::from_fn(|i| self.at(x + i as i64 - 1, y + j as i64 - 1));
            let dot =
                |weights: &[f32; 4]| -> f32 { row.iter().zip(weights).map(|(p, w)| p * w).sum() };
            let value = dot(&across);
            sample.value += down[j] * value;
            sample.slope += Vector2::new(down[j] * dot(&by_u), by_v[j] * value);
        }
        if sample.value.is_nan() {
            return self.bilinear_with_slope(pixel);
        }
        sample
    }

    /// The value of [`Sampler::bicubic_with_slope`].
    pub fn bicubic(&self, pixel: &Vector2<f64>) -> f32 {
        let cubic = self.bicubic_with_slope(pixel).value;
        if cubic.is_nan() {
            self.bilinear(pixel)
        } else {
            cubic
        }
    }

    /// The pixel, or NaN where there is none.
    fn at(&self, x: i64, y: i64) -> f32 {
        let (width, height) = (self.plane.width() as i64, self.plane.height() as i64);
        let (mut x, mut y) = (x, y);
        if self.wraps {
            if (y < 0 || y >= height) && width % 2 == 0 {
                y = if y < 0 { -1 - y } else { 2 * height - 1 - y };
                x += width / 2;
            }
            x = x.rem_euclid(width);
        }
        let inside = x >= 0 && y >= 0;
        let pixel = inside.then(|| self.plane.get(x as usize, y as usize));
        pixel.flatten().copied().unwrap_or(f32::NAN)
    }
}

/// Pixel to the left and above, and the way from it; `None` for what no image can hold.
fn split(pixel: &Vector2<f64>) -> Option<(i64, i64, f32, f32)> {
    let floor = pixel.map(f64::floor);
    let sane = floor.iter().all(|v| v.abs() < f64::from(i32::MAX));
    let rest = pixel - floor;
    sane.then_some((floor.x as i64, floor.y as i64, rest.x as f32, rest.y as f32))
}

/// Weights of the pixels at -1, 0, 1, 2 for a value at `t` in [0, 1), and their derivatives.
#[inline(always)] // the vectors of a caller go through it
pub fn catmull_rom(t: f32) -> ([f32; 4], [f32; 4]) {
    let (t2, t3) = (t * t, t * t * t);
    (
        [
            0.5 * (2.0 * t2 - t3 - t),
            0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
            0.5 * (4.0 * t2 - 3.0 * t3 + t),
            0.5 * (t3 - t2),
        ],
        [
            0.5 * (4.0 * t - 3.0 * t2 - 1.0),
            0.5 * (9.0 * t2 - 10.0 * t),
            0.5 * (8.0 * t - 9.0 * t2 + 1.0),
            0.5 * (3.0 * t2 - 2.0 * t),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rounding of f32 sums of values near 10.
    const ROUNDING: f32 = 2e-5;

    fn quadratic(x: f64, y: f64) -> f32 {
        (3.0 + 0.5 * x - 0.25 * y + 0.03 * x * x + 0.02 * x * y - 0.04 * y * y) as f32
    }

    fn image(f: impl Fn(f64, f64) -> f32) -> Plane<f32> {
        Plane::from_fn(12, 10, |x, y| f(x as f64, y as f64))
    }

    proptest! {
        #[test]
        fn bilinear_of_an_affine_image_is_exact(x in 0.0..11.0_f64, y in 0.0..9.0_f64) {
            let affine = |x: f64, y: f64| (2.0 + 0.3 * x - 0.7 * y) as f32;
            let plane = image(affine);
            let sampler = Sampler::new(&plane);
            let pixel = Vector2::new(x, y);
            prop_assert!((sampler.bilinear(&pixel) - affine(x, y)).abs() < ROUNDING);
            let sample = sampler.bilinear_with_slope(&pixel);
            prop_assert!((sample.value - affine(x, y)).abs() < ROUNDING);
            prop_assert!((sample.slope - Vector2::new(0.3, -0.7)).norm() < ROUNDING);
        }

        #[test]
        fn bicubic_of_a_quadratic_image_is_exact(x in 1.0..9.99_f64, y in 1.0..7.99_f64) {
            let plane = image(quadratic);
            let sample = Sampler::new(&plane).bicubic_with_slope(&Vector2::new(x, y));
            prop_assert!((sample.value - quadratic(x, y)).abs() < ROUNDING);
            let slope = Vector2::new(0.5 + 0.06 * x + 0.02 * y, -0.25 + 0.02 * x - 0.08 * y);
            prop_assert!((sample.slope.cast::<f64>() - slope).norm() < f64::from(ROUNDING));
        }
    }

    #[test]
    fn samples_on_pixel_centres_are_the_pixels() {
        let plane = image(quadratic);
        let sampler = Sampler::new(&plane);
        for (x, y) in [(0, 0), (11, 9), (11, 0), (5, 4)] {
            let pixel = Vector2::new(x as f64, y as f64);
            assert_eq!(sampler.bilinear(&pixel), plane[(x, y)]);
            assert_eq!(sampler.bicubic(&pixel), plane[(x, y)]);
        }
    }

    #[test]
    fn samples_outside_the_outermost_centres_are_unknown() {
        let plane = image(quadratic);
        let sampler = Sampler::new(&plane);
        for (x, y) in [
            (-0.01, 4.0),
            (11.01, 4.0),
            (4.0, 9.2),
            (f64::NAN, 1.0),
            (1e300, 0.0),
        ] {
            let pixel = Vector2::new(x, y);
            assert!(sampler.bilinear(&pixel).is_nan() && sampler.bicubic(&pixel).is_nan());
            assert!(sampler.bilinear_with_slope(&pixel).slope.x.is_nan());
        }
    }

    #[test]
    fn unknown_pixels_spoil_only_the_samples_that_need_them() {
        let mut plane = image(quadratic);
        plane[(5, 5)] = f32::NAN;
        let sampler = Sampler::new(&plane);
        assert!(sampler.bilinear(&Vector2::new(4.5, 5.0)).is_nan());
        assert!(sampler.bilinear(&Vector2::new(4.5, 4.01)).is_nan());
        assert_eq!(sampler.bilinear(&Vector2::new(4.0, 5.0)), plane[(4, 5)]);
        assert!(sampler.bilinear(&Vector2::new(3.5, 4.5)).is_finite());
        // One cell further away the cubic falls back to the bilinear sample.
        let pixel = Vector2::new(3.5, 4.5);
        assert_eq!(
            sampler.bicubic(&pixel),
            sampler.bilinear_with_slope(&pixel).value
        );
    }

    #[test]
    fn wrapping_samples_go_on_across_the_seam_and_the_poles() {
        let plane = Plane::from_fn(8, 4, |x, y| (10 * y + x) as f32);
        let sampler = Sampler::wrapping(&plane);
        assert_eq!(sampler.bilinear(&Vector2::new(7.5, 1.0)), 13.5);
        assert_eq!(sampler.bilinear(&Vector2::new(-0.5, 1.0)), 13.5);
        // Halfway over the pole lies the pixel on the opposite meridian.
        assert_eq!(sampler.bilinear(&Vector2::new(1.0, -0.5)), 3.0);
        assert_eq!(sampler.bilinear(&Vector2::new(1.0, 3.5)), 33.0);
    }
}
