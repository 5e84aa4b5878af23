//! What a band of rows is brighter by, told from what its ranges and places are off by in common.

use super::rolling::Sample;
use nalgebra::{Matrix4, Vector4};

/// Share by which a row may well be brighter than the image.
const LIKELY: f64 = 0.1;

/// The least squares of a band of rows: what it is brighter by than the image, and by how many of their deviations
/// its ranges are off in common, and its places by column and row. The last three are known to be about one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RowLight {
    matrix: Matrix4<f64>,
    vector: Vector4<f64>,
}

impl RowLight {
    /// `sigma` of the past brightness, whose noise is in its square.
    pub fn add(&mut self, sample: &Sample, overall: f32, sigma: f32) {
        let [right, below] = sample.shifted;
        let by = Vector4::new(sample.past, sample.misplaced, right, below);
        let by = (by * overall).cast::<f64>();
        let left = f64::from(sample.new) - by[0];
        let noise2 = f64::from(overall * sigma).powi(2);
        self.matrix += by * by.transpose();
        self.vector += by * left;
        self.matrix[(0, 0)] -= noise2;
        self.vector[0] += noise2;
    }

    pub fn join(&mut self, other: &Self) {
        self.matrix += other.matrix;
        self.vector += other.vector;
    }

    /// Share of what the band says of its ranges that light could not explain as well.
    pub fn told(&self) -> f64 {
        let alike = self.matrix[(0, 1)].powi(2);
        let both = self.matrix[(0, 0)] * self.matrix[(1, 1)];
        if alike < both {
            1.0 - alike / both
        } else {
            0.0
        }
    }

    /// Share by which the band is brighter than the image, and its variance, for residuals' noise of standard
    /// deviation `sigma`.
    pub fn deviation(&self, sigma: f64) -> (f64, f64) {
        let noise2 = sigma * sigma;
        let known = Vector4::new(LIKELY.powi(-2), 1.0, 1.0, 1.0);
        let matrix = self.matrix + Matrix4::from_diagonal(&(noise2 * known));
        match matrix.cholesky() {
            Some(factor) => {
                let variance = noise2 * factor.inverse()[(0, 0)];
                (factor.solve(&self.vector)[0], variance)
            }
            None => (0.0, LIKELY * LIKELY),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_band_is_brighter_by_is_uncertain_where_misplaced_ranges_look_alike() {
        let band = |misplaced: fn(usize) -> f32| {
            let mut sums = RowLight::default();
            for x in 0..400 {
                let sample = Sample {
                    new: 106.0,
                    past: 100.0,
                    row: 0.0,
                    past_row: 0.0,
                    misplaced: misplaced(x),
                    shifted: [0.0; 2],
                };
                sums.add(&sample, 1.0, 0.0);
            }
            (sums.deviation(2.0), sums.told())
        };
        // Paint of both signs: light it is, and of ranges all is told. Of one: 6 % may be either, by what both are
        // expected to be.
        let ((deviation, variance), told) = band(|x| if x % 2 == 0 { 6.0 } else { -6.0 });
        assert!((deviation - 0.06).abs() < 1e-5 && variance.sqrt() < 0.002);
        assert!((told - 1.0).abs() < 1e-9, "{told}");
        let ((_, variance), told) = band(|_| 6.0);
        let expected = 0.06 * LIKELY / LIKELY.hypot(0.06);
        assert!((variance.sqrt() - expected).abs() < 1e-3, "{variance}");
        assert!(told < 1e-9, "{told}");
    }
}
