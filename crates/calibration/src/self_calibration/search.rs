//! The search for the values: align every pair, sum their equations, step, and again.

use super::SelfCalibrationConfig;
use super::frames::{Frame, FramePair, frame_step, pairs, velocities};
use super::image_model::ImageModel;
use super::pair_fit::{Normal, PairFit, PairRules};
use super::parameters::Unknowns;
use super::result::{CalibrationStatus, SelfCalibration};
use super::solve::{System, parameters};
use crate::Result;
use nalgebra::{DMatrix, DVector, Vector6};
use rayon::prelude::*;
use sphereflow_alignment::Config;
use sphereflow_alignment::tiling::Tiling;
use sphereflow_alignment::twist_from_pose;
use sphereflow_core::statistics::median_mut;
use sphereflow_sphere::Camera;

/// Solves for a pair's motion when it is first looked at, and later.
const FIRST_SOLVES: usize = 4;
const LATER_SOLVES: usize = 2;
/// A pair whose scene determines its motion less than this (Theorem 3) is left out: an odometry
/// drifts along what is undetermined without any motion, and the drift would pass for an error of
/// the depth.
const LEAST_SCORE: f64 = 0.03;
/// Residuals of a pair beyond this many times the noise are no calibration error.
const LARGEST_NOISE: f64 = 15.0;
/// A step below this share of the prior's standard deviation ends the search.
const SETTLED: f64 = 0.02;

/// A pair that fits, with its residual under the values given and now.
#[derive(Clone, Debug)]
struct Candidate {
    pair: FramePair,
    before: f64,
    now: f64,
}

/// The values so far and everything they are found from.
pub(super) struct Search<'a> {
    config: &'a SelfCalibrationConfig,
    frames: &'a [Frame],
    velocities: Vec<Vector6<f64>>,
    rules: PairRules,
    unknowns: Unknowns,
    values: DVector<f64>,
    model: ImageModel,
    candidates: Vec<Candidate>,
    /// How many fitted at the beginning.
    fitted: usize,
    iterations: usize,
    /// The equations of the last step, and how much they promise too much.
    last: Option<System>,
    inflation: f64,
}

impl<'a> Search<'a> {
    /// Aligns all pairs under the values given.
    pub(super) fn new(
        camera: &Camera,
        config: &'a SelfCalibrationConfig,
        odometry: &Config,
        frames: &'a [Frame],
    ) -> Result<Self> {
        let unknowns = Unknowns::new(camera, config);
        let values = unknowns.prior();
        let start = unknowns.calibrated(&values, config.readout_s)?;
        let model = ImageModel::new(&start, config.block, None)?;
        let (width, height) = (model.table.width, model.table.height);
        let rules = PairRules {
            tiling: Tiling::new(width, height, config.domains),
            domain_known_share: odometry.domain_known_share,
            min_domains: odometry.min_domains,
            max_jump: odometry.max_jump as f32,
            least_noise: config.least_noise,
            largest_noise: LARGEST_NOISE * odometry.domain_noise,
        };
        let candidates = pairs(frames, config).into_iter().map(|pair| Candidate {
            pair,
            before: f64::NAN,
            now: f64::NAN,
        });
        let mut search = Self {
            config,
            frames,
            velocities: velocities(frames),
            rules,
            unknowns,
            values,
            model,
            candidates: candidates.collect(),
            fitted: 0,
            iterations: 0,
            last: None,
            inflation: 1.0,
        };
        search.align(FIRST_SOLVES);
        search.keep_determined();
        for candidate in &mut search.candidates {
            candidate.before = candidate.now;
        }
        search.fitted = search.candidates.len();
        Ok(search)
    }

    /// A reason to stop where too few pairs are left.
    pub(super) fn too_few_pairs(&self) -> Option<CalibrationStatus> {
        let (found, config) = (self.candidates.len(), self.config);
        if found < config.min_pairs && self.iterations == 0 {
            return Some(CalibrationStatus::NotObservable(format!(
                "{found} pairs of frames {} to {} frames apart moved {} m against each other and \
                 fit, {} are needed: move the camera about in front of structure",
                config.min_gap, config.max_gap, config.min_motion_m, config.min_pairs
            )));
        }
        (found < (self.fitted / 2).max(config.min_pairs)).then(|| {
            let text = format!("of {} pairs of frames {found} still fit", self.fitted);
            CalibrationStatus::NoImprovement(text)
        })
    }

    /// One Gauss-Newton step; true where it was small.
    pub(super) fn step(&mut self) -> Result<bool> {
        let system = self.system()?;
        self.inflation = system.inflation(&self.away());
        let step = system.step(&self.away(), self.inflation);
        self.last = Some(system);
        self.values += &step;
        self.iterations += 1;
        self.model = self.model_of(&self.values, None)?;
        self.measure_velocities();
        self.align(LATER_SOLVES);
        let size = step.component_div(&self.unknowns.prior_std()).amax();
        Ok(size < SETTLED)
    }

    /// What was found, with its covariance.
    pub(super) fn finish(mut self) -> Result<SelfCalibration> {
        let (before, after) = self.residuals();
        if after >= before {
            let text = format!("the residual went from {before:.3e} to {after:.3e} 1/m");
            return self.unchanged(CalibrationStatus::NoImprovement(text));
        }
        let system = match self.last.take() {
            Some(system) => system,
            None => self.system()?,
        };
        let (share, inflation) = (self.config.observable_share, self.inflation);
        let (held, any_seen) = system.held(&self.unknowns, inflation, share);
        if !any_seen {
            let text = "the motion changed no standard deviation much".to_string();
            return self.unchanged(CalibrationStatus::NotObservable(text));
        }
        let covariance = system.covariance(inflation);
        let mut result = self.result(CalibrationStatus::Calibrated, &self.values)?;
        result.parameters = parameters(&self.unknowns, &self.values, &covariance, share);
        (result.covariance, result.held, result.inflation) = (covariance, held, inflation);
        Ok(result)
    }

    /// The values given, and why nothing better was found.
    pub(super) fn unchanged(self, status: CalibrationStatus) -> Result<SelfCalibration> {
        self.result(status, &self.unknowns.prior())
    }

    fn result(&self, status: CalibrationStatus, values: &DVector<f64>) -> Result<SelfCalibration> {
        let calibrated = self.unknowns.calibrated(values, self.config.readout_s)?;
        let (residual_before, residual_after) = self.residuals();
        let rms = |start: usize| {
            let squares = self
                .velocities
                .iter()
                .map(|v| v.fixed_rows::<3>(start).norm_squared());
            (squares.sum::<f64>() / self.velocities.len().max(1) as f64).sqrt()
        };
        let prior = DMatrix::from_diagonal(&self.unknowns.prior_std().map(|std| std * std));
        let share = self.config.observable_share;
        Ok(SelfCalibration {
            status,
            camera: calibrated.camera,
            correction: calibrated.correction,
            readout_s: calibrated.readout_s,
            parameters: parameters(&self.unknowns, values, &prior, share),
            covariance: prior,
            held: Vec::new(),
            residual_before,
            residual_after,
            inflation: 1.0,
            frames: self.frames.len(),
            pairs: self.candidates.len(),
            iterations: self.iterations,
            rms_rate_rad_s: rms(0),
            rms_speed_m_s: rms(3),
        })
    }

    fn away(&self) -> DVector<f64> {
        &self.values - self.unknowns.prior()
    }

    fn model_of(&self, values: &DVector<f64>, rays: Option<&ImageModel>) -> Result<ImageModel> {
        let calibrated = self.unknowns.calibrated(values, self.config.readout_s)?;
        ImageModel::new(&calibrated, self.config.block, rays)
    }

    /// Velocities from neighbouring frames under the current values: those of the odometry before
    /// the search knew nothing of the rows' times.
    fn measure_velocities(&mut self) {
        let steps: Vec<Option<Vector6<f64>>> = (1..self.frames.len())
            .into_par_iter()
            .map(|second| {
                let pair = frame_step(self.frames, second)?;
                let mut fit = PairFit::new(&self.rules, self.frames, &self.velocities, &pair)?;
                let aligned = fit.align(&self.model, LATER_SOLVES)?;
                let (from, to) = (&self.frames[second - 1], &self.frames[second]);
                let dt_s = to.stamp.seconds_since(from.stamp);
                Some(twist_from_pose(&aligned.motion, dt_s).vector())
            })
            .collect();
        for (i, velocity) in self.velocities.iter_mut().enumerate() {
            let step = |k: Option<usize>| k.and_then(|k| *steps.get(k)?);
            let (before, after) = (step(i.checked_sub(1)), step(Some(i)));
            *velocity = match (before, after) {
                (Some(before), Some(after)) => (before + after) * 0.5,
                (Some(one), None) | (None, Some(one)) => one,
                (None, None) => continue,
            };
        }
    }

    /// Finds all pairs' motions under the current values; those that do not fit are dropped.
    fn align(&mut self, solves: usize) {
        let found: Vec<Option<Candidate>> = self
            .candidates
            .par_iter()
            .map(|candidate| {
                let pair = &candidate.pair;
                let mut fit = PairFit::new(&self.rules, self.frames, &self.velocities, pair)?;
                let aligned = fit.align(&self.model, solves)?;
                let mut candidate = candidate.clone();
                (candidate.pair.motion, candidate.now) = (aligned.motion, aligned.noise);
                Some(candidate)
            })
            .collect();
        self.candidates = found.into_iter().flatten().collect();
    }

    /// Drops the pairs whose motion their scene does not determine.
    fn keep_determined(&mut self) {
        let determined: Vec<bool> = self
            .candidates
            .par_iter()
            .map(|candidate| {
                let pair = &candidate.pair;
                let fit = PairFit::new(&self.rules, self.frames, &self.velocities, pair);
                let score = fit.and_then(|mut fit| fit.score(&self.model));
                score.is_some_and(|score| score >= LEAST_SCORE)
            })
            .collect();
        let mut determined = determined.into_iter();
        self.candidates
            .retain(|_| determined.next().unwrap_or(false));
    }

    /// The equations of all pairs at the current values.
    fn system(&self) -> Result<System> {
        let changed: Vec<(ImageModel, f64)> = (0..self.unknowns.len())
            .into_par_iter()
            .map(|i| {
                let step = self.unknowns.step(i);
                let mut values = self.values.clone();
                values[i] += step;
                let rays = (!self.unknowns.changes_rays(i)).then_some(&self.model);
                Ok((self.model_of(&values, rays)?, step))
            })
            .collect::<Result<_>>()?;
        let normals: Vec<Option<Normal>> = self
            .candidates
            .par_iter()
            .map(|candidate| {
                let pair = &candidate.pair;
                let mut fit = PairFit::new(&self.rules, self.frames, &self.velocities, pair)?;
                let aligned = fit.align(&self.model, 0)?;
                Some(fit.normal(&self.model, &changed, aligned.noise))
            })
            .collect();
        let normals: Vec<Normal> = normals.into_iter().flatten().collect();
        Ok(System::new(&self.unknowns, &normals))
    }

    /// Median residual of the pairs that fit now: under the values given, and now.
    fn residuals(&self) -> (f64, f64) {
        let median = |of: fn(&Candidate) -> f64| {
            let mut sizes: Vec<f64> = self.candidates.iter().map(of).collect();
            median_mut(&mut sizes).unwrap_or(f64::NAN)
        };
        (median(|c| c.before), median(|c| c.now))
    }
}
