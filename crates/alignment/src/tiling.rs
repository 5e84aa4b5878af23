//! The domains: a tiling of the image by rectangles of about equal size.

/// Rectangular cells; the domain of block `(x, y)` is `column[x] + row[y]`.
#[derive(Clone, Debug)]
pub struct Tiling {
    /// Column of cells of each column of blocks.
    pub column: Vec<u32>,
    /// Already multiplied by the number of columns of cells.
    pub row: Vec<u32>,
    /// Number of cells.
    pub cells: usize,
    /// Blocks in each cell.
    pub full: Vec<u32>,
}

/// A cell is at least this many blocks wide and high, so that it has an inside.
const MIN_SIDE: usize = 4;

impl Tiling {
    /// About `wanted` cells over `width` x `height` blocks.
    pub fn new(width: usize, height: usize, wanted: usize) -> Self {
        let across = (wanted as f64 * width as f64 / height as f64).sqrt();
        let across = (across.round() as usize).clamp(1, (width / MIN_SIDE).max(1));
        let down = (wanted as f64 / across as f64).round() as usize;
        let down = down.clamp(1, (height / MIN_SIDE).max(1));
        let cell = |i: usize, cells: usize, size: usize| (i * cells / size) as u32;
        let column: Vec<u32> = (0..width).map(|x| cell(x, across, width)).collect();
        let row: Vec<u32> = (0..height)
            .map(|y| cell(y, down, height) * across as u32)
            .collect();
        let mut full = vec![0; across * down];
        for r in &row {
            for c in &column {
                full[(r + c) as usize] += 1;
            }
        }
        Self {
            column,
            row,
            cells: across * down,
            full,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiling_covers_all_blocks_with_about_the_wanted_number() {
        let tiling = Tiling::new(160, 120, 500);
        assert!((450..=550).contains(&tiling.cells), "{}", tiling.cells);
        assert_eq!(tiling.full.iter().sum::<u32>(), 160 * 120);
        assert!(tiling.full.iter().all(|&n| n >= 25));
    }

    #[test]
    fn tiling_of_a_small_image_has_fewer_cells() {
        let tiling = Tiling::new(20, 3, 500);
        assert_eq!(tiling.cells, 5);
    }
}
