//! One step of a range that is carried along by a flow and pulled towards a measurement.

use super::{Drive, RangeState};
use crate::rays::parts;
use nalgebra::Vector3;
use rayon::prelude::*;
use sphereflow_core::{Plane, Twist};
use sphereflow_raster::bilinear;

/// A field of [`Drive`] as planes, so that it can be sampled between pixels.
#[derive(Clone, Debug)]
pub(crate) struct DriveField {
    pub flow: [Plane<f32>; 2],
    pub rate: Plane<f32>,
    pub pull: Plane<f32>,
}

impl DriveField {
    pub fn new(width: usize, height: usize, drive: impl Fn(usize) -> Drive + Sync + Send) -> Self {
        let all: Vec<Drive> = (0..width * height).into_par_iter().map(drive).collect();
        let plane = |take: fn(&Drive) -> f32| {
            Plane::from_fn(width, height, |x, y| take(&all[y * width + x]))
        };
        Self {
            flow: [plane(|d| d.flow[0]), plane(|d| d.flow[1])],
            rate: plane(|d| d.rate),
            pull: plane(|d| d.pull),
        }
    }
}

impl RangeState {
    /// From one time to the next, `dt_s` later, with everything known at the middle.
    ///
    /// Each pixel is traced back along the flow (second order, no limit on the step); the range there
    /// is read bilinearly; on the way it changes by -v . eta, half of it before and half after the
    /// correction, which is the exact solution of D' = c - b D (no limit on the gain either).
    ///
    /// Thesis: eq. (3.5), (4.1): along the flow the observer is an ordinary differential equation; at
    /// inflow borders the range of the border pixel is read, whose slope across the border is zero.
    pub fn advance(&mut self, drive: &DriveField, twist: &Twist, dt_s: f64) {
        let (width, _) = self.rays.size();
        let (_, v) = parts(twist);
        let (rays, range, dt) = (&self.rays, &self.range, dt_s as f32);
        let read = if rays.wraps_around() {
            bilinear::wrapped
        } else {
            bilinear::clamped
        };
        self.spare
            .data_mut()
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, out)| {
                for (x, out) in out.iter_mut().enumerate() {
                    let here = y * width + x;
                    *out = if rays.is_valid(here) {
                        trace(range, drive, (x as f32, y as f32), dt, read).through(
                            &rays.rays()[here],
                            &v,
                            dt,
                        )
                    } else {
                        f32::NAN
                    };
                }
            });
        std::mem::swap(&mut self.range, &mut self.spare);
        self.keep_known();
    }

    /// The rim of a fish-eye reads from pixels without a ray, and a motion without measure leads out of
    /// single precision: such pixels keep the range of before.
    fn keep_known(&mut self) {
        for (i, value) in self.range.data_mut().iter_mut().enumerate() {
            if self.rays.is_valid(i) && !value.is_finite() {
                *value = self.spare.data()[i];
            }
        }
    }
}

/// What a pixel finds when it is traced back.
struct Origin {
    range: f32,
    rate: f32,
    pull: f32,
}

type Read = fn(&Plane<f32>, f32, f32) -> f32;

/// Two rounds of the implicit mid-point: middle = x - dt/2 V(middle).
#[inline]
fn trace(range: &Plane<f32>, drive: &DriveField, x: (f32, f32), dt: f32, read: Read) -> Origin {
    let mut flow = [
        read(&drive.flow[0], x.0, x.1),
        read(&drive.flow[1], x.0, x.1),
    ];
    let mut middle = x;
    for _ in 0..2 {
        middle = (x.0 - 0.5 * dt * flow[0], x.1 - 0.5 * dt * flow[1]);
        flow = [
            read(&drive.flow[0], middle.0, middle.1),
            read(&drive.flow[1], middle.0, middle.1),
        ];
    }
    Origin {
        range: read(range, x.0 - dt * flow[0], x.1 - dt * flow[1]),
        rate: read(&drive.rate, middle.0, middle.1),
        pull: read(&drive.pull, middle.0, middle.1),
    }
}

impl Origin {
    #[inline]
    fn through(&self, ray: &Vector3<f32>, v: &Vector3<f32>, dt: f32) -> f32 {
        let approach = 0.5 * dt * v.dot(ray);
        let carried = self.range - approach;
        let corrected = if self.rate > 0.0 {
            let target = self.pull / self.rate;
            target + (carried - target) * (-self.rate * dt).exp()
        } else {
            carried
        };
        // A surface that the camera would have passed stays a centimetre away.
        (corrected - approach).max(1e-2)
    }
}
