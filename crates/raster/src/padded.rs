//! An image with a rim all around, whose rows are whole vectors: sweeps need no special border pixels.

use pulp::Simd;
use rayon::prelude::*;
use sphereflow_core::{Error, Plane, Result};
use std::ops::DerefMut;

/// Columns of the widest vector; rows are as many of them as cover the image.
pub const LANES: usize = 16;

/// A plane of `width x height` pixels with [`LANES`] columns of rim left and right of whole vectors, and a
/// row of rim above and below. New rims are zero.
#[derive(Clone, Debug)]
pub struct Padded<D = Vec<f32>> {
    data: D,
    width: usize,
    height: usize,
    stride: usize,
}

impl Padded<Vec<f32>> {
    /// Where the pixels begin in what [`Padded::rows_mut`] gives.
    pub const PIXELS: usize = LANES;

    /// All zero, for planes `(width, height)`.
    pub fn zero(size: (usize, usize)) -> Self {
        Self::over(vec![0.0; Self::len(size)], size)
    }

    /// The pixels of a plane, in rims of zero.
    pub fn of(plane: &Plane<f32>) -> Self {
        let mut padded = Self::zero(plane.size());
        padded.load(plane);
        padded
    }

    /// Numbers that a plane takes, with its rims.
    pub fn len((width, height): (usize, usize)) -> usize {
        (width.next_multiple_of(LANES) + 2 * LANES) * (height + 2)
    }
}

impl<'a> Padded<&'a mut [f32]> {
    /// Planes of one size in one block of [`Padded::len`] each. One block is found again by the next call's
    /// allocation; many small ones go back to the system, and each of their pages costs a fault when it returns.
    ///
    /// # Errors
    /// A shape error naming `block`, where it is not as long as the planes together.
    pub fn split<const N: usize>(block: &'a mut [f32], size: (usize, usize)) -> Result<[Self; N]> {
        let len = Padded::len(size);
        if block.len() != N * len {
            return Err(Error::shape("block", N * len, block.len()));
        }
        let mut rest = block.chunks_exact_mut(len);
        Ok([(); N].map(|()| {
            let data = rest.next().unwrap_or_default(); // there are N, as the length says
            Self::over(data, size)
        }))
    }
}

impl<D: DerefMut<Target = [f32]>> Padded<D> {
    /// Over `data` of [`Padded::len`], which is taken as it is.
    fn over(data: D, (width, height): (usize, usize)) -> Self {
        let len = Padded::len((width, height));
        // Both callers make data of that length; a slip here would be found by the slices of rows.
        debug_assert_eq!(data.len(), len, "a plane and its rims");
        Self {
            data,
            width,
            height,
            stride: len / (height + 2),
        }
    }

    /// `(width, height)`, rims aside.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Columns in whole vectors.
    pub fn columns(&self) -> usize {
        self.stride - 2 * LANES
    }

    /// `count` pixels from column `x` of row `y`, shifted by columns and rows, at most one each.
    #[inline(always)]
    pub fn span(&self, x: usize, y: usize, count: usize, shift: [isize; 2]) -> &[f32] {
        let start = self.start(x, y);
        let start = start.wrapping_add_signed(shift[0] + shift[1] * self.stride as isize);
        &self.data[start..][..count]
    }

    /// `count` pixels from column `x` of row `y`.
    #[inline(always)]
    pub fn span_mut(&mut self, x: usize, y: usize, count: usize) -> &mut [f32] {
        let start = self.start(x, y);
        &mut self.data[start..][..count]
    }

    /// As [`Padded::span`], in vectors; `count` is whole vectors.
    #[inline(always)]
    pub fn vectors<S: Simd>(
        &self,
        x: usize,
        y: usize,
        count: usize,
        shift: [isize; 2],
    ) -> &[S::f32s] {
        &S::as_simd_f32s(self.span(x, y, count, shift)).0[..count / S::F32_LANES]
    }

    /// As [`Padded::span_mut`], in vectors.
    #[inline(always)]
    pub fn vectors_mut<S: Simd>(&mut self, x: usize, y: usize, count: usize) -> &mut [S::f32s] {
        &mut S::as_mut_simd_f32s(self.span_mut(x, y, count)).0[..count / S::F32_LANES]
    }

    #[inline(always)]
    fn start(&self, x: usize, y: usize) -> usize {
        (y + 1) * self.stride + LANES + x
    }

    /// Row `y`, rims aside.
    pub fn row(&self, y: usize) -> &[f32] {
        self.span(0, y, self.width, [0, 0])
    }

    /// As [`Padded::row`], to be written.
    pub fn row_mut(&mut self, y: usize) -> &mut [f32] {
        let width = self.width;
        self.span_mut(0, y, width)
    }

    /// All rows, rims aside, for several threads; of each the pixels are [`Padded::PIXELS`] and on.
    pub fn rows_mut(&mut self) -> rayon::slice::ChunksExactMut<'_, f32> {
        let stride = self.stride;
        self.data[stride..stride * (self.height + 1)].par_chunks_exact_mut(stride)
    }

    /// The pixels of a plane of the same size; the rims stay.
    pub fn load(&mut self, plane: &Plane<f32>) {
        for y in 0..self.height {
            self.row_mut(y).copy_from_slice(plane.row(y));
        }
    }

    /// As [`Padded::load`], with zero for what is not finite.
    pub fn load_known(&mut self, plane: &Plane<f32>) {
        self.load(plane);
        for value in self.data.iter_mut().filter(|value| !value.is_finite()) {
            *value = 0.0;
        }
    }

    /// The pixels into a plane of the same size.
    pub fn store(&self, plane: &mut Plane<f32>) {
        let rows = plane.data_mut().chunks_exact_mut(self.width);
        for (y, out) in rows.enumerate() {
            out.copy_from_slice(self.row(y));
        }
    }

    /// The pixels alone.
    pub fn to_plane(&self) -> Plane<f32> {
        let mut plane = Plane::filled(self.width, self.height, 0.0);
        self.store(&mut plane);
        plane
    }

    /// Continues row `y` by its last pixel to the right, and, if asked for, by its first to the left.
    #[inline(always)]
    pub fn continue_row(&mut self, y: usize, [left, right]: [bool; 2]) {
        let start = self.start(0, y);
        if left {
            self.data[start - 1] = self.data[start];
        }
        if right {
            self.data[start + self.width] = self.data[start + self.width - 1];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn split_of_a_block_of_another_length_is_an_error_that_names_both() {
        let size = (19, 5);
        let mut block = vec![0.0; 2 * Padded::len(size)];
        assert!(Padded::split::<2>(&mut block, size).is_ok());
        let text = Padded::split::<3>(&mut block, size)
            .unwrap_err()
            .to_string();
        let (three, two) = (3 * Padded::len(size), 2 * Padded::len(size));
        assert_eq!(text, format!("block: expected shape {three}, found {two}"));
    }

    #[test]
    fn padded_gives_back_its_plane_and_shifts_into_its_rim() {
        let plane = Plane::from_fn(19, 5, |x, y| (x + 100 * y) as f32 + 1.0);
        let mut padded = Padded::of(&plane);
        assert_eq!((padded.size(), padded.columns()), ((19, 5), 32));
        let mut back = Plane::filled(19, 5, 0.0);
        padded.store(&mut back);
        assert_eq!(back, plane);
        assert_eq!(padded.span(3, 2, 2, [1, -1]), [105.0, 106.0]);
        assert_eq!(padded.span(0, 0, 1, [-1, -1]), [0.0]);
        assert_eq!(padded.span(0, 4, 19, [0, 1]), [0.0; 19]);
        padded.continue_row(4, [true, true]);
        assert_eq!(padded.span(0, 4, 1, [-1, 0]), [401.0]);
        assert_eq!(padded.span(18, 4, 1, [1, 0]), [419.0]);
    }
}
