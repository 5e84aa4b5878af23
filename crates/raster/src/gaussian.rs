//! Gaussian smoothing of an image, borders continued by their last pixel.

use sphereflow_core::Plane;

/// A Gaussian of a standard deviation in pixels, cut at three of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaussian {
    /// Half of the symmetric kernel, centre first.
    half: Vec<f32>,
}

impl Gaussian {
    /// Zero (or less) smooths nothing.
    pub fn new(sigma_px: f32) -> Self {
        if !(sigma_px > 0.0 && sigma_px.is_finite()) {
            return Self { half: vec![1.0] };
        }
        let radius = (3.0 * sigma_px).ceil() as usize;
        let raw: Vec<f32> = (0..=radius)
            .map(|i| (-0.5 * (i as f32 / sigma_px).powi(2)).exp())
            .collect();
        let sum: f32 = raw[0] + 2.0 * raw[1..].iter().sum::<f32>();
        Self {
            half: raw.iter().map(|w| w / sum).collect(),
        }
    }

    /// Pixels from the border up to which what lies beyond it is missed.
    pub fn margin(&self) -> usize {
        /// Of the kernel's weight, what lies beyond a pixel's border is no matter from here on.
        const MISSED: f32 = 0.03;
        let beyond = |near: usize| {
            self.half[near.min(self.radius())..]
                .iter()
                .skip(1)
                .sum::<f32>()
        };
        (0..=self.radius())
            .find(|near| beyond(*near) < MISSED)
            .unwrap_or(0)
    }

    /// Pixels to each side.
    pub fn radius(&self) -> usize {
        self.half.len() - 1
    }

    /// What is left of the variance of white noise.
    pub fn noise_gain(&self) -> f32 {
        let sum = |w: &[f32]| w.iter().map(|w| w * w).sum::<f32>();
        let line = self.half[0] * self.half[0] + 2.0 * sum(&self.half[1..]);
        line * line
    }

    /// Mean square of both central differences of smoothed white noise, over the noise's variance.
    pub fn slope_gain(&self) -> f32 {
        let at = |i: i64| {
            let half = self.half.get(i.unsigned_abs() as usize);
            half.copied().unwrap_or(0.0)
        };
        let reach = self.half.len() as i64;
        let along: f32 = (-reach..=reach)
            .map(|i| (0.5 * (at(i + 1) - at(i - 1))).powi(2))
            .sum();
        2.0 * along * self.noise_gain().sqrt()
    }

    /// Smooths `image` into `out`, both of the same size.
    pub fn apply(&self, image: &Plane<f32>, out: &mut Plane<f32>) {
        self.apply_to(image, false, out);
    }

    /// [`Self::apply`], for images that may go on from the last column to the first (`wraps`).
    pub fn apply_to(&self, image: &Plane<f32>, wraps: bool, out: &mut Plane<f32>) {
        if self.radius() == 0 {
            out.data_mut().copy_from_slice(image.data());
            return;
        }
        pulp::Arch::new().dispatch(Smooth {
            half: &self.half,
            image,
            wraps,
            out,
        });
    }
}

/// Rows of an image smoothed, compiled for wide vectors.
struct Smooth<'a> {
    half: &'a [f32],
    image: &'a Plane<f32>,
    wraps: bool,
    out: &'a mut Plane<f32>,
}

impl pulp::WithSimd for Smooth<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self {
            half,
            image,
            wraps,
            out,
        } = self;
        let (width, height) = image.size();
        let radius = half.len() - 1;
        let mut padded = vec![0.0_f32; width + 2 * radius];
        for (y, out) in out.data_mut().chunks_exact_mut(width).enumerate() {
            // Down the columns first: whole rows are added, which vectorises.
            let line = &mut padded[radius..radius + width];
            for (to, from) in line.iter_mut().zip(image.row(y)) {
                *to = half[0] * from;
            }
            for (i, weight) in half.iter().enumerate().skip(1) {
                let (above, below) = (y.saturating_sub(i), (y + i).min(height - 1));
                let rows = image.row(above).iter().zip(image.row(below));
                for (to, (a, b)) in line.iter_mut().zip(rows) {
                    *to += weight * (a + b);
                }
            }
            let (first, last) = (padded[radius], padded[radius + width - 1]);
            padded[..radius].fill(first);
            padded[radius + width..].fill(last);
            if wraps && width >= radius {
                padded.copy_within(width..width + radius, 0);
                padded.copy_within(radius..2 * radius, radius + width);
            }
            for (to, from) in out.iter_mut().zip(&padded[radius..]) {
                *to = half[0] * from;
            }
            for (i, weight) in half.iter().enumerate().skip(1) {
                let sides = padded[radius - i..].iter().zip(&padded[radius + i..]);
                for (to, (a, b)) in out.iter_mut().zip(sides) {
                    *to += weight * (a + b);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaussian_keeps_constants_and_affine_interiors() {
        let ramp = Plane::from_fn(30, 20, |x, y| 3.0 + x as f32 + 2.0 * y as f32);
        let mut out = ramp.clone();
        Gaussian::new(1.5).apply(&ramp, &mut out);
        assert!((out[(15, 10)] - ramp[(15, 10)]).abs() < 1e-4);
        let flat = Plane::filled(30, 20, 7.0);
        Gaussian::new(2.5).apply(&flat, &mut out);
        assert!(out.data().iter().all(|v| (v - 7.0).abs() < 1e-5));
    }

    #[test]
    fn smoothing_around_an_image_that_wraps_does_not_depend_on_its_first_column() {
        let size = (32, 8);
        let paint = |x: usize, y: usize| ((x * 7 + y * 5) % 32) as f32;
        let image = Plane::from_fn(size.0, size.1, paint);
        let turned = Plane::from_fn(size.0, size.1, |x, y| paint((x + 11) % size.0, y));
        let gaussian = Gaussian::new(1.2);
        let (mut a, mut b) = (image.clone(), turned.clone());
        gaussian.apply_to(&image, true, &mut a);
        gaussian.apply_to(&turned, true, &mut b);
        let same = |x: usize, y: usize| (a[((x + 11) % size.0, y)] - b[(x, y)]).abs() < 1e-5;
        assert!((0..size.0).all(|x| (0..size.1).all(|y| same(x, y))));
    }

    #[test]
    fn margin_grows_with_the_kernel() {
        assert_eq!(Gaussian::new(0.0).margin(), 0);
        assert_eq!(Gaussian::new(0.5).margin(), 1);
        assert_eq!(Gaussian::new(1.2).margin(), 2);
    }

    #[test]
    fn noise_gain_is_the_sum_of_the_squared_kernel() {
        let dot = Plane::from_fn(31, 31, |x, y| if (x, y) == (15, 15) { 1.0 } else { 0.0 });
        let mut out = dot.clone();
        let gaussian = Gaussian::new(1.2);
        gaussian.apply(&dot, &mut out);
        let squares: f32 = out.data().iter().map(|v| v * v).sum();
        assert!((squares - gaussian.noise_gain()).abs() < 1e-6);
    }
}
