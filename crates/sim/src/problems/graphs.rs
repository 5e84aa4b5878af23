//! Pose graphs on a sphere, a torus and a plane grid.

use super::random::Random;
use crate::{Error, Result};
use nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3, Vector6};
use sphereflow_core::Pose;
use sphereflow_solver::graph::{EdgeKind, PoseGraph};
use sphereflow_sphere::lie::se3;
use std::f64::consts::{PI, TAU};

/// The surface that the path winds around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GraphKind {
    /// Rings from pole to pole.
    Sphere,
    /// Rings around a torus.
    Torus,
    /// Rows of a plane, there and back.
    Grid,
}

/// What a generated graph is like: odometry edges along the path, loop edges to the ring or row before.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphSettings {
    /// Surface.
    pub kind: GraphKind,
    /// Rings or rows, 2 or more.
    pub rings: usize,
    /// Poses of a ring or row, 3 or more.
    pub ring: usize,
    /// Noise of the measured rotations, radians.
    pub rotation_sigma: f64,
    /// Noise of the measured translations, metres; neighbours are about 1 m apart.
    pub translation_sigma: f64,
    /// Wrong loop edges, as a share of the right ones.
    pub wrong_loops: f64,
    /// The random numbers.
    pub seed: u64,
}

impl GraphSettings {
    /// 2 mrad and 2 cm of noise, no wrong loops.
    pub fn new(kind: GraphKind, rings: usize, ring: usize, seed: u64) -> Self {
        Self {
            kind,
            rings,
            ring,
            rotation_sigma: 0.002,
            translation_sigma: 0.02,
            wrong_loops: 0.0,
            seed,
        }
    }
}

/// A generated graph.
#[derive(Clone, Debug)]
pub struct Graph {
    /// The graph; it starts where odometry leads, and its first node is fixed at the truth.
    pub graph: PoseGraph<Pose, 6>,
    /// The true poses, world from body.
    pub truth: Vec<Pose>,
    /// Indices of the wrong edges.
    pub wrong: Vec<usize>,
}

/// The place on the surface at (ring, position on it), both from 0 to 1, and the path's direction.
fn place(settings: &GraphSettings, ring: f64, turn: f64) -> Vector3<f64> {
    let radius = settings.ring as f64 / TAU;
    let around = |r: f64| Vector3::new(r * (TAU * turn).cos(), r * (TAU * turn).sin(), 0.0);
    match settings.kind {
        GraphKind::Sphere => {
            // the poles themselves are left out
            let latitude = PI * (0.08 + 0.84 * ring);
            around(radius * latitude.sin()) - Vector3::z() * (radius * latitude.cos())
        }
        GraphKind::Torus => {
            let tube = settings.rings as f64 / TAU;
            let angle = TAU * ring;
            around(radius + tube * 1.5 + tube * angle.cos()) + Vector3::z() * (tube * angle.sin())
        }
        GraphKind::Grid => Vector3::new(
            turn * settings.ring as f64,
            ring * settings.rings as f64,
            0.0,
        ),
    }
}

fn truth(settings: &GraphSettings) -> Vec<Pose> {
    let count = settings.rings * settings.ring;
    let at = |k: f64| {
        let whole = k.floor() as usize;
        let row = (whole / settings.ring) as f64;
        let along = (k - row * settings.ring as f64) / settings.ring as f64;
        match settings.kind {
            GraphKind::Grid => {
                let back = row % 2.0 == 1.0;
                let last = 1.0 - 1.0 / settings.ring as f64;
                let along = if back { last - along } else { along };
                place(settings, row / settings.rings as f64, along)
            }
            _ => place(settings, k / count as f64, along),
        }
    };
    (0..count)
        .map(|k| {
            let (here, next) = (at(k as f64), at(k as f64 + 0.01));
            let forward = (next - here).normalize();
            let up = if forward.cross(&Vector3::z()).norm() > 0.1 {
                Vector3::z()
            } else {
                Vector3::x()
            };
            let right = forward.cross(&up).normalize();
            let down = forward.cross(&right);
            let axes = Matrix3::from_columns(&[right, down, forward]);
            let rotation = Rotation3::from_matrix_unchecked(axes);
            Pose::new(UnitQuaternion::from_rotation_matrix(&rotation), here)
        })
        .collect()
}

/// Generate a graph.
///
/// # Errors
/// Where a setting is outside its domain.
pub fn graph(settings: &GraphSettings) -> Result<Graph> {
    if settings.rings < 2 || settings.ring < 3 {
        let found = format!("{} x {}", settings.rings, settings.ring);
        return Err(Error::value("rings, ring", "at least 2 x 3", found));
    }
    let mut random = Random::new(settings.seed);
    let truth = truth(settings);
    let (rotation, translation) = (settings.rotation_sigma, settings.translation_sigma);
    let sigmas = Vector6::new(
        rotation,
        rotation,
        rotation,
        translation,
        translation,
        translation,
    );
    let information = Matrix6::from_diagonal(&sigmas.map(|s| 1.0 / (s * s)));
    let mut graph = PoseGraph::new();
    for pose in &truth {
        graph.add_node(*pose)?;
    }
    graph.fix_node(0)?;
    let mut measure = |graph: &mut PoseGraph<Pose, 6>, from: usize, to: usize, kind| {
        let noise = random.normal::<6>(1.0).component_mul(&sigmas);
        let measured = truth[from].inverse() * truth[to] * se3::exp(&noise);
        graph.add_edge((from, to), measured, &information, kind)
    };
    for to in 1..truth.len() {
        measure(&mut graph, to - 1, to, EdgeKind::Odometry)?;
    }
    let mut loops = 0;
    for to in settings.ring..truth.len() {
        let (row, k) = (to / settings.ring, to % settings.ring);
        let from = match settings.kind {
            // the pose beside it in the row that ran the other way
            GraphKind::Grid => row * settings.ring - 1 - k,
            _ => to - settings.ring,
        };
        if from + 1 < to {
            measure(&mut graph, from, to, EdgeKind::Loop)?;
            loops += 1;
        }
    }
    let mut wrong = Vec::new();
    for _ in 0..(settings.wrong_loops * f64::from(loops)).round() as usize {
        let (from, to) = (random.below(truth.len()), random.below(truth.len()));
        if from.abs_diff(to) > 1 {
            let measured = se3::exp(&random.normal::<6>(1.0));
            let ends = (from.min(to), from.max(to));
            wrong.push(graph.add_edge(ends, measured, &information, EdgeKind::Loop)?);
        }
    }
    graph.chain_odometry();
    Ok(Graph {
        graph,
        truth,
        wrong,
    })
}
