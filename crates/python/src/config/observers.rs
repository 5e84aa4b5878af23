//! Settings of the observers.

use super::Settings;
use crate::errors::IntoPython;
use crate::plain::{Plain, dict_of, field, not_plain, plain_names, plain_struct};
use nalgebra::Matrix4;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sphereflow_core::Pose;
pub use sphereflow_observers::attitude::AttitudeConfig;
use sphereflow_observers::attitude::{Method as AttitudeMethod, World};
use sphereflow_observers::imu_bias::ImuBiasMethod;
pub use sphereflow_observers::imu_bias::{ImuBiasConfig, ObserverGains};
pub use sphereflow_observers::navigation::NavigationConfig;
use sphereflow_observers::velocity_bias::BiasMethod;
pub use sphereflow_observers::velocity_bias::{FixedGains, VelocityBiasConfig};

plain_names!(AttitudeMethod { "inertial" => Inertial, "invariant" => Invariant });
plain_names!(World { "enu" => EastNorthUp, "rdf" => RightDownForward });
plain_struct!(AttitudeConfig {
    method,
    world,
    tau_accel_s,
    tau_mag_s,
    motion_bias,
    rest_bias,
    reject_disturbance,
    bias_clip_rad_s,
    bias_sigma_start_rad_s,
    bias_sigma_motion_rad_s,
    bias_sigma_rest_rad_s,
    bias_forgetting_s,
    invariant_gain,
    invariant_bias_gain,
    gyro_limit_rad_s,
    max_gap_s,
});
plain_names!(ImuBiasMethod { "ekf" => Ekf, "observer" => Observer });
plain_struct!(ObserverGains {
    lambda_v,
    lambda_g,
    lambda_w,
    lambda_a,
    k_v,
    k_w1,
    k_g2
});
plain_struct!(ImuBiasConfig {
    method,
    gains,
    gravity_m_s2,
    gravity_sigma_m_s2,
    field_dot_down,
    field_sigma,
    gyro_sigma_rad_s,
    accel_sigma_m_s2,
    gyro_walk,
    accel_walk,
    gyro_bias_sigma,
    accel_bias_sigma,
    gate,
    max_gap_s,
    gyro_limit_rad_s,
});
plain_names!(BiasMethod {
    "information" => Information,
    "observer" => Observer,
    "normalised" => Normalised,
});
plain_struct!(FixedGains {
    k_field,
    k_v,
    k_omega,
    lambda_y,
    lambda_d
});
plain_struct!(VelocityBiasConfig {
    method,
    gains,
    rate_per_s,
    forget_s,
    linear_sigma,
    angular_sigma,
    linear_bias_sigma,
    angular_bias_sigma,
    readout_s,
    timing_sigma_s,
    shared_error_px,
    max_gap_s,
    angular_limit_rad_s,
    max_width,
    window_border,
});

/// Calls `$call!` with the navigation filter's settings that are plain numbers.
macro_rules! navigation_numbers {
    ($call:ident) => {
        $call!(
            gyro_sigma_rad_s,
            accel_sigma_m_s2,
            gyro_walk,
            accel_walk,
            gyro_bias_sigma,
            accel_bias_sigma,
            mag_heading_sigma_rad,
            max_delay_s,
            max_gap_s,
            velocity_gate,
            pose_gate,
            patience_s,
            gyro_limit_rad_s
        )
    };
}

/// The pose of the camera is a 4x4 matrix, row by row.
impl Plain for NavigationConfig {
    fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let dict = PyDict::new(py);
        let matrix = self.body_from_camera.matrix();
        let rows: Vec<_> = matrix.row_iter().map(|row| row.transpose()).collect();
        dict.set_item("gravity_m_s2", self.gravity_m_s2.to_plain(py)?)?;
        dict.set_item("body_from_camera", rows.to_plain(py)?)?;
        macro_rules! set {
            ($($name:ident),+) => {{
                let Self { gravity_m_s2: _, body_from_camera: _, $($name),+ } = self;
                $(dict.set_item(stringify!($name), $name)?;)+
            }};
        }
        navigation_numbers!(set);
        Ok(dict.into_any())
    }

    fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let dict = dict_of(value)?;
        let rows: Vec<nalgebra::Vector4<f64>> = field(dict, "body_from_camera")?;
        let [a, b, c, d] = rows[..] else {
            return Err(not_plain("four rows", value));
        };
        let rows = [a, b, c, d].map(|row| row.transpose());
        let pose = Pose::from_matrix(&Matrix4::from_rows(&rows)).map_err(|mut error| {
            if let sphereflow_core::Error::Value { argument, .. } = &mut error {
                *argument = "body_from_camera".into();
            }
            crate::errors::core_error(&error)
        })?;
        macro_rules! get {
            ($($name:ident),+) => {
                Self {
                    gravity_m_s2: field(dict, "gravity_m_s2")?,
                    body_from_camera: pose,
                    $($name: field(dict, stringify!($name))?),+
                }
            };
        }
        Ok(navigation_numbers!(get))
    }
}

/// Settings whose checks are a method.
macro_rules! checked {
    ($($type:ident as $name:literal),+ $(,)?) => {$(
        impl Settings for $type {
            const NAME: &'static str = $name;

            fn defaults() -> Self {
                Self::default()
            }

            fn check(&self) -> PyResult<()> {
                Self::check(self).into_python()
            }
        }
    )+};
}
checked!(
    AttitudeConfig as "AttitudeConfig",
    ImuBiasConfig as "ImuBiasConfig",
    ObserverGains as "ImuBiasGains",
    VelocityBiasConfig as "VelocityBiasConfig",
    NavigationConfig as "NavigationConfig",
);

impl Settings for FixedGains {
    const NAME: &'static str = "VelocityBiasGains";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        let config = VelocityBiasConfig {
            gains: *self,
            ..VelocityBiasConfig::default()
        };
        config.check().into_python()
    }
}
