//! `_native.Engine`: the main job under a lock, so that several threads may hold it.

use crate::arrays::{colour as colour_image, mask as mask_image, metres, stamps, vectors3};
use crate::calibration_file::PyCalibration;
use crate::config::settings;
use crate::errors::{IntoPython, Kind, exception};
use crate::plain::Plain;
use crate::slam::PyVoxelCloud;
use crate::trajectory::PyTrajectory;
use crate::update::PyUpdate;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::{
    DepthMap, ImuBatch, ImuSample, MagSample, Pose, RangeMap, RgbdFrame, Stamp, Trajectory,
};
use sphereflow_engine::{Engine, EngineConfig, Kind as PoseKind, StopFlag};
use sphereflow_io::CalibrationFile;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The main job, one stage after the other: `sphereflow.Engine` is built on it.
///
/// Parameters
/// ----------
/// calibration : Calibration
///     The device.
/// config : sphereflow.config.EngineConfig, optional
///     The settings.
#[pyclass(name = "Engine", module = "sphereflow._native", subclass, frozen)]
pub struct PyEngine {
    engine: Mutex<Engine>,
    stop: StopFlag,
    size: (usize, usize),
    depth_scale: f64,
}

impl PyEngine {
    /// The engine; waits, without the interpreter's lock, while another thread uses it.
    fn locked<T>(&self, py: Python<'_>, job: impl FnOnce(&mut Engine) -> T + Send) -> T
    where
        T: Send,
    {
        py.detach(|| job(&mut self.guard()))
    }

    fn guard(&self) -> MutexGuard<'_, Engine> {
        self.engine.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl PyEngine {
    #[new]
    #[pyo3(signature = (calibration, config = None))]
    fn new(calibration: &PyCalibration, config: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let config: EngineConfig = settings(config)?;
        let rig = calibration.calibration()?;
        let size = rig
            .depth
            .as_ref()
            .map_or((0, 0), |c| (c.width(), c.height()));
        let engine = Engine::new(rig, config).into_python()?;
        Ok(Self {
            stop: engine.stop_flag(),
            engine: Mutex::new(engine),
            size,
            depth_scale: calibration.0.depth_scale,
        })
    }

    /// The next frame: `depth_m` along the optical axis or `range_m` along the ray, (H, W) metres, NaN
    /// unknown; `colour` RGB, (H, W, 3); `mask`, (H, W) bool, True where depth is to be ignored.
    ///
    /// Raises
    /// ------
    /// ShapeError, DtypeError
    ///     Naming the argument; the engine is as before.
    #[pyo3(signature = (stamp_ns, *, depth_m = None, range_m = None, colour = None, mask = None,
        colour_stamp_ns = None))]
    #[allow(clippy::too_many_arguments)] // keyword arguments of Python
    fn push_frame(
        &self,
        py: Python<'_>,
        stamp_ns: i64,
        depth_m: Option<&Bound<'_, PyAny>>,
        range_m: Option<&Bound<'_, PyAny>>,
        colour: Option<&Bound<'_, PyAny>>,
        mask: Option<&Bound<'_, PyAny>>,
        colour_stamp_ns: Option<i64>,
    ) -> PyResult<PyUpdate> {
        let size = Some(self.size);
        let plane = |value: Option<&Bound<'_, PyAny>>, name: &str| {
            value.map(|value| metres(value, name, size)).transpose()
        };
        let colour = colour.map(|image| colour_image(image, "colour", size));
        let mask = mask.map(|image| mask_image(image, "mask", self.size));
        let frame = RgbdFrame {
            stamp: Stamp::from_ns(stamp_ns),
            colour_stamp: colour_stamp_ns.map(Stamp::from_ns),
            depth: plane(depth_m, "depth_m")?.map(DepthMap::new),
            range: plane(range_m, "range_m")?.map(RangeMap::new),
            colour: colour.transpose()?,
            mask: mask.transpose()?,
            ..RgbdFrame::default()
        };
        let update = self.locked(py, |engine| engine.push(frame)).into_python()?;
        update.map(PyUpdate).ok_or_else(|| {
            exception(
                Kind::Value,
                "frame: expected an update, found none".to_string(),
            )
        })
    }

    /// Inertial readings: stamps (N,), rad/s (N, 3), m/s^2 (N, 3); NaN where a sensor is absent.
    fn push_imu(
        &self,
        py: Python<'_>,
        stamp_ns: &Bound<'_, PyAny>,
        gyro_rad_s: &Bound<'_, PyAny>,
        accel_m_s2: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let stamps = stamps(stamp_ns, "stamp_ns")?;
        let gyro = vectors3(gyro_rad_s, "gyro_rad_s")?;
        let accel = vectors3(accel_m_s2, "accel_m_s2")?;
        for (name, count) in [("gyro_rad_s", gyro.len()), ("accel_m_s2", accel.len())] {
            if count != stamps.len() {
                let text = format!("{name}: expected {} rows, found {count}", stamps.len());
                return Err(exception(Kind::Shape, text));
            }
        }
        let readings = stamps.into_iter().zip(gyro).zip(accel);
        let samples = readings
            .map(|((stamp, gyro_rad_s), accel_m_s2)| ImuSample {
                stamp,
                gyro_rad_s,
                accel_m_s2,
            })
            .collect();
        let batch = ImuBatch { samples };
        let pushed = self.locked(py, |engine| engine.push(batch));
        pushed.into_python().map(|_| ())
    }

    /// A reading of the magnetometer, microtesla, (3,).
    fn push_mag(&self, py: Python<'_>, stamp_ns: i64, mag_ut: [f64; 3]) -> PyResult<()> {
        let sample = MagSample {
            stamp: Stamp::from_ns(stamp_ns),
            mag_ut: mag_ut.into(),
        };
        let pushed = self.locked(py, |engine| engine.push(sample));
        pushed.into_python().map(|_| ())
    }

    /// After the last frame: keyframes compared with each other, all poses fitted, the cloud at them.
    ///
    /// Parameters
    /// ----------
    /// progress : callable, optional
    ///     Called with the comparisons done and those in all.
    ///
    /// Returns
    /// -------
    /// dict or None
    ///     keyframes, edges, rejected, failed, converged, interrupted, largest_change_m; None where
    ///     there was nothing to compare.
    #[pyo3(signature = (progress = None))]
    fn finish<'py>(
        &self,
        py: Python<'py>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let stop = &self.stop;
        let mut failure = None;
        let report = self.locked(py, |engine| {
            engine.finish_with(|done, total| {
                let told = Python::attach(|py| {
                    py.check_signals()?; // so that Ctrl-C ends it
                    match &progress {
                        Some(progress) => progress.call1(py, (done, total)).map(|_| ()),
                        None => Ok(()),
                    }
                });
                if let Err(error) = told {
                    stop.raise();
                    failure.get_or_insert(error);
                }
            })
        });
        if let Some(error) = failure {
            stop.clear();
            return Err(error);
        }
        let report = report.into_python()?;
        report.map(|report| report.to_plain(py)).transpose()
    }

    /// Forget everything but calibration and settings.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.stop.clear();
        self.locked(py, Engine::reset).into_python()
    }

    /// End `finish`, from another thread, after the comparison under way.
    fn cancel(&self) {
        self.stop.raise();
    }

    /// Poses of all frames that have one: "final" as the map has them now, "causal" as they were
    /// published.
    #[pyo3(signature = (kind = "final"))]
    fn trajectory(&self, py: Python<'_>, kind: &str) -> PyResult<PyTrajectory> {
        let kind = match kind {
            "final" => PoseKind::Final,
            "causal" => PoseKind::Causal,
            other => {
                let text = format!("kind: expected 'final' or 'causal', found '{other}'");
                return Err(exception(Kind::Value, text));
            }
        };
        let found = self.locked(py, |engine| engine.trajectory(kind));
        found.into_python().map(PyTrajectory)
    }

    /// Final poses of one segment.
    fn segment(&self, py: Python<'_>, index: u32) -> PyResult<PyTrajectory> {
        let found = self.locked(py, |engine| engine.map().segment(index));
        found.into_python().map(PyTrajectory)
    }

    /// The keyframes' poses.
    fn keyframes(&self, py: Python<'_>) -> PyResult<PyTrajectory> {
        let poses: Vec<(Stamp, Pose)> = self.locked(py, |engine| {
            let keyframes = engine.map().keyframes().iter();
            keyframes
                .map(|k| (k.stamp, k.world_from_keyframe))
                .collect()
        });
        let (stamps, poses) = poses.into_iter().unzip();
        Trajectory::from_vecs(stamps, poses)
            .into_python()
            .map(PyTrajectory)
    }

    /// The coloured cloud as `finish` put it together; with `growing`, of the keyframes that are
    /// followed by others.
    #[pyo3(signature = (*, growing = false))]
    fn cloud(&self, py: Python<'_>, growing: bool) -> PyVoxelCloud {
        self.locked(py, |engine| {
            PyVoxelCloud(match growing {
                true => engine.growing_cloud().clone(),
                false => engine.cloud().clone(),
            })
        })
    }

    /// Write keyframes and the motions measured between them as a g2o file.
    fn write_graph(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = self.locked(py, |engine| {
            let map = engine.map();
            let nodes = map.keyframes().iter().map(|k| k.world_from_keyframe);
            let edges = map.edges().iter().map(|edge| {
                let of_second = edge.information_of_second();
                (edge.a, edge.b, edge.a_from_b, of_second)
            });
            sphereflow_io::problems::write_g2o(&path, nodes, edges)
        });
        written.into_python()
    }

    /// What is known of the device.
    #[getter]
    fn calibration(&self, py: Python<'_>) -> PyResult<PyCalibration> {
        let known = self.locked(py, |engine| engine.calibration().clone());
        let file = CalibrationFile::of_calibration(&known, self.depth_scale);
        file.into_python().map(PyCalibration)
    }

    /// The numbers of the run so far, as a dict.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let report = self.locked(py, |engine| engine.report().clone());
        let dict = PyDict::new(py);
        dict.set_item("frames", report.frames)?;
        dict.set_item("frames_with_pose", report.with_pose)?;
        dict.set_item("coverage", report.coverage())?;
        dict.set_item("coverage_weak", report.coverage_weak())?;
        dict.set_item("keyframes", report.keyframes)?;
        let segment = |segment: &sphereflow_engine::Segment| {
            let entry = PyDict::new(py);
            entry.set_item("index", segment.index)?;
            entry.set_item("first_stamp_ns", segment.first.ns())?;
            entry.set_item("last_stamp_ns", segment.last.ns())?;
            entry.set_item("frames", segment.frames)?;
            Ok(entry)
        };
        let segments: PyResult<Vec<_>> = report.segments.iter().map(segment).collect();
        dict.set_item("segments", segments?)?;
        dict.set_item("world", report.world.name())?;
        dict.set_item("world_because", report.world.because())?;
        let graph = report.graph.map(|graph| graph.to_plain(py)).transpose()?;
        dict.set_item("graph", graph)?;
        Ok(dict)
    }
}
