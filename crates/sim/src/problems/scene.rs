//! Rooms and streets seen by a moving camera: bundle adjustment problems.

use super::random::Random;
use crate::{Error, Result};
use nalgebra::{Matrix2, Matrix3, UnitQuaternion, Vector2, Vector3, Vector6};
use sphereflow_core::Pose;
use sphereflow_solver::bundle::BundleProblem;
use sphereflow_sphere::Camera;
use sphereflow_sphere::lie::se3;

/// The shape of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// The camera walks around in a room and looks everywhere: every pose shares points with many.
    Room,
    /// The camera drives along a street: poses share points with their neighbours.
    Street,
}

/// What a generated scene is like. The start of the adjustment is the truth moved by the start
/// noises; the first two poses are true and fixed.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSettings {
    /// Shape.
    pub kind: SceneKind,
    /// Number of poses, 2 or more.
    pub poses: usize,
    /// Number of points.
    pub points: usize,
    /// Poses that see each point, at most.
    pub track: usize,
    /// Noise of the pixels, standard deviation.
    pub pixel_sigma: f64,
    /// Noise of the points measured in the camera frame, metres; none are measured where absent.
    pub depth_sigma_m: Option<f64>,
    /// Share of the pixels that are wrong, but for those that would leave a point less than three right
    /// ones.
    pub outliers: f64,
    /// Half the side of the square around the right pixel that a wrong one is anywhere in: the
    /// window in which a match is sought.
    pub outlier_window_px: f64,
    /// Angle between the outermost rays to a point, at least, radians: without parallax a point is
    /// as well at infinity, and solvers walk there as long as they are let. With outliers at least
    /// the angle by which a pixel can be wrong: rays that a wrong pixel turns further than the others
    /// converge meet behind the cameras.
    pub parallax_rad: f64,
    /// Start noise of the poses, radians and metres.
    pub start_sigma: f64,
    /// Start noise of the points, metres.
    pub point_sigma_m: f64,
    /// The random numbers.
    pub seed: u64,
}

impl SceneSettings {
    /// Tracks of 8, half a pixel of noise, no depth and no outliers, a start 1 cm and 0.01 rad off.
    pub fn new(kind: SceneKind, poses: usize, points: usize, seed: u64) -> Self {
        Self {
            kind,
            poses,
            points,
            track: 8,
            pixel_sigma: 0.5,
            depth_sigma_m: None,
            outliers: 0.0,
            outlier_window_px: 40.0,
            parallax_rad: 0.05,
            start_sigma: 0.01,
            point_sigma_m: 0.05,
            seed,
        }
    }
}

/// A generated scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The problem, at its start.
    pub problem: BundleProblem,
    /// The true poses, world from camera.
    pub true_poses: Vec<Pose>,
    /// The true points, world, metres.
    pub true_points: Vec<Vector3<f64>>,
}

/// Half the size of a room, metres: across, up, along.
const ROOM: [f64; 3] = [3.0, 1.4, 3.0];
/// Half the width of a street, metres.
const STREET: f64 = 5.0;
/// Distance between the poses along a street, metres.
const STEP: f64 = 0.5;
/// Poses that see each point, at least, where there are as many: a wrong pixel of a point that two
/// see cannot be told from the right one.
const LEAST_VIEWS: usize = 3;
/// Right pixels that are left of each point, at least, where it is seen so often (and one wrong one
/// at most where it is not): where the wrong ones are more, the cost has many minima far from the
/// truth, even behind cameras, and which one is found says nothing of a solver.
const LEAST_RIGHT: usize = 3;
/// Points tried for each one found.
const MAX_FAILURES: usize = 1000;
const FOCAL: f64 = 380.0;
const WIDTH: usize = 640;
const HEIGHT: usize = 480;
/// Points nearer than this are not measured, metres.
const NEAREST: f64 = 0.4;

fn truth(settings: &SceneSettings, random: &mut Random) -> Vec<Pose> {
    (0..settings.poses)
        .map(|k| {
            let turn = k as f64 / settings.poses as f64;
            let (heading, place) = match settings.kind {
                SceneKind::Room => {
                    let angle = std::f64::consts::TAU * turn;
                    let place = Vector3::new(angle.cos(), 0.2 * (5.0 * angle).sin(), angle.sin());
                    (3.0 * angle, place * 1.2)
                }
                SceneKind::Street => {
                    let along = STEP * k as f64;
                    (0.5 * (0.7 * along).sin(), Vector3::new(0.0, 0.0, along))
                }
            };
            let small = random.normal::<3>(0.05);
            let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), heading)
                * UnitQuaternion::new(small);
            Pose::new(rotation, place)
        })
        .collect()
}

fn point(settings: &SceneSettings, random: &mut Random) -> Vector3<f64> {
    match settings.kind {
        SceneKind::Room => {
            // on a wall, the floor or the ceiling, some of them on furniture in front of it
            let face = random.below(6);
            let depth = if random.uniform() < 0.3 {
                random.between(0.75, 1.0)
            } else {
                1.0
            };
            let mut at = Vector3::from_fn(|axis, _| random.between(-ROOM[axis], ROOM[axis]));
            let axis = face / 2;
            at[axis] = ROOM[axis] * depth * if face.is_multiple_of(2) { 1.0 } else { -1.0 };
            at
        }
        SceneKind::Street => {
            let length = STEP * settings.poses as f64 + 10.0;
            let side = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
            Vector3::new(
                side * STREET * random.between(0.8, 1.2),
                random.between(-6.0, 1.5),
                random.between(1.0, length),
            )
        }
    }
}

/// The pixel at which a true pose sees a true point.
fn sees(
    camera: &Camera,
    pose: &Pose,
    point: &Vector3<f64>,
) -> Option<(Vector2<f64>, Vector3<f64>)> {
    let x = pose.inverse().transform(point);
    let pixel = camera.project(&x).filter(|pixel| camera.contains(pixel))?;
    (x.z > NEAREST && x.z < 25.0).then_some((pixel, x))
}

/// The largest angle between the rays from these poses to the point and the first of them, radians.
fn parallax(poses: &[Pose], views: &[usize], point: &Vector3<f64>) -> f64 {
    let ray = |view: &usize| point - poses[*view].translation;
    let angles = views.iter().map(|view| ray(view).angle(&ray(&views[0])));
    angles.fold(0.0, f64::max)
}

/// Up to `track` poses that see the point, ascending.
fn viewers(
    settings: &SceneSettings,
    camera: &Camera,
    poses: &[Pose],
    point: &Vector3<f64>,
    random: &mut Random,
) -> Vec<usize> {
    let mut found = Vec::new();
    let tries = match settings.kind {
        SceneKind::Room => 8 * settings.track,
        SceneKind::Street => 60, // 30 m
    };
    let near = (point.z / STEP) as isize;
    for k in 0..tries {
        let pose = match settings.kind {
            SceneKind::Room => random.below(poses.len()),
            SceneKind::Street => match near - k as isize {
                behind if behind >= 0 => behind as usize,
                _ => break,
            },
        };
        if pose < poses.len()
            && !found.contains(&pose)
            && sees(camera, &poses[pose], point).is_some()
        {
            found.push(pose);
        }
        if found.len() >= settings.track {
            break;
        }
    }
    found.sort_unstable();
    found
}

/// Generate a scene.
///
/// # Errors
/// Where a setting is outside its domain.
pub fn scene(settings: &SceneSettings) -> Result<Scene> {
    if settings.poses < 2 || settings.track < 2 {
        let found = format!("{} and {}", settings.poses, settings.track);
        return Err(Error::value("poses, track", "2 or more", found));
    }
    let mut random = Random::new(settings.seed);
    let camera = Camera::pinhole(FOCAL, FOCAL, 319.5, 239.5, WIDTH, HEIGHT)?;
    let true_poses = truth(settings, &mut random);
    let mut problem = BundleProblem::new();
    problem.add_camera(camera.clone());
    for (k, pose) in true_poses.iter().enumerate() {
        let noise: Vector6<f64> = random.normal(settings.start_sigma);
        let start = if k < 2 {
            *pose
        } else {
            *pose * se3::exp(&noise)
        };
        problem.add_pose(start, 0)?;
    }
    problem.fix_pose(0)?;
    problem.fix_pose(1)?;
    let least_parallax = settings.parallax_rad.max(if settings.outliers > 0.0 {
        settings.outlier_window_px * std::f64::consts::SQRT_2 / FOCAL
    } else {
        0.0
    });
    let mut true_points = Vec::with_capacity(settings.points);
    let mut failures = 0;
    while true_points.len() < settings.points {
        let at = point(settings, &mut random);
        let views = viewers(settings, &camera, &true_poses, &at, &mut random);
        failures += 1;
        if failures > MAX_FAILURES * settings.points {
            let expected = "poses that see points together under the parallax asked for";
            return Err(Error::value("poses", expected, settings.poses));
        }
        let least = LEAST_VIEWS.min(settings.track).min(settings.poses);
        if views.len() < least || parallax(&true_poses, &views, &at) < least_parallax {
            continue;
        }
        let index = problem.add_point(at + random.normal::<3>(settings.point_sigma_m))?;
        let mut wrong = views.len().saturating_sub(LEAST_RIGHT).max(1);
        for view in views {
            let seen = (view, index, &mut wrong);
            observe(
                &mut problem,
                settings,
                seen,
                &true_poses[view],
                &at,
                &mut random,
            )?;
        }
        true_points.push(at);
    }
    Ok(Scene {
        problem,
        true_poses,
        true_points,
    })
}

fn observe(
    problem: &mut BundleProblem,
    settings: &SceneSettings,
    (view, index, wrong_left): (usize, usize, &mut usize),
    pose: &Pose,
    at: &Vector3<f64>,
    random: &mut Random,
) -> Result<()> {
    let Some((pixel, x)) = problem.camera(0).and_then(|camera| sees(camera, pose, at)) else {
        return Ok(());
    };
    let wrong = random.uniform() < settings.outliers && *wrong_left > 0;
    *wrong_left -= usize::from(wrong);
    let noisy = pixel + random.normal::<2>(settings.pixel_sigma);
    let window = settings.outlier_window_px;
    let off = Vector2::new(
        random.between(-window, window),
        random.between(-window, window),
    );
    let variance = settings.pixel_sigma.max(1e-3).powi(2);
    let pixel = if wrong { pixel + off } else { noisy };
    problem.add_pixel(view, index, pixel, &(Matrix2::identity() * variance))?;
    if let Some(sigma) = settings.depth_sigma_m {
        let measured = x + random.normal::<3>(sigma);
        let variance = sigma.max(1e-6).powi(2);
        problem.add_point_measurement(view, index, measured, &(Matrix3::identity() * variance))?;
    }
    Ok(())
}
