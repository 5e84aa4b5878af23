//! Surfaces moved to another camera: which is seen in each pixel there, and what comes into view.

use super::lattice::{Around, Lattice, TOGETHER};
use super::lens::Lens;
use super::step::Step;

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

/// Every old pixel at its new place; where several meet, the nearest surface stays.
pub(super) struct Splat<'a, L: Lens, F: Fn([f32; 2]) -> bool, const N: usize> {
    pub lens: &'a L,
    pub lattice: &'a Lattice,
    pub step: &'a Step,
    /// Zeta, and whatever else.
    pub old: &'a [[f32; N]],
    pub nearest: &'a mut [f32],
    /// Old pixels of a row, [`TOGETHER`] at most, that are moved or left out together.
    pub together: usize,
    /// Whether surfaces are asked for around a new place, that of the middle of such pixels.
    pub asked: F,
}

impl<L: Lens, F: Fn([f32; 2]) -> bool, const N: usize> pulp::WithSimd for Splat<'_, L, F, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let (lattice, step) = (self.lattice, self.step);
        self.nearest.fill(0.0);
        let back = step.rotation.transpose();
        let width = lattice.width;
        let together = self.together.min(TOGETHER);
        let (mut place, mut zeta) = ([[0.0_f32; TOGETHER]; 2], [0.0_f32; TOGETHER]);
        let (mut around, mut first) = (Around::new(), 0);
        while first < self.old.len() {
            // Not beyond the end of a row.
            let count = together.min(width - first % width);
            let (rays, nodes) = (&lattice.ray[first..][..count], &self.old[first..][..count]);
            first += count;
            let middle = count / 2;
            let moved = back * (rays[middle] - step.translation * nodes[middle][0]);
            if !(self.asked)(self.lens.project(&moved)) {
                continue;
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
