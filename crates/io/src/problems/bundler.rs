//! Bundler's `bundle.out`, version 0.3: text.
//!
//! After the counts come the cameras (f k1 k2, rotation by rows, translation) and the points
//! (position, colour, then camera, key, x, y of every view). Cameras without a focal length were
//! not used, and are left out.

use super::snavely::{add_camera, add_pixel};
use super::tokens::Tokens;
use crate::Result;
use nalgebra::{Matrix4, Vector3};
use sphereflow_core::Pose;
use sphereflow_solver::bundle::BundleProblem;
use std::path::Path;

pub(super) fn read(path: &Path, text: &str) -> Result<BundleProblem> {
    let mut tokens = Tokens::new(path, text);
    let cameras = tokens.count("the number of cameras")?;
    let points = tokens.count("the number of points")?;
    let mut problem = BundleProblem::new();
    let mut pose_of = Vec::new();
    for _ in 0..cameras {
        let intrinsics: [f64; 3] = tokens.numbers("f, k1, k2")?;
        let rotation: [f64; 9] = tokens.numbers("a rotation")?;
        let translation: [f64; 3] = tokens.numbers("a translation")?;
        if intrinsics[0] == 0.0 {
            pose_of.push(None);
            continue;
        }
        let mut matrix = Matrix4::identity();
        for (k, value) in rotation.into_iter().enumerate() {
            matrix[(k / 3, k % 3)] = value;
        }
        for (k, value) in translation.into_iter().enumerate() {
            matrix[(k, 3)] = value;
        }
        let pose = Pose::from_matrix(&matrix).map_err(|error| tokens.error("a pose", error))?;
        pose_of.push(Some(add_camera(&mut problem, &tokens, intrinsics, pose)?));
    }
    for _ in 0..points {
        let position = Vector3::from(tokens.numbers::<3>("a point")?);
        let point = problem.add_point(position);
        let point = point.map_err(|error| tokens.error("a point", error))?;
        tokens.numbers::<3>("a colour")?;
        for _ in 0..tokens.count("the number of views")? {
            let camera = tokens.count("the index of a camera")?;
            tokens.count("the index of a key")?;
            let pixel = tokens.numbers("a measurement")?;
            match pose_of.get(camera) {
                Some(Some(pose)) => add_pixel(&mut problem, &tokens, (*pose, point), pixel)?,
                _ => return Err(tokens.error("the index of a camera that was used", camera)),
            }
        }
    }
    Ok(problem)
}
