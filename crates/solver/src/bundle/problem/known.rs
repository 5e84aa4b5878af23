//! What is known of poses: priors, and relative poses measured between them.

use super::{BundleProblem, finite};
use crate::bundle::ids::index;
use crate::bundle::prior::{Prior, root_information, root_of_information};
use crate::bundle::relative::RelativePose;
use crate::{Error, Loss, Result};
use nalgebra::{Matrix3, Matrix6, SMatrix, UnitQuaternion, Vector3};
use sphereflow_core::Pose;

impl BundleProblem {
    /// What is known of a pose; the covariance is of the twist `[omega, v]` in the camera frame.
    ///
    /// # Errors
    /// Where the index is unknown, a number is not finite, or the covariance is not positive definite.
    pub fn add_pose_prior(
        &mut self,
        pose: usize,
        world_from_camera: &Pose,
        covariance: &Matrix6<f64>,
    ) -> Result<()> {
        index("pose", pose, self.views.len())?;
        finite("world_from_camera", &world_from_camera.translation)?;
        finite("world_from_camera", &world_from_camera.rotation.coords)?;
        let root = root_information("covariance", covariance)?;
        self.priors
            .push(Prior::of_pose(pose, world_from_camera, &root));
        Ok(())
    }

    /// What is known of a pose's rotation; the covariance is of the rotation vector in the camera
    /// frame, radians squared.
    ///
    /// # Errors
    /// Where the index is unknown, a number is not finite, or the covariance is not positive definite.
    pub fn add_attitude_prior(
        &mut self,
        pose: usize,
        world_from_camera: &UnitQuaternion<f64>,
        covariance: &Matrix3<f64>,
    ) -> Result<()> {
        index("pose", pose, self.views.len())?;
        finite("world_from_camera", &world_from_camera.coords)?;
        let mut root = SMatrix::<f64, 3, 6>::zeros();
        root.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&root_information("covariance", covariance)?);
        let known = Pose::new(*world_from_camera, Vector3::zeros());
        self.priors.push(Prior::of_pose(pose, &known, &root));
        Ok(())
    }

    /// A measured relative pose between two poses, with its information (inverse covariance) of the
    /// twist `[omega, v]` in the camera frame of `a`: the residual is
    /// `log(a_from_b at the poses * measured^-1)`, and counts by `loss`.
    ///
    /// # Errors
    /// Where an index is unknown or both are the same, a number is not finite, the information is not
    /// positive definite, or the loss has no positive threshold.
    pub fn add_relative_pose(
        &mut self,
        (a, b): (usize, usize),
        a_from_b: &Pose,
        information: &Matrix6<f64>,
        loss: Loss,
    ) -> Result<()> {
        index("a", a, self.views.len())?;
        index("b", b, self.views.len())?;
        if a == b {
            return Err(Error::value("b", "another pose than `a`", b));
        }
        finite("a_from_b", &a_from_b.translation)?;
        finite("a_from_b", &a_from_b.rotation.coords)?;
        loss.check()?;
        self.relative.push(RelativePose {
            a,
            b,
            inverse: a_from_b.inverse(),
            root: root_of_information("information", information)?,
            loss,
        });
        Ok(())
    }
}
