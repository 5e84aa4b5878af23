//! Pickle and copy: objects from the plain values that their `__reduce__` gave.

use crate::attitude::{PyAttitudeRun, PyAttitudeState};
use crate::calibration_file::PyCalibration;
use crate::camera::PyCamera;
use crate::depth::PyDepthResult;
use crate::depth_thesis::PyVariationalDepth;
use crate::errors::{Kind, exception};
use crate::frame::PyFrame;
use crate::imu_bias::{PyImuBiasRun, PyImuBiasState};
use crate::information::PyInformation;
use crate::navigation::PyNavigationState;
use crate::observers::PyVelocityBiasState;
use crate::odometry::PyOdometryResult;
use crate::plain::Plain;
use crate::self_calibration::PySelfCalibration;
use crate::solver::{PyMotion, PySolverResult};
use crate::trajectory::PyTrajectory;
use crate::update::PyUpdate;
use crate::velocity::PyVelocityEstimate;
use pyo3::prelude::*;

/// The object of a class from its state: what pickles call. Private.
#[pyfunction]
#[pyo3(name = "_restore")]
pub fn restore(py: Python<'_>, class: &str, state: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
    macro_rules! object {
        ($wrapper:ident) => {
            Ok(Py::new(py, $wrapper(Plain::from_plain(state)?))?.into_any())
        };
    }
    match class {
        "AttitudeRun" => object!(PyAttitudeRun),
        "AttitudeState" => object!(PyAttitudeState),
        "Camera" => object!(PyCamera),
        "ImuBiasRun" => object!(PyImuBiasRun),
        "ImuBiasState" => object!(PyImuBiasState),
        "Information" => object!(PyInformation),
        "Motion" => object!(PyMotion),
        "NavigationState" => object!(PyNavigationState),
        "OdometryResult" => object!(PyOdometryResult),
        "SelfCalibration" => object!(PySelfCalibration),
        "Trajectory" => object!(PyTrajectory),
        "VelocityBiasState" => object!(PyVelocityBiasState),
        "VelocityEstimate" => object!(PyVelocityEstimate),
        "Calibration" => {
            let calibration = PyCalibration::of_text(&state.extract::<String>()?)?;
            Ok(Py::new(py, calibration)?.into_any())
        }
        "Update" => object!(PyUpdate),
        "DepthResult" => Ok(Py::new(py, PyDepthResult::from_state(state)?)?.into_any()),
        "Frame" => Ok(Py::new(py, PyFrame::from_state(state)?)?.into_any()),
        "SolverResult" => Ok(Py::new(py, PySolverResult::from_plain(state)?)?.into_any()),
        "VariationalDepth" => Ok(Py::new(py, PyVariationalDepth::from_state(state)?)?.into_any()),
        other => {
            let text = format!("class: expected one of sphereflow's, found '{other}'");
            Err(exception(Kind::Value, text))
        }
    }
}
