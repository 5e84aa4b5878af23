//! The estimator of velocity biases: images and measured velocities in, biases with a status out.

use super::alignment::Sloped;
use super::config::{BiasMethod, MIN_SHARE, VelocityBiasConfig};
use super::debiased::blind_directions;
use super::images::{Binning, Images};
use super::observer::{FieldObserver, Gains, ImageVelocity};
use super::tracking::Tracking;
use super::window::Window;
use crate::checks::{DeadAxis, saturated};
use crate::limits;
use crate::spikes::{Sieved, SpikeGate};
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
    /// Of the angular and the linear velocity.
    gates: [SpikeGate; 2],
    /// The motion since the last images that were used is unknown.
    lost: bool,
    status: Status,
}

#[derive(Clone, Debug)]
enum Estimator {
    Information(Box<Tracking>),
    Observer(Box<FieldObserver>),
}

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
            gates: [SpikeGate::turning(), SpikeGate::speed()],
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
        if !limits::is_step(dt_s) {
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
                Some(reason @ (Reason::Gap { .. } | Reason::Saturated { .. })) => {
                    Status::Weak(reason)
                }
                Some(reason) => Status::Skipped(reason),
            });
        }
        self.linear_measured |= velocity.linear_m_s.is_some();
        // What was seen long ago is forgotten, as the biases are.
        self.seen *= (-dt_s / self.config.forget_s).exp();
        match &mut self.estimator {
            Estimator::Observer(observer) => {
                observer.step(images, velocity, self.mean_range, dt_s)?;
                self.seen += observer.seen(self.mean_range) * dt_s;
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
    fn lost_motion(&mut self, velocity: &ImageVelocity, dt_s: f64) -> Option<Reason> {
        let omega = velocity.angular_rad_s;
        let angular = self.gates[0].step(&omega, dt_s);
        let linear = velocity.linear_m_s.map(|v| self.gates[1].step(&v, dt_s));
        let refused = [Some(angular), linear]
            .into_iter()
            .flatten()
            .find_map(|s| match s {
                Sieved::Refused(reason) => Some(reason),
                _ => None,
            });
        let possible = limits::refused(Sensor::Velocity, &omega, limits::GYRO_RAD_S).is_none();
        let saturated = saturated(&omega, self.config.angular_limit_rad_s);
        let gap = dt_s > self.config.max_gap_s;
        gap.then_some(Reason::Gap { seconds: dt_s })
            .or(saturated.filter(|_| possible))
            .or(refused)
    }

    /// Velocities refused so far: numbers that nothing measures, and spikes.
    pub fn refused(&self) -> u64 {
        self.gates.iter().map(SpikeGate::refused).sum()
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
        blind_directions(&self.seen, self.mean_range, self.linear_measured)
    }
}
