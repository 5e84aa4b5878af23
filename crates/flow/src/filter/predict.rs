//! The state carried from one camera pose to the next.

use super::lattice::{Lattice, LensCall, mix};
use super::lens::Lens;
use super::state::Node;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// The motion: `x_old = rotation x_new + translation`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub rotation: Matrix3<f32>,
    pub translation: Vector3<f32>,
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
const INFLOW: f32 = 0.01;

/// Share of information left where a surface is stretched: part of it may be another, just uncovered.
const STRETCHED: f32 = 0.25;

/// Surfaces whose zeta differs by less than this share are one.
const SAME_SURFACE: f32 = 0.08;

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
        if occlusion {
            splat(lens, lattice, &step, old, nearest);
        }
        let (width, back) = (lattice.width, step.rotation.transpose());
        let nearest = &*nearest;
        new.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let here = y * width + x;
                let ray = &lattice.ray[here];
                if ray.x.is_nan() {
                    *out = [f32::NAN, 0.0, 0.0, f32::NAN];
                    continue;
                }
                let mut guess = known(old[here][0]);
                let mut kept = memory;
                if occlusion {
                    match surface(lattice, nearest, x, y) {
                        Seen::Again(zeta) => guess = zeta,
                        Seen::Between(zeta) => {
                            guess = zeta;
                            kept *= STRETCHED;
                        }
                        Seen::First(zeta, weak) => {
                            *out = fresh(if zeta > 0.0 { zeta } else { guess }, weak);
                            continue;
                        }
                    }
                }
                let turned = step.rotation * ray;
                *out = origin(lens, lattice, &step, &back, &turned, old, guess, kept);
            }
        });
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
enum Seen {
    Again(f32),
    /// Its neighbours on both sides, but not itself.
    Between(f32),
    First(f32, bool),
}

/// How far the first sight of a pixel looks for neighbours, pixels.
const LOOK: usize = 12;

/// What moved to pixel `(x, y)`: itself, or a crack between two that did. What comes out from behind
/// something is taken to lie as far as the farther of its neighbours in the row.
fn surface(lattice: &Lattice, nearest: &[f32], x: usize, y: usize) -> Seen {
    let (width, height) = (lattice.width, lattice.height);
    let here = y * width + x;
    if nearest[here] > 0.0 {
        return Seen::Again(nearest[here]);
    }
    if x > 0 && x + 1 < width && nearest[here - 1] > 0.0 && nearest[here + 1] > 0.0 {
        return Seen::Between(nearest[here - 1].min(nearest[here + 1]));
    }
    if y > 0 && y + 1 < height && nearest[here - width] > 0.0 && nearest[here + width] > 0.0 {
        return Seen::Between(nearest[here - width].min(nearest[here + width]));
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
    Seen::First(if farther.is_finite() { farther } else { 0.0 }, weak)
}

fn known(zeta: f32) -> f32 {
    if zeta > 0.0 { zeta } else { 1e-3 }
}

/// Every old pixel at its new place; where several meet, the nearest surface stays.
fn splat<L: Lens>(lens: &L, lattice: &Lattice, step: &Step, old: &[Node], nearest: &mut [f32]) {
    nearest.fill(0.0);
    let back = step.rotation.transpose();
    for (ray, node) in lattice.ray.iter().zip(old) {
        let moved = back * (ray - step.translation * node[0]);
        let zeta = node[0] / lens.gauge(&moved);
        let ahead = zeta > 0.0;
        if !ahead {
            continue;
        }
        let Some((four, s, t)) = lattice.around(lens.project(&moved)) else {
            continue;
        };
        // To the nearest pixel only: a share in all four would widen what is near, frame by frame.
        let place = four[usize::from(s > 0.5) + 2 * usize::from(t > 0.5)];
        nearest[place] = nearest[place].max(zeta);
    }
}

/// Looks up where the pixel was: a fixed point, for its own zeta says where.
#[allow(clippy::too_many_arguments)] // one call, in the innermost loop
#[inline(always)]
fn origin<L: Lens>(
    lens: &L,
    lattice: &Lattice,
    step: &Step,
    back: &Matrix3<f32>,
    turned: &Vector3<f32>,
    old: &[Node],
    guess: f32,
    memory: f32,
) -> Node {
    let mut zeta = guess;
    let mut node = [guess, 0.0, 0.0, 1.0];
    let mut slope = 1.0;
    let mut inside = true;
    for round in 0..3 {
        let there = turned + step.translation * zeta;
        let place = lens.project(&there);
        let found = lattice.around(place);
        inside = found.is_some();
        let (four, s, t) = match found {
            Some(found) => found,
            None => match lattice.around(clamped(lattice, place)) {
                Some(found) => found,
                None => return [guess, 0.0, 0.0, 1.0],
            },
        };
        let gauge = lens.gauge(&there);
        node = mix(old, four, s, t);
        let seen = zeta / gauge;
        let same = (node[0] - seen).abs() < SAME_SURFACE * seen;
        if !same && round > 0 {
            // On an edge, the pixels of the other surface are left out.
            node = nearest_of(old, four, s, t, seen);
        }
        let own = there / gauge;
        let moved = back * (own - step.translation * node[0]);
        let size = lens.gauge(&moved);
        let possible = node[0] > 0.0 && size > 0.0;
        if !possible {
            return [guess, 0.0, 0.0, 1.0];
        }
        zeta = node[0] / size;
        // Derivative of the new zeta by the old one, along a ray: near (gauge of the ray) / size^2.
        slope = lens.gauge(&(back * own)).max(0.1) / (size * size);
    }
    let keep = if inside { memory } else { memory * INFLOW };
    [
        zeta,
        node[1] * keep / slope,
        node[2] * keep / (slope * slope),
        node[3] * slope * slope,
    ]
}

/// The mix of those of four pixels whose surface is the one of `seen`; the closest, where none is.
fn nearest_of(old: &[Node], four: [usize; 4], s: f32, t: f32, seen: f32) -> Node {
    let shares = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
    let distance = |i: usize| (old[i][0] - seen).abs();
    let mut best = four[0];
    for place in four {
        if distance(place) < distance(best) {
            best = place;
        }
    }
    let centre = old[best][0];
    let (mut sum, mut total) = ([0.0_f32; 4], 0.0_f32);
    for (place, share) in four.into_iter().zip(shares) {
        if (old[place][0] - centre).abs() < SAME_SURFACE * centre {
            for (sum, value) in sum.iter_mut().zip(old[place]) {
                *sum += share * value;
            }
            total += share;
        }
    }
    if total > 1e-3 {
        sum.map(|v| v / total)
    } else {
        old[best]
    }
}

fn clamped(lattice: &Lattice, [x, y]: [f32; 2]) -> [f32; 2] {
    [
        x.clamp(0.0, (lattice.width - 1) as f32),
        y.clamp(0.0, (lattice.height - 1) as f32),
    ]
}
