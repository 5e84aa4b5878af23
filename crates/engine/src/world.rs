//! The world's axes: along gravity where the inertial sensor shows it, else those of the first camera.

use crate::config::WorldChoice;
use nalgebra::{UnitQuaternion, Vector3};
use sphereflow_core::{ImuSample, Pose};
use std::fmt;

/// Readings wanted before the first frame: a tenth of a second at 200 Hz averages hand tremor.
const LEAST_READINGS: usize = 20;
/// Norms of the mean specific force that pass for gravity, m/s^2.
const GRAVITY_M_S2: std::ops::RangeInclusive<f64> = 9.5..=10.1;
/// Largest standard deviation of the readings' norm, m/s^2: more is a camera in motion, whose mean
/// is off gravity by some degrees.
const CALM_M_S2: f64 = 0.5;

/// Which axes the world has, and why.
#[derive(Clone, Debug, PartialEq)]
pub enum World {
    /// y points down, along gravity; the heading is the first camera's.
    GravityAligned,
    /// The axes of the first camera.
    FirstCamera {
        /// Why not along gravity.
        because: String,
    },
}

impl World {
    /// Why the axes are the first camera's; `None` where they are along gravity.
    pub fn because(&self) -> Option<&str> {
        match self {
            Self::GravityAligned => None,
            Self::FirstCamera { because } => Some(because),
        }
    }

    /// `gravity-aligned` or `first-camera`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::GravityAligned => "gravity-aligned",
            Self::FirstCamera { .. } => "first-camera",
        }
    }
}

impl fmt::Display for World {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::GravityAligned => write!(f, "{}", self.name()),
            Self::FirstCamera { because } => write!(f, "{}: {because}", self.name()),
        }
    }
}

/// The world and the first camera's pose in it, from the inertial readings up to the first frame.
pub(crate) fn found(
    choice: WorldChoice,
    camera_from_imu: Option<&Pose>,
    readings: &[ImuSample],
) -> (World, Pose) {
    match down_in_camera(choice, camera_from_imu, readings) {
        Ok(down) => {
            let rotation = UnitQuaternion::rotation_between(&down, &Vector3::y());
            // Upside down: half a turn about the optical axis keeps the heading.
            let half = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
            let pose = Pose::new(rotation.unwrap_or(half), Vector3::zeros());
            (World::GravityAligned, pose)
        }
        Err(because) => (World::FirstCamera { because }, Pose::identity()),
    }
}

/// The direction of gravity in the camera's frame, or why it is not known.
fn down_in_camera(
    choice: WorldChoice,
    camera_from_imu: Option<&Pose>,
    readings: &[ImuSample],
) -> Result<Vector3<f64>, String> {
    if choice == WorldChoice::FirstCamera {
        return Err("asked for".into());
    }
    let Some(camera_from_imu) = camera_from_imu else {
        return Err("where the inertial sensor sits (camera_from_imu) is not known".into());
    };
    let forces = readings.iter().map(|reading| reading.accel_m_s2);
    let forces: Vec<Vector3<f64>> = forces.filter(|f| f.iter().all(|v| v.is_finite())).collect();
    let count = forces.len();
    if count < LEAST_READINGS {
        return Err(format!(
            "{count} readings of the accelerometer before the first frame, {LEAST_READINGS} needed"
        ));
    }
    let mean = forces.iter().sum::<Vector3<f64>>() / count as f64;
    let spread = forces
        .iter()
        .map(|f| (f - mean).norm_squared())
        .sum::<f64>()
        / count as f64;
    if !GRAVITY_M_S2.contains(&mean.norm()) || spread.sqrt() > CALM_M_S2 {
        return Err(format!(
            "the accelerometer reads {:.2} m/s^2 with a deviation of {:.2} before the first frame: \
             no camera at rest",
            mean.norm(),
            spread.sqrt()
        ));
    }
    // At rest it reads upwards.
    Ok(-(camera_from_imu.rotation * mean))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sphereflow_core::Stamp;

    fn readings(up: Vector3<f64>, count: usize) -> Vec<ImuSample> {
        (0..count)
            .map(|i| ImuSample {
                stamp: Stamp::from_ns(i as i64),
                gyro_rad_s: Vector3::zeros(),
                accel_m_s2: up * 9.81,
            })
            .collect()
    }

    #[test]
    fn world_of_a_tilted_camera_at_rest_has_gravity_along_y() {
        let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.0, -0.2));
        let camera_from_imu = Pose::new(
            UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 1.2, 0.3)),
            Vector3::new(0.02, 0.0, 0.1),
        );
        // world from camera is `tilt`: up, seen by the sensor
        let up = camera_from_imu.rotation.inverse() * (tilt.inverse() * -Vector3::y());
        let (world, pose) = found(WorldChoice::Auto, Some(&camera_from_imu), &readings(up, 40));
        assert_eq!(world, World::GravityAligned);
        let down = pose.rotation * (tilt.inverse() * Vector3::y());
        assert!((down - Vector3::y()).norm() < 1e-12, "{down}");
    }

    #[test]
    fn world_without_extrinsics_readings_or_rest_is_the_first_camera_with_the_reason() {
        let still = readings(-Vector3::y(), 40);
        let identity = Pose::identity();
        let reason = |choice, extrinsics: Option<&Pose>, readings: &[ImuSample]| {
            let (world, pose) = found(choice, extrinsics, readings);
            assert_eq!(pose, Pose::identity());
            world.to_string()
        };
        assert!(reason(WorldChoice::FirstCamera, Some(&identity), &still).contains("asked"));
        assert!(reason(WorldChoice::Auto, None, &still).contains("camera_from_imu"));
        assert!(reason(WorldChoice::Auto, Some(&identity), &still[..3]).contains("3 readings"));
        let mut shaken = still.clone();
        for (i, reading) in shaken.iter_mut().enumerate() {
            reading.accel_m_s2.x += if i % 2 == 0 { 3.0 } else { -3.0 };
        }
        assert!(reason(WorldChoice::Auto, Some(&identity), &shaken).contains("at rest"));
    }
}
