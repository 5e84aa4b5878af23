//! Settings of dense depth.

use super::Settings;
use crate::errors::IntoPython;
use crate::plain::{Plain, plain_names, plain_struct};
use pyo3::prelude::*;
use sphereflow_depth::{
    Brightness, DepthFilter, DepthObserver, FlowObserver, ObserverConfig, PixelRays, SobolevDepth,
    TvDepth,
};
pub use sphereflow_depth::{DepthFilterConfig, SobolevConfig, TvDepthConfig};
use sphereflow_sphere::Camera;

plain_names!(Brightness { "measured" => Measured, "constant" => Constant });
plain_struct!(DepthFilterConfig {
    binning,
    lags,
    sigma_grey,
    initial_range_m,
    farthest_m,
    roughness_per_m_rad,
    memory,
    start_frames,
    brightness,
    occlusion,
    keyframes,
});
plain_struct!(ObserverConfig {
    gain,
    initial_range_m,
    farthest_m,
    least_speed_m_s
});
plain_struct!(SobolevConfig {
    alpha_m_s,
    tolerance,
    iterations
});
// `lambda` is a keyword of Python.
plain_struct!(TvDepthConfig {
    lambda as "weight",
    beta2,
    gap,
    iterations,
    nearest_m
});

/// A camera of few pixels, on which settings are tried out.
fn small() -> PyResult<Camera> {
    Camera::pinhole(16.0, 16.0, 15.5, 15.5, 32, 32).into_python()
}

/// Its rays.
fn rays() -> PyResult<PixelRays> {
    PixelRays::new(&small()?).into_python()
}

impl Settings for DepthFilterConfig {
    const NAME: &'static str = "DepthFilterConfig";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        let filter = DepthFilter::new(&small()?, self.clone());
        filter.map(|_| ()).into_python()
    }
}

/// Of the observer that takes optical flow.
pub struct FlowObserverConfig(pub ObserverConfig);

/// Of the observer that takes inverse ranges.
pub struct DepthObserverConfig(pub ObserverConfig);

/// The two observers have the same settings with other gains.
macro_rules! observer_settings {
    ($($wrapper:ident of $observer:ident from $defaults:ident as $name:literal),+) => {$(
        impl Plain for $wrapper {
            fn to_plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                self.0.to_plain(py)
            }

            fn from_plain(value: &Bound<'_, PyAny>) -> PyResult<Self> {
                Plain::from_plain(value).map(Self)
            }
        }

        impl Settings for $wrapper {
            const NAME: &'static str = $name;

            fn defaults() -> Self {
                Self(ObserverConfig::$defaults())
            }

            fn check(&self) -> PyResult<()> {
                $observer::new(&rays()?, self.0).map(|_| ()).into_python()
            }
        }
    )+};
}
observer_settings!(
    FlowObserverConfig of FlowObserver from flow as "FlowObserverConfig",
    DepthObserverConfig of DepthObserver from depth as "DepthObserverConfig"
);

impl Settings for SobolevConfig {
    const NAME: &'static str = "SobolevConfig";

    fn defaults() -> Self {
        Self::default()
    }

    fn check(&self) -> PyResult<()> {
        SobolevDepth::new(&rays()?, *self).map(|_| ()).into_python()
    }
}

impl Settings for TvDepthConfig {
    const NAME: &'static str = "TvDepthConfig";

    /// For a pair of images by itself: until a thousandth is left to gain, and not the few
    /// iterations of a video that starts from the depth before.
    fn defaults() -> Self {
        Self {
            gap: 1e-3,
            iterations: 400,
            ..Self::default()
        }
    }

    fn check(&self) -> PyResult<()> {
        TvDepth::new(&rays()?, *self).map(|_| ()).into_python()
    }
}
