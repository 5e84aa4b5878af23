//! The Python module `sphereflow._native`: argument checks, views, error mapping; no arithmetic on pixels.

mod arguments;
mod arrays;
mod attitude;
mod calibration;
mod calibration_file;
mod camera;
mod config;
mod depth;
mod depth_thesis;
mod engine;
mod errors;
mod flow;
mod frame;
mod grid;
mod imu_bias;
mod information;
mod motion_arguments;
mod navigation;
mod observers;
mod odometry;
mod pickle;
mod plain;
mod position;
mod range_flow;
mod recording;
mod reduce;
mod self_calibration;
mod sim;
mod simulated_frame;
mod slam;
mod solver;
mod trajectory;
mod update;
mod velocity;

use pyo3::prelude::*;

/// The compiled half of sphereflow. Private: import `sphereflow`.
#[pymodule]
mod _native {
    use super::*;

    #[pymodule_export]
    use crate::attitude::{PyAttitudeFilter, PyAttitudeRun, PyAttitudeState, PyVisualAttitude};
    #[pymodule_export]
    use crate::calibration::{calibrate_camera_imu, calibrate_imu_still, calibrate_mag_ellipsoid};
    #[pymodule_export]
    use crate::calibration_file::PyCalibration;
    #[pymodule_export]
    use crate::camera::PyCamera;
    #[pymodule_export]
    use crate::config::{check_config, default_config};
    #[pymodule_export]
    use crate::depth::{PyDepthFilter, PyDepthResult};
    #[pymodule_export]
    use crate::depth_thesis::{
        PyDepthObserver, PyFlowObserver, PyVariationalDepth, py_sobolev_depth, py_tv_l1_depth,
    };
    #[pymodule_export]
    use crate::engine::PyEngine;
    #[pymodule_export]
    use crate::flow::{py_horn_schunck, py_rof_denoise, py_tv_l1};
    #[pymodule_export]
    use crate::frame::{PyFrame, PyFrameIterator};
    #[pymodule_export]
    use crate::grid::PySphereGrid;
    #[pymodule_export]
    use crate::imu_bias::{PyImuBiasEstimator, PyImuBiasRun, PyImuBiasState};
    #[pymodule_export]
    use crate::information::{PyInformation, py_information};
    #[pymodule_export]
    use crate::navigation::{PyNavigationFilter, PyNavigationState};
    #[pymodule_export]
    use crate::observers::{PyVelocityBiasEstimator, PyVelocityBiasState};
    #[pymodule_export]
    use crate::odometry::{PyDepthOdometry, PyOdometryResult};
    #[pymodule_export]
    use crate::pickle::restore;
    #[pymodule_export]
    use crate::plain::reason_codes;
    #[pymodule_export]
    use crate::position::PyPositionObserver;
    #[pymodule_export]
    use crate::range_flow::PyRangeFlow;
    #[pymodule_export]
    use crate::recording::{PyRecording, PyRecordingWriter, py_open_recording};
    #[pymodule_export]
    use crate::self_calibration::{PySelfCalibration, PySelfCalibrator};
    #[pymodule_export]
    use crate::sim::PySimulator;
    #[pymodule_export]
    use crate::simulated_frame::{PySimulatedFrame, PySimulatedFrames};
    #[pymodule_export]
    use crate::slam::PyVoxelCloud;
    #[pymodule_export]
    use crate::solver::{
        PyBundleProblem, PyImuPreintegration, PyInertialWindow, PyMotion, PyPoseGraph,
        PySimilarityGraph, PySolverResult,
    };
    #[pymodule_export]
    use crate::trajectory::{PyTrajectory, py_associate};
    #[pymodule_export]
    use crate::update::PyUpdate;
    #[pymodule_export]
    use crate::velocity::{PyVelocityEstimate, py_estimate_velocity};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
