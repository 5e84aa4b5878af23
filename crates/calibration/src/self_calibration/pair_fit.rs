//! One pair of frames: its motion under given values, and what it says of the values beyond it.

use super::frames::{Frame, FramePair};
use super::image_model::ImageModel;
use super::row_warp::RowWarp;
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use sphereflow_alignment::area_integrals::AreaIntegrals;
use sphereflow_alignment::binning::InverseDepth;
use sphereflow_alignment::observability::Spectrum;
use sphereflow_alignment::pose_from_twist;
use sphereflow_alignment::tiling::Tiling;
use sphereflow_alignment::{CellSums, Pair, weak_form::WeakForm};
use sphereflow_core::statistics::mad_sigma_mut;
use sphereflow_core::{Pose, Twist};

/// Cauchy's constant in units of the residuals' robust sigma: 95 % efficiency.
const CAUCHY: f64 = 2.385;
/// Reweighted solves for the motion after each warp.
const SWEEPS: usize = 5;
/// Step of the differences by the motion, radians and metres: a pixel of a Kinect or less.
const MOTION_STEP: f64 = 1e-3;
/// Weakest that is known of a motion before the pair is looked at: 1 rad, 1 m.
const MOTION_INFORMATION: f64 = 1.0;

/// What is the same for all pairs.
#[derive(Clone, Debug)]
pub(super) struct PairRules {
    pub(super) tiling: Tiling,
    pub(super) domain_known_share: f64,
    pub(super) min_domains: usize,
    pub(super) max_jump: f32,
    /// Smallest residual sigma that is believed, 1/m.
    pub(super) least_noise: f64,
    /// Largest residual sigma of a pair that is used, 1/m.
    pub(super) largest_noise: f64,
}

/// A domain: `change = coefficients . motion`, means over its solid angle.
#[derive(Clone, Copy, Debug)]
struct Row {
    cell: usize,
    change: f64,
    coefficients: Vector6<f64>,
}

/// The motion of a pair found under one set of values.
#[derive(Clone, Debug)]
pub(super) struct Aligned {
    pub(super) motion: Pose,
    /// Robust sigma of the domains' residuals, 1/m.
    pub(super) noise: f64,
}

/// What a pair says of the values once its motion is eliminated: `information delta = right`.
#[derive(Clone, Debug)]
pub(super) struct Normal {
    pub(super) information: DMatrix<f64>,
    pub(super) right: DVector<f64>,
}

/// Working memory of one pair.
pub(super) struct PairFit<'a> {
    rules: &'a PairRules,
    frames: [&'a Frame; 2],
    velocities: [Vector6<f64>; 2],
    motion: Pose,
    first: InverseDepth,
    second: InverseDepth,
    warped: InverseDepth,
    pair: Pair,
    sums: Vec<CellSums>,
    inside: AreaIntegrals,
    rows: Vec<Row>,
}

impl<'a> PairFit<'a> {
    pub(super) fn new(
        rules: &'a PairRules,
        frames: &'a [Frame],
        velocities: &[Vector6<f64>],
        pair: &FramePair,
    ) -> Option<Self> {
        let of = |i: usize| frames.get(i).zip(velocities.get(i));
        let ((first, v0), (second, v1)) = of(pair.first).zip(of(pair.second))?;
        Some(Self {
            rules,
            frames: [first, second],
            velocities: [*v0, *v1],
            motion: pair.motion,
            first: InverseDepth::default(),
            second: InverseDepth::default(),
            warped: InverseDepth::default(),
            pair: Pair::default(),
            sums: Vec::new(),
            inside: AreaIntegrals::default(),
            rows: Vec::new(),
        })
    }

    /// Finds the motion under `model`: warp, solve, and again. `None` where too little is seen of
    /// the same or it does not fit.
    pub(super) fn align(&mut self, model: &ImageModel, solves: usize) -> Option<Aligned> {
        for _ in 0..solves {
            self.measure(model)?;
            let step = Twist::from_vector(&self.robust_step());
            self.motion = pose_from_twist(&step, 1.0) * self.motion;
        }
        self.measure(model)?;
        let noise = self.noise(&Vector6::zeros());
        (noise <= self.rules.largest_noise).then_some(Aligned {
            motion: self.motion,
            noise,
        })
    }

    /// The equations of the values at the motion that [`Self::align`] found: residuals by
    /// differences towards `changed`, one model and step per value.
    pub(super) fn normal(
        &mut self,
        model: &ImageModel,
        changed: &[(ImageModel, f64)],
        noise: f64,
    ) -> Normal {
        let n = changed.len();
        let base = self.pair.clone();
        let motion = self.motion;
        // The motion's slopes too: those of the weak form are a percent or two off, which is much
        // where a parameter differs little from a motion.
        let mut motion_slopes = DMatrix::zeros(self.rows.len(), 6);
        for k in 0..6 {
            let mut step = Vector6::zeros();
            step[k] = MOTION_STEP;
            self.motion = pose_from_twist(&Twist::from_vector(&step), 1.0) * motion;
            self.look(model);
            self.slopes(&base, (model, model), MOTION_STEP, k, &mut motion_slopes);
        }
        self.motion = motion;
        let mut slopes = DMatrix::zeros(self.rows.len(), n);
        for (k, (other, step)) in changed.iter().enumerate() {
            self.look(other);
            self.slopes(&base, (model, other), *step, k, &mut slopes);
        }
        let sigma = noise.max(self.rules.least_noise);
        let mut own = Matrix6::identity() * MOTION_INFORMATION;
        let mut own_right = Vector6::zeros();
        let mut cross = DMatrix::zeros(6, n);
        let mut information = DMatrix::zeros(n, n);
        let mut right = DVector::zeros(n);
        for (r, row) in self.rows.iter().enumerate() {
            let weight = cauchy(row.change, sigma) / (sigma * sigma);
            let slope = slopes.row(r).transpose();
            let moved = Vector6::from_iterator(motion_slopes.row(r).iter().copied());
            // change + slope . delta + moved . motion = 0
            own += moved * moved.transpose() * weight;
            own_right -= moved * (weight * row.change);
            cross += moved * slope.transpose() * weight;
            information += &slope * slope.transpose() * weight;
            right -= &slope * (weight * row.change);
        }
        // The identity in `own` makes it invertible.
        let inverse = own.try_inverse().unwrap_or_else(Matrix6::zeros);
        let eliminated = cross.transpose() * inverse;
        Normal {
            information: information - &eliminated * &cross,
            right: right - &eliminated * own_right,
        }
    }

    /// Both images under `model`, the second warped into the first.
    fn look(&mut self, model: &ImageModel) {
        model.correct(&self.frames[0].measured, &mut self.first);
        model.correct(&self.frames[1].measured, &mut self.second);
        let warp = RowWarp {
            model,
            second: &self.second,
            motion: self.motion,
            velocities: self.velocities,
            max_jump: self.rules.max_jump,
        };
        warp.fill(&self.first, &mut self.warped);
        self.pair.fill(&model.table, &self.first, &self.warped);
    }

    /// The domains' balances at the current motion.
    fn measure(&mut self, model: &ImageModel) -> Option<()> {
        self.look(model);
        let form = WeakForm {
            table: &model.table,
            tiling: &self.rules.tiling,
            pair: &self.pair,
            max_jump: self.rules.max_jump,
        };
        form.accumulate(&mut self.sums, &mut self.inside);
        self.rows.clear();
        let share = self.rules.domain_known_share;
        for (cell, (sum, &full)) in self.sums.iter().zip(&self.rules.tiling.full).enumerate() {
            if sum.count > 0 && f64::from(sum.count) >= share * f64::from(full) {
                self.rows.push(Row {
                    cell,
                    change: sum.change / sum.area,
                    coefficients: Vector6::from(sum.coefficients) / sum.area,
                });
            }
        }
        (self.rows.len() >= self.rules.min_domains).then_some(())
    }

    /// How well the scene determines the pair's motion, 0 to 1 (Theorem 3); `None` where too
    /// little of it is known.
    pub(super) fn score(&mut self, model: &ImageModel) -> Option<f64> {
        self.measure(model)?;
        let (mut normal, mut range_m) = (Matrix6::zeros(), 0.0);
        for row in &self.rows {
            normal += row.coefficients * row.coefficients.transpose();
            range_m += self.sums[row.cell].area / self.sums[row.cell].gamma;
        }
        Some(Spectrum::new(&normal, range_m / self.rows.len() as f64).score())
    }

    /// Robust solution of the balances for the rest of the motion.
    fn robust_step(&self) -> Vector6<f64> {
        let mut step = Vector6::zeros();
        for _ in 0..SWEEPS {
            let sigma = self.noise(&step).max(self.rules.least_noise);
            let mut normal = Matrix6::identity() * (MOTION_INFORMATION * sigma * sigma);
            let mut right = Vector6::zeros();
            for row in &self.rows {
                let residual = row.change - row.coefficients.dot(&step);
                let weighted = row.coefficients * cauchy(residual, sigma);
                normal += weighted * row.coefficients.transpose();
                right += weighted * row.change;
            }
            match normal.try_inverse() {
                Some(inverse) => step = inverse * right,
                None => return Vector6::zeros(),
            }
        }
        step
    }

    /// Robust sigma of the residuals.
    fn noise(&self, step: &Vector6<f64>) -> f64 {
        let residual = |row: &Row| row.change - row.coefficients.dot(step);
        let mut residuals: Vec<f64> = self.rows.iter().map(residual).collect();
        mad_sigma_mut(&mut residuals).unwrap_or(f64::INFINITY)
    }

    /// Column `k` of `slopes`: difference from `base` by `step`, row by row.
    fn slopes(
        &self,
        base: &Pair,
        models: (&ImageModel, &ImageModel),
        step: f64,
        k: usize,
        slopes: &mut DMatrix<f64>,
    ) {
        let change = self.difference(base, models);
        for (r, row) in self.rows.iter().enumerate() {
            slopes[(r, k)] = change[row.cell] / step;
        }
    }

    /// Domain means of the residual now minus that of `base`, over the rays known in both: a ray
    /// that appears or vanishes is no derivative. Zero for a domain without any.
    ///
    /// The residual counts in units of its own noise, which the field multiplies as it does 1/Z:
    /// otherwise a field that shrinks 1/Z, and gives back the mean by its additive part, would shrink
    /// the noise and seem to fit better.
    fn difference(&self, base: &Pair, (from, to): (&ImageModel, &ImageModel)) -> Vec<f64> {
        let tiling = &self.rules.tiling;
        let mut sums = vec![(0.0_f64, 0.0_f64); tiling.cells];
        let width = from.table.width;
        for (y, row) in tiling.row.iter().enumerate() {
            for (x, column) in tiling.column.iter().enumerate() {
                let i = y * width + x;
                let now = self.pair.half[i] * (from.factor[i] / to.factor[i]);
                let change = 2.0 * (now - base.half[i]);
                if change.is_nan() {
                    continue;
                }
                let area = f64::from(from.table.area[i]);
                let sum = &mut sums[(row + column) as usize];
                sum.0 += f64::from(change) * area;
                sum.1 += area;
            }
        }
        let mean = |(change, area): (f64, f64)| if area > 0.0 { change / area } else { 0.0 };
        sums.into_iter().map(mean).collect()
    }
}

fn cauchy(residual: f64, sigma: f64) -> f64 {
    let ratio = residual / (CAUCHY * sigma);
    1.0 / (1.0 + ratio * ratio)
}
