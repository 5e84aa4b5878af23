//! Which primitives a bundle of neighbouring rays can meet: most rays then test two or three.

use super::bundle::{Bundle, Cone};
use crate::scene::{Crossing, Scene, Shape};
use nalgebra::Vector3;

/// Rounding of a cosine or of metres: a ray that grazes a ball or a box is not left out.
const GRAZING: f64 = 1e-12;

/// The primitives ahead of one origin, and those that a cone can meet.
pub(super) struct Candidates<'a> {
    scene: &'a Scene,
    origin: Vector3<f64>,
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
    /// Before anything is looked at.
    pub(super) fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            origin: Vector3::repeat(f64::NAN),
            chosen: Vec::new(),
            balls: Vec::new(),
            around: Vec::new(),
        }
    }

    /// For rays from `origin`, world frame; nothing is to be done where it is the last one.
    pub(super) fn look_from(&mut self, origin: &Vector3<f64>) {
        if self.origin == *origin {
            return;
        }
        self.origin = *origin;
        self.balls.clear();
        self.around.clear();
        let shapes = self.scene.primitives().iter().map(|p| &p.shape);
        for (primitive, shape) in shapes.enumerate() {
            let Some((centre, radius)) = shape.bounding_ball() else {
                self.around.push((primitive, shape));
                continue;
            };
            let towards = centre - origin;
            let distance = towards.norm();
            let bundle = if distance > radius {
                Cone::new(towards / distance, (radius / distance).asin())
            } else {
                Cone::new(Vector3::z(), std::f64::consts::PI)
            };
            self.balls.push(Ball {
                primitive,
                shape,
                bundle,
                nearest_m: distance - radius,
            });
        }
        let nearest_first = |a: &Ball<'_>, b: &Ball<'_>| a.nearest_m.total_cmp(&b.nearest_m);
        self.balls.sort_by(nearest_first);
    }

    /// Keep what a bundle of rays can meet, nearest first.
    pub(super) fn choose(&mut self, rays: &Bundle) {
        let offsets = rays.outward.map(|normal| normal.dot(&self.origin));
        let beside = |shape: &Shape| {
            let planes = rays.outward.iter().zip(offsets);
            // Wholly on the side of a plane where no ray goes.
            planes
                .into_iter()
                .any(|(n, at)| shape.least_along(n) - at > GRAZING)
        };
        self.chosen.clear();
        let possible = self.balls.iter();
        let possible = possible.filter(|ball| ball.bundle.meets(&rays.cone) && !beside(ball.shape));
        self.chosen.extend(possible);
    }

    /// The first crossing among the chosen.
    #[inline]
    pub(super) fn nearest(&self, unit: &Vector3<f64>) -> Option<Crossing> {
        let origin = &self.origin;
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
