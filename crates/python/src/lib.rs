//! The Python module `sphereflow._native`: argument checks, views, error mapping; no arithmetic on pixels.

mod arrays;
mod camera;
mod errors;
mod grid;
mod odometry;
mod recording;
mod sim;
mod slam;
mod trajectory;

use pyo3::prelude::*;

/// The compiled half of sphereflow. Private: import `sphereflow`.
#[pymodule]
mod _native {
    use super::*;

    #[pymodule_export]
    use crate::camera::PyCamera;
    #[pymodule_export]
    use crate::grid::PySphereGrid;
    #[pymodule_export]
    use crate::odometry::{
        PyDepthOdometry, PyOdometryResult, PyVelocityEstimate, py_estimate_velocity,
    };
    #[pymodule_export]
    use crate::recording::{
        PyFrame, PyFrameIterator, PyRecording, PyRecordingWriter, py_open_recording,
    };
    #[pymodule_export]
    use crate::sim::{PySimulatedFrame, PySimulatedFrames, PySimulator};
    #[pymodule_export]
    use crate::slam::PyVoxelCloud;
    #[pymodule_export]
    use crate::trajectory::{PyTrajectory, associate};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
