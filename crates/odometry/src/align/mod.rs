//! Alignment of two frames: robust solves of the weak form from coarse to fine, the second image
//! warped by the estimate before each.

mod overlap;
mod schedule;

use crate::Result;
use crate::binning::InverseDepth;
use crate::brightness::{Brightness, GreyPyramid, Images};
use crate::config::Config;
use crate::dissent::Dissent;
use crate::inside::Inside;
use crate::motion::size_m;
use crate::pyramid::{FramePyramid, LevelStack};
use crate::robust::{Prior, RobustSolver, Solution};
use crate::row_motion::{self, RollingShutter, RowMotion};
use crate::warp::Warp;
use crate::weak_form::{CellSums, Pair, WeakForm};
use nalgebra::{Matrix6, Vector6};
use schedule::{REPEAT, schedule};
use sphereflow_core::{Pose, Reason, Twist};
use sphereflow_sphere::Camera;
use sphereflow_sphere::lie::se3;

/// Steps of the warp's fixed point on the finest level and on the others. On the finest, one leaves
/// the noise of the first image in where the second is looked up, and costs a factor of two in drift
/// on real recordings; a third gains little.
const FINE_STEPS: usize = 2;
const COARSE_STEPS: usize = 1;
/// A last step beyond this is followed by another one, metres: rotation counts at the mean range.
const STILL_M: f64 = 5e-3;
/// An alignment that leaves out more of the domains than this is tried again from further away: on
/// static scenes that were aligned well it is a few in a hundred.
const DOUBTFUL: f64 = 0.08;
/// Solves of the coarsest level in such a trial.
const MANY_SOLVES: usize = 8;
/// How the second image was read out, as far as known before its motion is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ReadOut {
    /// Time between the exposures of first and last row, seconds.
    pub(crate) readout_s: f64,
    /// Pose of an earlier frame in the frame of the first image, and the time since then: with the
    /// pose sought it makes the velocity during the exposure.
    pub(crate) first_from_earlier: Pose,
    pub(crate) since_s: f64,
}

/// What to align, and what is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Task<'a> {
    pub(crate) first: &'a FramePyramid,
    pub(crate) second: &'a FramePyramid,
    /// `first_from_second`, a first guess.
    pub(crate) guess: Pose,
    /// Known of the motion `first_from_second` apart from the images, with the information in the
    /// coordinates of the first frame.
    pub(crate) prior: Option<(Pose, Matrix6<f64>)>,
    /// `None`: all rows were exposed at the stamp.
    pub(crate) readout: Option<ReadOut>,
    /// Brightness of both images, where known: pixels see what those of the depth images do.
    pub(crate) brightness: Option<(&'a GreyPyramid, &'a GreyPyramid)>,
    /// The finest level used.
    pub(crate) finest: usize,
    /// True to try samples where the first solve leaves more than noise.
    pub(crate) restart: bool,
}

/// Two frames aligned.
#[derive(Clone, Debug)]
pub(crate) struct Alignment {
    /// `first_from_second`.
    pub(crate) motion: Pose,
    /// Last solve.
    pub(crate) solution: Solution,
    /// Robust residual with which the first solve began.
    pub(crate) scale_at_start: f64,
    /// Share of the first image's blocks known in both.
    pub(crate) known_share: f64,
    /// Share of the first image's surface that lies within the second image.
    pub(crate) overlap: f64,
    /// Median displacement, pixels of the full image.
    pub(crate) flow_px: f64,
    /// What moves otherwise.
    pub(crate) dissent: Dissent,
    /// False where the steps still grew.
    pub(crate) settled: bool,
    pub(crate) solves: usize,
}

/// An alignment, or the reason why there is nothing to solve with the share of blocks known in both
/// images.
type Outcome = std::result::Result<Alignment, (Reason, f64)>;

/// Tables and working memory of one camera.
#[derive(Clone, Debug)]
pub(crate) struct Aligner {
    pub(crate) stack: LevelStack,
    /// The level that alignments begin with; overlap and flow are looked at there. Above it is the
    /// one in reserve.
    coarsest: usize,
    camera: Camera,
    warped: InverseDepth,
    rows: Vec<RowMotion>,
    pair: Pair,
    sums: Vec<CellSums>,
    inside: Inside,
    solver: RobustSolver,
    flows: Vec<f64>,
    brightness: Brightness,
}

impl Aligner {
    pub(crate) fn new(camera: &Camera, config: &Config) -> Result<Self> {
        config.validate()?;
        let stack = LevelStack::new(camera, config)?;
        Ok(Self {
            coarsest: stack.levels.len().min(config.levels) - 1,
            stack,
            camera: camera.clone(),
            warped: InverseDepth::default(),
            rows: Vec::new(),
            pair: Pair::default(),
            sums: Vec::new(),
            inside: Inside::default(),
            solver: RobustSolver::default(),
            flows: Vec::new(),
            brightness: Brightness::default(),
        })
    }

    /// Aligns from coarse to fine. Where nothing predicts the motion and the result leaves many
    /// domains out or did not settle, the level in reserve, and more solves, are tried too: the
    /// motion may have been too large for the others.
    ///
    /// # Errors
    /// The reason why there is nothing to solve, with the share of blocks known in both images.
    pub(crate) fn align(&mut self, config: &Config, task: &Task<'_>) -> Outcome {
        let coarsest = self.coarsest;
        let usual = self.align_from(config, task, coarsest, config.coarse_solves);
        if !task.restart || !is_doubtful(&usual) || coarsest <= task.finest {
            return usual;
        }
        let reserve = self.stack.levels.len() - 1;
        let others = [
            self.align_from(config, task, reserve, config.coarse_solves),
            self.align_from(config, task, coarsest, MANY_SOLVES),
        ];
        let better = |a: Outcome, b: Outcome| if misfit(&b) < misfit(&a) { b } else { a };
        others.into_iter().fold(usual, better)
    }

    fn align_from(
        &mut self,
        config: &Config,
        task: &Task<'_>,
        coarsest: usize,
        coarse_solves: usize,
    ) -> Outcome {
        let mut motion = task.guess;
        let mut last: Option<Solution> = None;
        let (mut scale_at_start, mut known_share) = (f64::NAN, 0.0);
        let (mut step_m, mut settled, mut solves) = (f64::INFINITY, true, 0);
        for level in schedule(config, task.finest, coarsest, coarse_solves) {
            // A single level is meant to be solved once: for slow motions, in a fraction of the time.
            let still = step_m < STILL_M || coarsest <= task.finest;
            if level >= REPEAT && settled && still {
                break;
            }
            let level = level % REPEAT;
            self.warp(config, task, level, motion);
            known_share = self.pair.known_share();
            if known_share < config.min_known_share {
                return Err((Reason::FewKnownPixels { share: known_share }, known_share));
            }
            let mut prior = prior_of_step(task, &motion);
            self.add_brightness(config, task, level, &mut prior);
            let solution = self
                .solve(config, level, &prior, task.restart && solves == 0)
                .map_err(|reason| (reason, known_share))?;
            if solves == 0 {
                scale_at_start = solution.scale_at_rest;
            }
            solves += 1;
            motion = se3::exp(&solution.twist) * motion;
            let size = size_m(&solution.twist, solution.mean_range_m);
            settled = size < step_m.max(config.covariance.floor_m) || solves == 1;
            step_m = size;
            last = Some(solution);
        }
        let (overlap, flow_px) = self.overlap_and_flow(task.first, &motion);
        let solution = last.ok_or((Reason::NotConverged, known_share))?;
        let moved_m = size_m(&se3::log(&motion), solution.mean_range_m);
        let dissent = self.solver.dissent(config, &solution, moved_m);
        Ok(Alignment {
            motion,
            dissent,
            solution,
            scale_at_start,
            known_share,
            overlap,
            flow_px,
            settled,
            solves,
        })
    }

    /// Makes the pair of the first image and the second one seen from the first's pose.
    fn warp(&mut self, config: &Config, task: &Task<'_>, level: usize, motion: Pose) {
        let shutter = task
            .readout
            .map_or_else(RollingShutter::default, |readout| {
                let moved = readout.first_from_earlier.inverse() * motion;
                RollingShutter {
                    twist: Twist::from_vector(&(se3::log(&moved) / readout.since_s)),
                    readout_s: readout.readout_s,
                }
            });
        let tables = &self.stack.levels[level];
        let (first, second) = (&task.first.levels[level], &task.second.levels[level]);
        if motion == Pose::identity() && shutter.is_global() {
            // An image at rest needs no look-up, which would lose the borders of holes.
            row_motion::fill(&mut self.rows, &motion, &shutter, tables.table.height);
            self.pair.fill(&tables.table, first, second);
            return;
        }
        Warp {
            camera: &tables.camera,
            plane: tables.plane.as_ref(),
            table: &tables.table,
            second,
            motion,
            shutter,
            max_jump: config.max_jump as f32,
            steps: if level == task.finest {
                FINE_STEPS
            } else {
                COARSE_STEPS
            },
        }
        .fill(first, &mut self.rows, &mut self.warped);
        self.pair.fill(&tables.table, first, &self.warped);
    }

    /// What the brightness says of the step left, where there are images.
    fn add_brightness(
        &mut self,
        config: &Config,
        task: &Task<'_>,
        level: usize,
        prior: &mut Prior,
    ) {
        let Some((first, second)) = task.brightness else {
            return;
        };
        let tables = &self.stack.levels[level];
        let images = Images {
            first_depth: &task.first.levels[level],
            pair: &self.pair.mean,
            first: &first.levels[level],
            second: &second.levels[level],
            rows: &self.rows,
        };
        let weight = config.brightness_weight;
        let term = self.brightness.term(tables, &images, weight);
        prior.information += term.information;
        prior.gradient += term.gradient;
    }

    /// Weak form and robust solve of the current pair.
    fn solve(
        &mut self,
        config: &Config,
        level: usize,
        prior: &Prior,
        restart: bool,
    ) -> std::result::Result<Solution, Reason> {
        let tables = &self.stack.levels[level];
        WeakForm {
            table: &tables.table,
            tiling: &tables.tiling,
            pair: &self.pair,
            max_jump: config.max_jump as f32,
        }
        .accumulate(&mut self.sums, &mut self.inside);
        let found = self.solver.take(&self.sums, &tables.tiling, config);
        if found < config.min_domains {
            return Err(Reason::FewDomains {
                found,
                needed: config.min_domains,
            });
        }
        let solution = if restart {
            self.solver.solve(config, prior)
        } else {
            self.solver.solve_from(config, prior, Vector6::zeros())
        };
        let finite = solution.twist.iter().all(|v| v.is_finite());
        finite.then_some(solution).ok_or(Reason::NotConverged)
    }

    /// The image of a frame as it would be had all rows been exposed at the stamp, given the
    /// camera's velocity during the exposure. Only the finest level is looked up; the others are
    /// averaged from it.
    pub(crate) fn undo_rolling_shutter(
        &mut self,
        config: &Config,
        frame: &FramePyramid,
        shutter: RollingShutter,
        out: &mut FramePyramid,
    ) {
        out.levels
            .resize_with(self.stack.levels.len(), Default::default);
        let tables = &self.stack.levels[0];
        Warp {
            camera: &tables.camera,
            plane: tables.plane.as_ref(),
            table: &tables.table,
            second: &frame.levels[0],
            motion: Pose::identity(),
            shutter,
            max_jump: config.max_jump as f32,
            steps: FINE_STEPS,
        }
        .fill(&frame.levels[0], &mut self.rows, &mut out.levels[0]);
        self.stack.coarsen(out);
    }
}

/// True where another trial may do better: it did not settle, or leaves many domains out.
fn is_doubtful(outcome: &Outcome) -> bool {
    outcome
        .as_ref()
        .map_or(true, |a| !a.settled || a.solution.rejected_share > DOUBTFUL)
}

/// The median residual, by which outcomes are compared: a motion in between those of two objects
/// leaves out nothing and suits nobody.
fn misfit(outcome: &Outcome) -> f64 {
    match outcome {
        Ok(alignment) if alignment.settled => alignment.solution.scale,
        _ => f64::INFINITY,
    }
}

/// What is known of the step that is left to do.
fn prior_of_step(task: &Task<'_>, motion: &Pose) -> Prior {
    task.prior.map_or_else(Prior::none, |(known, information)| {
        let motion = se3::log(&(known * motion.inverse()));
        Prior {
            motion,
            information,
            gradient: information * motion,
        }
    })
}
