//! The layout of a calibration file, as serde reads and writes it.

use super::{CameraEntry, ImuNoise};
use serde::{Deserialize, Serialize};
use sphereflow_core::{Error as CoreError, Pose};
use sphereflow_sphere::DepthCorrection;
use sphereflow_sphere::depth_correction::{TERM_COUNT, TERM_NAMES};
use std::collections::BTreeMap;

/// Version of the layout that is written; a key is never given another meaning under one number.
pub(super) const SCHEMA: u32 = 2;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Document {
    pub(super) schema: u32,
    pub(super) depth_scale: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) readout_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) colour_offset_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) imu_offset_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) gravity_in_world_m_s2: Option<[f64; 3]>,
    pub(super) depth: CameraEntry,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) colour: Option<CameraEntry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) colour_from_depth: Option<Transform>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) depth_field: Option<Fields>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) camera_from_imu: Option<Transform>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) imu_noise: Option<ImuNoise>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) deviations: BTreeMap<String, f64>,
}

/// A correction of depth; a term that is not named is zero.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Fields {
    #[serde(default)]
    relative: BTreeMap<String, f64>,
    #[serde(default)]
    additive: BTreeMap<String, f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Transform {
    translation: [f64; 3],
    quat_xyzw: [f64; 4],
}

impl Fields {
    pub(super) fn of(correction: &DepthCorrection) -> Self {
        let named = |values: &[f64; TERM_COUNT]| {
            let pairs = TERM_NAMES.iter().zip(values);
            let set = pairs.filter(|(_, value)| **value != 0.0);
            set.map(|(name, &value)| (name.to_string(), value))
                .collect()
        };
        Self {
            relative: named(correction.relative()),
            additive: named(correction.additive()),
        }
    }

    pub(super) fn correction(&self) -> std::result::Result<DepthCorrection, CoreError> {
        let list = |named: &BTreeMap<String, f64>| -> Vec<(String, f64)> {
            named
                .iter()
                .map(|(name, &value)| (name.clone(), value))
                .collect()
        };
        DepthCorrection::from_named(&list(&self.relative), &list(&self.additive))
    }
}

impl Transform {
    pub(super) fn of(pose: &Pose) -> Self {
        Self {
            translation: pose.translation.into(),
            quat_xyzw: pose.quat_xyzw(),
        }
    }

    /// A quaternion written by us is unit already, and keeps its bits.
    pub(super) fn pose(&self) -> std::result::Result<Pose, CoreError> {
        crate::trajectory::pose_from_parts(self.translation, self.quat_xyzw)
    }
}
