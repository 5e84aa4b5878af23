//! Velocities, biases and IMU samples as they are stated.

use super::BundleProblem;
use crate::bundle::ids::index;
use crate::bundle::inertial::{BiasPrior, Motion, Tie};
use crate::inertial::link::{InertialState, check, root};
use crate::inertial::{ImuBias, Preintegration};
use crate::{Error, Result};
use nalgebra::Vector3;
use sphereflow_core::Pose;
use sphereflow_core::checks::{each, positive};

impl BundleProblem {
    /// Gravity in the world (m/s^2, pointing down) and where the camera is in the body frame, which is
    /// the IMU's.
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn set_imu(&mut self, gravity: Vector3<f64>, body_from_camera: Pose) -> Result<()> {
        crate::inertial::finite("gravity", &gravity)?;
        let state = InertialState {
            pose: body_from_camera,
            ..InertialState::default()
        };
        check(&state)?;
        self.inertial.gravity = gravity;
        self.inertial.camera_from_body = body_from_camera.inverse();
        Ok(())
    }

    /// Estimate velocity and biases at a pose too, from here on.
    ///
    /// # Errors
    /// Where there is no such pose, it has a motion already, or a number is not finite.
    pub fn add_motion(&mut self, pose: usize, motion: Motion) -> Result<()> {
        index("pose", pose, self.poses())?;
        if self.inertial.views.contains(&pose) {
            return Err(Error::value("pose", "a pose without a motion", pose));
        }
        check(&InertialState {
            pose: Pose::identity(),
            velocity: motion.velocity,
            bias: motion.bias,
        })?;
        self.inertial.views.push(pose);
        self.inertial.motions.push(motion);
        Ok(())
    }

    /// Tie two poses that have motions by the samples between them.
    ///
    /// # Errors
    /// Where a pose has no motion, both are the same, or fewer than two samples were integrated.
    pub fn add_imu(&mut self, from: usize, to: usize, samples: Preintegration) -> Result<()> {
        let (first, second) = (
            self.motion_index("from", from)?,
            self.motion_index("to", to)?,
        );
        if from == to {
            return Err(Error::value("to", "another pose than `from`", to));
        }
        let root = root("samples", &samples)?;
        self.inertial.ties.push(Tie {
            from: first,
            to: second,
            samples,
            root,
        });
        Ok(())
    }

    /// Biases known at a pose that has a motion, with one standard deviation for each sensor.
    ///
    /// # Errors
    /// Where the pose has no motion, or a number is not finite or not positive.
    pub fn add_bias_prior(
        &mut self,
        pose: usize,
        bias: ImuBias,
        (gyro_sigma, accel_sigma): (f64, f64),
    ) -> Result<()> {
        let motion = self.motion_index("pose", pose)?;
        let sigmas = [("gyro_sigma", gyro_sigma), ("accel_sigma", accel_sigma)];
        each(positive, &sigmas)?;
        let root = [1.0 / gyro_sigma, 1.0 / accel_sigma];
        self.inertial.priors.push(BiasPrior { motion, bias, root });
        Ok(())
    }

    /// Velocity and biases at a pose; `None` where they are not estimated.
    pub fn motion(&self, pose: usize) -> Option<Motion> {
        let index = self.inertial.views.iter().position(|&view| view == pose)?;
        Some(self.inertial.motions[index])
    }

    fn motion_index(&self, argument: &str, pose: usize) -> Result<usize> {
        let found = self.inertial.views.iter().position(|&view| view == pose);
        found.ok_or_else(|| Error::value(argument, "a pose with a motion", pose))
    }
}
