//! Arguments that several classes take: vectors, rotations, covariances, names; and the text of a reason.

use crate::arrays::floats;
use crate::errors::{IntoPython, Kind, exception};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use pyo3::prelude::*;
use sphereflow_observers::Reason;

/// A vector of three from anything like an array.
pub fn vector3(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vector3<f64>> {
    let array = floats(value, name, &[Some(3)])?;
    Ok(Vector3::from_column_slice(array.as_slice()?))
}

/// A rotation from x, y, z, w, checked to be of norm 1.
pub fn rotation_from(value: &Bound<'_, PyAny>, name: &str) -> PyResult<UnitQuaternion<f64>> {
    let array = floats(value, name, &[Some(4)])?;
    let found = array.as_slice()?;
    let quat = [found[0], found[1], found[2], found[3]];
    let pose = sphereflow_core::Pose::from_parts([0.0; 3], quat).into_python()?;
    Ok(pose.rotation)
}

/// A 3x3 covariance, or a standard deviation for all axes.
pub fn covariance3(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Matrix3<f64>> {
    if let Ok(sigma) = value.extract::<f64>() {
        return Ok(Matrix3::identity() * (sigma * sigma));
    }
    let array = floats(value, name, &[Some(3), Some(3)])?;
    Ok(Matrix3::from_row_slice(array.as_slice()?))
}

/// The exception for a name that is none of those expected.
pub fn unknown(argument: &str, expected: &str, found: &str) -> PyErr {
    exception(
        Kind::Value,
        format!("{argument}: expected {expected}, found '{found}'"),
    )
}

/// The text of a reason, if any.
pub fn reason_text(reason: Option<Reason>) -> Option<String> {
    reason.map(|reason| reason.to_string())
}
