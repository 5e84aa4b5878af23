//! Keyframes whose surfaces overlap by the poses known so far, aligned with each other.

use crate::config::GraphConfig;
use crate::map::keyframe::Keyframe;
use crate::map::keyframe_graph::Edge;
use nalgebra::{Matrix6, Vector6};
use sphereflow_alignment::{Aligner, Alignment, Priors};
use sphereflow_core::Pose;
use sphereflow_odometry::KeyframePolicy;
use sphereflow_solver::StopFlag;

/// An aligned pair beyond this robust residual, in units of the noise, is not believed.
const MAX_RESIDUAL_SCALE: f64 = 5.0;
/// Factor on the formal standard deviation of an alignment between keyframes.
const FORMAL_SCALE: f64 = 2.0;

/// The motions measured, and how many pairs were compared without result.
pub(crate) struct Found {
    pub(crate) edges: Vec<Edge>,
    pub(crate) failed: usize,
}

/// Every keyframe with its parent and with the earlier ones that may see the same surface; `None`
/// where `stop` was raised.
pub(crate) fn compare_all(
    keyframes: &[Keyframe],
    aligner: &mut Aligner,
    config: &GraphConfig,
    policy: &KeyframePolicy,
    stop: &StopFlag,
    progress: &mut impl FnMut(usize),
) -> Option<Found> {
    let mut found = Found {
        edges: parent_edges(keyframes, config),
        failed: 0,
    };
    for b in 1..keyframes.len() {
        for (a, predicted) in candidates(&keyframes[..=b], aligner, config) {
            if stop.is_raised() {
                return None;
            }
            match compare((a, b), keyframes, predicted, aligner, config, policy) {
                Some(edge) => found.edges.push(edge),
                None => found.failed += 1,
            }
        }
        progress(b + 1);
    }
    Some(found)
}

/// The measured motion from each keyframe to the one that it hung on.
fn parent_edges(keyframes: &[Keyframe], config: &GraphConfig) -> Vec<Edge> {
    let of_parent = |(b, keyframe): (usize, &Keyframe)| {
        let parent = keyframe.parent?;
        let information = (parent.covariance + floor(config)).try_inverse()?;
        Some(Edge {
            a: parent.keyframe,
            b,
            a_from_b: parent.keyframe_from_camera,
            information,
        })
    };
    keyframes.iter().enumerate().filter_map(of_parent).collect()
}

/// Earlier keyframes that may see what the last one sees, with the motion predicted.
fn candidates(
    keyframes: &[Keyframe],
    aligner: &mut Aligner,
    config: &GraphConfig,
) -> Vec<(usize, Pose)> {
    let Some((last, earlier)) = keyframes.split_last() else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (a, keyframe) in earlier.iter().enumerate() {
        let a_from_b = keyframe.world_from_keyframe.inverse() * last.world_from_keyframe;
        let (distance_m, angle_rad) = a_from_b.distance_and_angle(&Pose::identity());
        if distance_m > config.max_distance_m || angle_rad > config.max_angle_rad {
            continue;
        }
        let (overlap, _) = aligner.overlap_and_flow(&keyframe.image, &a_from_b);
        if overlap > config.min_overlap {
            found.push((overlap, a, a_from_b));
        }
    }
    found.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
    found.truncate(config.max_edges);
    found.into_iter().map(|(_, a, pose)| (a, pose)).collect()
}

/// The measured motion between two keyframes; `None` where it is not to be believed.
fn compare(
    (a, b): (usize, usize),
    keyframes: &[Keyframe],
    predicted: Pose,
    aligner: &mut Aligner,
    config: &GraphConfig,
    policy: &KeyframePolicy,
) -> Option<Edge> {
    // The rolling shutter was undone when they became keyframes.
    let (first, second) = (&keyframes[a].image, &keyframes[b].image);
    let alignment = aligner.align(first, second, predicted, &Priors::default());
    let surprise_m = (alignment.motion.translation - predicted.translation).norm();
    let good = alignment.settled
        && alignment.residual_scale < MAX_RESIDUAL_SCALE
        && alignment.overlap > policy.least_overlap
        && alignment.rank == 6
        && surprise_m < policy.max_surprise_m;
    if !good {
        return None;
    }
    let information = covariance(aligner, &alignment, config)?.try_inverse()?;
    Some(Edge {
        a,
        b,
        a_from_b: alignment.motion,
        information,
    })
}

/// What the residuals show, and the floor below which no comparison is trusted.
fn covariance(
    aligner: &Aligner,
    alignment: &Alignment,
    config: &GraphConfig,
) -> Option<Matrix6<f64>> {
    let ratio = FORMAL_SCALE / aligner.config().covariance.scale;
    let formal = alignment.formal_covariance(aligner.config(), 1.0)?;
    Some(formal * (ratio * ratio) + floor(config))
}

fn floor(config: &GraphConfig) -> Matrix6<f64> {
    let (w, v) = (config.floor_rad.powi(2), config.floor_m.powi(2));
    Matrix6::from_diagonal(&Vector6::new(w, w, w, v, v, v))
}
