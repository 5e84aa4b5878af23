//! What is estimated, in which order: made once for a problem of one shape.

use super::chunk::{Chunk, Direct, Link, Touch};
use super::ids::{MOTION, NONE};
use super::issue::Issue;
use super::plan::{Blocks, Plan};
use super::problem::{BundleProblem, Observation};
use crate::linear::BlockPattern;

/// Measurements worth a part of their own.
const CHUNK: usize = 3000;
/// Parts at most; their number depends on the problem only, so that results do not depend on the
/// number of threads.
const MAX_CHUNKS: usize = 16;
/// Clearing and adding up one number of a part's own reduced matrix costs as much as so many
/// products, so that large systems of little work are made in fewer parts.
const COPY: usize = 8;
/// Parts at least, where there is anything to do in parallel.
const MIN_CHUNKS: usize = 2;

pub(super) struct Layout {
    pub pattern: BlockPattern,
    pub direct: Direct,
    pub chunks: Vec<Chunk>,
    /// Block of each view; `NONE` where it does not move.
    pub view_block: Vec<u32>,
    /// Block of each camera's intrinsics; `NONE` where they do not change.
    pub camera_block: Vec<u32>,
    /// Block of the intrinsics of each view; `NONE` where they do not change.
    pub camera_of_view: Vec<u32>,
    /// True where the poses are eliminated and the points stay.
    pub reversed: bool,
    /// Block of each motion; `NONE` where nothing determines it.
    pub motion_block: Vec<u32>,
    pub issues: Vec<Issue>,
}

/// Lay a plan out; `reversed` where the poses are eliminated and the points stay.
pub(super) fn layout(problem: &BundleProblem, plan: Plan, reversed: bool) -> Layout {
    let (active, blocks) = (&plan.active, &plan.blocks);
    let mut sizes = vec![6; plan.poses()];
    for (camera, intrinsics) in problem.intrinsics.iter().enumerate() {
        if blocks.cameras[camera] != NONE {
            sizes.push(intrinsics.free());
        }
    }
    let motions = blocks.motions.iter().filter(|&&b| b != NONE);
    sizes.extend(motions.map(|_| MOTION));
    let (starts, members) = plan.groups(problem, reversed);
    let pattern = BlockPattern::from_groups(sizes, &starts, &members);
    let direct = direct(problem, &pattern, blocks);
    let total = active.order.len();
    let parts = match products(&starts, reversed) / (COPY * pattern.len()).max(1) {
        _ if reversed => MAX_CHUNKS,
        room => room.clamp(MIN_CHUNKS, MAX_CHUNKS),
    };
    let parts = total.div_ceil(CHUNK).clamp(1, parts);
    let mut chunks = Vec::with_capacity(parts);
    let mut point = 0;
    for part in 1..=parts {
        let mut chunk = Chunk::new(!reversed);
        let last = part == parts;
        while point < problem.points.len() && (last || active.starts[point] < part * total / parts)
        {
            let of_point = active.of_point(problem, point);
            fill(&mut chunk, problem, point, of_point, blocks, &pattern);
            point += 1;
        }
        chunk.allocate(&pattern, &direct);
        chunks.push(chunk);
    }
    Layout {
        pattern,
        direct,
        chunks,
        camera_of_view: (problem.views.iter())
            .map(|view| blocks.cameras[view.camera])
            .collect(),
        view_block: plan.blocks.views,
        camera_block: plan.blocks.cameras,
        motion_block: plan.blocks.motions,
        reversed,
        issues: plan.issues,
    }
}

/// Products of the elimination of the points, from the blocks that each touches.
fn products(starts: &[usize], reversed: bool) -> usize {
    let blocks = starts.windows(2).map(|pair| pair[1] - pair[0]);
    let pairs: usize = blocks.map(|n| n * (n + 1) / 2).sum();
    if reversed { 0 } else { pairs * 108 }
}

fn direct(problem: &BundleProblem, pattern: &BlockPattern, blocks: &Blocks) -> Direct {
    let (mut diagonal, mut targets, mut len) = (Vec::new(), Vec::new(), 0);
    for block in 0..pattern.blocks() {
        let area = pattern.size(block) * pattern.size(block);
        diagonal.push(len);
        targets.push((len, pattern.diagonal(block), area));
        len += area;
    }
    diagonal.push(len);
    let mut cross = vec![NONE; blocks.views.len()];
    for (view, &block) in blocks.views.iter().enumerate() {
        let camera = blocks.cameras[problem.views[view].camera];
        if block == NONE || camera == NONE {
            continue;
        }
        let (row, column) = (camera as usize, block as usize);
        if let Some(offset) = pattern.offset(row, column) {
            cross[view] = len as u32;
            targets.push((len, offset, pattern.size(row) * 6));
            len += pattern.size(row) * 6;
        }
    }
    Direct {
        diagonal,
        cross,
        targets,
        len,
    }
}

/// Add a point and its measurements to a chunk.
fn fill<'a>(
    chunk: &mut Chunk,
    problem: &BundleProblem,
    point: usize,
    observations: impl Iterator<Item = &'a Observation> + Clone,
    blocks: &Blocks,
    pattern: &BlockPattern,
) {
    if observations.clone().next().is_none() {
        return;
    }
    let free = !problem.points[point].fixed;
    chunk.begin_point(point, free);
    let mut touched = Vec::new();
    if free {
        blocks.touched(problem, observations.clone(), &mut touched);
    }
    let first = chunk.touches.len();
    for &block in &touched {
        chunk.add_touch(Touch::new(block, pattern.size(block as usize)));
    }
    let touch = |block: u32| match touched.binary_search(&block) {
        Ok(k) if block != NONE => (first + k) as u32,
        _ => NONE,
    };
    let pairs = if chunk.eliminates() {
        &touched[..]
    } else {
        &[]
    };
    for (b, &column) in pairs.iter().enumerate() {
        for &row in &pairs[b..] {
            // every pair of a group has a block
            let offset = pattern.offset(row as usize, column as usize);
            chunk.pairs.push(offset.map_or(NONE, |o| o as u32));
        }
    }
    for observation in observations {
        let view = observation.view as usize;
        let camera = problem.views[view].camera;
        chunk.add_observation(
            Link {
                view: observation.view,
                camera: camera as u32,
                observations: 0,
                view_block: blocks.views[view],
                camera_block: blocks.cameras[camera],
                view_touch: touch(blocks.views[view]),
                camera_touch: touch(blocks.cameras[camera]),
            },
            observation.measurement,
        );
    }
}
