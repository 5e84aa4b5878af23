//! Parts of the image near some of its pixels.

use crate::filter::lattice::Lattice;

/// Pixels to a side of a tile.
const SIDE: usize = 8;

/// Tiles to each side that count as near: as far as the middle of pixels that are worked on together may be from
/// the last of them.
const REACH: usize = Tiles::TOGETHER / 2 / SIDE + 1;

/// Which tiles are near one of the pixels.
pub(super) struct Tiles {
    columns: usize,
    rows: usize,
    wraps: bool,
    near: Vec<bool>,
}

impl Tiles {
    /// Pixels of a row, at most, that are near by where their middle is.
    pub const TOGETHER: usize = 16;

    pub fn around(lattice: &Lattice, pixels: &[u32]) -> Self {
        let columns = lattice.width.div_ceil(SIDE);
        let rows = lattice.height.div_ceil(SIDE);
        let mut there = vec![false; columns * rows];
        for at in pixels {
            let (x, y) = (*at as usize % lattice.width, *at as usize / lattice.width);
            there[y / SIDE * columns + x / SIDE] = true;
        }
        let mut tiles = Self {
            columns,
            rows,
            wraps: lattice.wraps,
            near: vec![false; columns * rows],
        };
        for (tile, _) in there.iter().enumerate().filter(|(_, there)| **there) {
            tiles.mark(tile % columns, tile / columns);
        }
        tiles
    }

    fn mark(&mut self, column: usize, row: usize) {
        for y in row.saturating_sub(REACH)..(row + REACH + 1).min(self.rows) {
            for x in 0..=2 * REACH {
                let x = (column + x) as isize - REACH as isize;
                if let Some(x) = self.inside(x) {
                    self.near[y * self.columns + x] = true;
                }
            }
        }
    }

    fn inside(&self, column: isize) -> Option<usize> {
        let columns = self.columns as isize;
        match self.wraps {
            true => Some(column.rem_euclid(columns) as usize),
            false => (0..columns).contains(&column).then_some(column as usize),
        }
    }

    /// Whether pixels around a place, which may be somewhat outside of the image, may be near.
    #[inline(always)]
    pub fn near(&self, [x, y]: [f32; 2]) -> bool {
        let side = SIDE as f32;
        let [x, y] = [(x / side).floor(), (y / side).floor()];
        let reach = REACH as f32;
        let [columns, rows] = [self.columns, self.rows].map(|n| n as f32);
        // Also false for NaN.
        let close = x >= -reach && y >= -reach && x < columns + reach && y < rows + reach;
        if !close {
            return false;
        }
        let most = (self.columns - 1) as isize;
        let x = self
            .inside(x as isize)
            .unwrap_or((x as isize).clamp(0, most) as usize);
        let y = (y as isize).clamp(0, self.rows as isize - 1) as usize;
        self.near[y * self.columns + x]
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::*;
    use sphereflow_sphere::Camera;

    const WIDTH: usize = 320;
    const HEIGHT: usize = 160;

    #[test]
    fn pixels_within_half_a_block_are_near_and_those_blocks_away_are_not() {
        let pinhole = Camera::pinhole(200.0, 200.0, 159.5, 79.5, WIDTH, HEIGHT).unwrap();
        let sphere = Camera::equirectangular(WIDTH, HEIGHT).unwrap();
        for camera in [pinhole, sphere] {
            let lattice = Lattice::new(&camera).unwrap();
            let pixel = (314_usize, 60_usize);
            let tiles = Tiles::around(&lattice, &[(pixel.1 * WIDTH + pixel.0) as u32]);
            let half = (Tiles::TOGETHER / 2) as f32;
            let (px, py) = (pixel.0 as f32, pixel.1 as f32);
            for (dx, dy) in [(-half, 0.0), (5.0, -half), (0.0, half), (-half, half)] {
                assert!(tiles.near([px + dx, py + dy]), "{dx}, {dy}");
            }
            // Beyond the image's border, or around it.
            let beyond = px + half;
            assert!(tiles.near([beyond, py]), "beyond the border");
            assert_eq!(tiles.near([beyond - WIDTH as f32, py]), lattice.wraps);
            let far = (3 * Tiles::TOGETHER) as f32;
            for (dx, dy) in [(-far, 0.0), (0.0, far)] {
                assert!(!tiles.near([px + dx, py + dy]), "{dx}, {dy}");
            }
            assert!(!tiles.near([f32::NAN, py]));
        }
    }
}
