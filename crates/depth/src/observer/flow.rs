//! The observer that takes optical flow.

use super::transport::DriveField;
use super::{Drive, ObserverConfig, RangeState};
use crate::rays::{finite_twist, parts};
use crate::{DepthReason, DepthStatus, PixelRays, Result};
use sphereflow_core::checks::positive;
use sphereflow_core::{Plane, Twist};
use sphereflow_flow::FlowField;
use sphereflow_raster::same_size;

/// A flow with less of its pixels known, or fitting the motion, says nothing.
const LEAST_SHARE: f64 = 0.02;

/// Range from optical flow and known velocities.
///
/// Thesis: eq. (3.3), (3.4). With the corrections that (3.4) needs: v . eta takes the unit ray, and
/// the product g . w is that of the sphere, not that of the pinhole coordinates.
#[derive(Clone, Debug)]
pub struct FlowObserver(RangeState);

impl FlowObserver {
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

    /// Steps `dt_s` ahead, with the flow (pixels in `dt_s`, NaN unknown) and the velocities of the middle.
    /// Where the motion shows no depth, or the flow does not say, the range is carried along by what the
    /// state says.
    ///
    /// # Errors
    /// Shape and value errors naming the argument; the state is as before.
    pub fn step(&mut self, flow: &FlowField, twist: &Twist, dt_s: f64) -> Result<DepthStatus> {
        same_size("flow", self.0.rays.size(), flow.size())?;
        finite_twist(twist)?;
        positive("dt_s", dt_s)?;
        let mut status = self.0.status(twist, dt_s);
        let mut field = self.field(flow, twist, dt_s);
        if status == DepthStatus::Updated {
            status = self.judge(flow, &field);
        }
        if status != DepthStatus::Updated {
            field = self.0.carried(twist);
        }
        self.0.advance(&field, twist, dt_s);
        Ok(status)
    }

    /// The measured flow, and the correction that it asks for.
    fn field(&self, flow: &FlowField, twist: &Twist, dt_s: f64) -> DriveField {
        let gain = self.0.config.gain as f32;
        let least = 1.0 / self.0.config.farthest_m as f32;
        let (omega, v) = parts(twist);
        let (rays, rate) = (&self.0.rays, (1.0 / dt_s) as f32);
        let (width, height) = rays.size();
        DriveField::new(width, height, |i| {
            let measured = [flow.u.data()[i] * rate, flow.v.data()[i] * rate];
            let motion = rays.motion(i, &omega, &v);
            let eta = &rays.rays()[i];
            // |g|^2 = |v|^2 - (v . eta)^2, and g . w = -v . w for tangent w.
            let along = v.dot(eta);
            let g2 = v.norm_squared() - along * along;
            let rest = rays.tangent(
                i,
                measured[0] - motion.rotation[0],
                measured[1] - motion.rotation[1],
            );
            let b = -v.dot(&rest);
            // An unknown flow moves as the rotation does and corrects nothing.
            let known = b.is_finite();
            let corrected = known && b > g2 * least;
            Drive {
                flow: if known {
                    measured
                } else {
                    finite(motion.rotation)
                },
                rate: if corrected { gain * b } else { 0.0 },
                pull: if corrected { gain * g2 } else { 0.0 },
            }
        })
    }

    /// Whether enough of the flow is known, and fits a surface before a camera that moves like this.
    fn judge(&self, flow: &FlowField, field: &DriveField) -> DepthStatus {
        let (rays, pairs) = (&self.0.rays, flow.u.data().iter().zip(flow.v.data()));
        let (mut all, mut known, mut fitting) = (0_usize, 0_usize, 0_usize);
        for (i, (pair, rate)) in pairs.zip(field.rate.data()).enumerate() {
            if rays.is_valid(i) {
                all += 1;
                known += usize::from(pair.0.is_finite() && pair.1.is_finite());
                fitting += usize::from(*rate > 0.0);
            }
        }
        let share = |count: usize| count as f64 / all.max(1) as f64;
        if share(known) < LEAST_SHARE {
            let share = share(known);
            return DepthStatus::Unusable(DepthReason::FewKnownPixels { share });
        }
        if share(fitting) < LEAST_SHARE {
            let share = share(fitting);
            return DepthStatus::Unusable(DepthReason::PoorFit { share });
        }
        DepthStatus::Updated
    }
}

fn finite(flow: [f32; 2]) -> [f32; 2] {
    flow.map(|f| if f.is_finite() { f } else { 0.0 })
}
