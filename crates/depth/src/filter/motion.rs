//! The filter's pose: as given, or integrated from velocities with their noise.

use super::keyframes::Present;
use super::state::Drift;
use crate::Result;
use crate::rays::finite_twist;
use sphereflow_core::checks::{all_finite, each, non_negative, positive};
use sphereflow_core::{Pose, Stamp, Twist};
use sphereflow_sphere::lie::se3;

/// Noise of measured velocities, each axis and each step for itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VelocityNoise {
    /// Standard deviation of the angular velocity, rad/s.
    pub angular_rad_s: f64,
    /// Standard deviation of the linear velocity, m/s.
    pub linear_m_s: f64,
}

/// Noise of given poses, each axis and each pose for itself. What images show of it is put right.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseNoise {
    /// Standard deviation of the rotation, rad.
    pub rotation_rad: f64,
    /// Standard deviation of the position, metres.
    pub position_m: f64,
}

/// The pose of the last image and how uncertain it has become.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub pose: Pose,
    pub drift: Drift,
    /// Variance of the last pose by itself.
    pub noise: Drift,
    stamp: Option<Stamp>,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            pose: Pose::identity(),
            drift: Drift::default(),
            noise: Drift::default(),
            stamp: None,
        }
    }
}

impl Motion {
    pub fn present(&self) -> Present {
        Present {
            world_from_camera: self.pose,
            drift: self.drift,
            noise: self.noise,
        }
    }

    /// True where the stamp comes after the last one.
    pub fn follows(&self, stamp: Stamp) -> bool {
        self.stamp.is_none_or(|last| stamp > last)
    }

    pub fn set(&mut self, pose: Pose, noise: PoseNoise, stamp: Stamp) -> Result<()> {
        let numbers = pose.quat_xyzw();
        all_finite("world_from_camera", numbers.iter().chain(&pose.translation))?;
        let deviations = [
            ("noise.rotation_rad", noise.rotation_rad),
            ("noise.position_m", noise.position_m),
        ];
        each(non_negative, &deviations)?;
        self.pose = pose;
        self.noise = Drift {
            rotation: noise.rotation_rad.powi(2) as f32,
            translation: noise.position_m.powi(2) as f32,
        };
        self.stamp = Some(stamp);
        Ok(())
    }

    /// Thesis: eq. (1.8): q' = q omega / 2 and C' = q v q*, exact for constant body velocities.
    pub fn integrate(&mut self, twist: &Twist, dt_s: f64, noise: VelocityNoise) -> Result<()> {
        finite_twist(twist)?;
        positive("dt_s", dt_s)?;
        let deviations = [
            ("noise.angular_rad_s", noise.angular_rad_s),
            ("noise.linear_m_s", noise.linear_m_s),
        ];
        each(non_negative, &deviations)?;
        self.noise = Drift::default();
        self.pose = self.pose * se3::exp(&(twist.vector() * dt_s));
        self.drift.rotation += (noise.angular_rad_s * dt_s).powi(2) as f32;
        self.drift.translation += (noise.linear_m_s * dt_s).powi(2) as f32;
        self.stamp = self.stamp.map(|stamp| stamp.plus_seconds(dt_s));
        Ok(())
    }
}
