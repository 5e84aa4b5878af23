//! Brightness and range at the size that the estimators work at.

use crate::{Error, Result};
use sphereflow_core::Plane;
use sphereflow_sphere::{Camera, SphereGrid};
use std::ops::RangeInclusive;

/// A bin of ranges further apart than this, relative, spans an edge and is unknown.
const SPREAD: f32 = 0.12;

/// Ranges of rooms and landscapes, m; others are unknown. So is a brightness beyond any unit.
const RANGE_M: RangeInclusive<f32> = 1e-3..=1e5;
const GREY: RangeInclusive<f32> = -1e9..=1e9;

/// The two images of an instant, binned.
#[derive(Clone, Debug)]
pub struct Images {
    /// Brightness, any unit, NaN unknown.
    pub grey: Plane<f32>,
    /// Range, m, NaN unknown.
    pub range: Plane<f32>,
}

/// Bins images of one camera.
#[derive(Clone, Debug)]
pub struct Binning {
    size: (usize, usize),
    factor: usize,
}

impl Binning {
    /// The smallest binning to at most `max_width`, and the grid of the binned camera.
    ///
    /// # Errors
    /// A value error where the camera cannot be binned so far.
    pub fn new(camera: &Camera, max_width: usize) -> Result<(Self, SphereGrid)> {
        let mut factor = camera.width().div_ceil(max_width).max(1);
        if camera.wraps_around() {
            while !(camera.width().is_multiple_of(factor) && camera.height().is_multiple_of(factor))
            {
                factor += 1;
            }
        }
        let binned = camera.binned(factor)?;
        let size = (camera.width(), camera.height());
        Ok((Self { size, factor }, SphereGrid::new(&binned)?))
    }

    /// The images at the working size.
    ///
    /// # Errors
    /// A shape error where an image is not of the camera's size.
    pub fn bin(&self, grey: &Plane<f32>, range: &Plane<f32>) -> Result<Images> {
        for (name, found) in [("grey", grey.size()), ("range", range.size())] {
            if found != self.size {
                let text = |(w, h): (usize, usize)| format!("{h} x {w}");
                let error = sphereflow_core::Error::shape(name, text(self.size), text(found));
                return Err(Error::Core(error));
            }
        }
        Ok(Images {
            grey: self.mean(grey, f32::INFINITY, &GREY),
            range: self.mean(range, SPREAD, &RANGE_M),
        })
    }

    /// Means of bins; what lies outside `known` is unknown.
    fn mean(&self, image: &Plane<f32>, spread: f32, known: &RangeInclusive<f32>) -> Plane<f32> {
        let n = self.factor;
        let (width, height) = (image.width() / n, image.height() / n);
        let needed = (n * n).div_ceil(2);
        Plane::from_fn(width, height, |x, y| {
            let (mut sum, mut count, mut low, mut high) = (0.0, 0, f32::INFINITY, 0.0_f32);
            for row in y * n..(y + 1) * n {
                for v in &image.row(row)[x * n..(x + 1) * n] {
                    if known.contains(v) {
                        (sum, count) = (sum + v, count + 1);
                        (low, high) = (low.min(*v), high.max(*v));
                    }
                }
            }
            let whole = count >= needed && high - low <= spread * low.abs().max(f32::MIN_POSITIVE);
            if n == 1 || (whole && count > 0) || (count >= needed && spread.is_infinite()) {
                sum / count.max(1) as f32 + if count == 0 { f32::NAN } else { 0.0 }
            } else {
                f32::NAN
            }
        })
    }
}
