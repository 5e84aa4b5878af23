//! Block averages of the inverse depth: what the solver works on instead of single pixels.

use crate::depth_image::{Axis, DepthImage};
use rayon::prelude::*;

/// Columns handled at once: wide enough to fill vector registers, small enough for the stack.
const STRIP: usize = 64;

/// Every so many blocks and rows are looked at for the noise.
const BEND_STRIDE: usize = 3;

/// The inverse of depth or range over blocks of pixels, 1/m; NaN where unknown.
#[derive(Clone, Debug, Default)]
pub struct InverseDepth {
    /// 1/m, row after row; NaN where unknown.
    pub values: Vec<f32>,
    /// Of which distance they are the inverse.
    pub axis: Axis,
}

/// Which blocks count.
#[derive(Clone, Copy, Debug)]
pub struct BlockRule {
    /// Side, pixels.
    pub block: usize,
    /// Smallest share of known pixels.
    pub known_share: f32,
    /// Largest spread over the mean.
    pub max_spread: f32,
}

impl InverseDepth {
    /// Fills `self` with the block averages of `image`; rows and columns that fill no block are
    /// dropped. Allocates only where the size has grown.
    ///
    /// The inverse depth of a plane is linear in the pixels of an undistorted camera, so that its
    /// mean is exactly the value at the block's centre. Where `depth_per_range` is given, one number a
    /// pixel, depths are averaged as ranges.
    pub fn average(
        &mut self,
        image: &DepthImage<'_>,
        depth_per_range: Option<&[f32]>,
        rule: BlockRule,
    ) {
        let (width, height) = image.size();
        let (columns, rows) = (width / rule.block, height / rule.block);
        let factors = depth_per_range.filter(|_| image.axis() == Axis::Optical);
        self.axis = factors.map_or(image.axis(), |_| Axis::Ray);
        self.values.resize(columns * rows, f32::NAN);
        let metres = image.metres();
        let arch = pulp::Arch::new();
        self.values
            .par_chunks_mut(columns)
            .with_min_len(16)
            .enumerate()
            .for_each(|(y, out)| {
                let start = y * rule.block * width;
                let pixels = start..start + rule.block * width;
                let metres = &metres[pixels.clone()];
                arch.dispatch(BlockRow {
                    values: match factors {
                        None => Values::Metres(metres),
                        Some(factors) => Values::Scaled(metres, &factors[pixels]),
                    },
                    width,
                    rule,
                    out,
                });
            });
    }

    /// Makes unknown what lies on an edge between surfaces: where the inverse depth bends by more
    /// than `max_bend`, 1/m, from one block to the next but one. On a plane it does not bend at all,
    /// however slanted it is. `scratch` is working memory.
    pub fn cut_edges(&mut self, width: usize, max_bend: f32, scratch: &mut Vec<f32>) {
        scratch.clone_from(&self.values);
        let old = &scratch[..];
        self.values
            .par_chunks_mut(width)
            .with_min_len(16)
            .enumerate()
            .for_each(|(y, line)| {
                let row = |y: usize| &old[y * width..(y + 1) * width];
                let here = row(y);
                for x in 1..width.saturating_sub(1) {
                    let bend = here[x - 1] + here[x + 1] - 2.0 * here[x];
                    if bend.abs() > max_bend {
                        line[x] = f32::NAN;
                    }
                }
                if y > 0 && (y + 1) * width < old.len() {
                    let (above, below) = (row(y - 1), row(y + 1));
                    for x in 0..width {
                        let bend = above[x] + below[x] - 2.0 * here[x];
                        if bend.abs() > max_bend {
                            line[x] = f32::NAN;
                        }
                    }
                }
            });
    }

    /// Standard deviation of the bend from block to block along the rows, 1/m, from the size that
    /// four in five do not exceed: most of a scene is smooth, and of quantised depth the median
    /// bend is none at all.
    pub fn bend_noise(&self, width: usize, scratch: &mut Vec<f32>) -> f32 {
        scratch.clear();
        for line in self.values.chunks(width).step_by(BEND_STRIDE) {
            let bends = line.windows(3).step_by(BEND_STRIDE);
            let sizes = bends.map(|w| (w[0] + w[2] - 2.0 * w[1]).abs());
            scratch.extend(sizes.filter(|bend| bend.is_finite()));
        }
        if scratch.is_empty() {
            return 0.0;
        }
        let at = scratch.len() * 4 / 5;
        let (_, size, _) = scratch.select_nth_unstable_by(at, f32::total_cmp);
        *size / 1.2816 // sigmas of a normal distribution
    }

    /// Fills `self` with the averages of blocks of values of `fine`, which has `width` columns.
    pub fn average_of(&mut self, fine: &Self, width: usize, rule: BlockRule) {
        let rows = fine.values.len() / width / rule.block;
        let columns = width / rule.block;
        self.axis = fine.axis;
        self.values.resize(columns * rows, f32::NAN);
        let arch = pulp::Arch::new();
        for (y, out) in self.values.chunks_mut(columns).enumerate() {
            let start = y * rule.block * width;
            arch.dispatch(BlockRow {
                values: Values::Inverse(&fine.values[start..start + rule.block * width]),
                width,
                rule,
                out,
            });
        }
    }

    /// Share of known values, 0 to 1.
    pub fn known_share(&self) -> f64 {
        let known = self.values.iter().filter(|v| v.is_finite()).count();
        known as f64 / self.values.len().max(1) as f64
    }

    /// True where both hold the same numbers, unknown ones included.
    pub fn same_as(&self, other: &Self) -> bool {
        let same = |a: &f32, b: &f32| a == b || (a.is_nan() && b.is_nan());
        self.axis == other.axis
            && self.values.len() == other.values.len()
            && self
                .values
                .iter()
                .zip(&other.values)
                .all(|(a, b)| same(a, b))
    }
}

/// What is averaged.
#[derive(Clone, Copy)]
enum Values<'a> {
    /// Distances.
    Metres(&'a [f32]),
    /// Distances, and factors of their inverse.
    Scaled(&'a [f32], &'a [f32]),
    /// Inverse distances.
    Inverse(&'a [f32]),
}

/// One row of blocks. A struct instead of a closure: only so is the body compiled for the processor
/// at hand.
struct BlockRow<'a> {
    values: Values<'a>,
    width: usize,
    rule: BlockRule,
    out: &'a mut [f32],
}

impl pulp::WithSimd for BlockRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let block = self.rule.block;
        let per_strip = STRIP / block;
        for (strip, out) in self.out.chunks_mut(per_strip).enumerate() {
            let x = strip * per_strip * block;
            let mut columns = Columns::new();
            for row in 0..block {
                let start = row * self.width + x;
                let pixels = start..start + out.len() * block;
                match self.values {
                    Values::Metres(metres) => columns.add(&metres[pixels], |_, m| 1.0 / m),
                    Values::Scaled(metres, factors) => {
                        let factors = &factors[pixels.clone()];
                        columns.add(&metres[pixels], |k, m| factors[k] / m);
                    }
                    Values::Inverse(values) => columns.add(&values[pixels], |_, v| v),
                }
            }
            let means = match block {
                // constants, so that the compiler can unroll them
                2 => columns.means(2, self.rule),
                4 => columns.means(4, self.rule),
                8 => columns.means(8, self.rule),
                _ => columns.means(block, self.rule),
            };
            out.copy_from_slice(&means[..out.len()]);
        }
    }
}

/// Sums over the rows of a strip of blocks, column by column.
struct Columns {
    sum: [f32; STRIP],
    known: [f32; STRIP],
    low: [f32; STRIP],
    high: [f32; STRIP],
}

impl Columns {
    fn new() -> Self {
        Self {
            sum: [0.0; STRIP],
            known: [0.0; STRIP],
            low: [f32::INFINITY; STRIP],
            high: [0.0; STRIP],
        }
    }

    /// Adds a row of the values' inverse distances.
    #[inline(always)]
    fn add(&mut self, values: &[f32], inverse: impl Fn(usize, f32) -> f32) {
        let columns = self
            .sum
            .iter_mut()
            .zip(&mut self.known)
            .zip(self.low.iter_mut().zip(&mut self.high));
        for ((k, &value), ((sum, known), (low, high))) in values.iter().enumerate().zip(columns) {
            let inverse = inverse(k, value);
            let is_known = (value > 0.0) & (inverse > 0.0); // false for NaN
            let (value, bottom) = if is_known {
                (inverse, inverse)
            } else {
                (0.0, f32::INFINITY)
            };
            *sum += value;
            *known += if is_known { 1.0 } else { 0.0 };
            *low = if bottom < *low { bottom } else { *low };
            *high = if value > *high { value } else { *high };
        }
    }

    /// Means of the strip's blocks, NaN where unknown.
    #[inline(always)]
    fn means(&self, block: usize, rule: BlockRule) -> [f32; STRIP] {
        let known = merged(&self.known, block, |a, b| a + b);
        let sum = merged(&self.sum, block, |a, b| a + b);
        let low = merged(&self.low, block, |a, b| if b < a { b } else { a });
        let high = merged(&self.high, block, |a, b| if b > a { b } else { a });
        let least = (rule.known_share * (block * block) as f32).max(1.0);
        let mut means = [f32::NAN; STRIP];
        for k in 0..STRIP {
            let mean = sum[k] / known[k];
            let good = (known[k] >= least) & (high[k] - low[k] <= rule.max_spread * mean);
            means[k] = if good { mean } else { f32::NAN };
        }
        means
    }
}

/// Neighbouring columns of each block as one.
#[inline(always)]
fn merged(columns: &[f32; STRIP], block: usize, merge: impl Fn(f32, f32) -> f32) -> [f32; STRIP] {
    let mut out = [0.0; STRIP];
    for (out, columns) in out.iter_mut().zip(columns.chunks_exact(block)) {
        *out = columns[1..].iter().fold(columns[0], |a, &b| merge(a, b));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use sphereflow_core::{DepthMap, Plane};

    const RULE: BlockRule = BlockRule {
        block: 4,
        known_share: 0.8,
        max_spread: 0.12,
    };

    fn averaged(f: impl FnMut(usize, usize) -> f32) -> InverseDepth {
        let map = DepthMap::new(Plane::from_fn(134, 9, f));
        let mut out = InverseDepth::default();
        out.average(&DepthImage::from(&map), None, RULE);
        out
    }

    #[test]
    fn average_of_slanted_plane_is_the_value_at_the_block_centre() {
        let inverse = |x: f32, y: f32| 0.5 + 1e-3 * x + 2e-3 * y;
        let out = averaged(|x, y| 1.0 / inverse(x as f32, y as f32));
        assert_eq!(out.values.len(), 33 * 2);
        for (i, value) in out.values.iter().enumerate() {
            let centre = inverse((i % 33) as f32 * 4.0 + 1.5, (i / 33) as f32 * 4.0 + 1.5);
            // f32 rounding of sixteen terms
            assert!((value - centre).abs() < 1e-6, "{value} {centre}");
        }
    }

    #[test]
    fn average_drops_blocks_with_holes_or_jumps() {
        let holes = averaged(|x, y| {
            if x < 4 && x + 4 * y % 16 < 4 {
                f32::NAN
            } else {
                2.0
            }
        });
        assert!(holes.values[0].is_nan() && holes.values[1] == 0.5);
        let jump = averaged(|x, _| if x < 2 { 1.0 } else { 2.0 });
        assert!(jump.values[0].is_nan() && jump.values[1] == 0.5);
        let one_hole = averaged(|x, y| if (x, y) == (1, 1) { f32::NAN } else { 2.0 });
        assert_eq!(one_hole.values[0], 0.5);
    }

    #[test]
    fn average_of_nothing_known_is_nothing() {
        assert_eq!(averaged(|_, _| f32::NAN).known_share(), 0.0);
    }
}
