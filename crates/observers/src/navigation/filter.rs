//! The navigation filter: samples in, in any order within the delay; always an answer out.

use super::config::NavigationConfig;
use super::history::{History, Input, forward};
use super::measurement::Measurement;
use super::state::{Belief, Matrix15, NominalState, P, THETA, V};
use crate::checks::{Watch, is_finite};
use crate::{Reason, Result, Sensor, Status};
use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3};
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
}

/// Tilt of the first reading, rad: the accelerometer may have moved.
const TILT_SIGMA: f64 = 0.2;
/// What defines the world is exact but for this, rad and m.
const GAUGE_SIGMA: f64 = 1e-3;
/// Velocity before anything was measured, m/s.
const VELOCITY_SIGMA: f64 = 1.0;
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
        })
    }

    /// The settings.
    pub fn config(&self) -> &NavigationConfig {
        &self.config
    }

    /// An inertial reading.
    pub fn push_imu(&mut self, sample: &ImuSample) -> Status {
        let (gyro, accel) = (&sample.gyro_rad_s, &sample.accel_m_s2);
        for (sensor, v) in [(Sensor::Gyro, gyro), (Sensor::Accel, accel)] {
            if !is_finite(v) {
                return Status::Skipped(Reason::NotFinite { sensor });
            }
        }
        let Some(history) = &mut self.history else {
            self.history = Some(History::new(first_belief(&self.config, sample)));
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
            self.watch.step(gyro, Some(accel), step_s);
        }
        if step_s > self.config.max_gap_s {
            self.watch.remember(Reason::Gap { seconds: step_s });
        }
        // An inertial reading is never rejected.
        let _ = history.insert(sample.stamp, Input::Imu(*gyro, *accel), &self.config);
        self.status()
    }

    /// A magnetic field, body frame, any unit. The first one after the first pose says where the
    /// field points.
    pub fn push_mag(&mut self, stamp: Stamp, mag_ut: &Vector3<f64>) -> Status {
        let Some(history) = &self.history else {
            return Status::Starting(Reason::NoData);
        };
        if !is_finite(mag_ut) || mag_ut.norm() < 1e-9 {
            return Status::Skipped(Reason::NotFinite {
                sensor: Sensor::Mag,
            });
        }
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
        let finite = is_finite(velocity_m_s) && covariance.iter().all(|v| v.is_finite());
        if !(finite && covariance.diagonal().min() > 0.0) {
            return Status::Skipped(Reason::NotFinite {
                sensor: Sensor::Velocity,
            });
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
        let finite = is_finite(&world_from_camera.translation)
            && world_from_camera
                .rotation
                .coords
                .iter()
                .chain(covariance.iter())
                .all(|v| v.is_finite());
        if !(finite && covariance.diagonal().min() > 0.0) {
            return Status::Skipped(Reason::NotFinite {
                sensor: Sensor::Pose,
            });
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
        if !(sigma_m_s.is_finite() && sigma_m_s > 0.0) {
            return Status::Skipped(Reason::NotFinite {
                sensor: Sensor::ZeroVelocity,
            });
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
            history.doubt((2.0 * distance / limit).max(1.0));
        }
        self.rejected_since = None;
        self.watch.remember(reason);
        let newest = self.history.as_ref().map_or(stamp, |h| h.newest().stamp);
        self.measure(stamp.max(newest), Measurement::Pose(pose, covariance))
    }
}

/// Level by the first specific force, at the origin, heading 0.
fn first_belief(config: &NavigationConfig, sample: &ImuSample) -> Belief {
    let up = -config.gravity_m_s2;
    let rotation = UnitQuaternion::rotation_between(&sample.accel_m_s2, &up).unwrap_or_else(|| {
        let across = up.cross(&Vector3::x()) + up.cross(&Vector3::z());
        UnitQuaternion::from_scaled_axis(across.normalize() * std::f64::consts::PI)
    });
    let down = config.gravity_m_s2.normalize();
    let mut belief = Belief {
        stamp: sample.stamp,
        nominal: NominalState {
            world_from_body: Pose::new(rotation, Vector3::zeros()),
            velocity_m_s: Vector3::zeros(),
            gyro_bias_rad_s: Vector3::zeros(),
            accel_bias_m_s2: Vector3::zeros(),
        },
        covariance: Matrix15::zeros(),
        gyro: sample.gyro_rad_s,
        accel: sample.accel_m_s2,
        coasting_s: 0.0,
    };
    let level = Matrix3::identity() - down * down.transpose();
    let tilt = level * TILT_SIGMA.powi(2) + Matrix3::identity() * GAUGE_SIGMA.powi(2);
    belief
        .covariance
        .fixed_view_mut::<3, 3>(THETA, THETA)
        .copy_from(&tilt);
    belief.add_variance(V, VELOCITY_SIGMA.powi(2));
    belief.add_variance(P, GAUGE_SIGMA.powi(2));
    belief.add_variance(9, config.gyro_bias_sigma.powi(2));
    belief.add_variance(12, config.accel_bias_sigma.powi(2));
    belief
}
