//! `SelfCalibrator`: lens, depth field and read-out time of a depth camera from its motion.

use crate::camera::PyCamera;
use crate::config::{keywords, settings};
use crate::errors::{IntoPython, Kind, exception};
use crate::motion_arguments::Image;
use crate::odometry::PyOdometryResult;
use crate::plain::{Plain, calibration_code};
use crate::recording::PyRecording;
use crate::reduce::{Reduced, reduced};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use sphereflow_calibration::{
    CalibrationStatus, SelfCalibration, SelfCalibrationConfig, SelfCalibrator,
};
use sphereflow_core::Stamp;
use sphereflow_sphere::depth_correction::TERM_NAMES;
use std::path::PathBuf;

/// What a self-calibration found, and what the motion let it see.
#[pyclass(name = "SelfCalibration", module = "sphereflow.odometry", frozen)]
pub struct PySelfCalibration(pub SelfCalibration);

#[pymethods]
impl PySelfCalibration {
    /// "calibrated", "not observable" or "no improvement"; only the first has new values.
    #[getter]
    fn status(&self) -> &'static str {
        self.0.status.name()
    }

    /// Why, where it is not "calibrated".
    #[getter]
    fn reason(&self) -> Option<String> {
        match &self.0.status {
            CalibrationStatus::NotObservable(why) | CalibrationStatus::NoImprovement(why) => {
                Some(why.clone())
            }
            CalibrationStatus::Calibrated => None,
        }
    }

    /// Stable code of the reason, in snake_case (docs/reason-codes.md); None where there is none.
    #[getter]
    fn reason_code(&self) -> Option<&'static str> {
        calibration_code(&self.0.status)
    }

    /// The values that decided: none yet, they stand in the words of `reason`.
    #[getter]
    fn reason_values<'py>(&self, py: Python<'py>) -> Bound<'py, PyDict> {
        PyDict::new(py)
    }

    /// The camera with what was found of its lens.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(self.0.camera.clone())
    }

    /// Coefficients by name: `relative` (m, no unit) and `additive` (a, 1/m) of
    /// 1/Z_true = (1 + m) / Z_measured + a.
    #[getter]
    fn depth_correction<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let fields = [
            ("relative", self.0.correction.relative()),
            ("additive", self.0.correction.additive()),
        ];
        let dict = PyDict::new(py);
        for (name, values) in fields {
            let named = TERM_NAMES.into_iter().zip(values.iter().copied());
            dict.set_item(name, named.into_py_dict(py)?)?;
        }
        Ok(dict)
    }

    /// Rolling shutter read-out time, seconds.
    #[getter]
    fn readout_s(&self) -> f64 {
        self.0.readout_s
    }

    /// The numbers one by one: dicts of name, value, std, prior_std, observable.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let entry = |p: &sphereflow_calibration::CalibratedParameter| {
            let dict = PyDict::new(py);
            dict.set_item("name", &p.name)?;
            dict.set_item("value", p.value)?;
            dict.set_item("std", p.std)?;
            dict.set_item("prior_std", p.prior_std)?;
            dict.set_item("observable", p.observable)?;
            Ok(dict)
        };
        self.0.parameters.iter().map(entry).collect()
    }

    /// Covariance of the parameters, in their order, (N, N).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (rows, columns) = self.0.covariance.shape();
        let flat = self.0.covariance.transpose();
        PyArray1::from_slice(py, flat.as_slice()).reshape([rows, columns])
    }

    /// Combinations that the motion did not show, the worst first: dicts of std_share (of the
    /// prior's) and shares (name to signed share).
    #[getter]
    fn held<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let entry = |held: &sphereflow_calibration::HeldCombination| {
            let dict = PyDict::new(py);
            dict.set_item("std_share", held.std_share)?;
            dict.set_item("shares", held.shares.clone().into_py_dict(py)?)?;
            Ok(dict)
        };
        self.0.held.iter().map(entry).collect()
    }

    /// Median over the pairs of the domains' robust residual before, 1/m; NaN without pairs.
    #[getter]
    fn residual_before(&self) -> f64 {
        self.0.residual_before
    }

    /// And after.
    #[getter]
    fn residual_after(&self) -> f64 {
        self.0.residual_after
    }

    /// Factor on the standard deviations, found by leaving out each part of the recording.
    #[getter]
    fn inflation(&self) -> f64 {
        self.0.inflation
    }

    /// Frames with a measured pose.
    #[getter]
    fn frames(&self) -> usize {
        self.0.frames
    }

    /// Pairs of frames that were used.
    #[getter]
    fn pairs(&self) -> usize {
        self.0.pairs
    }

    /// Gauss-Newton steps.
    #[getter]
    fn iterations(&self) -> usize {
        self.0.iterations
    }

    /// Rms of the angular rate, rad/s: what a rolling shutter is seen by.
    #[getter]
    fn rms_rate_rad_s(&self) -> f64 {
        self.0.rms_rate_rad_s
    }

    /// Rms of the speed, m/s.
    #[getter]
    fn rms_speed_m_s(&self) -> f64 {
        self.0.rms_speed_m_s
    }

    /// Write a calibration file: everything else as in the recording's own calibration.
    ///
    /// Parameters
    /// ----------
    /// path : path
    ///     The TOML file; written beside and renamed.
    /// recording : Recording
    ///     The recording that was calibrated.
    ///
    /// Raises
    /// ------
    /// DataError
    ///     Where nothing was calibrated, or the recording has no calibration.
    fn write(&self, path: PathBuf, recording: &PyRecording) -> PyResult<()> {
        if let Some(why) = self.reason() {
            let text = format!("nothing to write, {}: {why}", self.status());
            return Err(exception(Kind::Data, text));
        }
        let Some(own) = recording.0.calibration() else {
            let text = "recording: expected one with a calibration, found none";
            return Err(exception(Kind::Data, text));
        };
        let mut calibration = own.with_camera(&self.0.camera).into_python()?;
        let correction = self.0.correction;
        calibration.depth_field = (!correction.is_identity()).then_some(correction);
        calibration.readout_s = (self.0.readout_s != 0.0).then_some(self.0.readout_s);
        calibration.write(&path).into_python()
    }

    fn __repr__(&self) -> String {
        format!(
            "SelfCalibration({}, {} pairs, residual {:.3e} -> {:.3e} 1/m)",
            self.0.status, self.0.pairs, self.0.residual_before, self.0.residual_after
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "SelfCalibration", self.0.to_plain(py)?)
    }
}

/// Calibrates a depth camera from its motion alone: no target, no true poses.
///
/// Push the frames of a recording, then `solve`. Pairs of frames a fraction of a second apart agree
/// on a rigid motion only where rays, depths and the times of the rows are right.
///
/// Parameters
/// ----------
/// camera : Camera
///     The depth camera with its calibration so far; not one of 360 degrees.
/// config : sphereflow.config.SelfCalibrationConfig, optional
///     All settings. The keywords that follow, where given, replace what it says.
/// lens, field, readout : bool, optional
///     What to estimate: the rest of the lens, the smooth error of 1/Z, the read-out time.
/// readout_s : float, optional
///     Read-out time so far, seconds; 0 for a global shutter.
/// max_pairs : int, optional
///     Pairs of frames at most; time grows with them.
#[pyclass(name = "SelfCalibrator", module = "sphereflow.odometry")]
pub struct PySelfCalibrator(SelfCalibrator);

#[pymethods]
impl PySelfCalibrator {
    #[new]
    #[pyo3(signature = (camera, *, config = None, lens = None, field = None, readout = None,
        readout_s = None, max_pairs = None))]
    fn new(
        camera: &PyCamera,
        config: Option<&Bound<'_, PyAny>>,
        lens: Option<bool>,
        field: Option<bool>,
        readout: Option<bool>,
        readout_s: Option<f64>,
        max_pairs: Option<usize>,
    ) -> PyResult<Self> {
        let mut config: SelfCalibrationConfig = settings(config)?;
        keywords!(config {
            lens = lens,
            field = field,
            readout = readout,
            readout_s = readout_s,
            max_pairs = max_pairs,
        });
        let calibrator = SelfCalibrator::new(&camera.0, config);
        calibrator.into_python().map(Self)
    }

    /// The next frame, as the camera measured it.
    ///
    /// Parameters
    /// ----------
    /// depth_m : array_like of float, (H, W)
    ///     Metres along the optical axis, NaN or zero unknown.
    /// stamp_ns : int
    ///     Nanoseconds.
    ///
    /// Returns
    /// -------
    /// OdometryResult
    ///     Of the odometry that finds the motion; frames without a measured pose are left out.
    fn push(
        &mut self,
        py: Python<'_>,
        depth_m: &Bound<'_, PyAny>,
        stamp_ns: i64,
    ) -> PyResult<PyOdometryResult> {
        let camera = self.0.camera();
        let size = (camera.width(), camera.height());
        let image = Image::new(depth_m, "depth_m", size, "axis")?;
        let calibrator = &mut self.0;
        let result = py.detach(|| calibrator.push(image.view(), Stamp::from_ns(stamp_ns)));
        result.into_python().map(PyOdometryResult)
    }

    /// Calibrate from the frames so far.
    ///
    /// Parameters
    /// ----------
    /// progress : callable, optional
    ///     Called with the steps done and the steps at most. What it raises is raised at the end.
    ///
    /// Returns
    /// -------
    /// SelfCalibration
    ///     Also where nothing was observable: look at `status`.
    #[pyo3(signature = (progress = None))]
    fn solve(&self, py: Python<'_>, progress: Option<Py<PyAny>>) -> PyResult<PySelfCalibration> {
        let mut raised = None;
        let calibrator = &self.0;
        let found = py.detach(|| {
            calibrator.solve(|done, total| {
                let Some(progress) = &progress else { return };
                let called = Python::attach(|py| progress.call1(py, (done, total)).map(|_| ()));
                raised = raised.take().or(called.err());
            })
        });
        match raised {
            Some(error) => Err(error),
            None => found.into_python().map(PySelfCalibration),
        }
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }
}
