//! The rectangles of the image: cells of a tiling, and domains made of one or of 2x2 cells.

/// Cells are at least so many pixels wide and high.
const MIN_SIDE: usize = 4;
/// Cells are at most so many times as long as wide, where the wanted number allows.
const MAX_ASPECT: f64 = 1.6;

/// A tiling of the image by `across` x `down` cells, and the domains that are made of them.
#[derive(Clone, Debug)]
pub(crate) struct Domains {
    /// First column of each cell, and the end of the last.
    pub(crate) columns: Vec<usize>,
    /// First row of each cell, and the end of the last.
    pub(crate) rows: Vec<usize>,
    /// Each domain is 2x2 cells.
    overlap: bool,
}

impl Domains {
    /// About `wanted` domains in an image of `width` x `height` pixels.
    pub(crate) fn new(width: usize, height: usize, wanted: usize, overlap: bool) -> Self {
        let extra = usize::from(overlap);
        let (most_across, most_down) = (most(width), most(height));
        let mut best = (f64::INFINITY, 1, 1);
        for across in 1 + extra..=most_across.max(1 + extra) {
            let down = (wanted as f64 / (across - extra) as f64).round() as usize + extra;
            let down = down.clamp(1 + extra, most_down.max(1 + extra));
            let found = ((across - extra) * (down - extra)) as f64;
            let sides = (width as f64 / across as f64) / (height as f64 / down as f64);
            let aspect = sides.max(1.0 / sides);
            // The right number first, then the shape, within the limit.
            let cost = 1e3 * (found / wanted as f64 - 1.0).abs()
                + aspect
                + 1e3 * (aspect - MAX_ASPECT).max(0.0);
            if cost < best.0 {
                best = (cost, across, down);
            }
        }
        let bounds = |cells: usize, size: usize| (0..=cells).map(|i| i * size / cells).collect();
        Self {
            columns: bounds(best.1.min(width.max(1)), width),
            rows: bounds(best.2.min(height.max(1)), height),
            overlap,
        }
    }

    /// Cells in a row.
    pub(crate) fn across(&self) -> usize {
        self.columns.len() - 1
    }

    /// Cells in a column.
    pub(crate) fn down(&self) -> usize {
        self.rows.len() - 1
    }

    /// The indices of the cells of every domain, domain after domain.
    pub(crate) fn for_each(&self, mut visit: impl FnMut(&mut dyn Iterator<Item = usize>)) {
        let extra = usize::from(self.overlap);
        let offsets: &[(usize, usize)] = if self.overlap {
            &[(0, 0), (1, 0), (0, 1), (1, 1)]
        } else {
            &[(0, 0)]
        };
        let across = self.across();
        for row in 0..self.down().saturating_sub(extra) {
            for column in 0..across.saturating_sub(extra) {
                let mut cells = offsets.iter().map(|(x, y)| (row + y) * across + column + x);
                visit(&mut cells);
            }
        }
    }
}

fn most(size: usize) -> usize {
    (size / MIN_SIDE).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(domains: &Domains) -> usize {
        let mut count = 0;
        domains.for_each(|_| count += 1);
        count
    }

    /// Thesis: Table 6.1: the numbers of domains that it lists.
    #[test]
    fn domains_are_as_many_as_wanted_and_tile_the_image() {
        for wanted in [40, 100, 200, 500, 1000] {
            let domains = Domains::new(640, 480, wanted, false);
            assert_eq!(count(&domains), wanted);
            assert_eq!(
                (domains.columns[0], domains.columns[domains.across()]),
                (0, 640)
            );
            assert_eq!((domains.rows[0], domains.rows[domains.down()]), (0, 480));
            let overlapping = count(&Domains::new(640, 480, wanted, true));
            let share = overlapping as f64 / wanted as f64;
            assert!((0.9..1.1).contains(&share), "{overlapping} of {wanted}");
        }
    }

    #[test]
    fn domains_that_overlap_are_four_cells_of_the_tiling() {
        let domains = Domains::new(64, 48, 12, true);
        let mut first = Vec::new();
        domains.for_each(|cells| {
            if first.is_empty() {
                first = cells.collect();
            }
        });
        let across = domains.across();
        assert_eq!(first, [0, 1, across, across + 1]);
    }

    #[test]
    fn domains_of_a_small_image_are_fewer() {
        assert_eq!(count(&Domains::new(20, 8, 500, false)), 10);
        assert_eq!(count(&Domains::new(3, 2, 500, false)), 1);
        assert_eq!(count(&Domains::new(1, 1, 6, true)), 0);
    }
}
