//! The projector's shadow: what the camera sees and the projector beside it does not stays unknown.
//!
//! A pixel `u` of inverse depth `rho` lies on the projector's column `p = u - f b rho`, where `b` is
//! the projector's place to the right of the camera. Of all pixels on one column the projector
//! lights only the nearest. With the projector on the right, shadows fall on the left of an object.

use rayon::prelude::*;

/// A pixel is in shadow where another one on its projector column is nearer by more than this
/// disparity, pixels: slanted surfaces put neighbours on one column, which are no shadow.
const SELF_SHADOW_PX: f32 = 1.5;

/// Buffers of the shadow, kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shadow {
    nearest: Vec<f32>,
}

impl Shadow {
    /// Sets the inverse depths (1/m, NaN unknown) that the projector does not light to NaN.
    ///
    /// `disparity_px_m` is `f b` in pixel metres, positive where the projector is on the right;
    /// `max_inverse` is the largest inverse depth that the sensor reads.
    pub(crate) fn cast(
        &mut self,
        inverse: &mut [f32],
        width: usize,
        disparity_px_m: f32,
        max_inverse: f32,
    ) {
        // A shift by more than the image finds nothing to darken in it.
        let margin = ((disparity_px_m.abs() * max_inverse).ceil() as usize).min(width) + 2;
        let columns = width + 2 * margin;
        let rows = inverse.len() / width;
        self.nearest.resize(columns * rows, 0.0);
        inverse
            .par_chunks_mut(width)
            .zip(self.nearest.par_chunks_mut(columns))
            .for_each(|(row, nearest)| {
                cast_row(row, nearest, margin as f32, disparity_px_m);
            });
    }
}

#[cfg(test)]
impl Shadow {
    pub(crate) fn address(&self) -> *const f32 {
        self.nearest.as_ptr()
    }
}

/// One row: the largest disparity on each projector column, then the pixels behind it.
fn cast_row(row: &mut [f32], nearest: &mut [f32], margin: f32, disparity_px_m: f32) {
    nearest.fill(0.0);
    let column = |u: usize, rho: f32| u as f32 - disparity_px_m * rho + margin;
    let reach = disparity_px_m.abs();
    for (u, rho) in row.iter().enumerate() {
        // A surface that faces the projector leaves columns out: each pixel covers two of them.
        // Unknown depth is NaN, falls on column 0 and loses the comparison there.
        let first = column(u, *rho) as usize;
        for slot in nearest.iter_mut().skip(first).take(2) {
            if *rho * reach > *slot {
                *slot = *rho * reach;
            }
        }
    }
    for (u, rho) in row.iter_mut().enumerate() {
        let lit = nearest
            .get((column(u, *rho) + 0.5) as usize)
            .copied()
            .unwrap_or(0.0);
        if lit > *rho * reach + SELF_SHADOW_PX {
            *rho = f32::NAN;
        }
    }
}
