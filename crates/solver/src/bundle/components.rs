//! Which poses hang together, and whether anything holds each group in place.

use super::active::Active;
use super::issue::Issue;
use super::prior::Prior;
use super::problem::BundleProblem;

/// Groups of poses joined by points and priors.
struct Union {
    parent: Vec<usize>,
}

impl Union {
    fn root(&mut self, mut node: usize) -> usize {
        while self.parent[node] != node {
            self.parent[node] = self.parent[self.parent[node]];
            node = self.parent[node];
        }
        node
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b);
    }
}

#[derive(Clone, Copy, Default)]
struct Group {
    seen: bool,
    moves: bool,
    metric: bool,
    /// Gravity is felt: the vertical is known.
    upright: bool,
    held_poses: usize,
    held_points: usize,
}

/// The poses of a prior, and those of its motions.
fn members<'a>(problem: &'a BundleProblem, prior: &'a Prior) -> impl Iterator<Item = usize> + 'a {
    let of_motions = prior.motions.iter();
    let of_motions = of_motions.map(|&motion| problem.inertial.views[motion]);
    prior.views.iter().copied().chain(of_motions)
}

/// Disconnected groups, and groups with a free gauge.
pub(super) fn issues(problem: &BundleProblem, active: &Active, used: &[bool]) -> Vec<Issue> {
    let views = problem.views.len();
    let mut union = Union {
        parent: (0..views).collect(),
    };
    for point in 0..problem.points.len() {
        let mut first = None;
        if problem.points[point].fixed {
            continue;
        }
        for observation in active.of_point(problem, point) {
            let view = observation.view as usize;
            union.join(*first.get_or_insert(view), view);
        }
    }
    for prior in &problem.priors {
        let mut first = None;
        for view in members(problem, prior) {
            union.join(*first.get_or_insert(view), view);
        }
    }
    for [first, second] in problem.inertial.ties() {
        union.join(first, second);
    }
    for edge in &problem.relative {
        union.join(edge.a, edge.b);
    }
    let groups = describe(problem, active, used, &mut union);
    let mut issues = Vec::new();
    let count = groups
        .iter()
        .filter(|group| group.seen && group.moves)
        .count();
    if count > 1 {
        issues.push(Issue::Disconnected { groups: count });
    }
    for (pose, group) in groups.iter().enumerate() {
        let held = group.held_poses > 0 || group.held_points >= 3;
        let scaled = group.metric || group.held_poses > 1 || group.held_points >= 2;
        let directions = match (held, scaled) {
            // a turn about the vertical and a shift
            (false, true) if group.upright => 4,
            (true, true) => continue,
            (true, false) => 1,
            (false, true) => 6,
            (false, false) => 7,
        };
        if group.seen && group.moves {
            issues.push(Issue::FreeGauge { pose, directions });
        }
    }
    issues
}

fn describe(
    problem: &BundleProblem,
    active: &Active,
    used: &[bool],
    union: &mut Union,
) -> Vec<Group> {
    let views = problem.views.len();
    let mut groups = vec![Group::default(); views];
    for view in (0..views).filter(|&view| used[view]) {
        let root = union.root(view);
        let group = &mut groups[root];
        group.seen = true;
        group.moves |= !problem.views[view].fixed;
        group.held_poses += usize::from(problem.views[view].fixed);
    }
    for [view, _] in problem.inertial.ties() {
        let root = union.root(view);
        groups[root].metric = true;
        groups[root].upright = true;
    }
    // where one edge alone joins two groups of points without a scale, that of one is not named
    for edge in &problem.relative {
        groups[union.root(edge.a)].metric = true;
    }
    for prior in problem.priors.iter().filter(|prior| prior.holds_position()) {
        // a joint prior of several poses was made from something that held them
        groups[union.root(prior.views[0])].held_poses += prior.views.len();
    }
    for point in 0..problem.points.len() {
        for observation in active.of_point(problem, point) {
            let group = &mut groups[union.root(observation.view as usize)];
            group.metric |= !observation.measurement.is_ray();
            group.held_points += usize::from(problem.points[point].fixed);
        }
    }
    groups
}
