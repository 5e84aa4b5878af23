//! The navigation filter: samples in, in any order within the delay; always an answer out.

use super::config::NavigationConfig;
use super::history::{History, Input, forward};
use super::measurement::Measurement;
use super::state::{Belief, Matrix15, NominalState};
use crate::checks::Watch;
use crate::limits;
use crate::spikes::{Sieved, SpikeGate};
use crate::{Reason, Result, Sensor, Status};
use nalgebra::{Matrix3, SMatrix, Vector3};
use sphereflow_core::{ImuSample, Pose, Stamp};
use sphereflow_sphere::lie::so3;

/// What is told of an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NavigationState {
    /// When.
    pub stamp: Stamp,
    /// Pose of the body, velocity (world frame) and biases.
    pub nominal: NominalState,
    /// Covariance of [theta, v, p, gyro bias, accelerometer bias], world frame but for the biases,
    /// with `R_true = exp(theta) R`.
    pub covariance: Matrix15,
    /// How good the state is, and why not better.
    pub status: Status,
}

/// Position, velocity, attitude and IMU biases from whatever comes. Before the first inertial
/// reading there is no answer; before the first pose the world is that of the first reading: level,
/// at the origin, heading 0.
#[derive(Clone, Debug)]
pub struct NavigationFilter {
    config: NavigationConfig,
    history: Option<History>,
    anchored: bool,
    field: Option<Vector3<f64>>,
    last_mag: Option<Stamp>,
    /// When the field was last another than the reference.
    disturbed: Option<Stamp>,
    /// First rejected pose since the last good one.
    rejected_since: Option<Stamp>,
    watch: Watch,
    last_imu: Option<Stamp>,
    /// Of gyro and accelerometer.
    gates: [SpikeGate; 2],
    /// The last inertial reading, where it is held back.
    held: Option<ImuSample>,
    /// Readings out of order and measurements that were refused.
    refused: u64,
}

/// Variances grow by no more than this factor where vision disagrees: each patience's time once.
const LARGEST_DOUBT: f64 = 1e6;
/// Nothing but integration for longer is coasting, seconds.
const COASTING_S: f64 = 0.2;
/// Magnetometer readings closer than this are left out: their errors are the same, seconds.
const MAG_SPACING_S: f64 = 0.1;
/// Relative change of the field's norm, and change of its dip, that are a disturbance.
const FIELD_NORM: f64 = 0.1;
const FIELD_DIP_RAD: f64 = 0.17;
/// After a disturbance the field must be itself for so long before it is believed, seconds.
const CALM_S: f64 = 0.5;

impl NavigationFilter {
    /// # Errors
    /// A value error naming the setting out of range.
    pub fn new(config: NavigationConfig) -> Result<Self> {
        config.check()?;
        Ok(Self {
            config,
            history: None,
            anchored: false,
            field: None,
            last_mag: None,
            disturbed: None,
            rejected_since: None,
            watch: Watch::new(config.gyro_limit_rad_s),
            last_imu: None,
            gates: [SpikeGate::gyro(), SpikeGate::accel()],
            held: None,
            refused: 0,
        })
    }

    /// The settings.
    pub fn config(&self) -> &NavigationConfig {
        &self.config
    }

    /// An inertial reading.
    pub fn push_imu(&mut self, sample: &ImuSample) -> Status {
        let (gyro, accel) = (&sample.gyro_rad_s, &sample.accel_m_s2);
        if let Some(reason) = impossible(sample) {
            self.refused += 1;
            return Status::Skipped(reason);
        }
        let Some(history) = &mut self.history else {
            self.history = Some(History::new(Belief::first(&self.config, sample)));
            return Status::Starting(Reason::NoData);
        };
        if sample.stamp == history.earliest() || history.has_imu_at(sample.stamp) {
            return Status::Skipped(Reason::StampNotIncreasing);
        }
        if sample.stamp < history.earliest() {
            let seconds = history.newest().stamp.seconds_since(sample.stamp);
            return Status::Skipped(Reason::TooLate { seconds });
        }
        // A late reading fills its place, but says nothing of the time after the last one.
        let step_s = sample
            .stamp
            .seconds_since(self.last_imu.unwrap_or(history.earliest()));
        if step_s > 0.0 {
            self.last_imu = Some(sample.stamp);
            let saturated = self.watch.step(gyro, Some(accel), step_s);
            if step_s > self.config.max_gap_s {
                self.watch.remember(Reason::Gap { seconds: step_s });
            }
            if let Some(reason) = self.sieve(sample, step_s) {
                return if saturated {
                    self.status()
                } else {
                    Status::Skipped(reason)
                };
            }
        }
        self.insert_imu(sample);
        self.status()
    }

    /// Why the newest inertial reading is not used yet; one that was held back and turns out to be
    /// real is put in its place.
    fn sieve(&mut self, sample: &ImuSample, step_s: f64) -> Option<Reason> {
        let held = self.held.take();
        let [gyro, accel] = &mut self.gates;
        let found = [
            gyro.step(&sample.gyro_rad_s, step_s),
            accel.step(&sample.accel_m_s2, step_s),
        ];
        let was_real = found.iter().any(|f| matches!(f, Sieved::Late(..)));
        if let (true, Some(held)) = (was_real, held) {
            self.insert_imu(&held);
        }
        let reason = found.iter().find_map(|f| match f {
            Sieved::Refused(reason) => Some(*reason),
            _ => None,
        })?;
        self.held = Some(*sample);
        Some(reason)
    }

    fn insert_imu(&mut self, sample: &ImuSample) {
        let input = Input::Imu(sample.gyro_rad_s, sample.accel_m_s2);
        if let Some(history) = &mut self.history
            && sample.stamp > history.earliest()
            && history.insert(sample.stamp, input, &self.config).is_err()
        {
            self.refused += 1;
        }
    }

    /// Readings and measurements refused so far: numbers that nothing measures, and spikes. Those
    /// that the belief does not explain (a status of its own) are not among them.
    pub fn refused(&self) -> u64 {
        self.refused + self.gates.iter().map(SpikeGate::refused).sum::<u64>()
    }

    /// A measurement that is none.
    fn refuse(&mut self, reason: Reason) -> Status {
        self.refused += 1;
        Status::Skipped(reason)
    }

    /// A magnetic field, body frame, any unit. The first one after the first pose says where the
    /// field points.
    pub fn push_mag(&mut self, stamp: Stamp, mag_ut: &Vector3<f64>) -> Status {
        if let Some(reason) = limits::refused_field(mag_ut) {
            return self.refuse(reason);
        }
        let Some(history) = &self.history else {
            return Status::Starting(Reason::NoData);
        };
        let Some(reference) = self.field else {
            let rotation = history.before(stamp).nominal.world_from_body.rotation;
            self.field = Some(rotation * mag_ut);
            return Status::Starting(Reason::NoData);
        };
        let rotation = history.before(stamp).nominal.world_from_body.rotation;
        if !self.is_same_field(&(rotation * mag_ut), &reference) {
            self.disturbed = Some(stamp);
            return Status::Skipped(Reason::MagneticDisturbance);
        }
        let calm = |since: Stamp| stamp.seconds_since(since) >= CALM_S;
        if !self.disturbed.is_none_or(calm) {
            return Status::Skipped(Reason::MagneticDisturbance);
        }
        if self
            .last_mag
            .is_some_and(|last| stamp.seconds_since(last) < MAG_SPACING_S)
        {
            return self.status();
        }
        self.last_mag = Some(stamp);
        self.measure(stamp, Measurement::Mag(*mag_ut, reference))
    }

    /// Norm and dip of a field in the world are those of the reference: what tells a magnet nearby
    /// from the Earth's field without the heading.
    fn is_same_field(&self, field: &Vector3<f64>, reference: &Vector3<f64>) -> bool {
        let down = self.config.gravity_m_s2;
        let dip = |f: &Vector3<f64>| f.angle(&down);
        (field.norm() / reference.norm() - 1.0).abs() <= FIELD_NORM
            && (dip(field) - dip(reference)).abs() <= FIELD_DIP_RAD
    }

    /// Velocity of the camera in its own frame, m/s, with its covariance: from geometric flow.
    pub fn push_velocity(
        &mut self,
        stamp: Stamp,
        velocity_m_s: &Vector3<f64>,
        covariance: &Matrix3<f64>,
    ) -> Status {
        let sensor = Sensor::Velocity;
        let bad = limits::refused(sensor, velocity_m_s, limits::SPEED_M_S)
            .or_else(|| limits::refused_covariance(sensor, covariance));
        if let Some(reason) = bad {
            return self.refuse(reason);
        }
        self.measure(stamp, Measurement::Velocity(*velocity_m_s, *covariance))
    }

    /// Pose of the camera, `world_from_camera`, with its covariance [rotation vector, position] in
    /// the world frame, rad^2 and m^2: from vision. The first one defines the world.
    pub fn push_pose(
        &mut self,
        stamp: Stamp,
        world_from_camera: &Pose,
        covariance: &SMatrix<f64, 6, 6>,
    ) -> Status {
        let sensor = Sensor::Pose;
        let q = world_from_camera.rotation;
        let bad = limits::refused(sensor, &world_from_camera.translation, limits::POSITION_M)
            .or_else(|| limits::refused(sensor, &(q.imag() * q.w), 1.0))
            .or_else(|| limits::refused_covariance(sensor, covariance));
        if let Some(reason) = bad {
            return self.refuse(reason);
        }
        let pose = *world_from_camera * self.config.body_from_camera.inverse();
        let lever = world_from_camera.rotation
            * self.config.body_from_camera.rotation.inverse()
            * self.config.body_from_camera.translation;
        let mut j = SMatrix::<f64, 6, 6>::identity();
        j.fixed_view_mut::<3, 3>(3, 0).copy_from(&so3::hat(&lever));
        let covariance = j * covariance * j.transpose();
        if !self.anchored {
            return self.anchor(stamp, &pose, &covariance);
        }
        let status = self.measure(stamp, Measurement::Pose(pose, covariance));
        if !matches!(status, Status::Skipped(Reason::Gated { .. })) {
            self.rejected_since = None;
            return status;
        }
        self.lose_patience(stamp, pose, covariance, status)
    }

    /// The assurance that the body stands still, with the standard deviation of its velocity, m/s.
    pub fn push_zero_velocity(&mut self, stamp: Stamp, sigma_m_s: f64) -> Status {
        if !limits::SIGMA.contains(&sigma_m_s) {
            let sensor = Sensor::ZeroVelocity;
            return self.refuse(Reason::BadCovariance { sensor });
        }
        self.measure(stamp, Measurement::ZeroVelocity(sigma_m_s))
    }

    /// The state at `stamp`: from the last sample before it, predicted with its inertial reading
    /// held; earlier than the oldest sample kept, the oldest. `None` before the first reading.
    pub fn state(&self, stamp: Stamp) -> Option<NavigationState> {
        let history = self.history.as_ref()?;
        let mut belief = *history.before(stamp);
        forward(&mut belief, stamp, None, &self.config);
        Some(NavigationState {
            stamp: belief.stamp,
            nominal: belief.nominal,
            covariance: belief.covariance,
            status: self.status_of(&belief),
        })
    }

    /// How good the newest state is.
    pub fn status(&self) -> Status {
        match &self.history {
            None => Status::Starting(Reason::NoData),
            Some(history) => self.status_of(history.newest()),
        }
    }

    fn status_of(&self, belief: &Belief) -> Status {
        if let Some(reason) = self.watch.flaw() {
            return Status::Weak(reason);
        }
        if belief.coasting_s > COASTING_S {
            let seconds = belief.coasting_s;
            return Status::Weak(Reason::Coasting { seconds });
        }
        if self.anchored {
            Status::Ok
        } else {
            Status::Starting(Reason::NoData)
        }
    }

    fn measure(&mut self, stamp: Stamp, measurement: Measurement) -> Status {
        let Some(history) = &mut self.history else {
            return Status::Starting(Reason::NoData);
        };
        if stamp < history.earliest() {
            let seconds = history.newest().stamp.seconds_since(stamp);
            return Status::Skipped(Reason::TooLate { seconds });
        }
        match history.insert(stamp, Input::Measurement(measurement), &self.config) {
            Ok(()) => self.status(),
            Err(reason) => Status::Skipped(reason),
        }
    }

    /// The first pose defines the world.
    fn anchor(&mut self, stamp: Stamp, pose: &Pose, covariance: &SMatrix<f64, 6, 6>) -> Status {
        let status = self.measure(stamp, Measurement::Anchor(*pose, *covariance));
        self.anchored = !matches!(status, Status::Skipped(_)) && self.history.is_some();
        status
    }

    /// Vision has disagreed for too long: the belief is doubted until the pose is explained. The
    /// jump that follows is one that the covariance told of.
    fn lose_patience(
        &mut self,
        stamp: Stamp,
        pose: Pose,
        covariance: SMatrix<f64, 6, 6>,
        status: Status,
    ) -> Status {
        let since = *self.rejected_since.get_or_insert(stamp);
        let patient = stamp.seconds_since(since) < self.config.patience_s;
        let (Status::Skipped(reason), false) = (status, patient) else {
            return status;
        };
        let Reason::Gated {
            distance, limit, ..
        } = reason
        else {
            return status;
        };
        if let Some(history) = &mut self.history {
            history.doubt(
                (2.0 * distance / limit).clamp(1.0, LARGEST_DOUBT),
                &self.config,
            );
        }
        self.rejected_since = None;
        self.watch.remember(reason);
        let newest = self.history.as_ref().map_or(stamp, |h| h.newest().stamp);
        self.measure(stamp.max(newest), Measurement::Pose(pose, covariance))
    }
}

/// Why an inertial reading is none.
fn impossible(sample: &ImuSample) -> Option<Reason> {
    limits::refused(Sensor::Gyro, &sample.gyro_rad_s, limits::GYRO_RAD_S)
        .or_else(|| limits::refused(Sensor::Accel, &sample.accel_m_s2, limits::ACCEL_M_S2))
}
