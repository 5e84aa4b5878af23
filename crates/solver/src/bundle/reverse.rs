//! Poses out of the normal equations instead of points, where the poses are the larger part.
//!
//! Thesis: section 8.4.2 eliminates the points. The same Schur complement taken the other way round
//! leaves a system of three unknowns for each point (and the free intrinsics), which is the smaller
//! one where many poses look at few points. No prior may tie poses then.

mod elimination;

use super::chunk::{Chunk, PointStep};
use super::ids::NONE;
use super::layout::Layout;
use crate::linear::{BlockPattern, BlockSolver, LinearSolver};
use crate::minimise::damping_term;
use crate::options::Damping;
use elimination::{Coupling, Part, Source};
use rayon::prelude::*;

/// Couplings of poses and points that are worth a part of their own.
const PART: usize = 3000;
/// Parts at most.
const MAX_PARTS: usize = 16;

/// The system of the points and the intrinsics that is left when the poses are eliminated.
pub(super) struct Reverse {
    pattern: BlockPattern,
    solver: BlockSolver,
    parts: Vec<Part>,
    reduced: Vec<f64>,
    step: Vec<f64>,
    /// For each part of the points the block of each; `NONE` where it does not move.
    point_block: Vec<Vec<u32>>,
    /// Intrinsics by point: part of the points, their numbers there, offset in the reduced matrix.
    mixed: Vec<(usize, std::ops::Range<usize>, usize)>,
    /// Blocks of poses; those of intrinsics come after them.
    poses: usize,
}

/// True where the poses are independent given the points, and their elimination leaves a system of
/// less than half as many unknowns.
pub(super) fn pays(poses: usize, points: usize, tied: bool) -> bool {
    !tied && points > 0 && 6 * poses > 2 * 3 * points
}

impl Reverse {
    /// For a layout whose points are not eliminated.
    pub fn new(layout: &Layout, choice: LinearSolver) -> Self {
        let poses = layout.view_block.iter().filter(|&&b| b != NONE).count();
        let cameras = layout.pattern.blocks() - poses;
        let mut next = 0;
        let number = |free: bool, next: &mut u32| {
            *next += u32::from(free);
            if free { *next - 1 } else { NONE }
        };
        let point_block: Vec<Vec<u32>> = (layout.chunks.iter())
            .map(|chunk| {
                let free = (0..chunk.points.len()).map(|point| chunk.is_free(point));
                free.map(|free| number(free, &mut next)).collect()
            })
            .collect();
        let points = next as usize;
        let of_block = |block: usize| (points + block - poses) as u32;
        let couplings = couplings(layout, &point_block, poses, of_block);
        let mut sizes = vec![3; points];
        sizes.extend((0..cameras).map(|camera| layout.pattern.size(poses + camera)));
        let (mut starts, mut members) = (vec![0], Vec::new());
        for of_pose in &couplings {
            members.extend(of_pose.iter().map(|coupling| coupling.block));
            starts.push(members.len());
        }
        let mut raw = Vec::new();
        for (part, chunk) in layout.chunks.iter().enumerate() {
            for (point, block) in point_block[part].iter().enumerate() {
                for (touched, numbers) in chunk.touched(point) {
                    if touched >= poses {
                        let camera = of_block(touched);
                        members.extend([*block, camera]);
                        starts.push(members.len());
                        raw.push((part, numbers, camera, *block));
                    }
                }
            }
        }
        let pattern = BlockPattern::from_groups(sizes, &starts, &members);
        let mixed = raw.into_iter().filter_map(|(part, numbers, row, column)| {
            let offset = pattern.offset(row as usize, column as usize)?;
            Some((part, numbers, offset))
        });
        Self {
            mixed: mixed.collect(),
            solver: BlockSolver::new(&pattern, choice),
            parts: split(&couplings, &pattern),
            reduced: vec![0.0; pattern.len()],
            step: vec![0.0; pattern.dimension()],
            pattern,
            point_block,
            poses,
        }
    }

    /// How the reduced system is solved.
    pub fn kind(&self) -> LinearSolver {
        self.solver.kind()
    }

    /// Solve the damped normal equations: the step of poses and intrinsics into `blocks`, that of the
    /// points into their parts. False where they are not positive definite.
    pub fn step(
        &mut self,
        layout: &mut Layout,
        (direct, gradient): (&[f64], &[f64]),
        (damping, lambda): (Damping, f64),
        blocks: &mut [f64],
    ) -> bool {
        let known = (&*layout, direct, gradient);
        self.parts
            .par_iter_mut()
            .for_each(|part| part.eliminate(known, (damping, lambda)));
        if self.parts.iter().any(|part| part.singular) {
            return false;
        }
        self.assemble(layout, (direct, gradient), (damping, lambda));
        let (pattern, reduced, step) = (&self.pattern, &self.reduced, &mut self.step);
        if !(self.solver.factor(pattern, reduced) && self.solver.solve(pattern, reduced, step)) {
            return false;
        }
        let step = &self.step;
        let known = (&*layout, direct, gradient);
        self.parts
            .par_iter_mut()
            .for_each(|part| part.substitute(known, pattern, step));
        for part in &self.parts {
            blocks[6 * part.first..6 * part.first + part.steps.len()].copy_from_slice(&part.steps);
        }
        let points = self.pattern.dimension() - (blocks.len() - 6 * self.poses);
        blocks[6 * self.poses..].copy_from_slice(&step[points..]);
        for (chunk, of_chunk) in layout.chunks.iter_mut().zip(&self.point_block) {
            let start = |point: usize| match of_chunk[point] {
                NONE => None,
                block => Some(pattern.start(block as usize)),
            };
            move_points(chunk, (damping, lambda), |point| {
                let start = start(point)?;
                Some([step[start], step[start + 1], step[start + 2]])
            });
        }
        true
    }

    /// The sum of the parts, the points' own blocks, the intrinsics' and the damping.
    fn assemble(
        &mut self,
        layout: &Layout,
        (direct, gradient): (&[f64], &[f64]),
        (damping, lambda): (Damping, f64),
    ) {
        self.reduced.fill(0.0);
        self.step.fill(0.0);
        for part in &self.parts {
            add(&mut self.reduced, &part.reduced);
            add(&mut self.step, &part.rhs);
        }
        for (chunk, blocks) in layout.chunks.iter().zip(&self.point_block) {
            for (point, &block) in blocks.iter().enumerate() {
                if block == NONE {
                    continue;
                }
                let (v, g) = chunk.point_normal(point);
                let offset = self.pattern.diagonal(block as usize);
                let start = self.pattern.start(block as usize);
                let full = [v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5]];
                add(&mut self.reduced[offset..offset + 9], &full);
                for (axis, k) in [0, 3, 5].into_iter().enumerate() {
                    self.reduced[offset + 4 * axis] += damping_term(damping, lambda, v[k]);
                    self.step[start + axis] -= g[axis];
                }
            }
        }
        for (part, numbers, offset) in &self.mixed {
            let w = layout.chunks[*part].numbers(numbers);
            add(&mut self.reduced[*offset..offset + w.len()], w);
        }
        let points = self.pattern.blocks() - (layout.pattern.blocks() - self.poses);
        for block in self.poses..layout.pattern.blocks() {
            let (size, from) = (layout.pattern.size(block), layout.direct.diagonal[block]);
            let at = points + block - self.poses;
            let (to, start) = (self.pattern.diagonal(at), self.pattern.start(at));
            add(
                &mut self.reduced[to..to + size * size],
                &direct[from..from + size * size],
            );
            for k in 0..size {
                let entry = direct[from + k * (size + 1)];
                self.reduced[to + k * (size + 1)] += damping_term(damping, lambda, entry);
                self.step[start + k] -= gradient[layout.pattern.start(block) + k];
            }
        }
    }
}

/// For each pose block what it shares with points and intrinsics, by ascending reduced block.
fn couplings(
    layout: &Layout,
    point_block: &[Vec<u32>],
    poses: usize,
    of_block: impl Fn(usize) -> u32,
) -> Vec<Vec<Coupling>> {
    let mut all: Vec<Vec<Coupling>> = vec![Vec::new(); poses];
    for (part, chunk) in layout.chunks.iter().enumerate() {
        for (point, &block) in point_block[part].iter().enumerate() {
            for (touched, numbers) in chunk.touched(point) {
                if touched < poses {
                    let source = Source::Chunk(part, numbers.start);
                    all[touched].push(Coupling::new(block, 3, source));
                }
            }
        }
    }
    for (view, &block) in layout.view_block.iter().enumerate() {
        let cross = layout.direct.cross[view];
        if block != NONE && cross != NONE {
            let camera = layout.camera_of_view[view] as usize;
            let size = layout.pattern.size(camera);
            let source = Source::Direct(cross as usize);
            all[block as usize].push(Coupling::new(of_block(camera), size, source));
        }
    }
    all
}

/// Consecutive poses by parts of about the same work; their number depends on the problem only.
fn split(couplings: &[Vec<Coupling>], pattern: &BlockPattern) -> Vec<Part> {
    let total: usize = couplings.iter().map(Vec::len).sum();
    let parts = total.div_ceil(PART).clamp(1, MAX_PARTS);
    let (mut all, mut first, mut before) = (Vec::new(), 0, 0);
    for part in 1..=parts {
        let (mut end, mut count) = (first, before);
        while end < couplings.len() && (part == parts || count < part * total / parts) {
            count += couplings[end].len();
            end += 1;
        }
        all.push(Part::new(first, &couplings[first..end], pattern));
        (first, before) = (end, count);
    }
    all
}

/// Candidates of the points, and what their steps promise.
fn move_points(
    chunk: &mut Chunk,
    (damping, lambda): (Damping, f64),
    step: impl Fn(usize) -> Option<[f64; 3]>,
) {
    let mut sum = PointStep::default();
    for point in 0..chunk.points.len() {
        let position = chunk.current[point];
        sum.state_squared += position.norm_squared();
        let Some(d) = step(point) else {
            chunk.candidate[point] = position;
            continue;
        };
        let (v, g) = chunk.point_normal(point);
        for (axis, k) in [0, 3, 5].into_iter().enumerate() {
            let term = damping_term(damping, lambda, v[k]);
            sum.promised += 0.5 * d[axis] * (term * d[axis] - g[axis]);
            sum.squared += d[axis] * d[axis];
            chunk.candidate[point][axis] = position[axis] + d[axis];
        }
    }
    chunk.step = sum;
}

fn add(to: &mut [f64], from: &[f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += from;
    }
}
