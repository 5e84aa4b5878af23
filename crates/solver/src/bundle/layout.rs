//! What is estimated, in which order: made once for a problem of one shape.

use super::chunk::{Chunk, Link, NONE, Touch};
use super::components;
use super::issue::Issue;
use super::measurement::Measurement;
use super::problem::{BundleProblem, Observation};
use super::state::ViewPose;
use crate::linear::BlockPattern;

/// Measurements worth a part of their own.
const CHUNK: usize = 3000;
/// Parts at most; their number depends on the problem only, so that results do not depend on the
/// number of threads.
const MAX_CHUNKS: usize = 16;
/// Numbers in the copies of the reduced matrix that the parts add to (512 MiB).
const MAX_COPIES: usize = 1 << 26;

/// The measurements that count, by points.
pub(super) struct Active {
    starts: Vec<usize>,
    order: Vec<u32>,
}

impl Active {
    /// The measurements of a point, by ascending pose.
    pub fn of_point<'a>(
        &'a self,
        problem: &'a BundleProblem,
        point: usize,
    ) -> impl Iterator<Item = &'a Observation> + Clone {
        self.order[self.starts[point]..self.starts[point + 1]]
            .iter()
            .map(|&k| &problem.observations[k as usize])
    }

    fn sorted(problem: &BundleProblem, keep: &[bool]) -> Self {
        let mut starts = vec![0; problem.points.len() + 1];
        let kept = || (0..keep.len()).filter(|&k| keep[k]);
        for k in kept() {
            starts[problem.observations[k].point as usize + 1] += 1;
        }
        for point in 0..problem.points.len() {
            starts[point + 1] += starts[point];
        }
        let (mut next, mut order) = (starts.clone(), vec![0; starts[problem.points.len()]]);
        for k in kept() {
            let place = &mut next[problem.observations[k].point as usize];
            order[*place] = k as u32;
            *place += 1;
        }
        for point in 0..problem.points.len() {
            order[starts[point]..starts[point + 1]]
                .sort_by_key(|&k| problem.observations[k as usize].view);
        }
        Self { starts, order }
    }
}

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
    pub issues: Vec<Issue>,
}

pub(super) fn layout(problem: &BundleProblem) -> Layout {
    let mut issues = Vec::new();
    let active = active(problem, &mut issues);
    let (view_block, camera_block, used) = blocks(problem, &active, &mut issues);
    issues.extend(components::issues(problem, &active, &used));
    let count = |blocks: &[u32]| blocks.iter().filter(|&&b| b != NONE).count();
    let mut sizes = vec![6; count(&view_block)];
    for (camera, intrinsics) in problem.intrinsics.iter().enumerate() {
        if camera_block[camera] != NONE {
            sizes.push(intrinsics.free());
        }
    }
    let (starts, members) = groups(problem, &active, &view_block, &camera_block);
    let pattern = BlockPattern::from_groups(sizes, &starts, &members);
    let direct = direct(problem, &pattern, &view_block, &camera_block);
    let total = active.order.len();
    let room = (MAX_COPIES / pattern.len().max(1)).max(2);
    let parts = total.div_ceil(CHUNK).clamp(1, MAX_CHUNKS.min(room));
    let mut chunks = Vec::with_capacity(parts);
    let mut point = 0;
    for part in 1..=parts {
        let mut chunk = Chunk::default();
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
        view_block,
        camera_block,
        issues,
    }
}

/// Leaves out what is not seen, and points that nothing determines.
fn active(problem: &BundleProblem, issues: &mut Vec<Issue>) -> Active {
    let poses: Vec<ViewPose> = problem
        .views
        .iter()
        .map(|view| ViewPose::from_world_from_camera(&view.world_from_camera))
        .collect();
    let mut keep = vec![false; problem.observations.len()];
    for (k, observation) in problem.observations.iter().enumerate() {
        let (view, point) = (observation.view as usize, observation.point as usize);
        let x = poses[view].transform(&problem.points[point].position);
        let intrinsics = &problem.intrinsics[problem.views[view].camera];
        let squared = observation.measurement.squared(intrinsics, &x);
        keep[k] = squared.is_some_and(f64::is_finite);
        if !keep[k] {
            issues.push(Issue::NotSeen {
                observation: k,
                pose: view,
                point,
            });
        }
    }
    let mut active = Active::sorted(problem, &keep);
    let mut left_out = false;
    for (point, node) in problem.points.iter().enumerate() {
        let (views, determined) = determined(active.of_point(problem, point));
        if node.fixed || determined {
            continue;
        }
        issues.push(Issue::PointUndetermined { point, views });
        for &k in &active.order[active.starts[point]..active.starts[point + 1]] {
            keep[k as usize] = false;
            left_out = true;
        }
    }
    if left_out {
        active = Active::sorted(problem, &keep);
    }
    active
}

/// Number of views, and whether the measurements (by ascending view) fix a position.
fn determined<'a>(observations: impl Iterator<Item = &'a Observation>) -> (usize, bool) {
    let (mut views, mut rays, mut ranges, mut whole) = (0, 0, 0, false);
    let (mut last_view, mut last_ray) = (None, None);
    for observation in observations {
        let view = Some(observation.view);
        views += usize::from(last_view != view);
        last_view = view;
        match observation.measurement {
            Measurement::Pixel { .. } => {
                rays += usize::from(last_ray != view);
                last_ray = view;
            }
            Measurement::Point { .. } => whole = true,
            Measurement::InverseRange { .. } => ranges += 1,
        }
    }
    (
        views,
        whole || rays > 1 || (rays == 1 && ranges > 0) || ranges > 2,
    )
}

fn blocks(
    problem: &BundleProblem,
    active: &Active,
    issues: &mut Vec<Issue>,
) -> (Vec<u32>, Vec<u32>, Vec<bool>) {
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
    for (pose, view) in problem.views.iter().enumerate() {
        if !used[pose] && !view.fixed {
            issues.push(Issue::PoseUndetermined { pose });
        }
    }
    (view_block, camera_block, used)
}

/// The blocks that measurements and priors tie together.
fn groups(
    problem: &BundleProblem,
    active: &Active,
    view_block: &[u32],
    camera_block: &[u32],
) -> (Vec<usize>, Vec<u32>) {
    let (mut starts, mut members): (Vec<usize>, Vec<u32>) = (vec![0], Vec::new());
    for (point, node) in problem.points.iter().enumerate() {
        if !node.fixed {
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
        let blocks = prior.views.iter().map(|&view| view_block[view]);
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
    for (b, &column) in blocks.iter().enumerate() {
        for &row in &blocks[b..] {
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
