//! Derivatives of brightness from two images, of second order about the time between them.

use crate::{Result, same_size};
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
        let mut rows = PairRows::new(image0, image1)?;
        let (width, height) = image0.size();
        let [mut x, mut y, mut t] = [(); 3].map(|()| Plane::filled(width, height, 0.0));
        let [all_x, all_y, all_t] = [&mut x, &mut y, &mut t].map(Plane::data_mut);
        let out = all_x.chunks_mut(width).zip(all_y.chunks_mut(width));
        for (row, ((x, y), t)) in out.zip(all_t.chunks_mut(width)).enumerate() {
            rows.write(row, [x, y, t]);
        }
        Ok(Self { x, y, t })
    }
}

/// The rows of [`Derivatives::of_pair`], one after the other.
pub struct PairRows<'a> {
    images: [&'a Plane<f32>; 2],
    /// Mean image of rows above, at and below.
    means: [Vec<f32>; 3],
}

impl<'a> PairRows<'a> {
    /// Of two images.
    ///
    /// # Errors
    /// A shape error where the sizes differ.
    pub fn new(image0: &'a Plane<f32>, image1: &'a Plane<f32>) -> Result<Self> {
        same_size("image1", image0.size(), image1.size())?;
        Ok(Self {
            images: [image0, image1],
            means: [(); 3].map(|()| vec![0.0; image0.width()]),
        })
    }

    /// Slopes by column and row and the difference in time, of row `y`.
    pub fn write(&mut self, y: usize, out: [&mut [f32]; 3]) {
        let Self { images, means } = self;
        pulp::Arch::new().dispatch(PairRow {
            images,
            means,
            y,
            out,
        });
    }
}

/// [`PairRows::write`], compiled for wide vectors.
struct PairRow<'a, 'b> {
    images: &'a [&'b Plane<f32>; 2],
    means: &'a mut [Vec<f32>; 3],
    y: usize,
    out: [&'a mut [f32]; 3],
}

impl pulp::WithSimd for PairRow<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let height = self.images[0].height();
        let rows = [
            self.y.saturating_sub(1),
            self.y,
            (self.y + 1).min(height - 1),
        ];
        for (mean, row) in self.means.iter_mut().zip(rows) {
            let [a, b] = self.images.map(|image| image.row(row));
            for ((mean, a), b) in mean.iter_mut().zip(a).zip(b) {
                *mean = 0.5 * (a + b);
            }
        }
        let [out_x, out_y, out_t] = self.out;
        let [a, b] = self.images.map(|image| image.row(self.y));
        for ((out, a), b) in out_t.iter_mut().zip(a).zip(b) {
            *out = b - a;
        }
        let [above, own, below] = self.means.each_ref().map(Vec::as_slice);
        sobel_row([above, own, below], rows[2] - rows[0], [out_x, out_y]);
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
pub fn sobel_into(image: &Plane<f32>, x: &mut Plane<f32>, y: &mut Plane<f32>) {
    let width = image.width();
    let arch = pulp::Arch::new();
    let rows = x.data_mut().par_chunks_mut(width);
    rows.zip(y.data_mut().par_chunks_mut(width))
        .enumerate()
        .for_each(|(row, (x, y))| arch.dispatch(SobelRow { image, row, x, y }));
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
        let last = self.image.height() - 1;
        let (above, below) = (self.row.saturating_sub(1), (self.row + 1).min(last));
        let rows = [above, self.row, below].map(|row| self.image.row(row));
        sobel_row(rows, below - above, [self.x, self.y]);
    }
}

/// One row of both Sobel slopes, of the rows above, at and below it, of which the outer are `span` apart.
/// One-sided at the border, with the right scale.
#[inline(always)]
fn sobel_row([a, b, c]: [&[f32]; 3], span: usize, [out_x, out_y]: [&mut [f32]; 2]) {
    let width = b.len();
    let per_y = 1.0 / (4.0 * span.max(1) as f32);
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
