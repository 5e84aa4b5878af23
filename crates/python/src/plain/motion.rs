//! Results of odometry, self-calibration and solver as plain values.

use super::{Plain, not_plain, plain_names, plain_struct};
use pyo3::prelude::*;
use sphereflow_alignment::{Information, VelocityEstimate, WeakDirection};
use sphereflow_calibration::{
    CalibratedParameter, CalibrationStatus, HeldCombination, SelfCalibration,
};
use sphereflow_odometry::{KeyframeMotion, OdometryResult, Timings};
use sphereflow_slam::GraphReport;
use sphereflow_solver::{Iteration, LinearSolver, StopReason, Summary};

plain_struct!(WeakDirection {
    direction,
    std_m_s,
    score,
    estimated
});
plain_struct!(VelocityEstimate {
    status,
    twist,
    covariance,
    score,
    weak_directions,
    known_share,
    overlap,
    flow_px,
    rejected_share,
    divided_share,
    domains,
    residual_scale,
    mean_range_m,
    iterations,
});
plain_struct!(KeyframeMotion {
    keyframe,
    keyframe_from_camera,
    covariance
});
plain_struct!(Timings {
    averaging_s,
    estimation_s
});
plain_struct!(OdometryResult {
    stamp,
    status,
    world_from_camera,
    twist,
    covariance,
    keyframe_motion,
    estimate,
    segment,
    timings,
} skip { keyframes });
plain_struct!(GraphReport {
    keyframes,
    edges,
    rejected,
    failed,
    converged,
    interrupted,
    largest_change_m,
});
plain_struct!(Information {
    matrix,
    mean_range_m,
    eigenvalues,
    directions,
    score,
    domains
});
plain_struct!(CalibratedParameter {
    name,
    value,
    std,
    prior_std,
    observable
});
plain_struct!(HeldCombination { std_share, shares });
plain_struct!(SelfCalibration {
    status,
    camera,
    correction,
    readout_s,
    parameters,
    covariance,
    held,
    residual_before,
    residual_after,
    inflation,
    frames,
    pairs,
    iterations,
    rms_rate_rad_s,
    rms_speed_m_s,
});
plain_struct!(Iteration {
    cost,
    decrease,
    gain,
    gradient,
    step,
    lambda,
    accepted,
    elapsed
});
plain_struct!(Summary {
    initial_cost,
    final_cost,
    iterations,
    stop,
    elapsed
});
plain_names!(StopReason {
    "function_tolerance" => FunctionTolerance,
    "gradient_tolerance" => GradientTolerance,
    "parameter_tolerance" => ParameterTolerance,
    "max_iterations" => MaxIterations,
    "time_budget" => TimeBudget,
    "interrupted" => Interrupted,
    "no_descent" => NoDescent,
    "nothing_to_do" => NothingToDo,
});
plain_names!(LinearSolver {
    "auto" => Auto,
    "dense" => Dense,
    "sparse" => Sparse,
    "iterative" => Iterative,
});

/// Six of something.
impl<T: Plain + Clone> Plain for [T; 6] {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.to_vec().to_plain(py)
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let items = Vec::<T>::from_plain(value)?;
        Self::try_from(items).map_err(|_| not_plain("six values", value))
    }
}

/// Name and reason in words.
impl Plain for CalibrationStatus {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let why = match self {
            Self::Calibrated => None,
            Self::NotObservable(why) | Self::NoImprovement(why) => Some(why.clone()),
        };
        (self.name().to_string(), why).to_plain(py)
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (name, why) = <(String, Option<String>)>::from_plain(value)?;
        match why {
            None => Some(Self::Calibrated),
            Some(why) => [Self::NotObservable, Self::NoImprovement]
                .into_iter()
                .map(|status| status(why.clone()))
                .find(|status| status.name() == name),
        }
        .ok_or_else(|| not_plain("a status of a calibration", value))
    }
}

/// The code of why there is no calibration; its values stand in the words alone.
pub fn calibration_code(status: &CalibrationStatus) -> Option<&'static str> {
    match status {
        CalibrationStatus::Calibrated => None,
        CalibrationStatus::NotObservable(_) => Some("not_observable"),
        CalibrationStatus::NoImprovement(_) => Some("no_improvement"),
    }
}

/// Every code of [`calibration_code`].
pub const CALIBRATION_CODES: &[(&str, &[&str])] =
    &[("not_observable", &[]), ("no_improvement", &[])];
