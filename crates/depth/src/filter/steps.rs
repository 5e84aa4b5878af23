//! The steps of the filter: predict, judge, compare, remember.

use super::contest::Contest;
use super::gain::{Light, MeasureGain};
use super::pair::Pair;
use super::predict::Predict;
use super::prepare::Prepared;
use super::slip::{Known, MeasureSlip};
use super::state::{Drift, Node, Past};
use super::step::relative;
use super::update::{Update, fade};
use super::{Brightness, DepthFilter, DepthStep};
use crate::{DepthReason, DepthStatus};
use nalgebra::Rotation3;
use sphereflow_core::Plane;

/// An image with less of its pixels textured, or known, says nothing.
const LEAST_SHARE: f32 = 0.02;

/// Updates after which the state says well enough where pixels are to tell whether exact poses are not; earlier
/// ones, of slow starts, are turned by nothing but the state's errors.
const SETTLED: usize = 30;

/// Corrections of a step, each by one linearisation, at most.
const MENDS: usize = 3;

/// A rotation that is told to be exact is off where its squared error over the predicted variance (of three numbers)
/// is above this: where it is exact, states in error lead to 40 in one pair of a thousand.
const CLEAR: f64 = 60.0;

/// Smaller slips, pixels of the filter in the middle of the image, are left to the state's errors.
const LEAST_SLIP_PX: f64 = 0.05;

/// Share of that which frames of late were off by, in the mean, where all pairs are looked at.
const OF_LATE: f64 = 0.1;

/// Share of the frames' rotation errors that a new one changes the measure of them by.
const TURN_MEMORY: f32 = 0.1;

/// Likewise for what that means for all ranges.
const SHARED_MEMORY: f64 = 0.03;

/// Share of the variance of the measured rotations, and of the told one, that is taken to stay after correction.
const LEFT: f32 = 0.1;

/// Parallax below which a pair of images says nothing, pixels of the filter.
const LEAST_PARALLAX_PX: f32 = 0.03;

impl DepthFilter {
    /// A step on one of the pool's threads: waking them for each of its two dozen loops costs milliseconds.
    pub(super) fn advance(&mut self, image: &Plane<f32>) -> DepthStep {
        rayon::scope(|_| self.advance_in_pool(image))
    }

    /// The state at the new pose.
    pub(super) fn predict(&mut self) {
        let Some(last) = self.past.front() else {
            return;
        };
        let memory = self.memory();
        self.lattice.lens.clone().with(Predict {
            lattice: &self.lattice,
            step: relative(&self.motion.pose, &last.world_from_camera),
            old: &self.nodes,
            new: &mut self.spare,
            nearest: &mut self.nearest,
            memory: memory as f32,
            occlusion: self.config.occlusion,
        });
        std::mem::swap(&mut self.nodes, &mut self.spare);
        if self.config.occlusion {
            let (nodes, nearest) = (&mut self.nodes[..], &self.nearest[..]);
            let present = self.motion.present();
            self.keyframes
                .recall(&self.lattice, (nodes, nearest), &present, memory as f32);
        }
    }

    /// Share of information that survives this frame.
    fn memory(&self) -> f64 {
        /// Share early on, so that first mistakes are forgotten.
        const EARLY: f64 = 0.8;
        /// Part of the start after which more and more is kept: by its end what is known is no mistake.
        const UNSETTLED: f64 = 2.0 / 3.0;
        let Self {
            updates, config, ..
        } = self;
        if *updates >= config.start_frames {
            return config.memory;
        }
        let done = *updates as f64 / config.start_frames as f64;
        let way = ((done - UNSETTLED) / (1.0 - UNSETTLED)).max(0.0);
        // What is lost falls by equal factors.
        1.0 - (1.0 - EARLY).powf(1.0 - way) * (1.0 - config.memory).powf(way)
    }

    /// Information of a pair on the scale of all depths, 1 over relative variance; a lag's pairs share their
    /// motion with as many frames.
    fn scale_per_frame(distance_m: f64, drift: &Drift, lag: usize, depth_m: f64) -> f64 {
        let variance = f64::from(drift.translation) + f64::from(drift.rotation) * depth_m.powi(2);
        distance_m.powi(2) / (variance * lag as f64)
    }

    /// Whether image and motion can say anything.
    pub(super) fn verdict(&self, prepared: &Prepared) -> DepthStatus {
        if prepared.known < LEAST_SHARE {
            let share = f64::from(prepared.known);
            return DepthStatus::Unusable(DepthReason::FewKnownPixels { share });
        }
        if prepared.textured < LEAST_SHARE {
            let share = f64::from(prepared.textured);
            return DepthStatus::Unusable(DepthReason::NoTexture { share });
        }
        // Unusable images leave gaps in the past: it may have nothing to compare with.
        if self.compared().next().is_none() {
            return DepthStatus::Started;
        }
        let least_m = self.least_baseline_m();
        let (mut baseline_m, mut turn, mut sees) = (0.0_f64, 0.0_f64, false);
        for (_, past) in self.compared() {
            let (distance, angle) = self.motion.pose.distance_and_angle(&past.world_from_camera);
            baseline_m = baseline_m.max(distance);
            turn = turn.max(angle);
            sees |= distance > least_m;
        }
        match () {
            () if sees => DepthStatus::Updated,
            () if turn > 1e-4 => {
                DepthStatus::Unobservable(DepthReason::PureRotation { baseline_m })
            }
            () => DepthStatus::Unobservable(DepthReason::NoMotion { baseline_m }),
        }
    }

    /// Baseline whose parallax in the middle of the image is just enough, metres.
    fn least_baseline_m(&self) -> f64 {
        f64::from(LEAST_PARALLAX_PX) / (f64::from(self.lattice.focal_px) * self.middle_zeta())
    }

    /// zeta in the middle of the image, 1/m.
    fn middle_zeta(&self) -> f64 {
        let middle = self.lattice.height / 2 * self.lattice.width + self.lattice.width / 2;
        let zeta = f64::from(self.nodes[middle][0]);
        if zeta > 0.0 {
            zeta
        } else {
            1.0 / self.config.initial_range_m
        }
    }

    /// The new image and a past one, before their light is compared.
    fn pair<'a>(&'a self, new: &'a Prepared, (lag, past): (usize, &'a Past)) -> Pair<'a> {
        let drift = self.motion.drift.since(&past.drift);
        Pair {
            lattice: &self.lattice,
            step: relative(&self.motion.pose, &past.world_from_camera),
            new,
            past: &past.image,
            surface: if self.config.occlusion {
                &past.surface
            } else {
                &[]
            },
            gain: Vec::new(),
            told: Vec::new(),
            drift: drift.plus(&self.motion.noise).plus(&past.noise),
            lag,
            repeats: self.repeats(lag),
        }
    }

    /// Puts a pair's step right: by as much as poses are told to be off, or, where they are told to be exact, by
    /// a rotation that is clear. Returns the variance per axis of the rotation that was missing, rad^2.
    ///
    /// Of poses that are told to be exact one pair an image is looked at, in turn, unless some were not of late.
    fn mend(&self, pair: &mut Pair<'_>, nodes: &[Node], depth_m: f64, in_turn: bool) -> f32 {
        let mut known = Known::of(pair, 1.0 / depth_m);
        let focal_px = f64::from(self.lattice.focal_px);
        let off_px = f64::from(self.turn_variance.sqrt()) * focal_px;
        let asked = self.updates >= SETTLED && (in_turn || off_px > OF_LATE * LEAST_SLIP_PX);
        if !known.told && !asked {
            return 0.0;
        }
        let mut left = None;
        for _ in 0..MENDS {
            let slip = self.lattice.lens.with(MeasureSlip { pair, nodes, known });
            let size_px = focal_px * slip.rotation().norm().max(slip.place().norm() / depth_m);
            if size_px < LEAST_SLIP_PX || (!known.told && slip.chi < CLEAR) {
                break;
            }
            known.mend(&slip);
            left = Some(slip.left);
            let rotation = Rotation3::new(slip.rotation().cast::<f32>());
            pair.step.rotation = rotation.matrix() * pair.step.rotation;
            pair.step.translation = rotation * pair.step.translation + slip.place().cast::<f32>();
        }
        if let (true, Some([rotation, place])) = (known.told, left) {
            pair.drift.rotation = rotation as f32 + LEFT * pair.drift.rotation;
            pair.drift.translation = place as f32 + LEFT * pair.drift.translation;
        }
        pair.drift.rotation += LEFT * self.turn_variance;
        known.turned() as f32
    }

    /// Brightness of an image against a past one.
    fn light(&self, prepared: &Prepared, past: (usize, &Past), nodes: &[Node]) -> Light {
        match self.config.brightness {
            Brightness::Constant => Light {
                gain: vec![1.0; self.lattice.height],
                past: Vec::new(),
                told: vec![1.0; self.lattice.height],
            },
            Brightness::Measured => self.lattice.lens.with(MeasureGain {
                pair: &self.pair(prepared, past),
                nodes,
            }),
        }
    }

    /// What the image is compared with: lag, past frame, baseline, light, and the past image in the light of the
    /// new one where light runs over the rows.
    fn comparisons<'a>(
        &'a self,
        prepared: &Prepared,
        nodes: &[Node],
        least_m: f64,
    ) -> Vec<Comparison<'a>> {
        let comparison = |(lag, past): (usize, &'a Past)| {
            let (distance_m, _) = self.motion.pose.distance_and_angle(&past.world_from_camera);
            (distance_m > least_m).then(|| {
                let light = self.light(prepared, (lag, past), nodes);
                let rolls = !light.past.is_empty();
                let width = self.lattice.width;
                Comparison {
                    lag,
                    past,
                    distance_m,
                    lit: rolls.then(|| past.image.lit(&light.past, width)),
                    gain: light.gain,
                    told: light.told,
                }
            })
        };
        self.compared().filter_map(comparison).collect()
    }

    pub(super) fn update(&mut self, prepared: &Prepared, step: &mut DepthStep) {
        let least_m = self.least_baseline_m();
        let (mut scale, depth_m) = (0.0_f64, 1.0 / self.middle_zeta());
        let mut nodes = std::mem::take(&mut self.nodes);
        let mut trust = std::mem::take(&mut self.trust);
        let mut doubt = std::mem::take(&mut self.doubt);
        let (mut turns, mut longest_m) = (0.0, least_m);
        let comparisons = self.comparisons(prepared, &nodes, least_m);
        let mut pairs = Vec::with_capacity(comparisons.len());
        for (index, of) in comparisons.iter().enumerate() {
            let mut pair = self.pair(prepared, (of.lag, of.past));
            pair.past = of.lit.as_ref().unwrap_or(pair.past);
            pair.gain.clone_from(&of.gain);
            pair.told.clone_from(&of.told);
            let in_turn = index == self.updates % comparisons.len();
            turns += self.mend(&mut pair, &nodes, depth_m, in_turn);
            longest_m = longest_m.max(of.distance_m);
            scale = scale.max(Self::scale_per_frame(
                of.distance_m,
                &pair.drift,
                of.lag,
                depth_m,
            ));
            pairs.push(pair);
        }
        if self.config.occlusion {
            let contest = Contest {
                pairs: &pairs,
                nodes: &mut nodes,
            };
            self.lattice.lens.with(contest);
        }
        let turns = turns / pairs.len().max(1) as f32;
        doubt.begin(&self.lattice, prepared.margin as usize);
        let tally = self.lattice.lens.with(Update {
            pairs: &pairs,
            nodes: &mut nodes,
            trust: &mut trust,
            views: doubt.views(),
        });
        drop(pairs);
        fade(&mut nodes, &trust, doubt.views());
        doubt.learn(&tally);
        (self.trust, self.doubt) = (trust, doubt);
        self.turn_variance += TURN_MEMORY * (turns - self.turn_variance);
        let shared = f64::from(self.turn_variance) * (depth_m / longest_m).powi(2);
        self.shared_variance += SHARED_MEMORY * (shared.min(1.0) - self.shared_variance);
        self.nodes = nodes;
        self.scale_information = self.memory() * self.scale_information + scale;
        step.fitting_share = tally.fitting as f32 / tally.compared as f32;
    }

    /// The image and the surface it saw, for the frames to come. An unusable image leaves a gap.
    pub(super) fn remember(&mut self, mut image: Prepared, mut surface: Vec<f32>, usable: bool) {
        /// Relative deviation up to which a surface may hide others; early mistakes should not.
        const TRUSTED: f32 = 0.1;
        const EARLY: f32 = 0.03;
        let settled = self.updates >= self.config.start_frames;
        let trusted = if settled { TRUSTED } else { EARLY };
        surface.clear();
        if self.config.occlusion {
            let zeta = |n: &Node| {
                let known = n[3] < (trusted * n[0]).powi(2);
                if known { n[0] } else { 0.0 }
            };
            surface.extend(self.nodes.iter().map(zeta));
        }
        if !usable {
            image.pixel.clear();
        }
        self.past.push_front(Past {
            image,
            world_from_camera: self.motion.pose,
            surface,
            drift: self.motion.drift,
            noise: self.motion.noise,
        });
    }
}

/// A past frame that an image is compared with.
struct Comparison<'a> {
    lag: usize,
    past: &'a Past,
    distance_m: f64,
    gain: Vec<f32>,
    told: Vec<f32>,
    /// The past image in the new one's light, where that is another by rows.
    lit: Option<Prepared>,
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::*;
    use crate::DepthFilterConfig;
    use sphereflow_sphere::Camera;

    #[test]
    fn memory_is_short_at_the_start_and_grows_to_what_was_asked() {
        let camera = Camera::pinhole(60.0, 60.0, 31.5, 23.5, 64, 48).unwrap();
        let config = DepthFilterConfig {
            start_frames: 30,
            memory: 0.997,
            ..DepthFilterConfig::default()
        };
        let mut filter = DepthFilter::new(&camera, config).unwrap();
        let memory: Vec<f64> = (0..40)
            .map(|updates| {
                filter.updates = updates;
                filter.memory()
            })
            .collect();
        assert!(memory[..=20].iter().all(|kept| (kept - 0.8).abs() < 1e-12));
        assert!(memory[30..].iter().all(|kept| *kept == 0.997));
        // What is lost falls by one factor from image to image.
        let factor = (0.003_f64 / 0.2).powf(0.1);
        for pair in memory[20..=30].windows(2) {
            let lost = (1.0 - pair[1]) / (1.0 - pair[0]);
            assert!((lost - factor).abs() < 1e-9, "{lost}, {factor}");
        }
        filter.config.start_frames = 0;
        filter.updates = 0;
        assert_eq!(filter.memory(), 0.997);
    }
}
