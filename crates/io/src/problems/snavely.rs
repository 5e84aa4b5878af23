//! The camera of Bundler and BAL: y up, looking along -z, one focal length, k1 and k2.
//!
//! `p = -X / X.z`, `pixel = f (1 + k1 |p|^2 + k2 |p|^4) p` from the middle of the image, y up. Turned
//! half around x it is OpenCV's model with cx = cy = 0 and pixels (u, -v).

use super::tokens::Tokens;
use crate::{Error, Result};
use nalgebra::{Matrix2, UnitQuaternion, Vector2, Vector3};
use sphereflow_core::Pose;
use sphereflow_solver::bundle::BundleProblem;
use sphereflow_sphere::Camera;
use std::path::Path;

/// Half a turn about x: our camera frame from theirs, and back.
fn flip() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
}

/// A camera and its pose, given as theirs from the world.
pub(super) fn add_camera(
    problem: &mut BundleProblem,
    tokens: &Tokens<'_>,
    [f, k1, k2]: [f64; 3],
    theirs_from_world: Pose,
) -> Result<usize> {
    // the files do not say the size of the image; nothing here looks at it
    let coefficients = [k1, k2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let camera = Camera::opencv(f, f, 0.0, 0.0, coefficients, 1, 1)
        .map_err(|error| tokens.error("a camera", error))?;
    let camera = problem.add_camera(camera);
    let added = problem
        .free_intrinsics(camera, &["focal", "k1", "k2"])
        .and_then(|()| {
            let ours = Pose::new(flip(), Vector3::zeros()) * theirs_from_world;
            problem.add_pose(ours.inverse(), camera)
        });
    added.map_err(|error| tokens.error("a camera", error))
}

/// A pixel as the files have it.
pub(super) fn add_pixel(
    problem: &mut BundleProblem,
    tokens: &Tokens<'_>,
    (pose, point): (usize, usize),
    [u, v]: [f64; 2],
) -> Result<()> {
    problem
        .add_pixel(pose, point, Vector2::new(u, -v), &Matrix2::identity())
        .map(|_| ())
        .map_err(|error| tokens.error("a measurement", error))
}

/// f, k1, k2 and theirs-from-world of a pose.
pub(super) fn camera_of(
    path: &Path,
    problem: &BundleProblem,
    pose: usize,
) -> Result<([f64; 3], Pose)> {
    let camera = problem
        .camera_of_pose(pose)
        .and_then(|camera| problem.camera(camera));
    let (Some(camera), Some(world_from_camera)) = (camera, problem.pose(pose)) else {
        return Err(Error::content(path, "a known pose", pose));
    };
    let named = camera.named_parameters();
    let value = |name: &str| {
        named
            .iter()
            .find(|(other, _)| *other == name)
            .map_or(0.0, |v| v.1)
    };
    let theirs = Pose::new(flip(), Vector3::zeros()) * world_from_camera.inverse();
    Ok(([value("fx"), value("k1"), value("k2")], theirs))
}
