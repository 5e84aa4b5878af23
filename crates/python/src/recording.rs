//! `open_recording`, `Recording` and `RecordingWriter`.

use crate::arrays::metres;
use crate::calibration_file::PyCalibration;
use crate::camera::PyCamera;
use crate::errors::{IntoPython, io_error};
use crate::frame::{PyFrame, PyFrameIterator};
use crate::trajectory::PyTrajectory;
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::{DepthMap, ImuSample, MagSample, RangeMap, RgbdFrame, Stamp};
use sphereflow_io::{CalibrationFile, OpenOptions, Recording, RecordingWriter, open_recording};
use std::path::PathBuf;
use std::sync::Mutex;

/// A recording on disk: TUM RGB-D, 7-Scenes or EuRoC (inertial only).
#[pyclass(name = "Recording", module = "sphereflow.io", frozen)]
pub struct PyRecording(pub Recording);

/// Vectors as an (N, 3) array.
pub fn rows3<'py>(
    py: Python<'py>,
    rows: impl ExactSizeIterator<Item = Vector3<f64>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let count = rows.len();
    PyArray1::from_iter(py, rows.flat_map(|v| [v.x, v.y, v.z])).reshape([count, 3])
}

/// Inertial samples as a dict of arrays.
pub fn imu_arrays<'py>(py: Python<'py>, samples: &[ImuSample]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item(
        "stamp_ns",
        PyArray1::from_iter(py, samples.iter().map(|s| s.stamp.ns())),
    )?;
    dict.set_item(
        "gyro_rad_s",
        rows3(py, samples.iter().map(|s| s.gyro_rad_s))?,
    )?;
    dict.set_item(
        "accel_m_s2",
        rows3(py, samples.iter().map(|s| s.accel_m_s2))?,
    )?;
    Ok(dict)
}

/// Magnetic samples as a dict of arrays.
pub fn mag_arrays<'py>(py: Python<'py>, samples: &[MagSample]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item(
        "stamp_ns",
        PyArray1::from_iter(py, samples.iter().map(|s| s.stamp.ns())),
    )?;
    dict.set_item("mag_ut", rows3(py, samples.iter().map(|s| s.mag_ut))?)?;
    Ok(dict)
}

#[pymethods]
impl PyRecording {
    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// What kind of folder it is.
    #[getter]
    fn kind(&self) -> String {
        self.0.kind().to_string()
    }

    /// The folder.
    #[getter]
    fn path(&self) -> PathBuf {
        self.0.path().to_path_buf()
    }

    /// Stamps of the frames, int64 nanoseconds, (N,).
    #[getter]
    fn stamp_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.0.stamps().iter().map(|s| s.ns()))
    }

    /// The camera; None for a recording without images.
    #[getter]
    fn camera(&self) -> Option<PyCamera> {
        self.0.camera().cloned().map(PyCamera)
    }

    /// Which calibration is used, and where it comes from.
    #[getter]
    fn calibration_source(&self) -> String {
        self.0.calibration_source()
    }

    /// Counts of the depth images per metre.
    #[getter]
    fn depth_scale(&self) -> Option<f64> {
        self.0.depth_scale()
    }

    /// Rolling shutter read-out time, seconds, where the calibration gives one: row y of H is exposed
    /// (y / H - 1/2) readout_s after the stamp.
    #[getter]
    fn readout_s(&self) -> Option<f64> {
        self.0
            .calibration()
            .and_then(|calibration| calibration.readout_s)
    }

    /// True where the calibration corrects depth: the frames' depth is then not the stored one.
    #[getter]
    fn depth_corrected(&self) -> bool {
        self.0.depth_corrected()
    }

    /// What is known of the device; the frames' depth is already corrected by its `depth_field`. None
    /// for a recording without images.
    #[getter]
    fn calibration(&self) -> PyResult<Option<PyCalibration>> {
        let known = self.0.device().into_python()?;
        Ok(known.map(PyCalibration))
    }

    /// World from camera, where the recording has a truth.
    #[getter]
    fn truth(&self) -> Option<PyTrajectory> {
        self.0.truth().cloned().map(PyTrajectory)
    }

    /// True where colour and depth pixels see along the same rays.
    #[getter]
    fn colour_registered(&self) -> bool {
        self.0.colour_registered()
    }

    /// Gravity in the world of the truth, m/s^2, pointing down, (3,), where it is known.
    #[getter]
    fn gravity_in_world<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0
            .gravity_in_world()
            .map(|g| PyArray1::from_slice(py, g.as_slice()))
    }

    /// Differences between depth and colour stamps: dict of pairs, median_s, max_s, tolerance_s.
    #[getter]
    fn sync<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(sync) = self.0.sync() else {
            return Ok(None);
        };
        let dict = PyDict::new(py);
        dict.set_item("pairs", sync.pairs)?;
        dict.set_item("median_s", sync.median_s)?;
        dict.set_item("max_s", sync.max_s)?;
        dict.set_item("tolerance_s", sync.tolerance_s)?;
        Ok(Some(dict))
    }

    /// What was passed over while reading, counted.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0
            .warnings()
            .as_slice()
            .iter()
            .map(ToString::to_string)
            .collect()
    }

    /// What a reader of the results should know about this kind of recording.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.notes().to_vec()
    }

    /// Inertial samples: dict of stamp_ns (N,), gyro_rad_s (N, 3), accel_m_s2 (N, 3); NaN where a
    /// sensor is absent.
    #[getter]
    fn imu<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        imu_arrays(py, self.0.imu())
    }

    /// Magnetic samples: dict of stamp_ns (N,), mag_ut (N, 3).
    #[getter]
    fn mag<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        mag_arrays(py, self.0.mag())
    }

    /// Frame `index`, read now.
    fn frame(&self, py: Python<'_>, index: usize) -> PyResult<PyFrame> {
        PyFrame::new(py, py.detach(|| self.0.frame(index)).into_python()?)
    }

    /// Frames from `start` to `stop` in order, decoded ahead while the caller works.
    #[pyo3(signature = (start = 0, stop = None, *, prefetch = 8))]
    fn frames(
        &self,
        start: usize,
        stop: Option<usize>,
        prefetch: usize,
    ) -> PyResult<PyFrameIterator> {
        let stop = stop.unwrap_or(self.0.len()).min(self.0.len());
        self.0
            .stream(start.min(stop)..stop, prefetch)
            .into_python()
            .map(|stream| PyFrameIterator(Mutex::new(stream)))
    }

    fn __repr__(&self) -> String {
        format!(
            "Recording({}, {} frames, {})",
            self.0.kind(),
            self.0.len(),
            self.0.path().display()
        )
    }
}

/// Open a recording, guessing its kind from the files in it.
///
/// Parameters
/// ----------
/// path : path
///     A TUM RGB-D, 7-Scenes or EuRoC (inertial only) folder, or one of sphereflow's own.
/// calibration : path, optional
///     Calibration file (TOML) instead of the one that would be found.
/// depth_scale : float, optional
///     Counts of the depth images per metre, instead of the calibration's.
/// sync_tolerance_s : float, optional
///     Largest difference between depth and colour stamps; half a frame where absent.
///
/// Returns
/// -------
/// Recording
///     Its `warnings` say what was passed over, `calibration_source` which calibration is used.
///
/// Raises
/// ------
/// DataError
///     With path, line, what was expected and found; also where the depth scale cannot be right.
/// MissingFileError
///     Where there is no such folder.
#[pyfunction]
#[pyo3(
    name = "open_recording",
    signature = (path, *, calibration = None, depth_scale = None, sync_tolerance_s = None)
)]
pub fn py_open_recording(
    py: Python<'_>,
    path: PathBuf,
    calibration: Option<PathBuf>,
    depth_scale: Option<f64>,
    sync_tolerance_s: Option<f64>,
) -> PyResult<PyRecording> {
    let calibration = calibration
        .map(|path| CalibrationFile::read(&path))
        .transpose();
    let calibration = calibration.map_err(|error| io_error(&error))?;
    let options = OpenOptions {
        calibration,
        depth_scale,
        sync_tolerance_s,
    };
    py.detach(|| open_recording(&path, &options))
        .into_python()
        .map(PyRecording)
}

/// Writes your own frames as a recording that `open_recording` reads back.
///
/// Until `finish` the folder is called `<path>.partial`.
///
/// Parameters
/// ----------
/// path : path
///     A folder that does not exist or is empty.
/// camera : Camera
///     The camera of depth and colour.
/// depth_scale : float
///     Counts per metre of the stored 16-bit depth images.
#[pyclass(name = "RecordingWriter", module = "sphereflow.io")]
pub struct PyRecordingWriter {
    writer: Option<RecordingWriter>,
    size: (usize, usize),
    all_around: bool,
}

#[pymethods]
impl PyRecordingWriter {
    #[new]
    #[pyo3(signature = (path, camera, *, depth_scale = 1000.0))]
    fn new(path: PathBuf, camera: &PyCamera, depth_scale: f64) -> PyResult<Self> {
        let calibration = CalibrationFile::of_camera(&camera.0, depth_scale).into_python()?;
        Ok(Self {
            writer: Some(RecordingWriter::create(&path, calibration).into_python()?),
            size: (camera.0.width(), camera.0.height()),
            all_around: camera.0.wraps_around(),
        })
    }

    /// Add a frame: depth along the optical axis (range along the ray for a 360-degree camera) in
    /// metres, (H, W), and RGB, (H, W, 3).
    #[pyo3(signature = (depth_m, stamp_ns, *, colour = None))]
    fn push(
        &mut self,
        py: Python<'_>,
        depth_m: &Bound<'_, PyAny>,
        stamp_ns: i64,
        colour: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let plane = metres(depth_m, "depth_m", Some(self.size))?;
        let (depth, range) = if self.all_around {
            (None, Some(RangeMap::new(plane)))
        } else {
            (Some(DepthMap::new(plane)), None)
        };
        let frame = RgbdFrame {
            stamp: Stamp::from_ns(stamp_ns),
            depth,
            range,
            colour: colour
                .map(|image| crate::arrays::colour(image, "colour", Some(self.size)))
                .transpose()?,
            ..RgbdFrame::default()
        };
        match &mut self.writer {
            Some(writer) => py.detach(|| writer.push(&frame)).into_python(),
            None => Err(finished()),
        }
    }

    /// Write the indexes and give the folder its name.
    fn finish(&mut self, py: Python<'_>) -> PyResult<()> {
        match self.writer.take() {
            Some(writer) => py.detach(|| writer.finish()).map(|_| ()).into_python(),
            None => Err(finished()),
        }
    }
}

fn finished() -> PyErr {
    let message = "recording: expected one that is still open, found one that is finished";
    crate::errors::exception(crate::errors::Kind::Value, message)
}
