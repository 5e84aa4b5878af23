//! The area integrals of the weak form: summed down the columns of a row of domains first, where
//! neighbours go side by side, and then across.

use crate::cell_sums::CellSums;
use crate::pair::Pair;
use crate::sphere_table::SphereTable;
use crate::tiling::Tiling;

/// Integrals over each column of blocks: change, area, gamma, and the three of the source.
const SUMS: usize = 6;

/// Working memory of [`crate::weak_form::WeakForm::accumulate`]: one sum per column of blocks.
#[derive(Clone, Debug, Default)]
pub struct AreaIntegrals {
    columns: [Vec<f64>; SUMS],
    count: Vec<u32>,
}

impl AreaIntegrals {
    pub(crate) fn start(&mut self, width: usize) {
        for column in &mut self.columns {
            column.clear();
            column.resize(width, 0.0);
        }
        self.count.clear();
        self.count.resize(width, 0);
    }

    /// Adds row `y` of the blocks.
    #[inline(always)]
    pub(crate) fn add(&mut self, pair: &Pair, table: &SphereTable, y: usize) {
        let width = self.count.len();
        let row = y * width..(y + 1) * width;
        let (mean, half) = (&pair.mean[row.clone()], &pair.half[row.clone()]);
        let area = &table.area[row.clone()];
        let [ax, ay, az] = table.area_ray.each_ref().map(|all| &all[row.clone()]);
        let [change, areas, gamma, vx, vy, vz] = self.columns.each_mut().map(|c| &mut c[..width]);
        let count = &mut self.count[..width];
        for x in 0..width {
            let is_known = !mean[x].is_nan();
            let known = |value: f32| if is_known { value } else { 0.0 };
            let (mean, half, area) = (known(mean[x]), known(half[x]), known(area[x]));
            let source = 2.0 * (mean * mean + half * half);
            change[x] += f64::from(2.0 * half * area);
            areas[x] += f64::from(area);
            gamma[x] += f64::from(mean * area);
            vx[x] += f64::from(source * known(ax[x]));
            vy[x] += f64::from(source * known(ay[x]));
            vz[x] += f64::from(source * known(az[x]));
            count[x] += u32::from(is_known);
        }
    }

    /// Adds the column sums to a row of domains and resets them.
    pub(crate) fn finish(&mut self, tiling: &Tiling, row: u32, sums: &mut [CellSums]) {
        for (x, column) in tiling.column.iter().enumerate() {
            let cell = &mut sums[(row + column) as usize];
            let [change, area, gamma, vx, vy, vz] = self.columns.each_ref().map(|c| c[x]);
            cell.change += change;
            cell.area += area;
            cell.gamma += gamma;
            cell.coefficients[3] += vx;
            cell.coefficients[4] += vy;
            cell.coefficients[5] += vz;
            cell.count += self.count[x];
        }
        self.start(tiling.column.len());
    }
}
