//! Alignment of two frames: robust solves of the weak form from coarse to fine, the second image
//! warped by the estimate before each.

mod alignment;
mod level;
mod overlap;
mod priors;
mod progress;
mod schedule;
mod shutter;

use crate::Result;
use crate::area_integrals::AreaIntegrals;
use crate::binning::InverseDepth;
use crate::brightness::{Brightness, BrightnessPyramid};
use crate::cell_sums::CellSums;
use crate::config::Config;
use crate::depth_image::DepthImage;
use crate::motion::size_m;
use crate::pair::Pair;
use crate::pyramid::{FramePyramid, LevelStack};
use crate::robust::{Prior, RobustSolver};
use crate::row_motion::RowMotion;
pub use alignment::Alignment;
use alignment::Solved;
pub use priors::{MotionPrior, Priors, ReadOut};
use progress::Progress;
use schedule::{Solve, schedule};
use sphereflow_core::{Plane, Pose, Reason};
use sphereflow_sphere::Camera;
use sphereflow_sphere::lie::se3;

/// Steps of the warp's fixed point on the finest level and on the others. On the finest, one leaves
/// the noise of the first image in where the second is looked up, and costs a factor of two in drift
/// on real recordings; a third gains little.
const FINE_STEPS: usize = 2;
const COARSE_STEPS: usize = 1;
/// An alignment that leaves out more of the domains than this is tried again from further away: on
/// static scenes that were aligned well it is a few in a hundred.
const DOUBTFUL: f64 = 0.08;
/// Solves of the coarsest level in such a trial.
const MANY_SOLVES: usize = 8;

/// What to align, and what is known.
#[derive(Clone, Copy, Debug)]
struct Task<'a> {
    first: &'a FramePyramid,
    second: &'a FramePyramid,
    /// `first_from_second`, a first guess.
    guess: Pose,
    priors: &'a Priors<'a>,
    /// The finest level that is asked for and known in both frames.
    finest: usize,
}

/// A descent through the levels, or the reason why there is nothing to solve with the share of
/// blocks known in both images.
type Outcome = std::result::Result<Solved, (Reason, f64)>;

/// Aligns frames of one camera: its tables and working memory. No call allocates once frames of the
/// same kind have been aligned.
///
/// ```
/// use sphereflow_alignment::{Aligner, Config, DepthImage, FramePyramid, Priors};
/// use sphereflow_core::{DepthMap, Plane, Pose};
/// use sphereflow_sphere::Camera;
///
/// # fn main() -> sphereflow_alignment::Result<()> {
/// let camera = Camera::pinhole(260.0, 260.0, 159.5, 119.5, 320, 240)?;
/// let mut aligner = Aligner::new(&camera, Config::default())?;
/// // A bowl: what the camera sees determines all six directions of motion.
/// let depth = DepthMap::new(Plane::from_fn(320, 240, |x, y| {
///     2.0 - 0.4 * (x as f32 / 40.0).sin() - 0.3 * (y as f32 / 30.0).cos()
/// }));
/// let mut keyframe = FramePyramid::default();
/// aligner.average(&DepthImage::from(&depth), "depth", &mut keyframe)?;
/// let found = aligner.align(&keyframe, &keyframe.coarse(), Pose::identity(), &Priors::default());
/// assert!(found.status.has_pose() && found.covariance.is_some());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Aligner {
    config: Config,
    stack: LevelStack,
    /// The level that alignments begin with; overlap and flow are looked at there. Above it is the
    /// one in reserve.
    coarsest: usize,
    camera: Camera,
    warped: InverseDepth,
    rows: Vec<RowMotion>,
    pair: Pair,
    sums: Vec<CellSums>,
    inside: AreaIntegrals,
    solver: RobustSolver,
    flows: Vec<f64>,
    brightness: Brightness,
}

impl Aligner {
    /// Prepares the tables of `camera`.
    ///
    /// # Errors
    /// Where a setting is out of range or the image is smaller than a block.
    pub fn new(camera: &Camera, config: Config) -> Result<Self> {
        config.validate()?;
        let stack = LevelStack::new(camera, &config)?;
        Ok(Self {
            coarsest: stack.levels.len().min(config.levels) - 1,
            config,
            stack,
            camera: camera.clone(),
            warped: InverseDepth::default(),
            rows: Vec::new(),
            pair: Pair::default(),
            sums: Vec::new(),
            inside: AreaIntegrals::default(),
            solver: RobustSolver::default(),
            flows: Vec::new(),
            brightness: Brightness::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Averages a depth image into all levels of `out`; `argument` is its name in an error.
    ///
    /// # Errors
    /// A shape error where the image is not of the camera's size; `out` is then as before.
    pub fn average(
        &self,
        depth: &DepthImage<'_>,
        argument: &str,
        out: &mut FramePyramid,
    ) -> Result<()> {
        self.stack.average(depth, argument, out)
    }

    /// Averages an image of the brightness, 0 to 255, into all levels of `out`; `argument` is its
    /// name in an error.
    ///
    /// # Errors
    /// A shape error where the image is not of the camera's size; `out` is then as before.
    pub fn average_brightness(
        &self,
        image: &Plane<f32>,
        argument: &str,
        out: &mut BrightnessPyramid,
    ) -> Result<()> {
        let size = (self.camera.width(), self.camera.height());
        let (block, levels) = (self.stack.finest_block, &self.stack.levels);
        out.fill(image, argument, size, block, levels)
    }

    /// Aligns `frame` to `keyframe` from coarse to fine, beginning at `guess`
    /// (`keyframe_from_frame`). Any two frames of the camera may be aligned, at any time; what is
    /// found depends on the arguments alone. Frames of other sizes, and empty ones, have no blocks
    /// in common with any other: they are lost as [`Reason::FewKnownPixels`] with a share of 0.
    ///
    /// Thesis: section 6.2
    pub fn align(
        &mut self,
        keyframe: &FramePyramid,
        frame: &FramePyramid,
        guess: Pose,
        priors: &Priors<'_>,
    ) -> Alignment {
        let config = self.config;
        let Some(known) = self.finest_known(keyframe, frame, priors) else {
            return Alignment::unsolved(guess, Reason::FewKnownPixels { share: 0.0 }, 0.0);
        };
        let task = Task {
            first: keyframe,
            second: frame,
            guess,
            priors,
            finest: priors.finest_level.max(known),
        };
        match self.align_task(&config, &task) {
            Ok(solved) => Alignment::of(&config, solved),
            Err((reason, known_share)) => Alignment::unsolved(guess, reason, known_share),
        }
    }

    /// The finest level that both frames have; `None` where one is not of this camera.
    fn finest_known(
        &self,
        keyframe: &FramePyramid,
        frame: &FramePyramid,
        priors: &Priors<'_>,
    ) -> Option<usize> {
        if let Some((first, second)) = priors.brightness {
            let fits = first.fits(&self.stack.levels) && second.fits(&self.stack.levels);
            if !fits {
                return None;
            }
        }
        let first = self.stack.finest_level(keyframe)?;
        Some(first.max(self.stack.finest_level(frame)?))
    }

    /// Where nothing predicts the motion and the result leaves many domains out or did not settle,
    /// the level in reserve, and more solves, are tried too: the motion may have been too large for
    /// the others.
    fn align_task(&mut self, config: &Config, task: &Task<'_>) -> Outcome {
        let coarsest = self.coarsest;
        let usual = self.align_from(config, task, coarsest, config.coarse_solves);
        if !task.priors.restart || !is_doubtful(&usual) || coarsest <= task.finest {
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
        let mut progress = Progress::from(task.guess);
        for solve in schedule(config, task.finest, coarsest, coarse_solves) {
            let level = solve.level();
            if matches!(solve, Solve::IfStillMoving(_)) && progress.is_done(coarsest <= task.finest)
            {
                break;
            }
            self.warp(config, task, level, progress.motion);
            let share = self.pair.known_share();
            progress.known_share = share;
            if share < config.min_known_share {
                return Err((Reason::FewKnownPixels { share }, share));
            }
            let known = task.priors.motion.as_ref();
            let mut prior = known.map_or_else(Prior::none, |p| p.of_step(&progress.motion));
            self.add_brightness(config, task, level, &mut prior);
            let restart = task.priors.restart && progress.solves == 0;
            let solution = self
                .solve(config, level, &prior, restart)
                .map_err(|reason| (reason, share))?;
            progress.step(solution, config.covariance.floor_m);
        }
        self.finish(config, task, progress)
    }

    /// What is left to say of a descent: overlap, flow and a second motion.
    fn finish(&mut self, config: &Config, task: &Task<'_>, progress: Progress) -> Outcome {
        let motion = progress.motion;
        let (overlap, flow_px) = self.overlap_and_flow(task.first, &motion);
        let known_share = progress.known_share;
        let solution = progress.last.ok_or((Reason::NotConverged, known_share))?;
        let moved_m = size_m(&se3::log(&motion), solution.mean_range_m);
        Ok(Solved {
            motion,
            second_motion: self.solver.second_motion(config, &solution, moved_m),
            solution,
            scale_at_start: progress.scale_at_start,
            known_share,
            overlap,
            flow_px,
            settled: progress.settled,
            solves: progress.solves,
        })
    }
}

/// True where another trial may do better: it did not settle, or leaves many domains out.
fn is_doubtful(outcome: &Outcome) -> bool {
    outcome
        .as_ref()
        .map_or(true, |a| !a.settled || a.solution.rejected_share > DOUBTFUL)
}

/// The median residual, by which outcomes are compared: a motion between those of two objects
/// rejects no domain yet fits neither.
fn misfit(outcome: &Outcome) -> f64 {
    match outcome {
        Ok(solved) if solved.settled => solved.solution.scale,
        _ => f64::INFINITY,
    }
}
