//! Which unknowns the measurements determine, how they are numbered, and what ties them.

use super::active::{Active, active};
use super::ids::NONE;
use super::issue::Issue;
use super::problem::{BundleProblem, Observation};

/// The block of every unknown but the points; `NONE` where it is not estimated.
pub(super) struct Blocks {
    /// Of each pose.
    pub views: Vec<u32>,
    /// Of each camera's intrinsics.
    pub cameras: Vec<u32>,
    /// Of each motion.
    pub motions: Vec<u32>,
}

impl Blocks {
    /// The blocks of a point's measurements, ascending, each once.
    pub fn touched<'a>(
        &self,
        problem: &BundleProblem,
        observations: impl Iterator<Item = &'a Observation>,
        members: &mut Vec<u32>,
    ) {
        let first = members.len();
        for observation in observations {
            let view = observation.view as usize;
            let used = observation.measurement.uses_camera();
            let camera = self.cameras[problem.views[view].camera];
            members.push(self.views[view]);
            members.push(if used { camera } else { NONE });
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
}

/// The measurements that count, and the unknowns that they determine.
pub(super) struct Plan {
    pub active: Active,
    pub blocks: Blocks,
    /// Poses that something measures.
    pub used: Vec<bool>,
    /// What is left out or stays.
    pub issues: Vec<Issue>,
}

impl Plan {
    /// Number what moves: poses, then intrinsics, then motions.
    pub fn new(problem: &BundleProblem) -> Self {
        let mut issues = Vec::new();
        let active = active(problem, &mut issues);
        let mut used = vec![false; problem.views.len()];
        let mut camera_used = vec![false; problem.intrinsics.len()];
        for &k in &active.order {
            let observation = &problem.observations[k as usize];
            used[observation.view as usize] = true;
            if observation.measurement.uses_camera() {
                camera_used[problem.views[observation.view as usize].camera] = true;
            }
        }
        for prior in &problem.priors {
            for &view in &prior.views {
                used[view] = true;
            }
        }
        let relative = problem.relative.iter().flat_map(|edge| [edge.a, edge.b]);
        for view in problem.inertial.ties().flatten().chain(relative) {
            used[view] = true;
        }
        let mut next = 0;
        let mut number = |yes: bool| {
            next += u32::from(yes);
            if yes { next - 1 } else { NONE }
        };
        let views = (0..used.len())
            .map(|view| number(used[view] && !problem.views[view].fixed))
            .collect();
        let cameras = (0..camera_used.len())
            .map(|camera| number(camera_used[camera] && problem.intrinsics[camera].free() > 0))
            .collect();
        let motions = (0..problem.inertial.motions.len())
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
        Self {
            active,
            blocks: Blocks {
                views,
                cameras,
                motions,
            },
            used,
            issues,
        }
    }

    /// Number of poses that move.
    pub fn poses(&self) -> usize {
        self.blocks.views.iter().filter(|&&b| b != NONE).count()
    }

    /// Number of points that move.
    pub fn points(&self, problem: &BundleProblem) -> usize {
        let free = |&point: &usize| !problem.points[point].fixed && self.active.has(point);
        (0..problem.points.len()).filter(free).count()
    }

    /// The blocks that measurements and priors tie together.
    pub fn groups(&self, problem: &BundleProblem, reversed: bool) -> (Vec<usize>, Vec<u32>) {
        let (active, blocks) = (&self.active, &self.blocks);
        let (mut starts, mut members): (Vec<usize>, Vec<u32>) = (vec![0], Vec::new());
        for (point, node) in problem.points.iter().enumerate() {
            if !node.fixed && !reversed {
                blocks.touched(problem, active.of_point(problem, point), &mut members);
                starts.push(members.len());
            }
        }
        for (view, &block) in blocks.views.iter().enumerate() {
            let camera = blocks.cameras[problem.views[view].camera];
            members.extend([block, camera].iter().filter(|&&b| b != NONE));
            starts.push(members.len());
        }
        for prior in &problem.priors {
            let tied = (prior.views.iter().map(|&view| blocks.views[view]))
                .chain(prior.motions.iter().map(|&motion| blocks.motions[motion]));
            members.extend(tied.filter(|&b| b != NONE));
            starts.push(members.len());
        }
        for edge in &problem.relative {
            let ends = [edge.a, edge.b].map(|view| blocks.views[view]);
            members.extend(ends.into_iter().filter(|&b| b != NONE));
            starts.push(members.len());
        }
        let inertial = &problem.inertial;
        for (views, motions) in inertial.ties().zip(inertial.tied_motions()) {
            let tied = (views.into_iter().map(|view| blocks.views[view]))
                .chain(motions.into_iter().map(|motion| blocks.motions[motion]));
            members.extend(tied.filter(|&b| b != NONE));
            starts.push(members.len());
        }
        (starts, members)
    }
}
