//! Which primitives a bundle of neighbouring rays can meet: most rays then test two or three.

use crate::scene::{Crossing, Scene, Shape};
use nalgebra::{Rotation3, Vector3};

/// Rounding of a cosine: a ray that grazes a bounding ball is not left out.
const GRAZING: f64 = 1e-12;

/// A cone around a bundle of rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cone {
    axis: Vector3<f64>,
    half_angle_rad: f64,
    cos: f64,
    sin: f64,
}

impl Cone {
    /// Around unit rays; NaN rays are left out, and without any ray the cone is the whole sphere.
    pub(super) fn around(rays: &[Vector3<f64>]) -> Self {
        let known = || rays.iter().filter(|ray| ray.x.is_finite());
        let mean: Vector3<f64> = known().sum();
        let Some(axis) = mean.try_normalize(1e-6) else {
            return Self::new(Vector3::z(), std::f64::consts::PI);
        };
        let widest = known().map(|ray| ray.angle(&axis)).fold(0.0, f64::max);
        Self::new(axis, widest + 1e-9)
    }

    fn new(axis: Vector3<f64>, half_angle_rad: f64) -> Self {
        let (sin, cos) = half_angle_rad.sin_cos();
        Self {
            axis,
            half_angle_rad,
            cos,
            sin,
        }
    }
}

/// The primitives ahead of one origin, and those that a cone can meet.
pub(super) struct Candidates<'a> {
    scene: &'a Scene,
    /// The bounded primitives, nearest first.
    balls: Vec<Ball<'a>>,
    /// What surrounds the camera: always a candidate, and the last to be tried.
    around: Vec<(usize, &'a Shape)>,
    chosen: Vec<Ball<'a>>,
}

#[derive(Clone, Copy)]
struct Ball<'a> {
    primitive: usize,
    shape: &'a Shape,
    /// The rays from the origin to its bounding ball, world frame.
    bundle: Cone,
    nearest_m: f64,
}

impl<'a> Candidates<'a> {
    /// For rays from `origin`, world frame.
    pub(super) fn new(scene: &'a Scene, origin: &Vector3<f64>) -> Self {
        let (mut balls, mut around) = (Vec::new(), Vec::new());
        for (primitive, shape) in scene.primitives().iter().map(|p| &p.shape).enumerate() {
            let Some((centre, radius)) = shape.bounding_ball() else {
                around.push((primitive, shape));
                continue;
            };
            let towards = centre - origin;
            let distance = towards.norm();
            let bundle = if distance > radius {
                Cone::new(towards / distance, (radius / distance).asin())
            } else {
                Cone::new(Vector3::z(), std::f64::consts::PI)
            };
            balls.push(Ball {
                primitive,
                shape,
                bundle,
                nearest_m: distance - radius,
            });
        }
        balls.sort_by(|a, b| a.nearest_m.total_cmp(&b.nearest_m));
        Self {
            scene,
            chosen: Vec::with_capacity(balls.len()),
            balls,
            around,
        }
    }

    /// Keep what a cone can meet, nearest first.
    pub(super) fn choose(&mut self, cone: &Cone, world_from_camera: &Rotation3<f64>) {
        let axis = world_from_camera * cone.axis;
        self.chosen.clear();
        self.chosen.extend(self.balls.iter().filter(|ball| {
            // Overlap where the angle between the axes is at most the sum of the half angles.
            ball.bundle.half_angle_rad + cone.half_angle_rad >= std::f64::consts::PI
                || axis.dot(&ball.bundle.axis)
                    >= ball.bundle.cos * cone.cos - ball.bundle.sin * cone.sin
        }));
    }

    /// The first crossing among the chosen.
    #[inline]
    pub(super) fn nearest(&self, origin: &Vector3<f64>, unit: &Vector3<f64>) -> Option<Crossing> {
        let mut nearest: Option<Crossing> = None;
        for ball in &self.chosen {
            if nearest.is_some_and(|c| c.range_m < ball.nearest_m) {
                break;
            }
            if unit.dot(&ball.bundle.axis) < ball.bundle.cos - GRAZING {
                continue; // passes the bounding ball by: cheaper than the shape's own test
            }
            nearest = ball.shape.nearer(origin, unit, ball.primitive, nearest);
        }
        for (primitive, shape) in &self.around {
            nearest = shape.nearer(origin, unit, *primitive, nearest);
        }
        debug_assert!(nearest.is_none_or(|c| c.primitive < self.scene.primitives().len()));
        nearest
    }
}
