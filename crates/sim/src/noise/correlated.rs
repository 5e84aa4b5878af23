//! A random field of unit variance, correlated over several pixels: the sum of a few smoothed white fields.

use super::stream::Streams;
use super::{checks, normals};
use rayon::prelude::*;
use sphereflow_core::{Error, Result};

/// Rows that are filtered side by side.
const LOCKSTEP: usize = 4;

/// One scale of the correlated field: white noise through two first-order filters in a row, along
/// x and along y.
///
/// Its autocorrelation at `d` pixels along a row or column is
/// `a^d (1 + d (1 - a^2) / (1 + a^2))` with `a = decay_per_px`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CorrelationScale {
    /// Share of the field's variance, 0 to 1; the shares of all scales sum to 1.
    pub variance_share: f64,
    /// Factor `a` of the filters, from 0 (white) to below 1.
    pub decay_per_px: f64,
}

/// # Errors
/// Names the scale whose share or decay is out of range, or the sum that is not 1.
pub(crate) fn check(scales: &[CorrelationScale]) -> Result<()> {
    for scale in scales {
        checks::non_negative("correlation.variance_share", scale.variance_share)?;
        checks::share("correlation.decay_per_px", scale.decay_per_px)?;
    }
    let sum: f64 = scales.iter().map(|s| s.variance_share).sum();
    if (sum - 1.0).abs() > 1e-6 {
        return Err(Error::value(
            "correlation.variance_share",
            "shares that sum to 1",
            sum,
        ));
    }
    Ok(())
}

/// Two first-order filters in a row, `u = a u + b w`, `y = a y + c u`, scaled so that white noise of
/// unit variance gives `y` of unit variance; started from their stationary law, so that the border
/// of the image is no different from its middle.
#[derive(Clone, Copy)]
struct Cascade {
    a: f32,
    b: f32,
    c: f32,
    /// Stationary correlation of `u` and `y`.
    r: f32,
    /// `sqrt(1 - r^2)`.
    s: f32,
}

impl Cascade {
    fn new(decay: f64) -> Self {
        let a2 = decay * decay;
        let r = (1.0 / (1.0 + a2)).sqrt();
        Self {
            a: decay as f32,
            b: (1.0 - a2).sqrt() as f32,
            c: ((1.0 - a2) * r) as f32,
            r: r as f32,
            s: (1.0 - r * r).sqrt() as f32,
        }
    }

    /// Fills rows of `width` with filtered white noise, row `k` from stream `first_stream + k`.
    fn fill_rows(&self, rows: &mut [f32], width: usize, streams: &Streams, first_stream: u64) {
        let mut starts = [[0.0]; LOCKSTEP];
        let chunks = rows.chunks_exact_mut(width).zip(&mut starts);
        for (index, (row, start)) in (first_stream..).zip(chunks) {
            let mut rng = streams.chunk(index);
            normals::for_each(start, &mut rng, |value, normal| *value = normal);
            normals::for_each(row, &mut rng, |value, normal| *value = normal);
        }
        let starts = starts.map(|[start]| start);
        if rows.len() == LOCKSTEP * width {
            self.filter::<LOCKSTEP>(rows, width, starts);
        } else {
            for (row, start) in rows.chunks_exact_mut(width).zip(starts) {
                self.filter::<1>(row, width, [start]);
            }
        }
    }

    /// Filters `N` rows along x, side by side: within one row every step waits for the last.
    fn filter<const N: usize>(&self, rows: &mut [f32], width: usize, starts: [f32; N]) {
        let (mut u, mut y) = ([0.0; N], [0.0; N]);
        for x in 0..width {
            for row in 0..N {
                let value = &mut rows[row * width + x];
                if x == 0 {
                    u[row] = *value;
                    y[row] = self.r * u[row] + self.s * starts[row];
                } else {
                    u[row] = self.a * u[row] + self.b * *value;
                    y[row] = self.a * y[row] + self.c * u[row];
                }
                *value = y[row];
            }
        }
    }

    /// Filters down the rows of `white` (one row more than the image) and adds `gain` times the
    /// result to `field`. `u` and `y` are scratch rows.
    fn add_columns(
        &self,
        white: &[f32],
        gain: f32,
        field: &mut [f32],
        u: &mut [f32],
        y: &mut [f32],
    ) {
        let width = u.len();
        let (start, innovations) = white.split_at(width);
        let rows = innovations
            .chunks_exact(width)
            .zip(field.chunks_exact_mut(width));
        for (index, (w_row, out)) in rows.enumerate() {
            if index == 0 {
                u.copy_from_slice(w_row);
                for ((y, w), n) in y.iter_mut().zip(w_row).zip(start) {
                    *y = self.r * w + self.s * n;
                }
            } else {
                for ((y, u), w) in y.iter_mut().zip(u.iter_mut()).zip(w_row) {
                    *u = self.a * *u + self.b * w;
                    *y = self.a * *y + self.c * *u;
                }
            }
            for (out, y) in out.iter_mut().zip(y.iter()) {
                *out += gain * y;
            }
        }
    }
}

/// Buffers of the field; they grow once and are kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct CorrelatedField {
    white: Vec<f32>,
    u: Vec<f32>,
    y: Vec<f32>,
    field: Vec<f32>,
}

impl CorrelatedField {
    /// The field of one frame, row-major, `width * height` values of zero mean and unit variance.
    /// `scales` must have passed [`check`]; both sizes are above zero.
    pub(crate) fn generate(
        &mut self,
        width: usize,
        height: usize,
        scales: &[CorrelationScale],
        streams: &Streams,
    ) -> &[f32] {
        self.field.clear();
        self.field.resize(width * height, 0.0);
        self.white.resize(width * (height + 1), 0.0);
        self.u.resize(width, 0.0);
        self.y.resize(width, 0.0);
        for (index, scale) in scales.iter().enumerate() {
            let cascade = Cascade::new(scale.decay_per_px);
            self.white
                .par_chunks_mut(LOCKSTEP * width)
                .enumerate()
                .for_each(|(block, rows)| {
                    let stream = (index as u64) << 32 | (block * LOCKSTEP) as u64;
                    cascade.fill_rows(rows, width, streams, stream);
                });
            let gain = scale.variance_share.sqrt() as f32;
            cascade.add_columns(&self.white, gain, &mut self.field, &mut self.u, &mut self.y);
        }
        &self.field
    }
}

#[cfg(test)]
impl CorrelatedField {
    pub(crate) fn addresses(&self) -> [*const f32; 4] {
        [&self.white, &self.u, &self.y, &self.field].map(|v| v.as_ptr())
    }
}

#[cfg(test)]
mod tests {
    use super::super::stream::Purpose;
    use super::*;

    /// Three standard errors of the estimates over 40 fields of 200 x 160 pixels (about 64 000
    /// independent patches of 20 pixels).
    const CORRELATION_TOLERANCE: f64 = 0.02;

    #[test]
    fn correlated_field_has_unit_variance_and_stated_correlation_along_both_axes_and_at_borders() {
        let (width, height, decay) = (200, 160, 0.7);
        let scale = CorrelationScale {
            variance_share: 1.0,
            decay_per_px: decay,
        };
        let mut buffers = CorrelatedField::default();
        let (mut across, mut down, mut border) = ([0.0; 7], [0.0; 7], 0.0);
        let frames = 40;
        for frame in 0..frames {
            let streams = Streams::new(3, Purpose::CorrelatedDepth, frame);
            let field = buffers.generate(width, height, &[scale], &streams);
            let at = |x: usize, y: usize| f64::from(field[y * width + x]);
            for d in 0..7 {
                let mut sums = (0.0, 0.0);
                for y in 0..height - 6 {
                    for x in 0..width - 6 {
                        sums.0 += at(x, y) * at(x + d, y);
                        sums.1 += at(x, y) * at(x, y + d);
                    }
                }
                let count = ((height - 6) * (width - 6) * frames as usize) as f64;
                across[d] += sums.0 / count;
                down[d] += sums.1 / count;
            }
            let ring = (0..width).map(|x| at(x, 0).powi(2)).sum::<f64>()
                + (0..height).map(|y| at(0, y).powi(2)).sum::<f64>();
            border += ring / ((width + height) * frames as usize) as f64;
        }
        for d in 0..7 {
            let a2 = decay * decay;
            let expected = decay.powi(d as i32) * (1.0 + d as f64 * (1.0 - a2) / (1.0 + a2));
            assert!(
                (across[d] - expected).abs() < CORRELATION_TOLERANCE
                    && (down[d] - expected).abs() < CORRELATION_TOLERANCE,
                "{d} px: {} across, {} down, expected {expected}",
                across[d],
                down[d]
            );
        }
        // 14 400 border pixels, of which about 1 in 6 is independent: three standard errors.
        assert!((border - 1.0).abs() < 0.09, "border variance {border}");
    }

    #[test]
    fn correlation_shares_that_do_not_sum_to_one_are_an_error() {
        let scale = |variance_share, decay_per_px| CorrelationScale {
            variance_share,
            decay_per_px,
        };
        assert!(check(&[scale(0.5, 0.2), scale(0.5, 0.9)]).is_ok());
        for bad in [
            [scale(0.5, 0.2), scale(0.4, 0.9)],
            [scale(1.5, 0.2), scale(-0.5, 0.9)],
            [scale(0.5, 1.0), scale(0.5, 0.9)],
            [scale(0.5, f64::NAN), scale(0.5, 0.9)],
        ] {
            let error = check(&bad).unwrap_err().to_string();
            assert!(error.contains("correlation."), "{error}");
        }
    }
}
