//! The state carried from one camera pose to the next.

use super::carry::{Block, Carry};
use super::lattice::{Lattice, LensCall, TOGETHER};
use super::lens::Lens;
use super::splat::Splat;
use super::state::Node;
use super::step::Step;
use rayon::prelude::*;

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
                together: TOGETHER,
                asked: |_| true,
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
