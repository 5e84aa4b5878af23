//! A flow field: how far each pixel's content moves.

use crate::Result;
use sphereflow_core::Plane;
use sphereflow_raster::same_size;

/// Displacements in pixels (columns to the right, rows down), from the first image to the second.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowField {
    /// Along the rows (x), pixels.
    pub u: Plane<f32>,
    /// Down the columns (y), pixels.
    pub v: Plane<f32>,
}

impl FlowField {
    /// No motion.
    pub fn zero(width: usize, height: usize) -> Self {
        Self {
            u: Plane::filled(width, height, 0.0),
            v: Plane::filled(width, height, 0.0),
        }
    }

    /// `(width, height)`.
    pub fn size(&self) -> (usize, usize) {
        self.u.size()
    }

    /// Nothing known.
    pub(crate) fn unknown(width: usize, height: usize) -> Self {
        Self {
            u: Plane::filled(width, height, f32::NAN),
            v: Plane::filled(width, height, f32::NAN),
        }
    }

    /// No motion where it is unknown: a field to start from.
    pub(crate) fn as_start(&self) -> Self {
        let mut start = self.clone();
        for plane in [&mut start.u, &mut start.v] {
            for value in plane.data_mut().iter_mut().filter(|v| !v.is_finite()) {
                *value = 0.0;
            }
        }
        start
    }

    /// Mean length of the difference to `truth`, pixels, over the pixels where the truth is known
    /// (the end-point error of the Middlebury benchmark).
    ///
    /// # Errors
    /// A shape error where the sizes differ.
    pub fn endpoint_error(&self, truth: &Self) -> Result<f64> {
        same_size("truth", self.size(), truth.size())?;
        let pairs = self.u.data().iter().zip(self.v.data());
        let truths = truth.u.data().iter().zip(truth.v.data());
        let (mut sum, mut known) = (0.0_f64, 0_usize);
        for ((u, v), (tu, tv)) in pairs.zip(truths) {
            let error = f64::from(u - tu).hypot(f64::from(v - tv));
            if tu.is_finite() && tv.is_finite() {
                sum += error;
                known += 1;
            }
        }
        Ok(sum / known as f64)
    }

    /// The field of an image `(width, height)` of another size, displacements scaled with it.
    pub(crate) fn resized(&self, width: usize, height: usize) -> Self {
        let (old_width, old_height) = self.size();
        let (sx, sy) = (
            old_width as f32 / width as f32,
            old_height as f32 / height as f32,
        );
        let resize = |plane: &Plane<f32>, scale: f32| {
            Plane::from_fn(width, height, |x, y| {
                let (x, y) = ((x as f32 + 0.5) * sx - 0.5, (y as f32 + 0.5) * sy - 0.5);
                scale * sphereflow_raster::bilinear::clamped(plane, x, y)
            })
        };
        Self {
            u: resize(&self.u, 1.0 / sx),
            v: resize(&self.v, 1.0 / sy),
        }
    }
}
