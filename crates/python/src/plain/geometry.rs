//! Vectors, matrices, poses, cameras and trajectories as plain values; many numbers as bytes.

use super::{Plain, dict_of, field, not_plain};
use crate::errors::IntoPython;
use nalgebra::{DMatrix, Quaternion, SMatrix, UnitQuaternion, Vector3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use sphereflow_core::{Pose, Stamp, Trajectory, Twist};
use sphereflow_sphere::{Camera, DepthCorrection};

/// Numbers as little-endian bytes.
fn bytes_of<'py>(py: Python<'py>, numbers: impl Iterator<Item = f64>) -> Bound<'py, PyAny> {
    let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
    PyBytes::new(py, &bytes).into_any()
}

/// Numbers of little-endian bytes.
fn numbers_of(value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let bytes: &[u8] = value.extract().map_err(|_| not_plain("bytes", value))?;
    let (numbers, _) = bytes.as_chunks::<8>();
    Ok(numbers.iter().map(|b| f64::from_le_bytes(*b)).collect())
}

/// The numbers in nalgebra's order, column by column.
impl<const R: usize, const C: usize> Plain for SMatrix<f64, R, C> {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.as_slice().to_vec().to_plain(py)
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let numbers = Vec::<f64>::from_plain(value)?;
        if numbers.len() != R * C {
            return Err(not_plain(&format!("{} numbers", R * C), value));
        }
        Ok(Self::from_column_slice(&numbers))
    }
}

impl Plain for DMatrix<f64> {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let dict = PyDict::new(py);
        dict.set_item("rows", self.nrows())?;
        dict.set_item("columns", self.ncols())?;
        dict.set_item("numbers", bytes_of(py, self.iter().copied()))?;
        Ok(dict.into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let dict = dict_of(value)?;
        let (rows, columns) = (field::<usize>(dict, "rows")?, field(dict, "columns")?);
        let numbers = match dict.get_item("numbers")? {
            Some(numbers) => numbers_of(&numbers)?,
            None => Vec::new(),
        };
        if numbers.len() != rows * columns {
            return Err(not_plain(&format!("{rows} x {columns} numbers"), value));
        }
        Ok(Self::from_column_slice(rows, columns, &numbers))
    }
}

/// `i, j, k, w`, not normalised again.
impl Plain for UnitQuaternion<f64> {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.coords.to_plain(py)
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let coords = nalgebra::Vector4::from_plain(value)?;
        unit(&coords.into()).ok_or_else(|| not_plain("a unit quaternion", value))
    }
}

/// A quaternion that is a unit one already, with its bits.
fn unit(coords: &[f64; 4]) -> Option<UnitQuaternion<f64>> {
    /// Rounding leaves the norm this near to 1.
    const UNIT: f64 = 1e-9;
    let quaternion = Quaternion::from(*coords);
    ((quaternion.norm() - 1.0).abs() < UNIT).then(|| UnitQuaternion::new_unchecked(quaternion))
}

impl Plain for Pose {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        (self.rotation, self.translation).to_plain(py)
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (rotation, translation) = <(UnitQuaternion<f64>, Vector3<f64>)>::from_plain(value)?;
        Ok(Self::new(rotation, translation))
    }
}

impl Plain for Twist {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        (self.angular_rad_s, self.linear_m_s).to_plain(py)
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (angular_rad_s, linear_m_s) = Plain::from_plain(value)?;
        Ok(Self {
            angular_rad_s,
            linear_m_s,
        })
    }
}

impl Plain for Stamp {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.ns().to_plain(py)
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        i64::from_plain(value).map(Self::from_ns)
    }
}

impl Plain for Camera {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let parameters: Vec<(String, f64)> = self
            .named_parameters()
            .into_iter()
            .map(|(name, value)| (name.to_string(), value))
            .collect();
        let dict = PyDict::new(py);
        dict.set_item("model", self.model_name())?;
        dict.set_item("parameters", parameters.to_plain(py)?)?;
        dict.set_item("width", self.width())?;
        dict.set_item("height", self.height())?;
        Ok(dict.into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let dict = dict_of(value)?;
        let model: String = field(dict, "model")?;
        let parameters: Vec<(String, f64)> = field(dict, "parameters")?;
        let (width, height) = (field(dict, "width")?, field(dict, "height")?);
        Camera::from_named(&model, &parameters, width, height).into_python()
    }
}

impl Plain for DepthCorrection {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        (self.relative().to_vec(), self.additive().to_vec()).to_plain(py)
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (relative, additive) = <(Vec<f64>, Vec<f64>)>::from_plain(value)?;
        let terms = |values: Vec<f64>| {
            <[f64; sphereflow_sphere::depth_correction::TERM_COUNT]>::try_from(values)
                .map_err(|_| not_plain("one number a term", value))
        };
        Self::new(terms(relative)?, terms(additive)?).into_python()
    }
}

/// Stamps, positions and quaternions as bytes.
impl Plain for Trajectory {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let stamps: Vec<u8> = self
            .stamps()
            .iter()
            .flat_map(|stamp| stamp.ns().to_le_bytes())
            .collect();
        let numbers = self.poses().iter().flat_map(|pose| {
            let ([x, y, z], [i, j, k, w]) = (pose.translation.into(), pose.quat_xyzw());
            [x, y, z, i, j, k, w]
        });
        let dict = PyDict::new(py);
        dict.set_item("stamp_ns", PyBytes::new(py, &stamps))?;
        dict.set_item("poses", bytes_of(py, numbers))?;
        Ok(dict.into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let dict = dict_of(value)?;
        let (Some(stamps), Some(poses)) = (dict.get_item("stamp_ns")?, dict.get_item("poses")?)
        else {
            return Err(not_plain("stamp_ns and poses", value));
        };
        let stamps: &[u8] = stamps.extract().map_err(|_| not_plain("bytes", &stamps))?;
        let stamps = stamps.as_chunks::<8>().0.iter();
        let stamps = stamps.map(|bytes| Stamp::from_ns(i64::from_le_bytes(*bytes)));
        let numbers = numbers_of(&poses)?;
        let pose = |&[x, y, z, i, j, k, w]: &[f64; 7]| {
            let rotation = unit(&[i, j, k, w]).ok_or_else(|| not_plain("poses", value))?;
            Ok(Pose::new(rotation, Vector3::new(x, y, z)))
        };
        let poses = numbers.as_chunks::<7>().0.iter().map(pose);
        let poses = poses.collect::<PyResult<Vec<Pose>>>()?;
        Trajectory::from_vecs(stamps.collect(), poses).into_python()
    }
}
