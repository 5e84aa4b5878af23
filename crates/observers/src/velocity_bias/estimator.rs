//! The estimator of velocity biases: images and measured velocities in, biases with a status out.

use super::alignment::Sloped;
use super::config::{BiasMethod, MIN_SHARE, VelocityBiasConfig};
use super::images::{Binning, Images};
use super::observer::{FieldObserver, Gains, ImageVelocity};
use super::tracking::Tracking;
use super::window::Window;
use crate::checks::{DeadAxis, is_finite, saturated};
use crate::{Reason, Result, Sensor, Status};
use nalgebra::{Matrix6, Vector3, Vector6};
use sphereflow_core::{Plane, RangeMap};
use sphereflow_sphere::{Camera, SphereGrid};

/// What is told after each pair of images; order [angular, linear].
#[derive(Clone, Debug, PartialEq)]
pub struct VelocityBiasState {
    /// To be subtracted from the measured angular velocity, rad/s.
    pub angular_rad_s: Vector3<f64>,
    /// To be subtracted from the measured linear velocity, m/s; `None` before one was measured.
    pub linear_m_s: Option<Vector3<f64>>,
    /// Covariance of the information form; the observers have none.
    pub covariance: Option<Matrix6<f64>>,
    /// Directions [angular, linear] that the images so far do not show, of unit length with rates
    /// scaled by the mean range.
    pub blind_directions: Vec<Vector6<f64>>,
    /// The images' part of the observers' Lyapunov function.
    pub field_energy: Option<f64>,
    /// What became of the images.
    pub status: Status,
}

/// Estimates the biases of measured velocities.
#[derive(Clone, Debug)]
pub struct VelocityBiasEstimator {
    config: VelocityBiasConfig,
    grid: SphereGrid,
    binning: Binning,
    estimator: Estimator,
    mean_range: f64,
    /// Information of the images so far, for observability.
    seen: Matrix6<f64>,
    linear_measured: bool,
    /// Of the angular and the linear velocity.
    axes: [DeadAxis; 2],
    /// The motion since the last images that were used is unknown.
    lost: bool,
    status: Status,
}

#[derive(Clone, Debug)]
enum Estimator {
    Information(Box<Tracking>),
    Observer(Box<FieldObserver>),
}

/// Square root of the smallest to the largest eigenvalue below which a direction is blind.
const BLIND_SCORE: f64 = 0.01;

impl VelocityBiasEstimator {
    /// For the images of a camera.
    ///
    /// # Errors
    /// A value error naming the setting out of range.
    pub fn new(camera: &Camera, config: VelocityBiasConfig) -> Result<Self> {
        config.check()?;
        let (binning, grid) = Binning::new(camera, config.max_width)?;
        let observer = |gains: Gains| -> Result<Estimator> {
            let window = Window::new(&grid, config.window_border)?;
            let lambda = [config.gains.lambda_y, config.gains.lambda_d];
            let observer =
                FieldObserver::new(grid.clone(), window, gains, config.gains.k_field, lambda);
            Ok(Estimator::Observer(Box::new(observer)))
        };
        let estimator = match config.method {
            BiasMethod::Information => {
                Estimator::Information(Box::new(Tracking::new(&grid, &config)))
            }
            BiasMethod::Observer => observer(Gains::Fixed(config.gains.k_omega, config.gains.k_v))?,
            BiasMethod::Normalised => observer(Gains::Normalised(config.rate_per_s))?,
        };
        Ok(Self {
            config,
            grid,
            binning,
            estimator,
            mean_range: 1.0,
            seen: Matrix6::zeros(),
            linear_measured: false,
            axes: [DeadAxis::new(); 2],
            lost: false,
            status: Status::Starting(Reason::NoData),
        })
    }

    /// The settings.
    pub fn config(&self) -> &VelocityBiasConfig {
        &self.config
    }

    /// Brightness (any unit) and range (m) of an instant, NaN unknown, and the velocities measured
    /// over the `dt_s` since the images before (means over that time). Without a linear velocity the
    /// observers take it for zero, and the information form for unknown.
    ///
    /// # Errors
    /// A shape error where an image is not of the camera's size.
    pub fn step(
        &mut self,
        grey: &Plane<f32>,
        range: &RangeMap,
        velocity: &ImageVelocity,
        dt_s: f64,
    ) -> Result<VelocityBiasState> {
        self.status = self.advance(grey, range.metres(), velocity, dt_s)?;
        Ok(self.state())
    }

    /// The state after the last images.
    pub fn state(&self) -> VelocityBiasState {
        let (bias, covariance, field_energy) = match &self.estimator {
            Estimator::Information(i) => {
                let known = i.knowledge();
                (*known.bias(), Some(known.covariance()), None)
            }
            Estimator::Observer(o) => (o.bias(), None, Some(o.field_energy())),
        };
        VelocityBiasState {
            angular_rad_s: bias.fixed_rows::<3>(0).into_owned(),
            linear_m_s: self
                .linear_measured
                .then(|| bias.fixed_rows::<3>(3).into_owned()),
            covariance,
            blind_directions: self.blind_directions(),
            field_energy,
            status: self.status,
        }
    }

    /// The Lyapunov function (5.17) of the observer with fixed gains.
    pub fn lyapunov(&self, true_bias: &Vector6<f64>) -> Option<f64> {
        match &self.estimator {
            Estimator::Observer(o) => o.lyapunov(true_bias),
            Estimator::Information(_) => None,
        }
    }

    fn advance(
        &mut self,
        grey: &Plane<f32>,
        range: &Plane<f32>,
        velocity: &ImageVelocity,
        dt_s: f64,
    ) -> Result<Status> {
        let images = self.binning.bin(grey, range)?;
        if !(dt_s > 0.0 && dt_s.is_finite()) {
            return Ok(Status::Skipped(Reason::StampNotIncreasing));
        }
        let (sum, count) = images
            .range
            .data()
            .iter()
            .filter(|d| d.is_finite())
            .fold((0.0, 0_usize), |(sum, n), d| (sum + f64::from(*d), n + 1));
        let share = count as f64 / images.range.data().len().max(1) as f64;
        let lost = self.lost_motion(velocity, dt_s);
        if share < MIN_SHARE {
            match (&mut self.estimator, lost) {
                (Estimator::Information(information), None) => information.coast(velocity, dt_s),
                _ => self.lost = true,
            }
            return Ok(Status::Skipped(Reason::FewPixels { share }));
        }
        self.mean_range = sum / count as f64;
        if std::mem::take(&mut self.lost) || lost.is_some() {
            self.restart(images, velocity)?;
            return Ok(match lost {
                None => Status::Starting(Reason::NoData),
                Some(reason @ Reason::NotFinite { .. }) => Status::Skipped(reason),
                Some(reason) => Status::Weak(reason),
            });
        }
        self.linear_measured |= velocity.linear_m_s.is_some();
        match &mut self.estimator {
            Estimator::Observer(observer) => {
                observer.step(images, velocity, dt_s)?;
                self.seen += observer.gram() * dt_s;
            }
            Estimator::Information(information) => {
                let image = Sloped::new(&self.grid, images)?;
                match information.step(&self.grid, image, velocity, self.mean_range, dt_s) {
                    Ok(seen) => self.seen += seen,
                    Err(status) => return Ok(status),
                }
            }
        }
        Ok(self.judge(velocity, dt_s))
    }

    /// Why the motion since the images before is not known.
    fn lost_motion(&self, velocity: &ImageVelocity, dt_s: f64) -> Option<Reason> {
        let v = velocity.linear_m_s.unwrap_or_default();
        if !(is_finite(&velocity.angular_rad_s) && is_finite(&v)) {
            let sensor = Sensor::Velocity;
            return Some(Reason::NotFinite { sensor });
        }
        if dt_s > self.config.max_gap_s {
            return Some(Reason::Gap { seconds: dt_s });
        }
        saturated(&velocity.angular_rad_s, self.config.angular_limit_rad_s)
    }

    /// The images are the first ones once more; what is known of the biases stays.
    fn restart(&mut self, images: Images, velocity: &ImageVelocity) -> Result<()> {
        match &mut self.estimator {
            Estimator::Observer(observer) => observer.restart(images),
            Estimator::Information(information) => {
                let image = Sloped::new(&self.grid, images)?;
                information.restart(&self.grid, image, velocity, self.mean_range);
            }
        }
        Ok(())
    }

    fn judge(&mut self, velocity: &ImageVelocity, dt_s: f64) -> Status {
        let angular = self.axes[0].step(&velocity.angular_rad_s, dt_s);
        let linear = velocity
            .linear_m_s
            .and_then(|v| self.axes[1].step(&v, dt_s));
        if let Some(axis) = angular.or(linear) {
            let sensor = Sensor::Velocity;
            return Status::Weak(Reason::DeadAxis { sensor, axis });
        }
        match self.blind_directions().len() {
            0 => Status::Ok,
            directions => Status::Weak(Reason::Unobservable { directions }),
        }
    }

    /// Thesis: Theorem 3: a closed scene with a rotation axis, or a view that slides on itself, shows
    /// fewer than six directions.
    fn blind_directions(&self) -> Vec<Vector6<f64>> {
        let size = if self.linear_measured { 6 } else { 3 };
        let l = self.mean_range;
        let scale = Matrix6::from_diagonal(&Vector6::new(1.0 / l, 1.0 / l, 1.0 / l, 1.0, 1.0, 1.0));
        let mut form = scale * self.seen * scale;
        if size == 3 {
            // Without linear velocity only the angular part is asked for.
            for i in 3..6 {
                form.row_mut(i).fill(0.0);
                form.column_mut(i).fill(0.0);
                form[(i, i)] = form[(0, 0)].max(form[(1, 1)]).max(form[(2, 2)]);
            }
        }
        let eigen = form.symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        (0..6)
            .filter(|i| eigen.eigenvalues[*i] <= BLIND_SCORE * BLIND_SCORE * largest)
            .map(|i| eigen.eigenvectors.column(i).into_owned())
            .collect()
    }
}
