//! What is estimated, in which order: made once for a problem of one shape.

use super::active::{Active, active};
use super::chunk::{Chunk, Link, NONE, Touch};
use super::components;
use super::inertial::MOTION;
use super::issue::Issue;
use super::measurement::Measurement;
use super::problem::{BundleProblem, Observation};
use super::reverse;
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

/// Where the directly measured blocks (diagonal, and intrinsics by pose) are kept, apart from the
/// reduced matrix.
pub(super) struct Direct {
    /// Offset of each diagonal block; one more at the end.
    pub diagonal: Vec<usize>,
    /// Offset of the block intrinsics by pose of each view; `NONE` where there is none.
    pub cross: Vec<u32>,
    /// Offset here, offset in the reduced matrix, numbers.
    pub targets: Vec<(usize, usize, usize)>,
    pub len: usize,
}

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

/// Which unknowns are eliminated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Elimination {
    /// The larger part, if that leaves less to be solved.
    Auto,
    /// The points.
    Points,
}

pub(super) fn layout(problem: &BundleProblem, elimination: Elimination) -> Layout {
    let mut issues = Vec::new();
    let active = active(problem, &mut issues);
    let ([view_block, camera_block, motion_block], used) = blocks(problem, &active, &mut issues);
    issues.extend(components::issues(problem, &active, &used));
    let count = |blocks: &[u32]| blocks.iter().filter(|&&b| b != NONE).count();
    let mut sizes = vec![6; count(&view_block)];
    for (camera, intrinsics) in problem.intrinsics.iter().enumerate() {
        if camera_block[camera] != NONE {
            sizes.push(intrinsics.free());
        }
    }
    sizes.extend((0..count(&motion_block)).map(|_| MOTION));
    let tied = (problem.priors.iter()).any(|prior| prior.views.len() + prior.motions.len() > 1)
        || !problem.inertial.views.is_empty();
    let free_points = (0..problem.points.len())
        .filter(|&point| !problem.points[point].fixed && active.has(point))
        .count();
    let reversed =
        elimination == Elimination::Auto && reverse::pays(count(&view_block), free_points, tied);
    let (starts, members) = groups(
        problem,
        &active,
        reversed,
        [&view_block, &camera_block, &motion_block],
    );
    let pattern = BlockPattern::from_groups(sizes, &starts, &members);
    let direct = direct(problem, &pattern, &view_block, &camera_block);
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
            fill(
                &mut chunk,
                problem,
                point,
                of_point,
                (&view_block, &camera_block),
                &pattern,
            );
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
            .map(|view| camera_block[view.camera])
            .collect(),
        view_block,
        camera_block,
        motion_block,
        reversed,
        issues,
    }
}

/// Products of the elimination of the points, from the blocks that each touches.
fn products(starts: &[usize], reversed: bool) -> usize {
    let blocks = starts.windows(2).map(|pair| pair[1] - pair[0]);
    let pairs: usize = blocks.map(|n| n * (n + 1) / 2).sum();
    if reversed { 0 } else { pairs * 108 }
}

fn blocks(
    problem: &BundleProblem,
    active: &Active,
    issues: &mut Vec<Issue>,
) -> ([Vec<u32>; 3], Vec<bool>) {
    let mut used = vec![false; problem.views.len()];
    let mut camera_used = vec![false; problem.intrinsics.len()];
    for &k in &active.order {
        let observation = &problem.observations[k as usize];
        used[observation.view as usize] = true;
        if matches!(observation.measurement, Measurement::Pixel { .. }) {
            camera_used[problem.views[observation.view as usize].camera] = true;
        }
    }
    for prior in &problem.priors {
        for &view in &prior.views {
            used[view] = true;
        }
    }
    for view in problem.inertial.ties().flatten() {
        used[view] = true;
    }
    let mut next = 0;
    let mut number = |yes: bool| {
        next += u32::from(yes);
        if yes { next - 1 } else { NONE }
    };
    let view_block = (0..used.len())
        .map(|view| number(used[view] && !problem.views[view].fixed))
        .collect();
    let camera_block = (0..camera_used.len())
        .map(|camera| number(camera_used[camera] && problem.intrinsics[camera].free() > 0))
        .collect();
    let motion_block = (0..problem.inertial.motions.len())
        .map(|motion| {
            let prior = problem.priors.iter().any(|p| p.motions.contains(&motion));
            number(prior || problem.inertial.determines(motion))
        })
        .collect();
    for (pose, view) in problem.views.iter().enumerate() {
        if !used[pose] && !view.fixed {
            issues.push(Issue::PoseUndetermined { pose });
        }
    }
    ([view_block, camera_block, motion_block], used)
}

/// The blocks that measurements and priors tie together.
fn groups(
    problem: &BundleProblem,
    active: &Active,
    reversed: bool,
    [view_block, camera_block, motion_block]: [&[u32]; 3],
) -> (Vec<usize>, Vec<u32>) {
    let (mut starts, mut members): (Vec<usize>, Vec<u32>) = (vec![0], Vec::new());
    for (point, node) in problem.points.iter().enumerate() {
        if !node.fixed && !reversed {
            touched(
                problem,
                active.of_point(problem, point),
                view_block,
                camera_block,
                &mut members,
            );
            starts.push(members.len());
        }
    }
    for (view, &block) in view_block.iter().enumerate() {
        let camera = camera_block[problem.views[view].camera];
        members.extend([block, camera].iter().filter(|&&b| b != NONE));
        starts.push(members.len());
    }
    for prior in &problem.priors {
        let blocks = (prior.views.iter().map(|&view| view_block[view]))
            .chain(prior.motions.iter().map(|&motion| motion_block[motion]));
        members.extend(blocks.filter(|&b| b != NONE));
        starts.push(members.len());
    }
    let inertial = &problem.inertial;
    for (views, motions) in inertial.ties().zip(inertial.tied_motions()) {
        let blocks = (views.into_iter().map(|view| view_block[view]))
            .chain(motions.into_iter().map(|motion| motion_block[motion]));
        members.extend(blocks.filter(|&b| b != NONE));
        starts.push(members.len());
    }
    (starts, members)
}

/// The blocks of a point's measurements, ascending, each once.
fn touched<'a>(
    problem: &BundleProblem,
    observations: impl Iterator<Item = &'a Observation>,
    view_block: &[u32],
    camera_block: &[u32],
    members: &mut Vec<u32>,
) {
    let first = members.len();
    for observation in observations {
        let view = observation.view as usize;
        let pixel = matches!(observation.measurement, Measurement::Pixel { .. });
        let camera = camera_block[problem.views[view].camera];
        members.push(view_block[view]);
        members.push(if pixel { camera } else { NONE });
    }
    members[first..].sort_unstable();
    let mut end = first;
    for k in first..members.len() {
        let new = end == first || members[end - 1] != members[k];
        if new && members[k] != NONE {
            members[end] = members[k];
            end += 1;
        }
    }
    members.truncate(end);
}

fn direct(
    problem: &BundleProblem,
    pattern: &BlockPattern,
    view_block: &[u32],
    camera_block: &[u32],
) -> Direct {
    let (mut diagonal, mut targets, mut len) = (Vec::new(), Vec::new(), 0);
    for block in 0..pattern.blocks() {
        let area = pattern.size(block) * pattern.size(block);
        diagonal.push(len);
        targets.push((len, pattern.diagonal(block), area));
        len += area;
    }
    diagonal.push(len);
    let mut cross = vec![NONE; view_block.len()];
    for (view, &block) in view_block.iter().enumerate() {
        let camera = camera_block[problem.views[view].camera];
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
    (view_block, camera_block): (&[u32], &[u32]),
    pattern: &BlockPattern,
) {
    if observations.clone().next().is_none() {
        return;
    }
    let free = !problem.points[point].fixed;
    chunk.begin_point(point, free);
    let mut blocks = Vec::new();
    if free {
        touched(
            problem,
            observations.clone(),
            view_block,
            camera_block,
            &mut blocks,
        );
    }
    let first = chunk.touches.len();
    for &block in &blocks {
        chunk.add_touch(Touch::new(block, pattern.size(block as usize)));
    }
    let touch = |block: u32| match blocks.binary_search(&block) {
        Ok(k) if block != NONE => (first + k) as u32,
        _ => NONE,
    };
    let pairs = if chunk.eliminates() { &blocks[..] } else { &[] };
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
                view_block: view_block[view],
                camera_block: camera_block[camera],
                view_touch: touch(view_block[view]),
                camera_touch: touch(camera_block[camera]),
            },
            observation.measurement,
        );
    }
}
