//! Derivatives of brightness from two images, of second order about the time between them.

use crate::Result;
use crate::error::same_size;
use rayon::prelude::*;
use sphereflow_core::Plane;

/// Derivatives of brightness at the middle of two images, per pixel and per frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Derivatives {
    /// By the column.
    pub x: Plane<f32>,
    /// By the row.
    pub y: Plane<f32>,
    /// By time, per frame.
    pub t: Plane<f32>,
}

impl Derivatives {
    /// Sobel slopes of the mean image and the difference of both.
    ///
    /// Thesis: eq. (2.3), (2.4). Taken of the mean of both images, so that all three belong to the
    /// middle of the two times; at borders the image is continued by its last pixel.
    ///
    /// # Errors
    /// A shape error where the sizes differ.
    pub fn of_pair(image0: &Plane<f32>, image1: &Plane<f32>) -> Result<Self> {
        same_size("image1", image0.size(), image1.size())?;
        let (mean, t) = (
            pointwise(image0, image1, |a, b| 0.5 * (a + b)),
            pointwise(image0, image1, |a, b| b - a),
        );
        let (x, y) = sobel(&mean);
        Ok(Self { x, y, t })
    }

    /// Zero where one of them is unknown: nothing is said there, and nothing unknown spreads.
    pub(crate) fn silent_where_unknown(mut self) -> Self {
        let [x, y, t] = [&mut self.x, &mut self.y, &mut self.t].map(Plane::data_mut);
        for ((x, y), t) in x.iter_mut().zip(y).zip(t) {
            if !(*x + *y + *t).is_finite() {
                (*x, *y, *t) = (0.0, 0.0, 0.0);
            }
        }
        self
    }
}

/// Sobel slopes of one image, per pixel: (by column, by row).
///
/// Thesis: eq. (2.4).
pub fn sobel(image: &Plane<f32>) -> (Plane<f32>, Plane<f32>) {
    let (width, height) = image.size();
    let mut x = Plane::filled(width, height, 0.0);
    let mut y = Plane::filled(width, height, 0.0);
    sobel_into(image, &mut x, &mut y);
    (x, y)
}

/// [`sobel`] into planes of the image's size.
pub(crate) fn sobel_into(image: &Plane<f32>, x: &mut Plane<f32>, y: &mut Plane<f32>) {
    let width = image.width();
    let arch = pulp::Arch::new();
    let rows = x.data_mut().par_chunks_mut(width);
    rows.zip(y.data_mut().par_chunks_mut(width))
        .enumerate()
        .for_each(|(row, (x, y))| arch.dispatch(SobelRow { image, row, x, y }));
}

fn pointwise(a: &Plane<f32>, b: &Plane<f32>, f: impl Fn(f32, f32) -> f32) -> Plane<f32> {
    let mut out = a.clone();
    for (out, b) in out.data_mut().iter_mut().zip(b.data()) {
        *out = f(*out, *b);
    }
    out
}

/// [`sobel_row`], compiled for wide vectors.
struct SobelRow<'a> {
    image: &'a Plane<f32>,
    row: usize,
    x: &'a mut [f32],
    y: &'a mut [f32],
}

impl pulp::WithSimd for SobelRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        sobel_row(self.image, self.row, self.x, self.y);
    }
}

/// One row of both Sobel slopes. One-sided at the border, with the right scale.
#[inline(always)]
fn sobel_row(image: &Plane<f32>, row: usize, out_x: &mut [f32], out_y: &mut [f32]) {
    let (width, height) = image.size();
    let (above, below) = (row.saturating_sub(1), (row + 1).min(height - 1));
    let (a, b, c) = (image.row(above), image.row(row), image.row(below));
    let per_y = 1.0 / (4.0 * (below - above).max(1) as f32);
    let column = |x: usize| a[x] + 2.0 * b[x] + c[x];
    let slope = |x: usize| c[x] - a[x];
    for x in [0, width - 1] {
        let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
        let span_x = (right - left).max(1) as f32;
        out_x[x] = (column(right) - column(left)) / (4.0 * span_x);
        out_y[x] = (slope(left) + 2.0 * slope(x) + slope(right)) * per_y;
    }
    // Slices of one length have no bounds to check, so that the loop runs on vectors.
    let count = width.saturating_sub(2);
    if count == 0 {
        return;
    }
    let [al, am, ar] = [0, 1, 2].map(|i| &a[i..][..count]);
    let [bl, br] = [0, 2].map(|i| &b[i..][..count]);
    let [cl, cm, cr] = [0, 1, 2].map(|i| &c[i..][..count]);
    let (out_x, out_y) = (&mut out_x[1..][..count], &mut out_y[1..][..count]);
    for i in 0..count {
        let (left, right) = (al[i] + 2.0 * bl[i] + cl[i], ar[i] + 2.0 * br[i] + cr[i]);
        out_x[i] = 0.125 * (right - left);
        out_y[i] = ((cl[i] - al[i]) + 2.0 * (cm[i] - am[i]) + (cr[i] - ar[i])) * per_y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_of_a_moving_ramp_are_its_slopes_everywhere() {
        // Thesis: eq. (2.3), (2.4): exact on an affine image, at borders too.
        let ramp = |t: f32| Plane::from_fn(9, 7, |x, y| 3.0 * x as f32 - 2.0 * y as f32 + 5.0 * t);
        let d = Derivatives::of_pair(&ramp(0.0), &ramp(1.0)).unwrap();
        for (found, expected) in [(&d.x, 3.0), (&d.y, -2.0), (&d.t, 5.0)] {
            assert!(found.data().iter().all(|v| (v - expected).abs() < 1e-5));
        }
    }

    #[test]
    fn sobel_of_one_bright_pixel_is_the_printed_kernel() {
        // Thesis: eq. (2.4): the kernel 1/8 (1 0 -1; 2 0 -2; 1 0 -1), as convolution.
        let dot = Plane::from_fn(7, 7, |x, y| if (x, y) == (3, 3) { 8.0 } else { 0.0 });
        let (by_x, by_y) = sobel(&dot);
        assert_eq!((by_x[(2, 2)], by_x[(2, 3)], by_x[(4, 3)]), (1.0, 2.0, -2.0));
        assert_eq!((by_y[(2, 2)], by_y[(3, 2)], by_y[(3, 4)]), (1.0, 2.0, -2.0));
    }

    #[test]
    fn derivatives_of_images_of_two_sizes_are_an_error_that_names_both() {
        let error = Derivatives::of_pair(&Plane::filled(3, 2, 0.0), &Plane::filled(4, 2, 0.0));
        let text = error.unwrap_err().to_string();
        assert!(text.contains("image1") && text.contains("(2, 4)"), "{text}");
    }
}
