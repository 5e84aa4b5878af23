//! The information form: images aligned with references, biases from what that corrects.

use super::alignment::{Pair, Sloped, align};
use super::config::{MIN_SHARE, VelocityBiasConfig};
use super::information::{BiasInformation, BiasPrior, PoseInformation};
use super::observer::ImageVelocity;
use super::references::{Reference, References};
use super::row_motion::RowMotion;
use crate::{Reason, Sensor, Status};
use nalgebra::{Matrix6, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::SphereGrid;
use sphereflow_sphere::lie::se3;

/// Warps of a pair, at most: one more while the step moves the image by more than [`SETTLED_RAD`].
const MOST_WARPS: usize = 4;
/// A step of the warp below this angle is not repeated: a tenth of a pixel at 160.
const SETTLED_RAD: f64 = 5e-4;

/// Squared distance (6 degrees of freedom) beyond which an alignment has found another minimum.
const GATE: f64 = 35.0;
/// After so many of them in a row it is the readings that were wrong: a new reference begins.
const PATIENCE: usize = 5;

/// Angle between two neighbouring pixels in the middle of the image, rad.
fn pixel_angle(grid: &SphereGrid) -> f64 {
    let (x, y) = (grid.width() / 2, grid.height() / 2);
    grid.ray(x, y).angle(&grid.ray(x.saturating_sub(1), y))
}

/// Estimates biases by tracking references.
#[derive(Clone, Debug)]
pub struct Tracking {
    known: BiasInformation,
    references: References,
    readout_s: f64,
    timing_sigma_s: f64,
    /// Error of an alignment that all its pixels share, rad.
    shared_rad: f64,
    rejected: usize,
    linear_measured: bool,
}

impl Tracking {
    /// Before the first image.
    pub fn new(grid: &SphereGrid, config: &VelocityBiasConfig) -> Self {
        Self {
            known: BiasInformation::new(BiasPrior {
                start: [config.angular_bias_sigma, config.linear_bias_sigma],
                reading: [config.angular_sigma, config.linear_sigma],
                forget_s: config.forget_s,
            }),
            references: References::new(grid),
            readout_s: config.readout_s,
            timing_sigma_s: config.timing_sigma_s,
            shared_rad: config.shared_error_px * pixel_angle(grid),
            rejected: 0,
            linear_measured: false,
        }
    }

    /// Biases and their covariance.
    pub fn knowledge(&self) -> &BiasInformation {
        &self.known
    }

    /// The next image and the velocities since the one before; the information of its alignment, or
    /// why there is none.
    pub fn step(
        &mut self,
        grid: &SphereGrid,
        image: Sloped,
        velocity: &ImageVelocity,
        mean_range: f64,
        dt_s: f64,
    ) -> Result<Matrix6<f64>, Status> {
        if velocity.linear_m_s.is_some() && !self.linear_measured {
            self.linear_measured = true;
            self.known.begin_linear();
        }
        let measured = stacked(velocity);
        let linear = velocity.linear_m_s.is_some();
        if self.references.is_empty() {
            let twist = measured - self.known.bias();
            self.begin(grid, image, &twist, &self.common_noise(&twist, mean_range));
            return Err(Status::Starting(Reason::NoData));
        }
        self.known.predict(&measured, linear, dt_s);
        let twist = measured - self.known.bias();
        let rows = RowMotion::new(&twist, self.readout_s, grid.height());
        let noise = self.common_noise(&twist, mean_range);
        let predicted = *self.known.pose();
        let Some((reference, _)) = self.references.nearest(&predicted, mean_range) else {
            return Err(Status::Starting(Reason::NoData));
        };
        let pair = Pair {
            grid,
            reference,
            image: &image,
            rows,
        };
        let (xi, found, share) = settle(&pair, &self.known, &noise, mean_range);
        let disagreement = self.known.disagreement(&xi, &found, &noise);
        if let Some(distance) = disagreement.filter(|d| *d > GATE) {
            self.rejected += 1;
            if self.rejected >= PATIENCE {
                self.begin(grid, image, &twist, &noise);
            }
            return Err(Status::Skipped(Reason::Gated {
                sensor: Sensor::Image,
                distance,
                limit: GATE,
            }));
        }
        if share < MIN_SHARE || !self.known.correct(&xi, &found, &noise) {
            self.begin(grid, image, &twist, &noise);
            return Err(Status::Skipped(Reason::FewPixels { share }));
        }
        self.rejected = 0;
        let pose = *self.known.pose();
        let nearest = self.references.nearest(&pose, mean_range);
        if nearest.is_none_or(|(_, distance)| self.references.is_far(distance)) {
            self.known.add_reference(&noise);
            self.references.add(Reference {
                images: image.images,
                rows,
                pose,
            });
        }
        Ok(found.information)
    }

    /// Images that cannot be aligned: the motion meanwhile is that of the velocities alone.
    pub fn coast(&mut self, velocity: &ImageVelocity, dt_s: f64) {
        if !self.references.is_empty() {
            let linear = velocity.linear_m_s.is_some();
            self.known.predict(&stacked(velocity), linear, dt_s);
        }
    }

    /// What came before is of no use any more.
    pub fn restart(
        &mut self,
        grid: &SphereGrid,
        image: Sloped,
        velocity: &ImageVelocity,
        mean_range: f64,
    ) {
        let measured = stacked(velocity);
        let twist = if measured.iter().all(|m| m.is_finite()) {
            measured - self.known.bias()
        } else {
            Vector6::zeros()
        };
        self.begin(grid, image, &twist, &self.common_noise(&twist, mean_range));
    }

    /// The image becomes the only reference.
    fn begin(
        &mut self,
        grid: &SphereGrid,
        image: Sloped,
        twist: &Vector6<f64>,
        noise: &Matrix6<f64>,
    ) {
        self.rejected = 0;
        self.known.restart(noise);
        self.references.clear();
        self.references.add(Reference {
            images: image.images,
            rows: RowMotion::new(twist, self.readout_s, grid.height()),
            pose: *self.known.pose(),
        });
    }

    /// What the residuals do not show of an alignment's error: all pixels share it. Stamps that do not
    /// agree move a moving camera; lens, blur and interpolation a part of a pixel.
    fn common_noise(&self, twist: &Vector6<f64>, mean_range: f64) -> Matrix6<f64> {
        let square = |i: usize| twist.fixed_rows::<3>(i).norm_squared();
        let variance = self.timing_sigma_s * self.timing_sigma_s;
        let a = square(0) * variance + self.shared_rad.powi(2);
        let v = square(3) * variance + (self.shared_rad * mean_range).powi(2);
        Matrix6::from_diagonal(&Vector6::new(a, a, a, v, v, v))
    }
}

/// [angular, linear], zero where none was measured.
fn stacked(velocity: &ImageVelocity) -> Vector6<f64> {
    let (w, v) = (
        velocity.angular_rad_s,
        velocity.linear_m_s.unwrap_or_default(),
    );
    Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z)
}

/// Aligned where readings and images together are best: warped again while that moves the image.
/// The twist from the predicted pose, the normal equations there, and the share of pixels.
fn settle(
    pair: &Pair<'_>,
    known: &BiasInformation,
    noise: &Matrix6<f64>,
    mean_range: f64,
) -> (Vector6<f64>, PoseInformation, f64) {
    let from_world = pair.reference.pose.inverse();
    let at = |xi: &Vector6<f64>| -> Pose { from_world * *known.pose() * se3::exp(xi) };
    let mut xi = Vector6::zeros();
    let (mut found, mut share) = align(pair, &at(&xi));
    for _ in 1..MOST_WARPS {
        let Some(step) = known.step_from(&xi, &found, noise) else {
            break;
        };
        let angle = step.fixed_rows::<3>(0).norm() + step.fixed_rows::<3>(3).norm() / mean_range;
        if angle < SETTLED_RAD || !angle.is_finite() {
            break;
        }
        xi += step;
        (found, share) = align(pair, &at(&xi));
    }
    (xi, found, share)
}
