//! The images that new ones are aligned with: as few as overlap with everything seen so far.
//!
//! A camera that comes back finds its old reference, and with it the attitude of then: what the
//! biases rest on does not drift with the number of frames.

use super::alignment::Sloped;
use super::row_motion::RowMotion;
use sphereflow_core::Pose;
use sphereflow_sphere::SphereGrid;

/// One reference.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Brightness and range, with their slopes.
    pub image: Sloped,
    /// How the camera moved while it was read.
    pub rows: RowMotion,
    /// First reference from this camera.
    pub pose: Pose,
}

/// All of them, oldest first.
#[derive(Clone, Debug)]
pub struct References {
    kept: Vec<Reference>,
    spacing_rad: f64,
}

/// A new reference every so much of the field of view.
const SPACING: f64 = 0.2;
/// Images kept at most, 700 kB each at 160x120.
const MOST: usize = 64;

impl References {
    /// None yet, for the images of a grid.
    pub fn new(grid: &SphereGrid) -> Self {
        let (w, h) = (grid.width(), grid.height());
        let across = if grid.wraps_around() {
            1.0
        } else {
            grid.ray(0, h / 2).angle(&grid.ray(w - 1, h / 2))
        };
        Self {
            kept: Vec::new(),
            spacing_rad: SPACING * across.min(1.5),
        }
    }

    /// The nearest one to a pose and its distance as an angle, rad: a shift counts by what it moves
    /// at the mean range.
    pub fn nearest(&self, pose: &Pose, mean_range: f64) -> Option<(&Reference, f64)> {
        let distance = |r: &Reference| {
            let (shift, angle) = r.pose.distance_and_angle(pose);
            angle + shift / mean_range
        };
        self.kept
            .iter()
            .map(|r| (r, distance(r)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// True before the first.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    /// True where a camera so far from its reference should become one.
    pub fn is_far(&self, distance: f64) -> bool {
        distance > self.spacing_rad
    }

    /// Keep one more; the oldest goes where there are too many.
    pub fn add(&mut self, reference: Reference) {
        if self.kept.len() == MOST {
            self.kept.remove(0);
        }
        self.kept.push(reference);
    }

    /// Forget all.
    pub fn clear(&mut self) {
        self.kept.clear();
    }
}
