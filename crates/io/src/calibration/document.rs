//! The TOML document of a calibration: reading it with errors that name the field, and writing it.

use super::layout::{Document, Fields, SCHEMA, Transform};
use super::migration::FirstDocument;
use super::{CalibrationFile, CameraEntry, ImuNoise};
use crate::{Error, Result, beside};
use nalgebra::Vector3;
use serde::Deserialize;
use sphereflow_core::{Error as CoreError, checks};
use std::path::Path;

/// Which layout a file is of.
#[derive(Deserialize)]
struct Version {
    schema: Option<toml::Value>,
}

impl CalibrationFile {
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
    /// As [`CalibrationFile::read`].
    pub fn from_toml(text: &str, path: &Path) -> Result<Self> {
        let (document, names) = parsed(text, path)?;
        let pose = |transform: Option<Transform>, table: &str| {
            let pose = transform.map(|t| t.pose()).transpose();
            pose.map_err(|error| field_error(path, table, error))
        };
        let file = Self {
            depth: document.depth,
            colour: document.colour,
            colour_from_depth: pose(document.colour_from_depth, "colour_from_depth.")?,
            depth_scale: document.depth_scale,
            readout_s: document.readout_s,
            colour_offset_s: document.colour_offset_s,
            imu_offset_s: document.imu_offset_s,
            gravity_in_world_m_s2: document.gravity_in_world_m_s2.map(Vector3::from),
            depth_field: document
                .depth_field
                .map(|fields| fields.correction())
                .transpose()
                .map_err(|error| field_error(path, names.depth_field, error))?,
            camera_from_imu: pose(document.camera_from_imu, "camera_from_imu.")?,
            imu_noise: document.imu_noise,
            deviations: document.deviations,
        };
        file.check(path, &names)?;
        Ok(file)
    }

    /// The text of the calibration file.
    ///
    /// # Errors
    /// [`Error::Calibration`] where a value would not be read back; `path` is for messages only.
    pub fn to_toml(&self, path: &Path) -> Result<String> {
        self.check(path, &NAMES)?;
        let document = Document {
            schema: SCHEMA,
            depth_scale: self.depth_scale,
            readout_s: self.readout_s,
            colour_offset_s: self.colour_offset_s,
            imu_offset_s: self.imu_offset_s,
            gravity_in_world_m_s2: self.gravity_in_world_m_s2.map(Into::into),
            depth: self.depth.clone(),
            colour: self.colour.clone(),
            colour_from_depth: self.colour_from_depth.as_ref().map(Transform::of),
            depth_field: self.depth_field.as_ref().map(Fields::of),
            camera_from_imu: self.camera_from_imu.as_ref().map(Transform::of),
            imu_noise: self.imu_noise,
            deviations: self.deviations.clone(),
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
    /// As [`CalibrationFile::to_toml`], and [`Error::System`] where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        beside::write_bytes(path, self.to_toml(path)?.as_bytes())
    }

    /// Every number within its domain, and the cameras ones that can be built.
    fn check(&self, path: &Path, names: &Names) -> Result<()> {
        let bad = |field: &str, expected: &str, found: f64| Error::Calibration {
            path: path.to_path_buf(),
            field: field.into(),
            message: format!("expected {expected}, found {found}"),
        };
        for (table, entry) in [
            (names.depth, Some(&self.depth)),
            ("colour.", self.colour.as_ref()),
        ] {
            for (name, &value) in entry.iter().flat_map(|entry| &entry.parameters) {
                if !value.is_finite() {
                    let field = format!("{table}parameters.{name}");
                    return Err(bad(&field, "a finite number", value));
                }
            }
            let camera = entry.map(CameraEntry::camera).transpose();
            camera.map_err(|error| field_error(path, table, error))?;
        }
        crate::images::check_scale(self.depth_scale).map_err(|e| field_error(path, "", e))?;
        for &value in self.gravity_in_world_m_s2.iter().flatten() {
            if !value.is_finite() {
                return Err(bad("gravity_in_world_m_s2", "finite m/s^2", value));
            }
        }
        for (name, value) in self.imu_noise.iter().flat_map(ImuNoise::named) {
            let table = format!("imu_noise.{name}");
            checks::non_negative(&table, value).map_err(|error| field_error(path, "", error))?;
        }
        let rest = self.calibration().map(drop);
        rest.map_err(|error| field_error(path, "", names.renamed(error)))
    }
}

/// What the entries are called in the file that is read.
struct Names {
    depth: &'static str,
    depth_field: &'static str,
    imu_offset_s: &'static str,
}

const NAMES: Names = Names {
    depth: "depth.",
    depth_field: "depth_field.",
    imu_offset_s: "imu_offset_s",
};

const FIRST_NAMES: Names = Names {
    depth: "",
    depth_field: "depth_correction.",
    imu_offset_s: "time_offset_s",
};

impl Names {
    /// The error of an entry under the name that the file has for it.
    fn renamed(&self, error: CoreError) -> CoreError {
        match error {
            CoreError::Value {
                argument,
                expected,
                found,
            } => {
                let own = match argument.as_str() {
                    "imu_offset_s" => self.imu_offset_s.into(),
                    "depth_field" => self.depth_field.trim_end_matches('.').into(),
                    _ => argument,
                };
                CoreError::value(own, expected, found)
            }
            other => other,
        }
    }
}

/// The document of a file of any schema that is known, and what it calls its entries.
fn parsed(text: &str, path: &Path) -> Result<(Document, Names)> {
    let fail = |error: &toml::de::Error| document_error(path, text, error);
    let version: Version = toml::from_str(text).map_err(|error| fail(&error))?;
    match version.schema.as_ref().map(toml::Value::as_integer) {
        None | Some(Some(1)) => {
            let first: FirstDocument = toml::from_str(text).map_err(|error| fail(&error))?;
            Ok((first.migrated(), FIRST_NAMES))
        }
        Some(Some(2)) => {
            let document = toml::from_str(text).map_err(|error| fail(&error))?;
            Ok((document, NAMES))
        }
        Some(_) => Err(Error::Calibration {
            path: path.to_path_buf(),
            field: "schema".into(),
            message: format!(
                "expected 1 or {SCHEMA}, found {}: a file of a later version of sphereflow",
                version
                    .schema
                    .map_or_else(String::new, |value| value.to_string())
            ),
        }),
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
