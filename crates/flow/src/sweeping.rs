//! The order in which repeated sweeps over an image share the cache.

use sphereflow_raster::LANES;
use std::ops::Range;

/// How sweeps are cut into pieces that stay in the cache.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blocks {
    /// Sweeps that run through the image together.
    pub together: usize,
    /// Columns of a tile, whole vectors.
    pub columns: usize,
}

/// What a sweep does to a piece of a row. A trait and not a closure: `#[inline(always)]` on `visit` lets it
/// be compiled for the vectors of its caller.
pub(crate) trait Sweep {
    /// Sweep `sweep` over `columns` of `row`.
    fn visit(&mut self, sweep: usize, row: usize, columns: Range<usize>);
}

/// Visits, for every sweep, every pixel of `columns` (whole vectors) times `height`, so that each pixel and
/// its neighbours have seen all earlier sweeps, and none beside it has seen a later one than the next.
///
/// Each sweep follows one row behind and one vector left of the one before; the result is that of sweep
/// after sweep, without going through the memory each time.
#[inline(always)]
pub(crate) fn sweep_together(
    (columns, height): (usize, usize),
    sweeps: usize,
    blocks: Blocks,
    pass: &mut impl Sweep,
) {
    let tiles = columns.div_ceil(blocks.columns);
    let mut done = 0;
    while done < sweeps {
        let together = blocks.together.min(sweeps - done);
        for tile in 0..tiles {
            for front in 0..height + together - 1 {
                for sweep in 0..together {
                    let Some(row) = front.checked_sub(sweep).filter(|row| *row < height) else {
                        continue;
                    };
                    let behind = sweep * LANES;
                    let first = (tile * blocks.columns).saturating_sub(behind);
                    let end = if tile + 1 == tiles {
                        columns
                    } else {
                        ((tile + 1) * blocks.columns).saturating_sub(behind)
                    };
                    if first < end {
                        pass.visit(done + sweep, row, first..end);
                    }
                }
            }
        }
        done += together;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts the visits of each pixel.
    struct Count {
        seen: Vec<usize>,
        width: usize,
    }

    impl Sweep for Count {
        fn visit(&mut self, sweep: usize, row: usize, columns: Range<usize>) {
            let (width, height) = (self.width as i64, (self.seen.len() / self.width) as i64);
            for x in columns.clone() {
                assert_eq!(self.seen[row * self.width + x], sweep);
                for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                    let (nx, ny) = (x as i64 + dx, row as i64 + dy);
                    if (0..width).contains(&nx) && (0..height).contains(&ny) {
                        // Of two images in turn, this sweep's and the next's keep what is read.
                        let state = self.seen[(ny * width + nx) as usize];
                        assert!((sweep..=sweep + 1).contains(&state), "{state} {sweep}");
                    }
                }
            }
            for x in columns {
                self.seen[row * self.width + x] += 1;
            }
        }
    }

    #[test]
    fn sweep_together_shows_each_pixel_its_neighbours_of_the_sweep_before() {
        for (width, height, sweeps) in [(304, 5, 19), (16, 4, 8), (128, 9, 3)] {
            for (together, columns) in [(8, 64), (3, 128), (20, 32), (1, 16)] {
                let seen = vec![0; width * height];
                let mut count = Count { seen, width };
                let blocks = Blocks { together, columns };
                sweep_together((width, height), sweeps, blocks, &mut count);
                assert!(count.seen.iter().all(|count| *count == sweeps));
            }
        }
    }
}
