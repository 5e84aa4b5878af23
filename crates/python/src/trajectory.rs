//! `Trajectory` and `associate`.

use crate::arrays::{floats, stamps};
use crate::errors::{IntoPython, Kind, exception};
use crate::pickle::{Reduced, reduced};
use crate::plain::Plain;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use sphereflow_core::{Pose, Stamp, Trajectory, associate as associate_stamps};
use sphereflow_io::trajectory::{
    TrajectoryFormat, read_trajectory, read_trajectory_lenient, write_trajectory,
};
use std::path::PathBuf;

/// Poses at strictly increasing stamps.
///
/// Parameters
/// ----------
/// stamp_ns : array_like of int, (N,)
///     Nanoseconds, strictly increasing. Floats are refused: they cannot hold a Unix time.
/// position_m : array_like, (N, 3)
///     Origin of the moving frame in the world, metres.
/// quat_xyzw : array_like, (N, 4)
///     Rotation, world from moving frame, unit quaternions in x, y, z, w order.
///
/// Raises
/// ------
/// ShapeError, DtypeError, ValueRangeError, TimeOrderError
///     Naming the argument, and the index where there is one.
#[pyclass(name = "Trajectory", module = "sphereflow", frozen)]
pub struct PyTrajectory(pub Trajectory);

#[pymethods]
impl PyTrajectory {
    #[new]
    #[pyo3(signature = (stamp_ns, position_m, quat_xyzw))]
    fn new(
        stamp_ns: &Bound<'_, PyAny>,
        position_m: &Bound<'_, PyAny>,
        quat_xyzw: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let stamps = stamps(stamp_ns, "stamp_ns")?;
        let n = Some(stamps.len());
        let positions = floats(position_m, "position_m", &[n, Some(3)])?;
        let quaternions = floats(quat_xyzw, "quat_xyzw", &[n, Some(4)])?;
        let (positions, _) = positions.as_slice()?.as_chunks::<3>();
        let (quaternions, _) = quaternions.as_slice()?.as_chunks::<4>();
        let poses = positions
            .iter()
            .zip(quaternions)
            .enumerate()
            .map(|(i, (&p, &q))| {
                Pose::from_parts(p, q).map_err(|e| exception(Kind::Value, format!("pose {i}: {e}")))
            })
            .collect::<PyResult<Vec<Pose>>>()?;
        Ok(Self(Trajectory::from_vecs(stamps, poses).into_python()?))
    }

    /// Read a trajectory file.
    ///
    /// Parameters
    /// ----------
    /// path : path
    ///     The file.
    /// format : {'tum', 'kitti', 'euroc'}, optional
    ///     Guessed from the first row where absent. KITTI has no time: stamps are row numbers in seconds.
    ///
    /// Raises
    /// ------
    /// DataError
    ///     With path, line, what was expected and what was found; also where stamps do not increase (see
    ///     `read_lenient`).
    /// MissingFileError
    ///     Where there is no such file.
    #[staticmethod]
    #[pyo3(signature = (path, *, format = None))]
    fn read(py: Python<'_>, path: PathBuf, format: Option<&str>) -> PyResult<Self> {
        let format = format.map(trajectory_format).transpose()?;
        py.detach(|| read_trajectory(&path, format))
            .into_python()
            .map(Self)
    }

    /// Read a trajectory file, leaving out rows whose stamp repeats or precedes the row before;
    /// returns the trajectory and what was left out, in words.
    #[staticmethod]
    #[pyo3(signature = (path, *, format = None))]
    fn read_lenient(
        py: Python<'_>,
        path: PathBuf,
        format: Option<&str>,
    ) -> PyResult<(Self, Vec<String>)> {
        let format = format.map(trajectory_format).transpose()?;
        let read = py.detach(|| read_trajectory_lenient(&path, format));
        let (trajectory, warnings) = read.into_python()?;
        let warnings = warnings
            .as_slice()
            .iter()
            .map(ToString::to_string)
            .collect();
        Ok((Self(trajectory), warnings))
    }

    /// Write a trajectory file; it gets its name only when it is complete.
    ///
    /// TUM and EuRoC files give back every bit: time is written with nine decimals from the integer, other
    /// numbers with the fewest digits that read back as the same float.
    ///
    /// Parameters
    /// ----------
    /// path : path
    ///     The file.
    /// format : {'tum', 'kitti', 'euroc'}, optional
    ///     TUM where absent.
    #[pyo3(signature = (path, *, format = None))]
    fn write(&self, py: Python<'_>, path: PathBuf, format: Option<&str>) -> PyResult<()> {
        let format = format.map_or(Ok(TrajectoryFormat::Tum), trajectory_format)?;
        py.detach(|| write_trajectory(&path, &self.0, format))
            .into_python()
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __repr__(&self) -> String {
        match (self.0.stamps().first(), self.0.stamps().last()) {
            (Some(first), Some(last)) => {
                format!("Trajectory({} poses, {first} s to {last} s)", self.0.len())
            }
            _ => "Trajectory(empty)".into(),
        }
    }

    /// Stamps, int64 nanoseconds, (N,).
    #[getter]
    fn stamp_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.0.stamps().iter().map(|s| s.ns()))
    }

    /// Positions in metres, (N, 3).
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let flat = self
            .0
            .poses()
            .iter()
            .flat_map(|p| [p.translation.x, p.translation.y, p.translation.z]);
        PyArray1::from_iter(py, flat).reshape([self.0.len(), 3])
    }

    /// Unit quaternions in x, y, z, w order, (N, 4).
    #[getter]
    fn quat_xyzw<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let flat = self.0.poses().iter().flat_map(Pose::quat_xyzw);
        PyArray1::from_iter(py, flat).reshape([self.0.len(), 4])
    }

    /// The pose at `stamp_ns` as a 4x4 matrix, or None outside or in a gap longer than `max_gap_s`.
    #[pyo3(signature = (stamp_ns, *, max_gap_s = 0.1))]
    fn interpolate<'py>(
        &self,
        py: Python<'py>,
        stamp_ns: i64,
        max_gap_s: f64,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.0
            .interpolate(Stamp::from_ns(stamp_ns), max_gap_s)
            .map(|pose| pose_matrix(py, &pose))
            .transpose()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "Trajectory", self.0.to_plain(py)?)
    }
}

fn trajectory_format(name: &str) -> PyResult<TrajectoryFormat> {
    name.parse::<TrajectoryFormat>().into_python()
}

/// A pose as a 4x4 array.
pub fn pose_matrix<'py>(py: Python<'py>, pose: &Pose) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let m = pose.matrix();
    PyArray1::from_iter(py, (0..16).map(|i| m[(i / 4, i % 4)])).reshape([4, 4])
}

/// A pose from a 4x4 array.
pub fn pose_from(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Pose> {
    let array = floats(value, name, &[Some(4), Some(4)])?;
    let matrix = nalgebra::Matrix4::from_row_slice(array.as_slice()?);
    Pose::from_matrix(&matrix).map_err(|e| exception(Kind::Value, format!("{name}: {e}")))
}

/// Pairs of the nearest stamps.
///
/// Each stamp of the shorter list takes the nearest of the longer one, which may serve twice: the rule
/// of evo.
///
/// Parameters
/// ----------
/// stamp_ns_a, stamp_ns_b : array_like of int, (N,), (M,)
///     Increasing nanoseconds.
/// max_difference_s : float
///     Pairs further apart than this are left out.
///
/// Returns
/// -------
/// ndarray of int, (K, 2)
///     Indices into `stamp_ns_a` and `stamp_ns_b`.
#[pyfunction]
#[pyo3(signature = (stamp_ns_a, stamp_ns_b, max_difference_s))]
pub fn associate<'py>(
    py: Python<'py>,
    stamp_ns_a: &Bound<'py, PyAny>,
    stamp_ns_b: &Bound<'py, PyAny>,
    max_difference_s: f64,
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    if !(max_difference_s.is_finite() && max_difference_s >= 0.0) {
        let text = format!("max_difference_s: expected seconds >= 0, found {max_difference_s}");
        return Err(exception(Kind::Value, text));
    }
    let (a, b) = (
        stamps(stamp_ns_a, "stamp_ns_a")?,
        stamps(stamp_ns_b, "stamp_ns_b")?,
    );
    let pairs = associate_stamps(&a, &b, (max_difference_s * 1e9).round() as u64);
    let flat = pairs.iter().flat_map(|&(i, j)| [i as i64, j as i64]);
    PyArray1::from_iter(py, flat).reshape([pairs.len(), 2])
}
