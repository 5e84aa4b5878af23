//! One solve on one level: the second image warped, the weak form summed, the robust solve.

use super::{Aligner, COARSE_STEPS, FINE_STEPS, Task};
use crate::brightness::Images;
use crate::config::Config;
use crate::robust::{Prior, Solution};
use crate::row_motion;
use crate::warp::Warp;
use crate::weak_form::WeakForm;
use nalgebra::Vector6;
use sphereflow_core::{Pose, Reason, Twist};
use sphereflow_sphere::RollingShutter;
use sphereflow_sphere::lie::se3;

impl Aligner {
    /// Makes the pair of the first image and the second one seen from the first's pose.
    pub(super) fn warp(&mut self, config: &Config, task: &Task<'_>, level: usize, motion: Pose) {
        let shutter = task
            .priors
            .readout
            .map_or_else(RollingShutter::default, |readout| {
                let moved = readout.keyframe_from_earlier.inverse() * motion;
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
    pub(super) fn add_brightness(
        &mut self,
        config: &Config,
        task: &Task<'_>,
        level: usize,
        prior: &mut Prior,
    ) {
        let Some((first, second)) = task.priors.brightness else {
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
    pub(super) fn solve(
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
}
