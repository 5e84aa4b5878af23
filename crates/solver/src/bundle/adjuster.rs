//! Bundle adjustment: the problem laid out once, then solved as often as wanted.

use super::assembly::Assembly;
use super::chunk::{Chunk, Scene};
use super::components;
use super::ids::NONE;
use super::inertial::Motion;
use super::intrinsics::Intrinsics;
use super::issue::Issue;
use super::layout::{Layout, layout};
use super::plan::Plan;
use super::problem::BundleProblem;
use super::reverse::{Reverse, pays};
use super::rows::RowMotion;
use super::state::ViewPose;
use crate::linear::{BlockSolver, LinearSolver};
use crate::minimise::{Step, System, minimise};
use crate::options::{Damping, Options};
use crate::summary::{StopReason, Summary};
use crate::{Error, Result};
use rayon::prelude::*;
use sphereflow_core::statistics::mad_sigma_mut;
use sphereflow_sphere::Camera;
use std::ops::Deref;
use std::time::Duration;

/// What an adjustment did, and what is wrong with the problem.
#[derive(Clone, Debug, PartialEq)]
pub struct BundleSummary {
    /// Costs, iterations, and why they ended.
    pub summary: Summary,
    /// What the measurements do not determine, and measurements that were left out.
    pub issues: Vec<Issue>,
    /// How the reduced system was solved.
    pub linear_solver: LinearSolver,
}

impl Deref for BundleSummary {
    type Target = Summary;

    fn deref(&self) -> &Summary {
        &self.summary
    }
}

/// Which unknowns are eliminated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Elimination {
    /// The larger part, if that leaves less to be solved.
    Auto,
    /// The points.
    Points,
}

/// A problem with everything that its adjustment needs. Solving again, from other poses, points and
/// intrinsics, allocates nothing but the summary (large factorisations are made in parts, whose
/// bookkeeping is rayon's).
pub struct BundleAdjuster {
    pub(super) problem: BundleProblem,
    pub(super) layout: Layout,
    pub(super) assembly: Assembly,
    pub(super) solver: BlockSolver,
    pub(super) reverse: Option<Reverse>,
    pub(super) poses: Vec<ViewPose>,
    pub(super) candidate_poses: Vec<ViewPose>,
    pub(super) intrinsics: Vec<Intrinsics>,
    pub(super) candidate_intrinsics: Vec<Intrinsics>,
    rows: Vec<RowMotion>,
    pub(super) motions: Vec<Motion>,
    pub(super) candidate_motions: Vec<Motion>,
    pub(super) eliminated: Option<(Damping, f64)>,
}

/// Adjust a problem in place. Thesis: section 8.4.2.
///
/// # Errors
/// Where a setting is outside its domain.
pub fn adjust(
    problem: &mut BundleProblem,
    linear_solver: LinearSolver,
    options: &Options,
) -> Result<BundleSummary> {
    let mut adjuster = BundleAdjuster::new(std::mem::take(problem), linear_solver);
    let summary = adjuster.solve(options);
    *problem = adjuster.into_problem();
    summary
}

impl BundleAdjuster {
    /// Lay the problem out. What it is measured by, what is fixed and what is left out as not seen
    /// stays as it is from here on.
    pub fn new(problem: BundleProblem, linear_solver: LinearSolver) -> Self {
        Self::with_elimination(problem, linear_solver, Elimination::Auto)
    }

    pub(super) fn with_elimination(
        problem: BundleProblem,
        linear_solver: LinearSolver,
        elimination: Elimination,
    ) -> Self {
        let mut plan = Plan::new(&problem);
        let groups = components::issues(&problem, &plan.active, &plan.used);
        plan.issues.extend(groups);
        let reversed = elimination == Elimination::Auto
            && pays(plan.poses(), plan.points(&problem), problem.ties_poses());
        let layout = layout(&problem, plan, reversed);
        let poses: Vec<ViewPose> = problem
            .views
            .iter()
            .map(|view| ViewPose::from_world_from_camera(&view.world_from_camera))
            .collect();
        Self {
            assembly: Assembly::new(&layout),
            reverse: (layout.reversed).then(|| Reverse::new(&layout, linear_solver)),
            solver: BlockSolver::new(&layout.pattern, linear_solver),
            candidate_poses: poses.clone(),
            poses,
            intrinsics: problem.intrinsics.clone(),
            candidate_intrinsics: problem.intrinsics.clone(),
            rows: problem.views.iter().map(|view| view.rows).collect(),
            motions: problem.inertial.motions.clone(),
            candidate_motions: problem.inertial.motions.clone(),
            eliminated: None,
            layout,
            problem,
        }
    }

    /// The problem in its present state.
    pub fn problem(&self) -> &BundleProblem {
        &self.problem
    }

    /// The problem in its present state.
    pub fn into_problem(self) -> BundleProblem {
        self.problem
    }

    /// What the measurements do not determine, and measurements that were left out.
    pub fn issues(&self) -> &[Issue] {
        &self.layout.issues
    }

    /// Start from other poses and points, given for all of them.
    ///
    /// # Errors
    /// Where a number is wrong or not finite.
    pub fn restart(
        &mut self,
        world_from_camera: &[sphereflow_core::Pose],
        points: &[nalgebra::Vector3<f64>],
    ) -> Result<()> {
        let found = (world_from_camera.len(), points.len());
        let expected = (self.problem.poses(), self.problem.points());
        if found != expected {
            let (expected, found) = (format!("{expected:?}"), format!("{found:?}"));
            return Err(Error::value("poses and points", expected, found));
        }
        for (pose, world_from_camera) in world_from_camera.iter().enumerate() {
            self.problem.set_pose(pose, *world_from_camera)?;
        }
        for (point, position) in points.iter().enumerate() {
            self.problem.set_point(point, *position)?;
        }
        Ok(())
    }

    /// Start from another camera, of the same model: its free parameters are estimated anew.
    ///
    /// # Errors
    /// Where there is no such camera, or its model is another.
    pub fn restart_camera(&mut self, camera: usize, start: &Camera) -> Result<()> {
        self.problem.set_camera(camera, start)
    }

    /// Adjust from the present state on.
    ///
    /// # Errors
    /// Where a setting or a loss is outside its domain, or a measurement that was seen when the
    /// problem was laid out is not seen any more.
    pub fn solve(&mut self, options: &Options) -> Result<BundleSummary> {
        let losses = self.problem.losses;
        losses.check()?;
        self.load();
        let movable = self.layout.pattern.blocks() > 0
            || self.layout.chunks.iter().any(Chunk::has_free_point);
        let summary = if movable {
            minimise(self, options)?
        } else {
            let cost = self.cost().unwrap_or(f64::NAN);
            Summary {
                initial_cost: cost,
                final_cost: cost,
                iterations: Vec::new(),
                stop: StopReason::NothingToDo,
                elapsed: Duration::ZERO,
            }
        };
        self.store();
        Ok(BundleSummary {
            summary,
            issues: self.layout.issues.clone(),
            linear_solver: (self.reverse.as_ref()).map_or(self.solver.kind(), Reverse::kind),
        })
    }

    pub(super) fn load(&mut self) {
        self.eliminated = None;
        for (pose, view) in self.poses.iter_mut().zip(&self.problem.views) {
            *pose = ViewPose::from_world_from_camera(&view.world_from_camera);
        }
        self.candidate_poses.copy_from_slice(&self.poses);
        for (rows, view) in self.rows.iter_mut().zip(&self.problem.views) {
            *rows = view.rows;
        }
        self.motions.copy_from_slice(&self.problem.inertial.motions);
        self.candidate_motions.copy_from_slice(&self.motions);
        let both = [&mut self.intrinsics, &mut self.candidate_intrinsics];
        for all in both {
            for (intrinsics, start) in all.iter_mut().zip(&self.problem.intrinsics) {
                intrinsics.copy_from(start);
            }
        }
        for chunk in &mut self.layout.chunks {
            for (current, &point) in chunk.current.iter_mut().zip(&chunk.points) {
                *current = self.problem.points[point as usize].position;
            }
        }
    }

    fn store(&mut self) {
        self.problem.inertial.motions.copy_from_slice(&self.motions);
        for (view, (pose, &block)) in
            (self.problem.views.iter_mut()).zip(self.poses.iter().zip(&self.layout.view_block))
        {
            if block != NONE {
                view.world_from_camera = pose.world_from_camera();
            }
        }
        for chunk in &self.layout.chunks {
            for (current, &point) in chunk.current.iter().zip(&chunk.points) {
                self.problem.points[point as usize].position = *current;
            }
        }
        for (camera, &block) in self.layout.camera_block.iter().enumerate() {
            if block != NONE {
                self.problem.intrinsics[camera].copy_from(&self.intrinsics[camera]);
            }
        }
    }

    fn evaluate(&mut self, candidate: bool) -> Option<f64> {
        let (poses, intrinsics, motions) = if candidate {
            (
                &self.candidate_poses,
                &self.candidate_intrinsics,
                &self.candidate_motions,
            )
        } else {
            (&self.poses, &self.intrinsics, &self.motions)
        };
        let scene = Scene {
            poses,
            intrinsics,
            rows: &self.rows,
            losses: &self.problem.losses,
        };
        self.layout
            .chunks
            .par_iter_mut()
            .for_each(|chunk| chunk.evaluate(&scene, candidate));
        let mut cost = (self.assembly).prior_cost(&self.problem.priors, (poses, motions))
            + self.problem.inertial.cost(poses, motions)
            + intrinsics.iter().map(Intrinsics::known_cost).sum::<f64>()
            + (self.problem.relative.iter().map(|edge| edge.cost(poses))).sum::<f64>();
        for chunk in &self.layout.chunks {
            cost += chunk.cost?;
        }
        Some(cost)
    }

    /// The standard deviation of the whitened residual components by their median absolute value: 1
    /// where the covariances are right. Scale the losses by it where they are not.
    pub fn residual_scale(&mut self) -> Option<f64> {
        self.load();
        let scene = Scene {
            poses: &self.poses,
            intrinsics: &self.intrinsics,
            rows: &self.rows,
            losses: &self.problem.losses,
        };
        let mut all = Vec::new();
        for chunk in &self.layout.chunks {
            chunk.residuals(&scene, &mut all);
        }
        mad_sigma_mut(&mut all)
    }

    /// The residuals of the present poses and intrinsics, with the points where they are.
    #[cfg(test)]
    pub(super) fn whitened(&self) -> nalgebra::DVector<f64> {
        let scene = Scene {
            poses: &self.poses,
            intrinsics: &self.intrinsics,
            rows: &self.rows,
            losses: &self.problem.losses,
        };
        let mut all = Vec::new();
        for chunk in &self.layout.chunks {
            chunk.residuals(&scene, &mut all);
        }
        nalgebra::DVector::from_vec(all)
    }

    /// The cost of the present state.
    #[cfg(test)]
    pub(super) fn solve_nothing(&mut self) -> f64 {
        self.load();
        self.cost().unwrap_or(f64::NAN)
    }

    #[cfg(test)]
    pub(super) fn is_reversed(&self) -> bool {
        self.reverse.is_some()
    }

    #[cfg(test)]
    pub(super) fn accept_blocks(&mut self) {
        std::mem::swap(&mut self.poses, &mut self.candidate_poses);
        std::mem::swap(&mut self.intrinsics, &mut self.candidate_intrinsics);
    }
}

impl System for BundleAdjuster {
    fn cost(&mut self) -> Option<f64> {
        self.evaluate(false)
    }

    fn linearise(&mut self, damping: Damping, lambda: f64) -> f64 {
        let scene = Scene {
            poses: &self.poses,
            intrinsics: &self.intrinsics,
            rows: &self.rows,
            losses: &self.problem.losses,
        };
        let (pattern, direct) = (&self.layout.pattern, &self.layout.direct);
        self.layout.chunks.par_iter_mut().for_each(|chunk| {
            chunk.linearise(&scene, (pattern, direct), (damping, lambda));
        });
        let state = (&self.poses[..], &self.motions[..]);
        self.assembly.gather(&self.layout, &self.problem, state);
        self.assembly.add_known(&self.layout, &self.intrinsics);
        self.eliminated = Some((damping, lambda));
        let points = self.layout.chunks.iter().map(|chunk| chunk.gradient_max);
        let blocks = self.assembly.gradient.iter().map(|g| g.abs());
        points.chain(blocks).fold(0.0, f64::max)
    }

    fn step(&mut self, damping: Damping, lambda: f64) -> Option<Step> {
        if !self.solve_blocks(damping, lambda) || !self.move_blocks() {
            return None;
        }
        Some(self.measure_step(damping, lambda))
    }

    fn candidate_cost(&mut self) -> Option<f64> {
        self.evaluate(true)
    }

    fn accept(&mut self) {
        std::mem::swap(&mut self.poses, &mut self.candidate_poses);
        std::mem::swap(&mut self.motions, &mut self.candidate_motions);
        std::mem::swap(&mut self.intrinsics, &mut self.candidate_intrinsics);
        for chunk in &mut self.layout.chunks {
            std::mem::swap(&mut chunk.current, &mut chunk.candidate);
        }
    }
}
