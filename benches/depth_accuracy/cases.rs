//! The sequences: scene, path, camera, noise, light, and what the filter is told of the motion.

use crate::Fallible;
use nalgebra::Vector3;
use sphereflow_core::Pose;
use sphereflow_depth::{PoseNoise, VelocityNoise};
use sphereflow_sim::scene::{Block, Primitive, Texture};
use sphereflow_sim::{Motion, Scene, SimConfig};
use sphereflow_sphere::Camera;

/// Brightness at a time (s) and a height in the image (0 to 1).
pub type Light = fn(f64, f64) -> f32;

/// What the filter is told of the motion.
#[derive(Clone, Copy)]
pub enum Drive {
    /// Exact poses.
    Poses,
    /// Velocities with this noise.
    Velocities(VelocityNoise),
    /// Poses with errors that fade within a tenth of a second, of this size, which the filter is told.
    NoisyPoses(PoseNoise),
    /// Poses of another clock, late by so many seconds; the filter is told 2 mm and 2 mrad.
    Late(f64),
}

/// A sequence.
pub struct Case {
    pub name: String,
    pub scene: Scene,
    pub motion: Motion,
    pub camera: Camera,
    pub sigma: f32,
    pub light: Light,
    pub impulses: f32,
    pub drive: Drive,
    /// Rotation only from this time on, seconds.
    pub stands_from_s: f64,
    pub asked: Asked,
}

impl Case {
    fn new(name: &str, scene: Scene, motion: Motion, sigma: f32) -> Fallible<Self> {
        Ok(Self {
            name: format!("{name}, sigma {sigma}"),
            scene,
            motion,
            camera: SimConfig::thesis_camera(640, 480)?,
            sigma,
            light: |_, _| 1.0,
            impulses: 0.0,
            drive: Drive::Poses,
            stands_from_s: f64::INFINITY,
            asked: Asked::BEST,
        })
    }

    /// Where the camera is.
    pub fn pose(&self, t_s: f64) -> Pose {
        let mut pose = self.motion.pose(t_s);
        if t_s > self.stands_from_s {
            pose.translation = self.motion.pose(self.stands_from_s).translation;
        }
        pose
    }
}

/// Largest errors that are asked, percent; infinite where nothing is.
#[derive(Clone, Copy, PartialEq)]
pub struct Asked {
    /// After half a second.
    pub half: f64,
    /// The mean over 2 to 4 s.
    pub mean: f64,
    /// At any time of 2 to 4 s.
    pub max: f64,
}

impl Asked {
    pub const NOTHING: Self = Self {
        half: f64::INFINITY,
        mean: f64::INFINITY,
        max: f64::INFINITY,
    };

    /// Of the filter in the room and its variants.
    const BEST: Self = Self {
        half: 1.0,
        mean: 0.35,
        max: 1.5,
    };

    /// Nothing of the start.
    fn late(mean: f64, max: f64) -> Self {
        Self {
            mean,
            max,
            ..Self::NOTHING
        }
    }
}

impl std::fmt::Display for Asked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let limits = [self.half, self.mean, self.max];
        let limits = limits.map(|limit| match limit.is_finite() {
            true => limit.to_string(),
            false => "-".into(),
        });
        f.write_str(&limits.join(", "))
    }
}

/// Thesis: section 4.2: aliased light at 4.17 Hz.
fn flicker(t_s: f64, _: f64) -> f32 {
    1.0 + 0.1 * (std::f64::consts::TAU * 4.17 * t_s).sin() as f32
}

fn rolling(t_s: f64, y: f64) -> f32 {
    1.0 + 0.1 * (std::f64::consts::TAU * (4.17 * t_s + 0.8 * y)).sin() as f32
}

/// The room with a box 0.7 m before the camera's first place, in the direction that it looks.
fn room_with_box() -> Fallible<Scene> {
    let mut primitives = Scene::thesis_room().primitives().to_vec();
    let half = Vector3::new(0.15, 0.2, 0.15);
    let block = Block::new(Vector3::new(0.4, 0.1, 0.95), half, 0.3);
    let paint = Texture::Sinusoid { period_m: 0.25 };
    primitives.push(Primitive::new(block, paint));
    Ok(Scene::new(primitives)?)
}

/// All sequences, in the order of the table.
pub fn cases(furniture: &[u64]) -> Fallible<Vec<Case>> {
    let path = Motion::sinusoids_411;
    let room = Scene::thesis_room;
    let mut all = Vec::new();
    for (sigma, mean) in [(0.0, 0.15), (1.0, 0.15), (10.0, 0.35)] {
        let mut case = Case::new("room", room(), path(), sigma)?;
        case.asked.mean = mean;
        all.push(case);
    }
    for (sigma, mean) in [(0.0, 0.1), (10.0, 0.35)] {
        let mut case = Case::new("ellipsoid", Scene::thesis_ellipsoid(), path(), sigma)?;
        case.asked = Asked::late(mean, 1.5);
        all.push(case);
    }
    for period_m in [0.1, 0.2, 1.0] {
        let name = format!("paint of {period_m} m");
        all.push(Case::new(
            &name,
            Scene::thesis_room_with(period_m)?,
            path(),
            10.0,
        )?);
    }
    for seed in 2..5 {
        let name = format!("hand-held {seed}");
        all.push(Case::new(&name, room(), Motion::hand_held(seed), 10.0)?);
    }
    for &seed in furniture {
        let scene = || Scene::furnished_room(seed);
        let (name, moved) = (format!("furnished {seed}"), Motion::hand_held(seed + 6));
        all.push(Case::new(&name, scene(), moved, 10.0)?);
        let name = format!("furnished {seed} on the path of 4.1.1");
        all.push(Case::new(&name, scene(), path(), 10.0)?);
    }
    for sigma in [0.0, 10.0] {
        let mut case = Case::new("box", room_with_box()?, path(), sigma)?;
        case.asked = Asked::late(4.0, f64::INFINITY);
        all.push(case);
    }
    for (name, light) in [("flicker", flicker as Light), ("rolling light", rolling)] {
        let mut case = Case::new(name, room(), path(), 10.0)?;
        (case.light, case.asked) = (light, Asked::late(0.4, 1.5));
        all.push(case);
    }
    for sigma in [0.0, 3.0, 10.0] {
        let mut case = Case::new("2 % impulses", room(), path(), sigma)?;
        (case.impulses, case.asked) = (0.02, Asked::late(3.0, f64::INFINITY));
        all.push(case);
    }
    all.extend(other_motions()?);
    Ok(all)
}

fn other_motions() -> Fallible<Vec<Case>> {
    let (path, room) = (Motion::sinusoids_411, Scene::thesis_room);
    let noise = |linear_m_s, angular_rad_s| VelocityNoise {
        linear_m_s,
        angular_rad_s,
    };
    let mut all = Vec::new();
    for (name, noise) in [
        ("velocities, exact", noise(0.0, 0.0)),
        (
            "velocities, noise 0.05 m/s, 0.005 rad/s",
            noise(0.05, 0.005),
        ),
    ] {
        let mut case = Case::new(name, room(), path(), 10.0)?;
        (case.drive, case.asked) = (Drive::Velocities(noise), Asked::NOTHING);
        all.push(case);
    }
    for (position_m, rotation_rad) in [(0.002, 0.002), (0.005, 0.005)] {
        let noise = PoseNoise {
            position_m,
            rotation_rad,
        };
        for (scene, kind) in [(room(), "room"), (Scene::furnished_room(1), "furnished 1")] {
            let name = format!("{kind}, pose errors of {position_m} m, {rotation_rad} rad");
            let mut case = Case::new(&name, scene, Motion::hand_held(7), 3.0)?;
            (case.drive, case.asked) = (Drive::NoisyPoses(noise), Asked::NOTHING);
            all.push(case);
        }
    }
    for late_s in [0.005, 0.015] {
        let name = format!("furnished 1, poses late by {late_s} s");
        let mut case = Case::new(&name, Scene::furnished_room(1), Motion::hand_held(7), 3.0)?;
        (case.drive, case.asked) = (Drive::Late(late_s), Asked::NOTHING);
        all.push(case);
    }
    let mut case = Case::new("pure rotation after 1.5 s", room(), path(), 10.0)?;
    (case.stands_from_s, case.asked) = (1.5, Asked::late(1.5, 1.5));
    all.push(case);
    for (name, scene, sigma) in [
        ("whole sphere, ellipsoid", Scene::thesis_ellipsoid(), 0.0),
        ("whole sphere, ellipsoid", Scene::thesis_ellipsoid(), 10.0),
        ("whole sphere, room", room(), 10.0),
    ] {
        let mut case = Case::new(name, scene, path(), sigma)?;
        case.camera = Camera::equirectangular(1024, 512)?;
        case.asked = Asked::late(0.7, 3.0);
        all.push(case);
    }
    Ok(all)
}
