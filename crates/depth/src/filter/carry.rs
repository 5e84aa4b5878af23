//! Where the pixels of a block were in the frame before, and what they take along from there.

use super::lattice::{Around, Lattice, TOGETHER, mix};
use super::lens::Lens;
use super::splat::{Moved, surface};
use super::state::{INFLOW, Node, STRETCHED, fresh, known};
use super::step::Step;
use super::surfaces::OTHER_SURFACE;
use nalgebra::{Matrix3, Vector3};

/// What all pixels share.
pub(super) struct Carry<'a> {
    pub lattice: &'a Lattice,
    pub step: Step,
    /// The rotation back.
    pub back: Matrix3<f32>,
    pub old: &'a [Node],
    /// Share of information that survives.
    pub memory: f32,
}

/// A block of pixels of a row: guesses, places in the frame before, what was there.
pub(super) struct Block {
    guess: [f32; TOGETHER],
    kept: [f32; TOGETHER],
    /// The node of pixels that have none from before.
    set: [Option<Node>; TOGETHER],
    zeta: [f32; TOGETHER],
    there: [[f32; TOGETHER]; 3],
    gauge: [f32; TOGETHER],
    place: [[f32; TOGETHER]; 2],
    around: Around<TOGETHER>,
    node: [Node; TOGETHER],
    inside: [bool; TOGETHER],
    /// Derivative of the new zeta by the old one, along a ray; NaN where there is none.
    slope: [f32; TOGETHER],
}

impl Block {
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            guess: [1.0; TOGETHER],
            kept: [0.0; TOGETHER],
            set: [None; TOGETHER],
            zeta: [1.0; TOGETHER],
            there: [[0.0; TOGETHER]; 3],
            gauge: [1.0; TOGETHER],
            place: [[0.0; TOGETHER]; 2],
            around: Around::new(),
            node: [[0.0; 4]; TOGETHER],
            inside: [true; TOGETHER],
            slope: [1.0; TOGETHER],
        }
    }

    /// Starts the pixels of a block, the first of which is `(x, y)` of the image.
    #[inline(always)]
    pub fn begin(
        &mut self,
        carry: &Carry<'_>,
        nearest: Option<&[f32]>,
        (x, y): (usize, usize),
        count: usize,
    ) {
        let first = y * carry.lattice.width + x;
        let rays = &carry.lattice.ray[first..][..count];
        // Most blocks have been seen wholly, and every pixel of them.
        if let Some(nearest) = nearest {
            let nearest = &nearest[first..][..count];
            let again = nearest.iter().fold(true, |all, zeta| all & (*zeta > 0.0));
            if rays.iter().fold(again, |all, ray| all & !ray.x.is_nan()) {
                self.guess[..count].copy_from_slice(nearest);
                self.zeta[..count].copy_from_slice(nearest);
                self.kept[..count].fill(carry.memory);
                self.set[..count].fill(None);
                return;
            }
        }
        for i in 0..count {
            self.guess(carry, nearest, (x + i, y), i);
        }
    }

    /// Starts pixel `i` of the block, which is `(x, y)` of the image.
    fn guess(
        &mut self,
        carry: &Carry<'_>,
        nearest: Option<&[f32]>,
        (x, y): (usize, usize),
        i: usize,
    ) {
        let here = y * carry.lattice.width + x;
        self.set[i] = None;
        if carry.lattice.ray[here].x.is_nan() {
            self.set[i] = Some([f32::NAN, 0.0, 0.0, f32::NAN]);
            return;
        }
        let mut guess = known(carry.old[here][0]);
        let mut kept = carry.memory;
        match nearest.map(|nearest| surface(carry.lattice, nearest, x, y)) {
            None => {}
            Some(Moved::Again(zeta)) => guess = zeta,
            Some(Moved::Between(zeta)) => {
                guess = zeta;
                kept *= STRETCHED;
            }
            Some(Moved::First(zeta, weak)) => {
                self.set[i] = Some(fresh(if zeta > 0.0 { zeta } else { guess }, weak));
            }
        }
        (self.guess[i], self.zeta[i], self.kept[i]) = (guess, guess, kept);
    }

    /// Places of the pixels in the frame before, by their present zeta.
    #[inline(always)]
    pub fn place<L: Lens>(&mut self, lens: &L, carry: &Carry<'_>, first: usize, count: usize) {
        let rays = &carry.lattice.ray[first..first + count];
        for (i, ray) in rays.iter().enumerate() {
            let there = carry.step.rotation * ray + carry.step.translation * self.zeta[i];
            let place = lens.project(&there);
            for k in 0..3 {
                self.there[k][i] = there[k];
            }
            (self.place[0][i], self.place[1][i]) = (place[0], place[1]);
            self.gauge[i] = lens.gauge(&there);
        }
    }

    /// The old nodes there; of pixels beyond the border, those at it. On an edge, the pixels of the other surface
    /// are left out.
    #[inline(always)]
    pub fn read(&mut self, carry: &Carry<'_>, round: usize, count: usize) {
        let lattice = carry.lattice;
        if lattice.wraps {
            for i in 0..count {
                self.inside[i] = !self.place[0][i].is_nan();
            }
        } else {
            let (right, bottom) = ((lattice.width - 1) as f32, (lattice.height - 1) as f32);
            for i in 0..count {
                let (x, y) = (self.place[0][i], self.place[1][i]);
                let (in_x, in_y) = (x.clamp(0.0, right), y.clamp(0.0, bottom));
                self.inside[i] = (x == in_x) & (y == in_y);
                (self.place[0][i], self.place[1][i]) = (in_x, in_y);
            }
        }
        lattice.around_each(&self.place, &mut self.around);
        for i in 0..count {
            let (s, t) = (self.around.across[i], self.around.down[i]);
            let four = self.around.four(lattice.width, i);
            let seen = self.zeta[i] / self.gauge[i];
            let [a, b, c, d] = four.map(|i| carry.old[i][0]);
            let range = a.max(b).max(c.max(d)) - a.min(b).min(c.min(d));
            // What is mixed across an edge frame by frame would wash it out.
            let same = range < lattice.same_surface * seen;
            self.node[i] = if same || round == 0 || s.is_nan() {
                mix(carry.old, four, s, t)
            } else {
                nearest_of(carry.old, four, (s, t), (seen, lattice.same_surface))
            };
        }
    }

    /// Pixels that would have been on another surface were hidden behind it: they start anew.
    #[inline(always)]
    pub fn reveal(&mut self, count: usize) {
        for i in 0..count {
            let seen = self.zeta[i] / self.gauge[i];
            let other = (self.node[i][0] - seen).abs() > OTHER_SURFACE * seen;
            if other && self.set[i].is_none() {
                self.set[i] = Some(fresh(self.guess[i], false));
            }
        }
    }

    /// The zeta that the old nodes have in the new frame. Impossible ones become NaN, and stay.
    #[inline(always)]
    pub fn carry<L: Lens>(&mut self, lens: &L, carry: &Carry<'_>, count: usize) {
        for i in 0..count {
            let per_gauge = 1.0 / self.gauge[i];
            let own = Vector3::from_fn(|k, _| self.there[k][i]) * per_gauge;
            let turned = carry.back * own;
            let moved = carry.back * (own - carry.step.translation * self.node[i][0]);
            let per_size = 1.0 / lens.gauge(&moved);
            let possible = self.node[i][0] > 0.0 && per_size > 0.0;
            self.zeta[i] = if possible {
                self.node[i][0] * per_size
            } else {
                f32::NAN
            };
            // Near (gauge of the ray) / size^2.
            let gauge = lens.gauge(&turned);
            let gauge = if gauge > 0.1 { gauge } else { 0.1 };
            self.slope[i] = gauge * per_size * per_size;
        }
    }

    #[inline(always)]
    pub fn write(&self, out: &mut [Node]) {
        for (i, out) in out.iter_mut().enumerate() {
            let [_, q, s, variance] = self.node[i];
            let slope = self.slope[i];
            let keep = self.kept[i] * if self.inside[i] { 1.0 } else { INFLOW };
            let per_slope = 1.0 / slope;
            let found = [
                self.zeta[i],
                q * keep * per_slope,
                s * keep * per_slope * per_slope,
                variance * slope * slope,
            ];
            let known = self.zeta[i] > 0.0;
            let node = if known {
                found
            } else {
                [self.guess[i], 0.0, 0.0, 1.0]
            };
            *out = self.set[i].unwrap_or(node);
        }
    }
}

/// The mix of those of four pixels whose surface is the one of `seen`; the closest, where none is.
#[inline(never)]
fn nearest_of(
    old: &[Node],
    four: [usize; 4],
    (s, t): (f32, f32),
    (seen, same): (f32, f32),
) -> Node {
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
        if (old[place][0] - centre).abs() < same * centre {
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
