//! `Simulator`: a recording that never happened, with exact truth.

use crate::camera::PyCamera;
use crate::errors::{IntoPython, Kind, core_error, exception, io_error};
use crate::recording::{imu_arrays, mag_arrays};
use crate::simulated_frame::{PySimulatedFrames, image, rgb};
use crate::solver::solver_error;
use crate::trajectory::{PyTrajectory, pose_from};
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_sim::noise::{ImageNoiseParameters, KinectParameters};
use sphereflow_sim::{DepthNoiseParameters, Error, MagConfig, Motion, Scene, SimConfig, Simulator};
use sphereflow_sphere::Camera;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex};

impl<T> IntoPython<T> for Result<T, Error> {
    fn into_python(self) -> PyResult<T> {
        self.map_err(|error| match error {
            Error::Core(error) => core_error(&error),
            Error::Io(error) => io_error(&error),
            Error::Solver(error) => solver_error(&error),
        })
    }
}

/// Frames drawn before they are asked for: two keep the drawing and the using thread busy.
const AHEAD: usize = 2;

/// A simulated recording: it has what a recording has, and exact truth.
///
/// Parameters
/// ----------
/// scene : {'furnished_room', 'thesis_room', 'ellipsoid', 'sphere'}
///     The world; the thesis's is that of its section 4.1.1.
/// motion : {'room_tour', 'hand_held', 'trolley', 'sinusoids_411', 'still'}
///     How the camera moves.
/// camera : Camera, optional
///     Any model; a 640x480 pinhole of 525 px where absent.
/// duration_s, rate_hz : float
///     Length (the motion's own where absent) and frames per second.
/// seed : int
///     Decides furniture, path and all noise: same seed, same bits.
/// depth_noise : {'kinect', 'independent', 'none'}
///     Structured light with correlated noise, steps, holes, shadow and distortion; each pixel for
///     itself; perfect.
/// image_sigma_grey : float
///     Noise of the colour image, grey levels.
/// readout_s : float
///     Rolling shutter: seconds from the first row to the last; 0 for a global shutter.
/// imu : bool
///     Simulate gyro and accelerometer.
/// mag : bool
///     Simulate a magnetometer in a field that varies in space.
///
/// Raises
/// ------
/// ValueRangeError
///     Naming the argument.
#[pyclass(name = "Simulator", module = "sphereflow.sim", frozen)]
pub struct PySimulator {
    simulator: Arc<Simulator>,
    name: String,
}

fn scene(name: &str, seed: u64) -> PyResult<Scene> {
    match name {
        "furnished_room" => Ok(Scene::furnished_room(seed)),
        "thesis_room" => Ok(Scene::thesis_room()),
        "ellipsoid" => Ok(Scene::thesis_ellipsoid()),
        "sphere" => Scene::sphere(2.0).into_python(),
        other => Err(unknown_name(
            "scene",
            "'furnished_room', 'thesis_room', 'ellipsoid' or 'sphere'",
            other,
        )),
    }
}

fn motion(name: &str, seed: u64) -> PyResult<Motion> {
    match name {
        "room_tour" => Ok(Motion::room_tour(seed)),
        "hand_held" => Ok(Motion::hand_held(seed)),
        "trolley" => Ok(Motion::trolley(seed)),
        "sinusoids_411" => Ok(Motion::sinusoids_411()),
        "still" => Ok(Motion::still()),
        other => Err(unknown_name(
            "motion",
            "'room_tour', 'hand_held', 'trolley', 'sinusoids_411' or 'still'",
            other,
        )),
    }
}

fn depth_noise(name: &str) -> PyResult<DepthNoiseParameters> {
    match name {
        "kinect" => Ok(DepthNoiseParameters::Kinect(KinectParameters::default())),
        "independent" => Ok(DepthNoiseParameters::Independent {
            sigma_inv_m: 1.8e-3,
            quantum_inv_m: 2.85e-3,
        }),
        "none" => Ok(DepthNoiseParameters::None),
        other => Err(unknown_name(
            "depth_noise",
            "'kinect', 'independent' or 'none'",
            other,
        )),
    }
}

fn unknown_name(argument: &str, expected: &str, found: &str) -> PyErr {
    exception(
        Kind::Value,
        format!("{argument}: expected {expected}, found '{found}'"),
    )
}

#[pymethods]
impl PySimulator {
    #[new]
    #[pyo3(signature = (*, scene = "furnished_room", motion = "room_tour", camera = None,
        duration_s = None, rate_hz = 30.0, seed = 0, depth_noise = "kinect", image_sigma_grey = 2.0,
        readout_s = 0.0, imu = true, mag = false))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        scene: &str,
        motion: &str,
        camera: Option<&PyCamera>,
        duration_s: Option<f64>,
        rate_hz: f64,
        seed: u64,
        depth_noise: &str,
        image_sigma_grey: f64,
        readout_s: f64,
        imu: bool,
        mag: bool,
    ) -> PyResult<Self> {
        let name = format!("simulated {scene}, {motion}, seed {seed}");
        let demo = SimConfig::demo(seed).into_python()?;
        let camera: Camera = camera.map_or(demo.camera.clone(), |camera| camera.0.clone());
        let motion = self::motion(motion, seed)?;
        let config = SimConfig {
            scene: self::scene(scene, seed)?,
            camera,
            duration_s: duration_s.unwrap_or(motion.duration_s),
            motion,
            rate_hz,
            depth_noise: self::depth_noise(depth_noise)?,
            image_noise: ImageNoiseParameters {
                sigma_grey: image_sigma_grey,
                ..ImageNoiseParameters::default()
            },
            readout_s,
            imu: demo.imu.filter(|_| imu),
            mag: mag.then(MagConfig::default),
            ..demo
        };
        let simulator = py.detach(|| Simulator::new(config)).into_python()?;
        Ok(Self {
            simulator: Arc::new(simulator),
            name,
        })
    }

    fn __len__(&self) -> usize {
        self.simulator.len()
    }

    /// What is simulated, in words.
    #[getter]
    fn kind(&self) -> &str {
        &self.name
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(self.simulator.config().camera.clone())
    }

    /// Stamps of the frames, int64 nanoseconds, (N,).
    #[getter]
    fn stamp_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let stamps = (0..self.simulator.len()).map(|i| self.simulator.stamp(i).ns());
        PyArray1::from_iter(py, stamps)
    }

    /// The exact poses, world from camera.
    #[getter]
    fn truth(&self) -> PyResult<PyTrajectory> {
        self.simulator.truth().into_python().map(PyTrajectory)
    }

    /// Where the calibration comes from.
    #[getter]
    fn calibration_source(&self) -> &'static str {
        "simulated, exact"
    }

    /// Simulated depth is in metres: there are no counts.
    #[getter]
    fn depth_scale(&self) -> Option<f64> {
        None
    }

    /// Rolling shutter read-out time, seconds.
    #[getter]
    fn readout_s(&self) -> f64 {
        self.simulator.config().readout_s
    }

    /// Colour and depth share their pixels.
    #[getter]
    fn colour_registered(&self) -> bool {
        true
    }

    /// A simulation passes over nothing.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// Nothing to note.
    #[getter]
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// All inertial samples: dict of stamp_ns (N,), gyro_rad_s (N, 3), accel_m_s2 (N, 3).
    #[getter]
    fn imu<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        imu_arrays(py, &self.simulator.inertial().into_python()?.0)
    }

    /// All magnetic samples: dict of stamp_ns (N,), mag_ut (N, 3).
    #[getter]
    fn mag<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        mag_arrays(py, &self.simulator.inertial().into_python()?.1)
    }

    /// Stamps of depth and colour agree exactly.
    #[getter]
    fn sync(&self) -> Option<Py<PyDict>> {
        None
    }

    /// Frames from `start` to `stop`, drawn ahead while the caller works.
    #[pyo3(signature = (start = 0, stop = None))]
    fn frames(&self, start: usize, stop: Option<usize>) -> PyResult<PySimulatedFrames> {
        let stop = stop.unwrap_or(usize::MAX).min(self.simulator.len());
        let (sender, receiver) = sync_channel(AHEAD);
        let simulator = Arc::clone(&self.simulator);
        std::thread::Builder::new()
            .name("simulate".into())
            .spawn(move || {
                let frames = simulator.frames().take(stop).skip(start);
                for frame in frames {
                    if sender.send(frame).is_err() {
                        return; // nobody is listening any more
                    }
                }
            })?;
        Ok(PySimulatedFrames(Mutex::new(receiver)))
    }

    /// What the camera sees from a pose, without noise: (range_m, depth_m, colour).
    #[allow(clippy::type_complexity)]
    fn render<'py>(
        &self,
        py: Python<'py>,
        world_from_camera: &Bound<'py, PyAny>,
    ) -> PyResult<(
        Bound<'py, PyArray2<f32>>,
        Bound<'py, PyArray2<f32>>,
        Bound<'py, PyArray3<u8>>,
    )> {
        let pose = pose_from(world_from_camera, "world_from_camera")?;
        let seen = py.detach(|| self.simulator.renderer().render(&pose));
        let range = image(py, seen.range.metres())?;
        Ok((
            range,
            image(py, seen.depth.metres())?,
            rgb(py, &seen.colour)?,
        ))
    }

    /// Write a recording to the folder `path`; `progress(frames_done, frames_total)` is called
    /// after each frame. Ctrl-C, and an exception of `progress`, end it and leave nothing.
    #[pyo3(signature = (path, *, progress = None))]
    fn write(&self, py: Python<'_>, path: PathBuf, progress: Option<Py<PyAny>>) -> PyResult<()> {
        let total = self.simulator.len();
        let mut failed = None;
        let tell = |done: usize| {
            let told = Python::attach(|py| {
                py.check_signals()?;
                progress.as_ref().map_or(Ok(()), |progress| {
                    progress.call1(py, (done, total)).map(|_| ())
                })
            });
            match told {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    failed = Some(error);
                    ControlFlow::Break(())
                }
            }
        };
        py.detach(|| self.simulator.write_with(&path, tell))
            .into_python()?;
        failed.map_or(Ok(()), Err)
    }

    fn __repr__(&self) -> String {
        format!("Simulator({}, {} frames)", self.name, self.simulator.len())
    }
}
