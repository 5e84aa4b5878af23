//! Calibration files of schema 1: the depth camera's entries at the top, older names.

use super::layout::{Document, Fields, SCHEMA, Transform};
use super::{CameraEntry, ImuNoise};
use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FirstDocument {
    #[serde(default)]
    #[allow(dead_code, reason = "a file may say that it is of schema 1")]
    schema: Option<u32>,
    model: String,
    width: usize,
    height: usize,
    depth_scale: f64,
    readout_s: Option<f64>,
    time_offset_s: Option<f64>,
    gravity_in_world_m_s2: Option<[f64; 3]>,
    parameters: BTreeMap<String, f64>,
    depth_correction: Option<Fields>,
    camera_from_imu: Option<Transform>,
    imu_noise: Option<ImuNoise>,
}

impl FirstDocument {
    /// The same content in today's layout.
    pub(super) fn migrated(self) -> Document {
        Document {
            schema: SCHEMA,
            depth_scale: self.depth_scale,
            readout_s: self.readout_s,
            colour_offset_s: None,
            imu_offset_s: self.time_offset_s,
            gravity_in_world_m_s2: self.gravity_in_world_m_s2,
            depth: CameraEntry {
                model: self.model,
                width: self.width,
                height: self.height,
                parameters: self.parameters,
            },
            colour: None,
            colour_from_depth: None,
            depth_field: self.depth_correction,
            camera_from_imu: self.camera_from_imu,
            imu_noise: self.imu_noise,
            deviations: BTreeMap::new(),
        }
    }
}
