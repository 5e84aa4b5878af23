//! Pixels looked up in a keyframe.

use super::Known;
use super::tiles::Tiles;
use crate::filter::lattice::{Lattice, LensCall};
use crate::filter::lens::Lens;
use crate::filter::splat::{Splat, seen_again};
use crate::filter::state::{Drift, Node};
use crate::filter::step::Step;
use crate::filter::surfaces::OTHER_SURFACE;
use nalgebra::Vector3;

/// Relative deviation up to which a range is remembered.
const KNOWN: f32 = 0.1;

/// What a range is known by is what so many pixels have said together, each of which is remembered by itself.
const SHARED: f32 = 64.0;

/// The new pixels as a keyframe saw them; those that it did not see stay in `new`.
pub(super) struct Recall<'a> {
    pub lattice: &'a Lattice,
    /// To the keyframe.
    pub step: Step,
    pub known: &'a [Known],
    pub nodes: &'a mut [Node],
    pub new: &'a mut Vec<u32>,
    /// Scratch: nearest surface of the keyframe in each pixel.
    pub nearest: &'a mut [f32],
    /// Share of information that survives the time since.
    pub memory: f32,
    /// Variance of the present pose against the keyframe's.
    pub drift: Drift,
}

impl LensCall<()> for Recall<'_> {
    fn call<L: Lens>(self, lens: &L) {
        let tiles = Tiles::around(self.lattice, self.new);
        pulp::Arch::new().dispatch(Splat {
            lens,
            lattice: self.lattice,
            step: &self.step,
            old: self.known,
            nearest: self.nearest,
            together: Tiles::TOGETHER,
            asked: |place| tiles.near(place),
        });
        let look = Look {
            lens,
            lattice: self.lattice,
            step: &self.step,
            known: self.known,
        };
        let (nodes, nearest) = (self.nodes, &*self.nearest);
        self.new.retain(|at| {
            let at = *at as usize;
            let place = (at % self.lattice.width, at / self.lattice.width);
            let guess = seen_again(self.lattice, nearest, place);
            let found = look.at(at, guess).map(|[zeta, variance]| {
                let moved = zeta.powi(4) * self.drift.translation;
                [zeta, variance / self.memory + moved]
            });
            let known = found.filter(|[zeta, variance]| *variance < (KNOWN * zeta).powi(2));
            if let Some([zeta, variance]) = known {
                nodes[at] = [zeta, 0.0, 1.0 / (SHARED * variance), variance];
            }
            known.is_none()
        });
    }
}

/// Looks single pixels up in a keyframe.
struct Look<'a, L: Lens> {
    lens: &'a L,
    lattice: &'a Lattice,
    step: &'a Step,
    known: &'a [Known],
}

impl<L: Lens> Look<'_, L> {
    /// Zeta and variance at a pixel to which a surface of about this zeta moved; `None` where the keyframe shows
    /// another one, or no surface moved there.
    fn at(&self, at: usize, guess: f32) -> Option<Known> {
        /// Of places in the keyframe, and of what is there: what moved to the pixel says nearly where.
        const ROUNDS: usize = 2;
        let (mut zeta, mut variance) = (guess, 0.0);
        for _ in 0..ROUNDS {
            if zeta <= 0.0 {
                return None;
            }
            let there = self.step.there(&self.lattice.ray[at], zeta);
            let gauge = self.lens.gauge(&there);
            let seen = zeta / gauge;
            let found = self.around(self.lens.project(&there), seen)?;
            let back = self.step.rotation.transpose();
            let moved: Vector3<f32> = back * (there / gauge - self.step.translation * found[0]);
            let per_size = 1.0 / self.lens.gauge(&moved);
            zeta = found[0] * per_size;
            // Near the derivative of the new zeta by the old one, for turns of less than a right angle.
            variance = found[1] * per_size.powi(4);
        }
        (zeta > 0.0 && variance.is_finite()).then_some([zeta, variance])
    }

    /// The mix of the pixels around a place that are of the surface of `seen`.
    fn around(&self, place: [f32; 2], seen: f32) -> Option<Known> {
        let (four, s, t) = self.lattice.around(place)?;
        let shares = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
        let off = |i: usize| (self.known[i][0] - seen).abs();
        let closest = four
            .into_iter()
            .min_by(|a, b| off(*a).total_cmp(&off(*b)))?;
        let middle = self.known[closest][0];
        if off(closest) > OTHER_SURFACE * seen {
            return None;
        }
        let (mut sum, mut total) = (self.known[closest].map(|v| 1e-3 * v), 1e-3);
        for (i, share) in four.into_iter().zip(shares) {
            if (self.known[i][0] - middle).abs() < self.lattice.same_surface * middle {
                sum = std::array::from_fn(|k| sum[k] + share * self.known[i][k]);
                total += share;
            }
        }
        Some(sum.map(|v| v / total))
    }
}
