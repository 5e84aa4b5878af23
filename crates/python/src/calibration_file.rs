//! `Calibration`: what is known of a device, and its file.

use crate::camera::PyCamera;
use crate::errors::{IntoPython, Kind, exception};
use crate::reduce::{Reduced, reduced};
use crate::trajectory::{pose_from, pose_matrix};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_io::CalibrationFile;
use sphereflow_sphere::depth_correction::TERM_NAMES;
use sphereflow_sphere::{Calibration, DepthCorrection};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a text is called in an error.
const TEXT: &str = "calibration";

/// Terms by name.
type Terms = BTreeMap<String, f64>;

/// What is known of a depth camera, its colour camera and its inertial sensor.
///
/// Parameters
/// ----------
/// depth : Camera
///     The depth camera.
/// colour : Camera, optional
///     The colour camera.
/// colour_from_depth : array_like, (4, 4), optional
///     Where the depth camera sits in the colour camera's frame; the identity where depth is registered
///     to colour.
/// camera_from_imu : array_like, (4, 4), optional
///     Where the inertial sensor sits in the depth camera's frame.
/// depth_field : dict, optional
///     `{"relative": {term: value}, "additive": {term: value}}` of 1/Z_true = (1 + m)/Z + a.
/// readout_s : float, optional
///     Rolling shutter: seconds between the exposures of the first and the last row.
/// colour_offset_s : float, optional
///     Middle of the colour exposure = colour stamp + this.
/// imu_offset_s : float, optional
///     IMU time = camera time + this.
/// deviations : dict, optional
///     Standard deviations by the entry's name.
/// depth_scale : float
///     Counts of stored depth images per metre.
#[pyclass(name = "Calibration", module = "sphereflow", frozen)]
#[derive(Clone)]
pub struct PyCalibration(pub CalibrationFile);

impl PyCalibration {
    /// The form in which estimators take it.
    pub fn calibration(&self) -> PyResult<Calibration> {
        self.0.calibration().into_python()
    }

    /// From the text of its file.
    pub fn of_text(text: &str) -> PyResult<Self> {
        let file = CalibrationFile::from_toml(text, Path::new(TEXT));
        file.into_python().map(Self)
    }

    fn text(&self) -> PyResult<String> {
        self.0.to_toml(Path::new(TEXT)).into_python()
    }
}

#[pymethods]
impl PyCalibration {
    #[new]
    #[pyo3(signature = (depth, *, colour = None, colour_from_depth = None, camera_from_imu = None,
        depth_field = None, readout_s = None, colour_offset_s = None, imu_offset_s = None,
        deviations = None, depth_scale = 1000.0))]
    #[allow(clippy::too_many_arguments)] // keyword arguments of Python
    fn new(
        depth: &PyCamera,
        colour: Option<&PyCamera>,
        colour_from_depth: Option<&Bound<'_, PyAny>>,
        camera_from_imu: Option<&Bound<'_, PyAny>>,
        depth_field: Option<BTreeMap<String, Terms>>,
        readout_s: Option<f64>,
        colour_offset_s: Option<f64>,
        imu_offset_s: Option<f64>,
        deviations: Option<Terms>,
        depth_scale: f64,
    ) -> PyResult<Self> {
        let pose = |value: Option<&Bound<'_, PyAny>>, name: &str| {
            value.map(|value| pose_from(value, name)).transpose()
        };
        let calibration = Calibration {
            depth: Some(depth.0.clone()),
            colour: colour.map(|camera| camera.0.clone()),
            colour_from_depth: pose(colour_from_depth, "colour_from_depth")?,
            camera_from_imu: pose(camera_from_imu, "camera_from_imu")?,
            depth_field: depth_field.map(|field| correction(&field)).transpose()?,
            readout_s,
            colour_offset_s,
            imu_offset_s,
            deviations: deviations.unwrap_or_default(),
        };
        calibration.check().into_python()?;
        CalibrationFile::of_calibration(&calibration, depth_scale)
            .into_python()
            .map(Self)
    }

    /// Read a calibration file (TOML, this or an earlier schema).
    ///
    /// Raises
    /// ------
    /// DataError, MissingFileError
    ///     Naming the file and the field.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        CalibrationFile::read(&path).into_python().map(Self)
    }

    /// Write the calibration file, beside and then renamed.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        self.0.write(&path).into_python()
    }

    /// The text of the file.
    fn to_toml(&self) -> PyResult<String> {
        self.text()
    }

    /// From the text of a file.
    #[staticmethod]
    fn from_toml(text: &str) -> PyResult<Self> {
        Self::of_text(text)
    }

    /// The depth camera.
    #[getter]
    fn depth(&self) -> PyResult<PyCamera> {
        self.0.camera().into_python().map(PyCamera)
    }

    /// The colour camera, or None where it is not known.
    #[getter]
    fn colour(&self) -> PyResult<Option<PyCamera>> {
        Ok(self.calibration()?.colour.map(PyCamera))
    }

    /// Depth camera in the colour camera's frame, (4, 4), or None.
    #[getter]
    fn colour_from_depth<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let pose = self.0.colour_from_depth.as_ref();
        pose.map(|pose| pose_matrix(py, pose)).transpose()
    }

    /// Inertial sensor in the depth camera's frame, (4, 4), or None.
    #[getter]
    fn camera_from_imu<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let pose = self.0.camera_from_imu.as_ref();
        pose.map(|pose| pose_matrix(py, pose)).transpose()
    }

    /// Fields of 1/Z_true = (1 + m)/Z + a: dict of `relative` and `additive` terms; None where depth
    /// is taken as it is.
    #[getter]
    fn depth_field<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(field) = &self.0.depth_field else {
            return Ok(None);
        };
        let dict = PyDict::new(py);
        for (name, values) in [
            ("relative", field.relative()),
            ("additive", field.additive()),
        ] {
            let terms = PyDict::new(py);
            for (term, value) in TERM_NAMES.iter().zip(values).filter(|(_, v)| **v != 0.0) {
                terms.set_item(term, value)?;
            }
            dict.set_item(name, terms)?;
        }
        Ok(Some(dict))
    }

    /// The same for depth images that are corrected already.
    fn without_depth_field(&self) -> Self {
        let mut file = self.0.clone();
        file.depth_field = None;
        Self(file)
    }

    /// The same with another read-out time, seconds.
    fn with_readout_s(&self, readout_s: f64) -> PyResult<Self> {
        let mut file = self.0.clone();
        file.readout_s = Some(readout_s);
        file.calibration().into_python()?;
        Ok(Self(file))
    }

    /// Rolling shutter: seconds between the exposures of first and last row; None: not known.
    #[getter]
    fn readout_s(&self) -> Option<f64> {
        self.0.readout_s
    }

    /// Middle of the colour exposure = colour stamp + this; None: not known.
    #[getter]
    fn colour_offset_s(&self) -> Option<f64> {
        self.0.colour_offset_s
    }

    /// IMU time = camera time + this; None: not known.
    #[getter]
    fn imu_offset_s(&self) -> Option<f64> {
        self.0.imu_offset_s
    }

    /// Standard deviations by the entry's name.
    #[getter]
    fn deviations(&self) -> Terms {
        self.0.deviations.clone()
    }

    /// Counts of stored depth images per metre.
    #[getter]
    fn depth_scale(&self) -> f64 {
        self.0.depth_scale
    }

    /// True where a pixel of the colour image sees what the same pixel of the depth image does.
    #[getter]
    fn is_registered(&self) -> PyResult<bool> {
        Ok(self.calibration()?.is_registered())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let text = self.text()?;
        reduced(py, "Calibration", text.into_pyobject(py)?.into_any())
    }

    fn __repr__(&self) -> String {
        let entry = &self.0.depth;
        format!(
            "Calibration(depth: {} {}x{}, readout_s: {}, depth_field: {})",
            entry.model,
            entry.width,
            entry.height,
            self.0.readout_s.map_or("unknown".into(), |s| s.to_string()),
            if self.0.depth_field.is_some() {
                "yes"
            } else {
                "no"
            },
        )
    }
}

/// A depth field from its terms by name.
fn correction(field: &BTreeMap<String, Terms>) -> PyResult<DepthCorrection> {
    if let Some(name) = field
        .keys()
        .find(|k| !matches!(k.as_str(), "relative" | "additive"))
    {
        let text = format!("depth_field: expected 'relative' and 'additive', found '{name}'");
        return Err(exception(Kind::Value, text));
    }
    let list = |name: &str| -> Vec<(String, f64)> {
        let terms = field.get(name).into_iter().flatten();
        terms.map(|(term, value)| (term.clone(), *value)).collect()
    };
    DepthCorrection::from_named(&list("relative"), &list("additive")).into_python()
}
