//! "Bundle Adjustment in the Large" (Agarwal et al., 2010): text.
//!
//! Cameras, points and measurements are counted in the first line; then come the measurements
//! (camera, point, x, y), the cameras (rotation vector, translation, f, k1, k2) and the points.

use super::snavely::{add_camera, add_pixel, camera_of};
use super::tokens::Tokens;
use crate::beside::write_file;
use crate::{Error, Result};
use nalgebra::Vector3;
use sphereflow_core::Pose;
use sphereflow_solver::bundle::BundleProblem;
use sphereflow_sphere::lie::so3;
use std::io::Write;
use std::path::Path;

pub(super) fn read(path: &Path, text: &str) -> Result<BundleProblem> {
    let mut tokens = Tokens::new(path, text);
    let cameras = tokens.count("the number of cameras")?;
    let points = tokens.count("the number of points")?;
    let count = tokens.count("the number of measurements")?;
    let mut measurements = Vec::new();
    for _ in 0..count {
        let camera = tokens.count("the index of a camera")?;
        let point = tokens.count("the index of a point")?;
        if camera >= cameras || point >= points {
            let expected = format!("a camera below {cameras} and a point below {points}");
            return Err(tokens.error(expected, format!("{camera} and {point}")));
        }
        measurements.push((camera, point, tokens.numbers::<2>("a measurement")?));
    }
    let mut problem = BundleProblem::new();
    for _ in 0..cameras {
        let [rx, ry, rz, tx, ty, tz, f, k1, k2] = tokens.numbers("a camera")?;
        let pose = Pose::new(
            so3::exp(&Vector3::new(rx, ry, rz)),
            Vector3::new(tx, ty, tz),
        );
        add_camera(&mut problem, &tokens, [f, k1, k2], pose)?;
    }
    for _ in 0..points {
        let position = Vector3::from(tokens.numbers::<3>("a point")?);
        let added = problem.add_point(position);
        added.map_err(|error| tokens.error("a point", error))?;
    }
    for (camera, point, pixel) in measurements {
        add_pixel(&mut problem, &tokens, (camera, point), pixel)?;
    }
    Ok(problem)
}

pub(super) fn write(path: &Path, problem: &BundleProblem) -> Result<()> {
    write_file(path, |file| {
        let counts = (problem.poses(), problem.points(), problem.observations());
        writeln!(file, "{} {} {}", counts.0, counts.1, counts.2)
            .map_err(Error::system(path, "write"))?;
        for (pose, point, pixel) in problem.pixels() {
            writeln!(file, "{pose} {point} {:e} {:e}", pixel.x, -pixel.y)
                .map_err(Error::system(path, "write"))?;
        }
        for pose in 0..problem.poses() {
            let ([f, k1, k2], theirs) = camera_of(path, problem, pose)?;
            let (r, t) = (so3::log(&theirs.rotation), theirs.translation);
            for value in [r.x, r.y, r.z, t.x, t.y, t.z, f, k1, k2] {
                writeln!(file, "{value:e}").map_err(Error::system(path, "write"))?;
            }
        }
        for point in (0..problem.points()).filter_map(|point| problem.point(point)) {
            for value in point.iter() {
                writeln!(file, "{value:e}").map_err(Error::system(path, "write"))?;
            }
        }
        Ok(())
    })
}
