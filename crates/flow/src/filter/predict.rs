//! The state carried from one camera pose to the next.

use super::carry::{Block, Carry, TOGETHER};
use super::keyframes::Tiles;
use super::lattice::{Around, Lattice, LensCall};
use super::lens::Lens;
use super::state::Node;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use sphereflow_core::Pose;

/// The motion: `x_old = rotation x_new + translation`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub rotation: Matrix3<f32>,
    pub translation: Vector3<f32>,
}

impl Step {
    /// A point of the new camera's ray, over its range, in the old camera.
    #[inline(always)]
    pub fn there(&self, ray: &Vector3<f32>, zeta: f32) -> Vector3<f32> {
        self.rotation * ray + self.translation * zeta
    }
}

/// `old_from_new` of two poses in the world.
pub(super) fn relative(new: &Pose, old: &Pose) -> Step {
    let old_from_new = old.inverse() * *new;
    Step {
        rotation: old_from_new.rotation.to_rotation_matrix().matrix().cast(),
        translation: old_from_new.translation.cast(),
    }
}

/// Carries `old` to the new pose.
pub(super) struct Predict<'a> {
    pub lattice: &'a Lattice,
    pub step: Step,
    pub old: &'a [Node],
    pub new: &'a mut [Node],
    /// Scratch: nearest surface seen in each pixel.
    pub nearest: &'a mut [f32],
    /// Share of information that survives.
    pub memory: f32,
    /// Whether nearer surfaces hide others.
    pub occlusion: bool,
}

/// Information left to a pixel that comes into view.
pub(super) const INFLOW: f32 = 0.01;

/// Share of information left where a surface is stretched: part of it may be another, just uncovered.
pub(super) const STRETCHED: f32 = 0.25;

impl LensCall<()> for Predict<'_> {
    fn call<L: Lens>(self, lens: &L) {
        let Self {
            lattice,
            step,
            old,
            new,
            nearest,
            memory,
            occlusion,
        } = self;
        let (width, arch) = (lattice.width, pulp::Arch::new());
        if occlusion {
            arch.dispatch(Splat {
                lens,
                lattice,
                step: &step,
                old,
                nearest,
                only: None,
            });
        }
        let back = step.rotation.transpose();
        let nearest = &*nearest;
        new.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            arch.dispatch(PredictRow {
                lens,
                carry: Carry {
                    lattice,
                    step,
                    back,
                    old,
                    memory,
                },
                nearest: occlusion.then_some(nearest),
                y,
                row,
            });
        });
    }
}

/// One row, compiled for wide vectors.
struct PredictRow<'a, L: Lens> {
    lens: &'a L,
    carry: Carry<'a>,
    /// Nearest surfaces, where they hide others.
    nearest: Option<&'a [f32]>,
    y: usize,
    row: &'a mut [Node],
}

impl<L: Lens> pulp::WithSimd for PredictRow<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let (mut x, mut block) = (0, Block::new());
        for out in self.row.chunks_mut(TOGETHER) {
            block.begin(&self.carry, self.nearest, (x, self.y), out.len());
            // What moved to a pixel says nearly where it was; the pixel itself less so.
            let rounds = if self.nearest.is_some() { 2 } else { 3 };
            let first = self.y * self.carry.lattice.width + x;
            for round in 0..rounds {
                block.place(self.lens, &self.carry, first, out.len());
                block.read(&self.carry, round, out.len());
                if round + 1 == rounds && self.nearest.is_some() {
                    block.reveal(out.len());
                }
                block.carry(self.lens, &self.carry, out.len());
            }
            block.write(out);
            x += out.len();
        }
    }
}

/// A pixel that has just come into view, with the zeta of its neighbours as a first guess. At the
/// image's border (`weak`) the planes know better.
pub(super) fn fresh(zeta: f32, weak: bool) -> Node {
    /// Relative deviation of such a guess.
    const DEVIATION: f32 = 0.25;
    let variance = (DEVIATION * zeta).powi(2);
    let information = if weak { INFLOW } else { 1.0 } / variance;
    [zeta, 0.0, information, variance]
}

/// Whether anything of the old frame moved to a pixel.
pub(super) enum Moved {
    Again(f32),
    /// Its neighbours on both sides, but not itself.
    Between(f32),
    First(f32, bool),
}

/// How far the first sight of a pixel looks for neighbours, pixels.
const LOOK: usize = 12;

/// What moved to pixel `(x, y)`: itself, or a crack between two that did. What comes out from behind
/// something is taken to lie as far as the farther of its neighbours in the row.
pub(super) fn surface(lattice: &Lattice, nearest: &[f32], x: usize, y: usize) -> Moved {
    let (width, height) = (lattice.width, lattice.height);
    let here = y * width + x;
    if nearest[here] > 0.0 {
        return Moved::Again(nearest[here]);
    }
    if x > 0 && x + 1 < width && nearest[here - 1] > 0.0 && nearest[here + 1] > 0.0 {
        return Moved::Between(nearest[here - 1].min(nearest[here + 1]));
    }
    if y > 0 && y + 1 < height && nearest[here - width] > 0.0 && nearest[here + width] > 0.0 {
        return Moved::Between(nearest[here - width].min(nearest[here + width]));
    }
    let row = &nearest[y * width..(y + 1) * width];
    let left = row[x.saturating_sub(LOOK)..x]
        .iter()
        .rev()
        .find(|z| **z > 0.0);
    let right = row[x..(x + LOOK).min(width)].iter().find(|z| **z > 0.0);
    let weak = left.is_none() || right.is_none();
    let sides = [left, right].into_iter().flatten().copied();
    let farther = sides.fold(f32::INFINITY, f32::min);
    Moved::First(if farther.is_finite() { farther } else { 0.0 }, weak)
}

/// Zeta of what moved to a pixel or to both sides of it; 0 where nothing did.
pub(super) fn seen_again(lattice: &Lattice, nearest: &[f32], (x, y): (usize, usize)) -> f32 {
    match surface(lattice, nearest, x, y) {
        Moved::Again(zeta) | Moved::Between(zeta) => zeta,
        Moved::First(..) => 0.0,
    }
}

pub(super) fn known(zeta: f32) -> f32 {
    if zeta > 0.0 { zeta } else { 1e-3 }
}

/// Every old pixel at its new place; where several meet, the nearest surface stays.
pub(super) struct Splat<'a, L: Lens, const N: usize> {
    pub lens: &'a L,
    pub lattice: &'a Lattice,
    pub step: &'a Step,
    /// Zeta, and whatever else.
    pub old: &'a [[f32; N]],
    pub nearest: &'a mut [f32],
    /// Where surfaces are asked for; everywhere where there is none.
    pub only: Option<&'a Tiles>,
}

impl<L: Lens, const N: usize> pulp::WithSimd for Splat<'_, L, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let (lattice, step) = (self.lattice, self.step);
        self.nearest.fill(0.0);
        let back = step.rotation.transpose();
        let width = lattice.width;
        let together = if self.only.is_some() {
            Tiles::TOGETHER
        } else {
            TOGETHER
        };
        let (mut place, mut zeta) = ([[0.0_f32; TOGETHER]; 2], [0.0_f32; TOGETHER]);
        let (mut around, mut first) = (Around::new(), 0);
        while first < self.old.len() {
            // Not beyond the end of a row.
            let count = together.min(width - first % width);
            let (rays, nodes) = (&lattice.ray[first..][..count], &self.old[first..][..count]);
            first += count;
            if let Some(only) = self.only {
                let middle = count / 2;
                let moved = back * (rays[middle] - step.translation * nodes[middle][0]);
                if !only.near(self.lens.project(&moved)) {
                    continue;
                }
            }
            for (i, (ray, node)) in rays.iter().zip(nodes).enumerate() {
                let moved = back * (ray - step.translation * node[0]);
                zeta[i] = node[0] / self.lens.gauge(&moved);
                [place[0][i], place[1][i]] = self.lens.project(&moved);
            }
            lattice.around_each(&place, &mut around);
            for (i, zeta) in zeta[..count].iter().enumerate() {
                let seen = (*zeta > 0.0) & !around.across[i].is_nan();
                if !seen {
                    continue;
                }
                // To the nearest pixel only: a share in all four would widen what is near, frame by frame.
                let to = around.nearest[i] as usize;
                let nearest = self.nearest[to];
                self.nearest[to] = if *zeta > nearest { *zeta } else { nearest };
            }
        }
    }
}
