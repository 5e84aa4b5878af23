//! The solver's classes: bundle adjustment, pose graphs, and what they share.

mod bundle;
mod graph;
mod inertial;
mod measured;
mod pose_graph;
mod result;
mod settings;
mod similarity_graph;

pub use bundle::PyBundleProblem;
pub use inertial::{PyImuPreintegration, PyInertialWindow, PyMotion};
pub use pose_graph::PyPoseGraph;
pub use result::PySolverResult;
pub use similarity_graph::PySimilarityGraph;

use crate::arguments::vector3;
use crate::arrays::floats;
use crate::errors::{IntoPython, Kind, core_error, exception};
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use settings::Settings;
use sphereflow_core::Pose;
use sphereflow_solver::graph::LoopSwitch;
use sphereflow_solver::{Error, Loss};

impl<T> IntoPython<T> for Result<T, Error> {
    fn into_python(self) -> PyResult<T> {
        self.map_err(|error| solver_error(&error))
    }
}

/// The exception of an error of the solver.
pub(crate) fn solver_error(error: &Error) -> PyErr {
    match error {
        Error::Core(error) => core_error(error),
        Error::NoCovariance { .. } => exception(Kind::Data, error),
    }
}

/// Poses as an array.
fn matrices<'py>(
    py: Python<'py>,
    poses: impl Iterator<Item = Pose>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (mut values, mut count) = (Vec::new(), 0);
    for pose in poses {
        values.extend(pose.matrix().transpose().iter());
        count += 1;
    }
    PyArray1::from_vec(py, values).reshape([count, 4, 4])
}

/// A loss from its name.
fn loss(name: &str, threshold: f64) -> PyResult<Loss> {
    let loss = match name {
        "quadratic" => Loss::Quadratic,
        "huber" => Loss::Huber(threshold),
        "cauchy" => Loss::Cauchy(threshold),
        "tukey" => Loss::Tukey(threshold),
        other => {
            let text = format!(
                "loss: expected 'quadratic', 'huber', 'cauchy' or 'tukey', found '{other}'"
            );
            return Err(exception(Kind::Value, text));
        }
    };
    loss.check().into_python()?;
    Ok(loss)
}

/// A square matrix of `N` rows.
fn square<const N: usize>(
    value: &Bound<'_, PyAny>,
    name: &str,
) -> PyResult<nalgebra::SMatrix<f64, N, N>> {
    let array = floats(value, name, &[Some(N), Some(N)])?;
    Ok(nalgebra::SMatrix::from_row_slice(array.as_slice()?))
}

/// How wrong loop edges are told.
fn switch(name: &str, threshold: f64) -> PyResult<LoopSwitch> {
    match name {
        "off" => Ok(LoopSwitch::Off),
        "gnc" => Ok(LoopSwitch::Graduated { threshold }),
        "dcs" => Ok(LoopSwitch::Scaled { phi: threshold }),
        other => {
            let text = format!("switch: expected 'off', 'gnc' or 'dcs', found '{other}'");
            Err(exception(Kind::Value, text))
        }
    }
}
