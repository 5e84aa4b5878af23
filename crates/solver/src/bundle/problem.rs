//! The problem as it is stated: cameras, poses, points, measurements, priors.

mod device;
mod inertial;
mod known;

pub use device::ReadDepth;

pub use super::measurement::Losses;

use super::ids::index;
use super::inertial::Inertial;
use super::intrinsics::Intrinsics;
use super::measurement::Measurement;
use super::prior::{Prior, root_information};
use super::relative::RelativePose;
use super::rows::RowMotion;
use super::sighting::RowPixel;
use crate::Result;
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3};
use sphereflow_core::Pose;
use sphereflow_core::checks::{all_finite, each, positive};
use sphereflow_sphere::Camera;

#[derive(Clone, Debug)]
pub(crate) struct View {
    pub world_from_camera: Pose,
    pub camera: usize,
    pub fixed: bool,
    pub rows: RowMotion,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct PointNode {
    pub position: Vector3<f64>,
    pub fixed: bool,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    pub view: u32,
    pub point: u32,
    pub measurement: Measurement,
}

/// A bundle adjustment problem. Poses are `world_from_camera`, points are in the world, metres;
/// indices are those the `add_` calls return. Measurements of different kinds count by their
/// covariances, which is how their influence is made equal (Thesis: section 9.3.2).
#[derive(Clone, Debug, Default)]
pub struct BundleProblem {
    pub(crate) intrinsics: Vec<Intrinsics>,
    pub(crate) views: Vec<View>,
    pub(crate) points: Vec<PointNode>,
    pub(crate) observations: Vec<Observation>,
    pub(crate) priors: Vec<Prior>,
    pub(crate) relative: Vec<RelativePose>,
    pub(crate) inertial: Inertial,
    /// The losses of the kinds of measurements; quadratic at first.
    pub losses: Losses,
}

fn finite<const N: usize>(argument: &str, values: &SMatrix<f64, N, 1>) -> Result<()> {
    Ok(all_finite(argument, values)?)
}

impl BundleProblem {
    /// Without anything in it.
    pub fn new() -> Self {
        Self::default()
    }

    /// A camera whose intrinsics are known; poses share it by its index.
    pub fn add_camera(&mut self, camera: Camera) -> usize {
        self.intrinsics.push(Intrinsics::fixed(camera));
        self.intrinsics.len() - 1
    }

    /// Estimate parameters of a camera, by their names in a calibration file; `focal` is `fx` and
    /// `fy` together; `readout_s`, `colour_offset_s` and the terms of the depth field
    /// (`depth_field.relative.z1`, ...) are those of
    /// [`DeviceCalibration`](crate::bundle::DeviceCalibration). Derivatives are closed forms for
    /// focal lengths, principal point, skew, OpenCV's coefficients and the device, and central
    /// differences for the other models' own parameters.
    ///
    /// # Errors
    /// Where there is no such camera or parameter, or a parameter is named twice.
    pub fn free_intrinsics(&mut self, camera: usize, names: &[&str]) -> Result<()> {
        index("camera", camera, self.intrinsics.len())?;
        self.intrinsics[camera].release(names)
    }

    /// A pose of a camera.
    ///
    /// # Errors
    /// Where there is no such camera, or the pose is not finite.
    pub fn add_pose(&mut self, world_from_camera: Pose, camera: usize) -> Result<usize> {
        index("camera", camera, self.intrinsics.len())?;
        finite("world_from_camera", &world_from_camera.translation)?;
        finite("world_from_camera", &world_from_camera.rotation.coords)?;
        self.views.push(View {
            world_from_camera,
            camera,
            fixed: false,
            rows: RowMotion::default(),
        });
        Ok(self.views.len() - 1)
    }

    /// A point.
    ///
    /// # Errors
    /// Where it is not finite.
    pub fn add_point(&mut self, position: Vector3<f64>) -> Result<usize> {
        finite("position", &position)?;
        self.points.push(PointNode {
            position,
            fixed: false,
        });
        Ok(self.points.len() - 1)
    }

    /// Hold a pose where it is: one fixes the gauge of metric problems, two of others.
    ///
    /// # Errors
    /// Where there is no such pose.
    pub fn fix_pose(&mut self, pose: usize) -> Result<()> {
        index("pose", pose, self.views.len())?;
        self.views[pose].fixed = true;
        Ok(())
    }

    /// Hold a point where it is.
    ///
    /// # Errors
    /// Where there is no such point.
    pub fn fix_point(&mut self, point: usize) -> Result<()> {
        index("point", point, self.points.len())?;
        self.points[point].fixed = true;
        Ok(())
    }

    fn observe(&mut self, pose: usize, point: usize, measurement: Measurement) -> Result<usize> {
        index("pose", pose, self.views.len())?;
        index("point", point, self.points.len())?;
        self.observations.push(Observation {
            view: pose as u32,
            point: point as u32,
            measurement,
        });
        Ok(self.observations.len() - 1)
    }

    /// `point` is seen from `pose` at `pixel`, with a covariance in pixels squared.
    ///
    /// # Errors
    /// Where an index is unknown, a number is not finite, or the covariance is not positive definite.
    pub fn add_pixel(
        &mut self,
        pose: usize,
        point: usize,
        pixel: Vector2<f64>,
        covariance: &Matrix2<f64>,
    ) -> Result<usize> {
        finite("pixel", &pixel)?;
        let root = root_information("covariance", covariance)?;
        self.observe(pose, point, Measurement::Pixel { pixel, root })
    }

    /// `point` is measured from `pose` at `point_in_camera`, metres. Thesis: eq. (9.1).
    ///
    /// # Errors
    /// Where an index is unknown, a number is not finite, or the covariance is not positive definite.
    pub fn add_point_measurement(
        &mut self,
        pose: usize,
        point: usize,
        point_in_camera: Vector3<f64>,
        covariance: &Matrix3<f64>,
    ) -> Result<usize> {
        finite("point_in_camera", &point_in_camera)?;
        let root = root_information("covariance", covariance)?;
        let point_in_camera = Measurement::Point {
            point: point_in_camera,
            root,
        };
        self.observe(pose, point, point_in_camera)
    }

    /// The inverse of the distance from `pose` to `point` along the ray, per metre, with its
    /// standard deviation.
    ///
    /// # Errors
    /// Where an index is unknown, or a number is not finite or not positive.
    pub fn add_inverse_range(
        &mut self,
        pose: usize,
        point: usize,
        inv_range: f64,
        sigma: f64,
    ) -> Result<usize> {
        each(positive, &[("inv_range", inv_range), ("sigma", sigma)])?;
        let root = 1.0 / sigma;
        self.observe(pose, point, Measurement::InverseRange { inv_range, root })
    }

    /// True where something but points ties poses together.
    pub(super) fn ties_poses(&self) -> bool {
        let joint = |prior: &Prior| prior.views.len() + prior.motions.len() > 1;
        self.priors.iter().any(joint)
            || !self.relative.is_empty()
            || !self.inertial.views.is_empty()
    }

    /// Number of poses.
    pub fn poses(&self) -> usize {
        self.views.len()
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.points.len()
    }

    /// Number of measurements.
    pub fn observations(&self) -> usize {
        self.observations.len()
    }

    /// The measured pixels: pose, point and pixel, in the order in which they were added.
    pub fn pixels(&self) -> impl Iterator<Item = (usize, usize, Vector2<f64>)> + '_ {
        self.observations
            .iter()
            .filter_map(|o| match o.measurement {
                Measurement::Pixel { pixel, .. } | Measurement::Row(RowPixel { pixel, .. }) => {
                    Some((o.view as usize, o.point as usize, pixel))
                }
                _ => None,
            })
    }

    /// A pose, world from camera; `None` where there is no such pose.
    pub fn pose(&self, pose: usize) -> Option<Pose> {
        self.views.get(pose).map(|view| view.world_from_camera)
    }

    /// A point, world, metres; `None` where there is no such point.
    pub fn point(&self, point: usize) -> Option<Vector3<f64>> {
        self.points.get(point).map(|point| point.position)
    }

    /// A camera; `None` where there is no such camera.
    pub fn camera(&self, camera: usize) -> Option<&Camera> {
        self.intrinsics.get(camera).map(|found| &found.camera)
    }

    /// The camera of a pose; `None` where there is no such pose.
    pub fn camera_of_pose(&self, pose: usize) -> Option<usize> {
        self.views.get(pose).map(|view| view.camera)
    }

    /// Move a pose: a new start.
    ///
    /// # Errors
    /// Where there is no such pose, or the new one is not finite.
    pub fn set_pose(&mut self, pose: usize, world_from_camera: Pose) -> Result<()> {
        index("pose", pose, self.views.len())?;
        finite("world_from_camera", &world_from_camera.translation)?;
        finite("world_from_camera", &world_from_camera.rotation.coords)?;
        self.views[pose].world_from_camera = world_from_camera;
        Ok(())
    }

    /// Another camera of the same model: a new start of its free parameters.
    ///
    /// # Errors
    /// Where there is no such camera, or its model is another.
    pub fn set_camera(&mut self, camera: usize, start: &Camera) -> Result<()> {
        index("camera", camera, self.intrinsics.len())?;
        self.intrinsics[camera].restart(start)
    }

    /// Move a point: a new start.
    ///
    /// # Errors
    /// Where there is no such point, or the new one is not finite.
    pub fn set_point(&mut self, point: usize, position: Vector3<f64>) -> Result<()> {
        index("point", point, self.points.len())?;
        finite("position", &position)?;
        self.points[point].position = position;
        Ok(())
    }
}
