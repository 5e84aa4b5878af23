//! Which measurements count: those that are seen, of points that they determine.

use super::issue::Issue;
use super::measurement::Measurement;
use super::problem::{BundleProblem, Observation};
use super::rows::CameraState;
use super::state::ViewPose;

/// The measurements that count, by points.
pub(super) struct Active {
    /// First place of each point in `order`; one more at the end.
    pub starts: Vec<usize>,
    /// Indices of the measurements.
    pub order: Vec<u32>,
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

    /// True where something measures the point.
    pub fn has(&self, point: usize) -> bool {
        self.starts[point] < self.starts[point + 1]
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

/// Leaves out what is not seen, and points that nothing determines.
pub(super) fn active(problem: &BundleProblem, issues: &mut Vec<Issue>) -> Active {
    let poses: Vec<ViewPose> = problem
        .views
        .iter()
        .map(|view| ViewPose::from_world_from_camera(&view.world_from_camera))
        .collect();
    let mut keep = vec![false; problem.observations.len()];
    for (k, observation) in problem.observations.iter().enumerate() {
        let (view, point) = (observation.view as usize, observation.point as usize);
        let x = poses[view].transform(&problem.points[point].position);
        let camera = CameraState {
            intrinsics: &problem.intrinsics[problem.views[view].camera],
            rows: &problem.views[view].rows,
        };
        let squared = observation.measurement.squared(camera, &x);
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
            Measurement::Pixel { .. } | Measurement::Row(_) => {
                rays += usize::from(last_ray != view);
                last_ray = view;
            }
            Measurement::Point { .. } => whole = true,
            Measurement::InverseRange { .. } | Measurement::InverseDepth(_) => ranges += 1,
        }
    }
    (
        views,
        whole || rays > 1 || (rays == 1 && ranges > 0) || ranges > 2,
    )
}
