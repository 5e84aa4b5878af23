//! Bicubic values and slopes of many places of a row at once.

use sphereflow_core::Plane;
use sphereflow_sphere::catmull_rom;

/// Places that are read together: their numbers stay in the first cache.
pub(super) const TOGETHER: usize = 64;

/// Catmull-Rom values and slopes at places well inside an image; those elsewhere are left to the caller.
///
/// As [`sphereflow_sphere::Sampler::bicubic_with_slope`], in three passes: what depends on a place alone, and
/// the mix along the rows, is computed for several places in one vector, the mix down the columns for
/// four columns in one.
pub(super) struct Bicubic {
    /// First of the sixteen pixels around each place.
    corner: [u32; TOGETHER],
    across: [f32; TOGETHER],
    down: [[f32; TOGETHER]; 8],
    /// Four columns mixed by the weights of the rows, and by their derivatives.
    mixed: [[f32; TOGETHER]; 4],
    tilted: [[f32; TOGETHER]; 4],
    /// Whether the place is at least a pixel inside.
    pub inside: [bool; TOGETHER],
    /// Value, slope by column, slope by row.
    pub found: [[f32; TOGETHER]; 3],
}

impl Bicubic {
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            corner: [0; TOGETHER],
            across: [0.0; TOGETHER],
            down: [[0.0; TOGETHER]; 8],
            mixed: [[0.0; TOGETHER]; 4],
            tilted: [[0.0; TOGETHER]; 4],
            inside: [false; TOGETHER],
            found: [[0.0; TOGETHER]; 3],
        }
    }

    /// Reads `image` at pixels `first..first + count` of row `y`, moved by `flow`.
    #[inline(always)]
    pub fn read(&mut self, image: &Plane<f32>, y: usize, first: usize, flow: [&[f32]; 2]) {
        let count = flow[0].len().min(TOGETHER);
        self.places(image.size(), y, first, flow, count);
        self.columns(image);
        for i in 0..count {
            let (w, d) = catmull_rom(self.across[i]);
            let (m, t) = (&self.mixed, &self.tilted);
            self.found[0][i] = w[0] * m[0][i] + w[1] * m[1][i] + (w[2] * m[2][i] + w[3] * m[3][i]);
            self.found[1][i] = d[0] * m[0][i] + d[1] * m[1][i] + (d[2] * m[2][i] + d[3] * m[3][i]);
            self.found[2][i] = w[0] * t[0][i] + w[1] * t[1][i] + (w[2] * t[2][i] + w[3] * t[3][i]);
        }
    }

    #[inline(always)]
    fn places(
        &mut self,
        (width, height): (usize, usize),
        y: usize,
        first: usize,
        flow: [&[f32]; 2],
        count: usize,
    ) {
        let (last_x, last_y) = (width as f32 - 2.0, height as f32 - 2.0);
        let (u, v) = (&flow[0][..count], &flow[1][..count]);
        let (y, first, width) = (y as f32, first as f32, width as u32);
        for i in 0..count {
            let (px, py) = (first + i as i32 as f32 + u[i], y + v[i]);
            // Also false for NaN.
            let inside = (px >= 1.0) & (py >= 1.0) & (px < last_x) & (py < last_y);
            let (px, py) = if inside { (px, py) } else { (1.0, 1.0) };
            let (x0, y0) = (px.floor(), py.floor());
            self.inside[i] = inside;
            self.corner[i] = whole(y0 - 1.0) * width + whole(x0 - 1.0);
            self.across[i] = px - x0;
            let (w, d) = catmull_rom(py - y0);
            for j in 0..4 {
                (self.down[j][i], self.down[4 + j][i]) = (w[j], d[j]);
            }
        }
    }

    /// Of all places: what is left of those beyond `count` is read in vain.
    #[inline(always)]
    fn columns(&mut self, image: &Plane<f32>) {
        let (data, width) = (image.data(), image.width());
        let mut columns = [[[0.0_f32; 4]; TOGETHER]; 2];
        let [mixes, tilts] = &mut columns;
        for (i, (mixes, tilts)) in mixes.iter_mut().zip(tilts).enumerate() {
            let (mut mixed, mut tilted) = ([0.0_f32; 4], [0.0_f32; 4]);
            for j in 0..4 {
                let start = self.corner[i] as usize + j * width;
                let row = &data[start..start + 4];
                let (w, d) = (self.down[j][i], self.down[4 + j][i]);
                for k in 0..4 {
                    mixed[k] += w * row[k];
                    tilted[k] += d * row[k];
                }
            }
            (*mixes, *tilts) = (mixed, tilted);
        }
        for (columns, out) in columns.iter().zip([&mut self.mixed, &mut self.tilted]) {
            let [a, b, c, d] = out;
            for i in 0..TOGETHER {
                [a[i], b[i], c[i], d[i]] = columns[i];
            }
        }
    }
}

/// A whole number below 2^23 as an integer: of one vector instruction, which a cast is not.
#[inline(always)]
fn whole(value: f32) -> u32 {
    const MANTISSA: u32 = (1 << 23) - 1;
    (value + (1_u32 << 23) as f32).to_bits() & MANTISSA
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;
    use sphereflow_sphere::Sampler;

    #[test]
    fn bicubic_of_a_row_is_that_of_the_sampler() {
        let image = Plane::from_fn(40, 20, |x, y| ((x * 31 + y * 57) % 23) as f32);
        let u: Vec<f32> = (0..30).map(|i| 3.0 - 0.37 * i as f32).collect();
        let v: Vec<f32> = (0..30).map(|i| 0.23 * i as f32 - 4.0).collect();
        let mut rows = Bicubic::new();
        rows.read(&image, 9, 5, [&u, &v]);
        let sampler = Sampler::new(&image);
        let mut seen = 0;
        for i in (0..30).filter(|i| rows.inside[*i]) {
            let place = Vector2::new((5 + i) as f32 + u[i], 9.0 + v[i]);
            let sample = sampler.bicubic_with_slope(&place.cast());
            let expected = [sample.value, sample.slope.x, sample.slope.y];
            for (found, expected) in rows.found.iter().zip(expected) {
                // Single precision at values of twenty.
                assert!((found[i] - expected).abs() < 1e-4);
            }
            seen += 1;
        }
        assert!(seen > 20);
    }
}
