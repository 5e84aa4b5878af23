//! `Trajectory`.

mod pairs;
mod selection;

pub use pairs::py_associate;

use crate::arrays::{floats, stamps};
use crate::errors::{IntoPython, Kind, exception};
use crate::plain::Plain;
use crate::reduce::{Reduced, reduced};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PySlice};
use selection::selected;
use sphereflow_core::{Pose, Stamp, Trajectory};
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
#[pyclass(name = "Trajectory", module = "sphereflow", frozen, eq)]
#[derive(PartialEq)]
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

    /// From poses as matrices.
    ///
    /// Parameters
    /// ----------
    /// stamp_ns : array_like of int, (N,)
    ///     Nanoseconds, strictly increasing.
    /// world_from_camera : array_like, (N, 4, 4)
    ///     Rigid transforms; the rotation blocks are projected to rotations.
    ///
    /// Raises
    /// ------
    /// ShapeError, DtypeError, ValueRangeError, TimeOrderError
    ///     Naming the argument, and the index where there is one.
    #[staticmethod]
    fn from_matrices(
        stamp_ns: &Bound<'_, PyAny>,
        world_from_camera: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let stamps = stamps(stamp_ns, "stamp_ns")?;
        let shape = [Some(stamps.len()), Some(4), Some(4)];
        let matrices = floats(world_from_camera, "world_from_camera", &shape)?;
        let (matrices, _) = matrices.as_slice()?.as_chunks::<16>();
        let pose = |(i, matrix): (usize, &[f64; 16])| {
            Pose::from_matrix(&nalgebra::Matrix4::from_row_slice(matrix))
                .map_err(|e| exception(Kind::Value, format!("world_from_camera[{i}]: {e}")))
        };
        let poses = matrices.iter().enumerate().map(pose);
        let poses = poses.collect::<PyResult<Vec<Pose>>>()?;
        Ok(Self(Trajectory::from_vecs(stamps, poses).into_python()?))
    }

    /// Stamps, int64 nanoseconds, (N,).
    #[getter]
    fn stamp_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let stamps: Vec<i64> = self.0.stamps().iter().map(|s| s.ns()).collect();
        PyArray1::from_vec(py, stamps)
    }

    /// Poses as matrices, (N, 4, 4).
    #[getter]
    fn world_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let flat = rows(self.0.poses(), |pose| {
            let m = pose.matrix().transpose();
            <[f64; 16]>::try_from(m.as_slice()).unwrap_or([f64::NAN; 16])
        });
        PyArray1::from_vec(py, flat).reshape([self.0.len(), 4, 4])
    }

    /// Length of the way from pose to pose, metres.
    #[getter]
    fn length_m(&self) -> f64 {
        let pairs = self.0.poses().windows(2);
        pairs
            .map(|pair| (pair[1].translation - pair[0].translation).norm())
            .sum()
    }

    /// The poses of another trajectory after these; its first stamp must come after the last here.
    ///
    /// Raises
    /// ------
    /// TimeOrderError
    ///     With the stamps that do not increase. The same as `self + other`.
    fn concatenated(&self, other: &Self) -> PyResult<Self> {
        let stamps = [self.0.stamps(), other.0.stamps()].concat();
        let poses = [self.0.poses(), other.0.poses()].concat();
        Ok(Self(Trajectory::from_vecs(stamps, poses).into_python()?))
    }

    fn __add__(&self, other: &Self) -> PyResult<Self> {
        self.concatenated(other)
    }

    /// The trajectory told in another world, or of another body that is fixed to the camera.
    ///
    /// Parameters
    /// ----------
    /// other_from_world : array_like, (4, 4), optional
    ///     Rigid transform from the world of these poses to the new one.
    /// camera_from_body : array_like, (4, 4), optional
    ///     Where the body whose poses are wanted sits on the camera.
    ///
    /// Returns
    /// -------
    /// Trajectory
    ///     `other_from_world @ world_from_camera @ camera_from_body` at the same stamps.
    ///
    /// Raises
    /// ------
    /// ShapeError, DtypeError, ValueRangeError
    ///     Naming the argument.
    #[pyo3(signature = (other_from_world = None, *, camera_from_body = None))]
    fn transformed(
        &self,
        other_from_world: Option<&Bound<'_, PyAny>>,
        camera_from_body: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let left = other_from_world.map(|pose| pose_from(pose, "other_from_world"));
        let right = camera_from_body.map(|pose| pose_from(pose, "camera_from_body"));
        let (left, right) = (left.transpose()?, right.transpose()?);
        let moved = self.0.poses().iter().map(|&pose| {
            let pose = left.map_or(pose, |left| left * pose);
            right.map_or(pose, |right| pose * right)
        });
        let stamps = self.0.stamps().to_vec();
        let moved = Trajectory::from_vecs(stamps, moved.collect()).into_python()?;
        Ok(Self(moved))
    }

    /// An integer gives the pair of `stamp_ns` and `world_from_camera` (4, 4); a slice, a mask (N,)
    /// of bools or increasing indices give a trajectory.
    fn __getitem__<'py>(
        &self,
        py: Python<'py>,
        key: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if let Ok(slice) = key.cast::<PySlice>() {
            let range = slice.indices(isize::try_from(self.0.len())?)?;
            let at = |k: usize| range.start + range.step * k as isize;
            return self.subset(py, (0..range.slicelength).map(at));
        }
        if let Ok(index) = key.extract::<isize>()
            && !key.is_instance_of::<PyBool>()
        {
            let index = self.index(index)?;
            let pose = pose_matrix(py, &self.0.poses()[index])?;
            return Ok((self.0.stamps()[index].ns(), pose)
                .into_pyobject(py)?
                .into_any());
        }
        let indices = selected(key, self.0.len())?;
        self.subset(py, indices.into_iter())
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let stamps = self.stamp_ns(py).call_method0("tolist")?;
        let zip = py.import("builtins")?.getattr("zip")?;
        zip.call1((stamps, self.world_from_camera(py)?))
    }

    /// Positions in metres, (N, 3).
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let flat = rows(self.0.poses(), |pose| pose.translation.into());
        PyArray1::from_vec(py, flat).reshape([self.0.len(), 3])
    }

    /// Unit quaternions in x, y, z, w order, (N, 4).
    #[getter]
    fn quat_xyzw<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let flat = rows(self.0.poses(), Pose::quat_xyzw);
        PyArray1::from_vec(py, flat).reshape([self.0.len(), 4])
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

impl PyTrajectory {
    /// An index that may count from the end.
    fn index(&self, index: isize) -> PyResult<usize> {
        let length = self.0.len();
        let from_start = if index < 0 {
            index + length as isize
        } else {
            index
        };
        let inside = usize::try_from(from_start).ok().filter(|i| *i < length);
        inside.ok_or_else(|| {
            PyIndexError::new_err(format!("index {index} of a trajectory of {length} poses"))
        })
    }

    /// The poses of indices, which must increase.
    fn subset<'py>(
        &self,
        py: Python<'py>,
        indices: impl Iterator<Item = isize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (mut stamps, mut poses) = (Vec::new(), Vec::new());
        for index in indices {
            let index = self.index(index)?;
            stamps.push(self.0.stamps()[index]);
            poses.push(self.0.poses()[index]);
        }
        let subset = Self(Trajectory::from_vecs(stamps, poses).into_python()?);
        Ok(Bound::new(py, subset)?.into_any())
    }
}

/// The numbers of all poses, one after the other.
fn rows<const N: usize>(poses: &[Pose], of: impl Fn(&Pose) -> [f64; N]) -> Vec<f64> {
    let mut flat = Vec::with_capacity(N * poses.len());
    poses
        .iter()
        .for_each(|pose| flat.extend_from_slice(&of(pose)));
    flat
}

fn trajectory_format(name: &str) -> PyResult<TrajectoryFormat> {
    name.parse::<TrajectoryFormat>().into_python()
}

/// A pose as a 4x4 array.
pub fn pose_matrix<'py>(py: Python<'py>, pose: &Pose) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let m = pose.matrix().transpose();
    PyArray1::from_slice(py, m.as_slice()).reshape([4, 4])
}

/// A pose from a 4x4 array.
pub fn pose_from(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Pose> {
    let array = floats(value, name, &[Some(4), Some(4)])?;
    let matrix = nalgebra::Matrix4::from_row_slice(array.as_slice()?);
    Pose::from_matrix(&matrix).map_err(|e| exception(Kind::Value, format!("{name}: {e}")))
}
