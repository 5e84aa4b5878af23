//! The observer that takes a depth image, as the variational methods of Chapter 2 give.

use super::transport::DriveField;
use super::{Drive, ObserverConfig, RangeState};
use crate::rays::{finite_twist, parts};
use crate::{DepthStatus, PixelRays, Result};
use sphereflow_core::checks::positive;
use sphereflow_core::{Plane, Twist};
use sphereflow_raster::same_size;

/// Range from a measured inverse range and known velocities.
///
/// Thesis: eq. (3.7), (3.8), with v . eta of the unit ray in (3.8).
#[derive(Clone, Debug)]
pub struct DepthObserver(RangeState);

impl DepthObserver {
    /// For a camera.
    ///
    /// # Errors
    /// Value errors for settings out of their domain.
    pub fn new(rays: &PixelRays, config: ObserverConfig) -> Result<Self> {
        RangeState::new(rays, config).map(Self)
    }

    /// The range at the time of the last step, metres; NaN where the camera has no ray.
    pub fn range(&self) -> &Plane<f32> {
        &self.0.range
    }

    /// Replaces the range.
    ///
    /// # Errors
    /// Shape and value errors naming `range`.
    pub fn set_range(&mut self, range: &Plane<f32>) -> Result<()> {
        self.0.set_range(range)
    }

    /// Steps `dt_s` ahead, with the inverse range (1/m, NaN unknown) and the velocities of the
    /// middle. Pixels without a measurement are carried along by what the state says.
    ///
    /// # Errors
    /// Shape and value errors naming the argument; the state is as before.
    pub fn step(
        &mut self,
        inv_range: &Plane<f32>,
        twist: &Twist,
        dt_s: f64,
    ) -> Result<DepthStatus> {
        same_size("inv_range", self.0.rays.size(), inv_range.size())?;
        finite_twist(twist)?;
        positive("dt_s", dt_s)?;
        let gain = self.0.config.gain as f32;
        let least = 1.0 / self.0.config.farthest_m as f32;
        let (omega, v) = parts(twist);
        let (rays, range) = (&self.0.rays, &self.0.range);
        let (width, height) = rays.size();
        let field = DriveField::new(width, height, |i| {
            let motion = rays.motion(i, &omega, &v);
            let measured = inv_range.data()[i];
            let known = measured.is_finite() && measured > least;
            let gamma = if known {
                measured
            } else {
                1.0 / range.data()[i]
            };
            let flow = [0, 1].map(|k| motion.rotation[k] + gamma * motion.translation[k]);
            Drive {
                flow: flow.map(|f| if f.is_finite() { f } else { 0.0 }),
                rate: if known { gain * gamma } else { 0.0 },
                pull: if known { gain } else { 0.0 },
            }
        });
        let any_known = field.rate.data().iter().any(|b| *b > 0.0);
        self.0.advance(&field, twist, dt_s);
        // A depth image is a measurement whatever the motion; without one only the motion is left.
        Ok(match self.0.status(twist, dt_s) {
            _ if any_known => DepthStatus::Updated,
            DepthStatus::Updated => {
                DepthStatus::Unusable(crate::DepthReason::FewKnownPixels { share: 0.0 })
            }
            still => still,
        })
    }
}
