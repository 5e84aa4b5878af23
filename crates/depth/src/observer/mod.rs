//! Asymptotic observers of the range (Chapter 3): carried by the flow, corrected by flow or depth.

mod depth;
mod flow;
mod transport;

pub use depth::DepthObserver;
pub use flow::FlowObserver;

use crate::rays::parts;
use crate::{DepthStatus, PixelRays};
use crate::{Error, Result};
use sphereflow_core::checks::{each, non_negative, positive};
use sphereflow_core::{Plane, Twist};
use sphereflow_raster::same_size;
use transport::DriveField;

/// Settings of both observers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObserverConfig {
    /// Gain k: seconds per metre with flow (the thesis uses 500, 100 on real data), metres per
    /// second with depth (30).
    pub gain: f64,
    /// Range everywhere before the first image, metres.
    pub initial_range_m: f64,
    /// A correction towards a range beyond this, or behind the camera, is refused: the sign of what was
    /// measured is wrong there.
    pub farthest_m: f64,
    /// Speed below which depth is not observable: the range is only carried along, m/s.
    pub least_speed_m_s: f64,
}

impl ObserverConfig {
    /// Thesis: section 4.1.2. k = 500 s/m, a metre everywhere at first.
    pub fn flow() -> Self {
        Self {
            gain: 500.0,
            initial_range_m: 1.0,
            farthest_m: 20.0,
            least_speed_m_s: 1e-3,
        }
    }

    /// Thesis: section 4.1.3. k = 30 m/s, a metre everywhere at first.
    pub fn depth() -> Self {
        Self {
            gain: 30.0,
            ..Self::flow()
        }
    }

    fn check(&self) -> Result<()> {
        let settings = [
            ("gain", self.gain),
            ("initial_range_m", self.initial_range_m),
            ("farthest_m", self.farthest_m),
        ];
        each(positive, &settings)?;
        non_negative("least_speed_m_s", self.least_speed_m_s)
    }
}

/// The state of an observer: the range in every pixel.
#[derive(Clone, Debug)]
pub(crate) struct RangeState {
    pub rays: PixelRays,
    pub config: ObserverConfig,
    pub range: Plane<f32>,
    spare: Plane<f32>,
}

/// What moves and corrects a pixel: flow in pixels per second, and b and c of the correction
/// c - b D, 1/s and m/s; b is zero where nothing is corrected.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drive {
    pub flow: [f32; 2],
    pub rate: f32,
    pub pull: f32,
}

impl RangeState {
    pub fn new(rays: &PixelRays, config: ObserverConfig) -> Result<Self> {
        config.check()?;
        let (width, height) = rays.size();
        let initial = config.initial_range_m as f32;
        let mut range = Plane::filled(width, height, initial);
        for (i, value) in range.data_mut().iter_mut().enumerate() {
            if !rays.is_valid(i) {
                *value = f32::NAN;
            }
        }
        Ok(Self {
            rays: rays.clone(),
            config,
            spare: range.clone(),
            range,
        })
    }

    /// Replaces the state.
    pub fn set_range(&mut self, range: &Plane<f32>) -> Result<()> {
        same_size("range", self.rays.size(), range.size())?;
        let known = |(i, d): (usize, &f32)| !self.rays.is_valid(i) || (d.is_finite() && *d > 0.0);
        if let Some((i, d)) = range.data().iter().enumerate().find(|entry| !known(*entry)) {
            let found = format!("{d} in pixel {i}");
            return Err(Error::value(
                "range",
                "positive metres in every pixel",
                found,
            ));
        }
        self.range.data_mut().copy_from_slice(range.data());
        Ok(())
    }

    /// The flow that the state and the motion predict, correcting nothing.
    pub fn carried(&self, twist: &Twist) -> DriveField {
        let (omega, v) = parts(twist);
        let (width, height) = self.rays.size();
        DriveField::new(width, height, |i| {
            let motion = self.rays.motion(i, &omega, &v);
            let gamma = 1.0 / self.range.data()[i];
            let flow = [0, 1].map(|k| motion.rotation[k] + gamma * motion.translation[k]);
            Drive {
                flow: flow.map(|f| if f.is_finite() { f } else { 0.0 }),
                rate: 0.0,
                pull: 0.0,
            }
        })
    }

    /// `Unobservable` where the speed says so.
    pub fn status(&self, twist: &Twist, dt_s: f64) -> DepthStatus {
        let speed = twist.linear_m_s.norm();
        if speed > self.config.least_speed_m_s {
            return DepthStatus::Updated;
        }
        let baseline_m = speed * dt_s;
        DepthStatus::Unobservable(if twist.angular_rad_s.norm() > 1e-6 {
            crate::DepthReason::PureRotation { baseline_m }
        } else {
            crate::DepthReason::NoMotion { baseline_m }
        })
    }
}
