//! Points alone under robust losses: each to where it costs less, while the poses stay.
//!
//! A step of everything together has one damping, and the reweighted quadratic above the cost: with
//! outliers it converges linearly, because a point between pixels that contradict each other creeps
//! to its place. Alone a point has three unknowns, a damping of its own and the cost's own second
//! order, and is there in a few steps; what is left to the step of everything is smooth. (Ceres calls
//! it inner iterations.) The cost only falls, so the minimum that is found is one of the same cost.

use super::{Chunk, Scene};
use crate::bundle::kernel::inverse_symmetric;
use crate::bundle::normal::{Curvature, Normal};
use crate::minimise::damping_term;
use crate::options::Damping;
use nalgebra::{Matrix3, Vector3};

/// Steps tried for each point, taken or not.
const TRIES: usize = 10;
/// A step that lowers the point's cost by a smaller share is the last.
const ENOUGH: f64 = 1e-4;
/// The damping that a point begins with, and what it is multiplied by after a step that was refused.
const DAMPING: f64 = 1e-4;
const GROWTH: f64 = 10.0;

impl Chunk {
    /// Moves the candidates; half the sum of the losses there, `None` where a point is not seen.
    pub(super) fn refine(&mut self, scene: &Scene) -> Option<f64> {
        pulp::Arch::new().dispatch(Refine(self, scene))
    }

    /// The cost of a point's measurements where it were at `position`, and whether a loss is felt;
    /// `None` where some camera does not see it there.
    #[inline(always)]
    fn cost_of(&self, point: usize, position: &Vector3<f64>, scene: &Scene) -> Option<(f64, bool)> {
        let links = self.starts[point].link as usize..self.starts[point + 1].link as usize;
        let mut k = self.starts[point].observation as usize;
        let (mut cost, mut felt) = (0.0, false);
        for link in &self.links[links] {
            let x = scene.poses[link.view as usize].transform(position);
            let camera = scene.camera(link);
            while k < link.observations as usize {
                let measurement = &self.observations[k];
                let squared = measurement.squared(camera, &x)?;
                let (rho, weight) = measurement.loss(scene.losses).evaluate(squared);
                cost += rho;
                felt |= weight < 1.0;
                k += 1;
            }
        }
        Some((0.5 * cost, felt))
    }

    /// Normal matrix and gradient of a point at `position`, the poses known.
    #[inline(always)]
    fn normal_of(
        &self,
        point: usize,
        position: &Vector3<f64>,
        scene: &Scene,
        normal: &mut Normal,
    ) -> (Matrix3<f64>, Vector3<f64>) {
        let (mut v, mut g) = (Matrix3::zeros(), Vector3::zeros());
        let links = self.starts[point].link as usize..self.starts[point + 1].link as usize;
        let mut k = self.starts[point].observation as usize;
        for link in &self.links[links] {
            let pose = &scene.poses[link.view as usize];
            let x = pose.transform(position);
            let camera = scene.camera(link);
            normal.clear(0);
            while k < link.observations as usize {
                self.observations[k].add(camera, &x, scene.losses, Curvature::Own, normal);
                k += 1;
            }
            v += pose.rotation.tr_mul(&(normal.m * pose.rotation));
            g += pose.rotation.tr_mul(&normal.g);
        }
        (v, g)
    }

    #[inline(always)]
    fn refine_point(&mut self, point: usize, scene: &Scene, normal: &mut Normal) -> Option<f64> {
        let mut position = self.candidate[point];
        let mut cost = match self.cost_of(point, &position, scene) {
            Some((cost, felt)) if !felt || !self.free[point] => return Some(cost),
            Some((cost, _)) => cost,
            None => {
                // it went behind a camera: from where it was
                position = self.current[point];
                self.cost_of(point, &position, scene)?.0
            }
        };
        let mut damping = DAMPING;
        let mut known = None;
        for _ in 0..TRIES {
            let (v, g) = match known {
                Some(known) => known,
                None => self.normal_of(point, &position, scene, normal),
            };
            let next = moved(&position, &v, &g, damping);
            let found = next.and_then(|next| Some((next, self.cost_of(point, &next, scene)?.0)));
            match found.filter(|(_, lower)| *lower < cost) {
                Some((next, lower)) => {
                    let last = cost - lower < ENOUGH * cost;
                    (position, cost, known) = (next, lower, None);
                    damping /= GROWTH;
                    if last {
                        break;
                    }
                }
                None => {
                    known = Some((v, g));
                    damping *= GROWTH;
                }
            }
        }
        self.candidate[point] = position;
        Some(cost)
    }
}

/// A damped step; `None` where the matrix is not positive definite.
#[inline(always)]
fn moved(
    position: &Vector3<f64>,
    v: &Matrix3<f64>,
    g: &Vector3<f64>,
    damping: f64,
) -> Option<Vector3<f64>> {
    let on = |entry: f64| entry + damping_term(Damping::Marquardt, damping, entry);
    let damped = [on(v.m11), v.m12, v.m13, on(v.m22), v.m23, on(v.m33)];
    let [xx, xy, xz, yy, yz, zz] = inverse_symmetric(&damped)?;
    Some(Vector3::new(
        position.x - (xx * g.x + xy * g.y + xz * g.z),
        position.y - (xy * g.x + yy * g.y + yz * g.z),
        position.z - (xz * g.x + yz * g.y + zz * g.z),
    ))
}

struct Refine<'a>(&'a mut Chunk, &'a Scene<'a>);

impl pulp::WithSimd for Refine<'_> {
    type Output = Option<f64>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Option<f64> {
        let Self(chunk, scene) = self;
        let (mut normal, mut cost) = (Normal::new(), 0.0);
        for point in 0..chunk.points.len() {
            cost += chunk.refine_point(point, scene, &mut normal)?;
        }
        Some(cost)
    }
}
