//! The TOML document of a calibration: reading it with errors that name the field, and writing it.

use super::{Calibration, ImuNoise};
use crate::{Error, Result, beside};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use sphereflow_core::{Error as CoreError, Pose};
use sphereflow_sphere::DepthCorrection;
use sphereflow_sphere::depth_correction::{TERM_COUNT, TERM_NAMES};
use std::collections::BTreeMap;
use std::path::Path;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    model: String,
    width: usize,
    height: usize,
    depth_scale: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    readout_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_offset_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gravity_in_world_m_s2: Option<[f64; 3]>,
    parameters: BTreeMap<String, f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    depth_correction: Option<Fields>,
    #[serde(skip_serializing_if = "Option::is_none")]
    camera_from_imu: Option<Transform>,
    #[serde(skip_serializing_if = "Option::is_none")]
    imu_noise: Option<ImuNoise>,
}

/// A depth correction; a term that is not named is zero.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Fields {
    #[serde(default)]
    relative: BTreeMap<String, f64>,
    #[serde(default)]
    additive: BTreeMap<String, f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Transform {
    translation: [f64; 3],
    quat_xyzw: [f64; 4],
}

impl Calibration {
    /// Read a calibration file.
    ///
    /// # Errors
    /// [`Error::Calibration`] naming the field that is missing, unknown, of the wrong type, not
    /// finite or out of range; [`Error::System`] where the file cannot be read.
    pub fn read(path: &Path) -> Result<Self> {
        let text = crate::rows::read_text(path)?;
        Self::from_toml(&text, path)
    }

    /// From the text of a calibration file; `path` is for messages only.
    ///
    /// # Errors
    /// As [`Calibration::read`].
    pub fn from_toml(text: &str, path: &Path) -> Result<Self> {
        let document: Document =
            toml::from_str(text).map_err(|error| document_error(path, text, &error))?;
        let camera_from_imu = document.camera_from_imu.map(|t| t.pose()).transpose();
        let calibration = Self {
            model: document.model,
            width: document.width,
            height: document.height,
            parameters: document.parameters,
            depth_scale: document.depth_scale,
            readout_s: document.readout_s,
            time_offset_s: document.time_offset_s,
            gravity_in_world_m_s2: document.gravity_in_world_m_s2.map(Vector3::from),
            depth_correction: document
                .depth_correction
                .map(|fields| fields.correction())
                .transpose()
                .map_err(|error| field_error(path, "depth_correction.", error))?,
            camera_from_imu: camera_from_imu
                .map_err(|error| field_error(path, "camera_from_imu.", error))?,
            imu_noise: document.imu_noise,
        };
        calibration.check(path)?;
        Ok(calibration)
    }

    /// The text of the calibration file.
    ///
    /// # Errors
    /// [`Error::Calibration`] where a value would not be read back; `path` is for messages only.
    pub fn to_toml(&self, path: &Path) -> Result<String> {
        self.check(path)?;
        let document = Document {
            model: self.model.clone(),
            width: self.width,
            height: self.height,
            depth_scale: self.depth_scale,
            readout_s: self.readout_s,
            time_offset_s: self.time_offset_s,
            gravity_in_world_m_s2: self.gravity_in_world_m_s2.map(Into::into),
            parameters: self.parameters.clone(),
            depth_correction: self.depth_correction.as_ref().map(Fields::of),
            camera_from_imu: self.camera_from_imu.map(|pose| Transform {
                translation: pose.translation.into(),
                quat_xyzw: pose.quat_xyzw(),
            }),
            imu_noise: self.imu_noise,
        };
        toml::to_string(&document).map_err(|error| Error::Calibration {
            path: path.to_path_buf(),
            field: "(whole file)".into(),
            message: error.to_string(),
        })
    }

    /// Write the calibration file.
    ///
    /// # Errors
    /// As [`Calibration::to_toml`], and [`Error::System`] where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        beside::write_bytes(path, self.to_toml(path)?.as_bytes())
    }

    /// Every number within its domain, and the camera one that can be built.
    fn check(&self, path: &Path) -> Result<()> {
        let bad = |field: &str, expected: &str, found: f64| Error::Calibration {
            path: path.to_path_buf(),
            field: field.into(),
            message: format!("expected {expected}, found {found}"),
        };
        for (name, &value) in &self.parameters {
            if !value.is_finite() {
                return Err(bad(&format!("parameters.{name}"), "a finite number", value));
            }
        }
        crate::images::check_scale(self.depth_scale).map_err(|e| field_error(path, "", e))?;
        if let Some(value) = self.readout_s
            && !(value.is_finite() && value.abs() < 1.0)
        {
            return Err(bad("readout_s", "seconds, below 1 either way", value));
        }
        if let Some(value) = self.time_offset_s
            && !value.is_finite()
        {
            return Err(bad("time_offset_s", "finite seconds", value));
        }
        for &value in self.gravity_in_world_m_s2.iter().flatten() {
            if !value.is_finite() {
                return Err(bad("gravity_in_world_m_s2", "finite m/s^2", value));
            }
        }
        for (name, value) in self.imu_noise.iter().flat_map(ImuNoise::named) {
            if !(value.is_finite() && value >= 0.0) {
                return Err(bad(
                    &format!("imu_noise.{name}"),
                    "a finite, not negative number",
                    value,
                ));
            }
        }
        let camera = self
            .camera()
            .map_err(|error| field_error(path, "", error))?;
        if self.depth_correction.is_some() && camera.wraps_around() {
            return Err(Error::Calibration {
                path: path.to_path_buf(),
                field: "depth_correction".into(),
                message: "expected a camera with an optical axis: the ranges of a 360-degree \
                          camera have no such correction"
                    .into(),
            });
        }
        Ok(())
    }
}

impl ImuNoise {
    fn named(&self) -> [(&'static str, f64); 4] {
        [
            ("gyroscope_noise_density", self.gyroscope_noise_density),
            ("gyroscope_random_walk", self.gyroscope_random_walk),
            (
                "accelerometer_noise_density",
                self.accelerometer_noise_density,
            ),
            ("accelerometer_random_walk", self.accelerometer_random_walk),
        ]
    }
}

impl Fields {
    fn of(correction: &DepthCorrection) -> Self {
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

    fn correction(&self) -> std::result::Result<DepthCorrection, CoreError> {
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
    /// A quaternion written by us is unit already, and keeps its bits.
    fn pose(&self) -> std::result::Result<Pose, CoreError> {
        crate::trajectory::pose_from_parts(self.translation, self.quat_xyzw)
    }
}

/// The core's errors name their argument: that is the field.
fn field_error(path: &Path, table: &str, error: CoreError) -> Error {
    let (field, message) = match error {
        CoreError::Value {
            argument,
            expected,
            found,
        } => (argument, format!("expected {expected}, found {found}")),
        other => ("model".into(), other.to_string()),
    };
    Error::Calibration {
        path: path.to_path_buf(),
        field: format!("{table}{field}"),
        message,
    }
}

/// TOML errors carry the place, and name the field in their text where it is missing or unknown.
fn document_error(path: &Path, text: &str, error: &toml::de::Error) -> Error {
    let place = error.span().and_then(|span| text.get(..span.start));
    let line = place.map_or(1, |before| before.matches('\n').count() + 1);
    let key = text
        .lines()
        .nth(line - 1)
        .and_then(|row| row.split('=').next());
    Error::Calibration {
        path: path.to_path_buf(),
        field: key.unwrap_or("").trim().to_string(),
        message: format!("line {line}: {}", error.message()),
    }
}
