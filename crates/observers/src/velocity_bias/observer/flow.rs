//! The flow of a step, and fields carried along it: back to the mid-point's foot, the window's change
//! along the way exact.

use super::super::window::Window;
use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use sphereflow_core::Plane;
use sphereflow_sphere::{Sampler, SphereGrid};

/// The flow of a step.
pub struct Flow<'a> {
    /// Geometry of the images.
    pub grid: &'a SphereGrid,
    /// The window.
    pub window: &'a Window,
    /// Metres, mean of the step.
    pub range: Plane<f32>,
    /// De-biased, rad/s.
    pub omega: Vector3<f64>,
    /// De-biased, m/s.
    pub v: Vector3<f64>,
    /// Seconds.
    pub dt_s: f64,
}

impl Flow<'_> {
    /// `W = eta x (omega + eta x v / D)`.
    fn velocity(&self, eta: &Vector3<f64>, range: f64) -> Vector3<f64> {
        eta.cross(&(self.omega + eta.cross(&self.v) / range))
    }

    /// A field carried along, its sources added, and corrected by what is measured. Where the
    /// estimate is unknown the measurement takes its place, and the other way round.
    pub fn transport(
        &self,
        field: &Plane<f32>,
        source: &Plane<f32>,
        is_range: bool,
        measured: &Plane<f32>,
        share: f64,
    ) -> Plane<f32> {
        let (width, height) = field.size();
        let mut out = Plane::filled(width, height, f32::NAN);
        let (sampler, ranges) = if self.grid.wraps_around() {
            (Sampler::wrapping(field), Sampler::wrapping(&self.range))
        } else {
            (Sampler::new(field), Sampler::new(&self.range))
        };
        out.data_mut()
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, row)| {
                for (x, out) in row.iter_mut().enumerate() {
                    let i = y * width + x;
                    let seen = f64::from(measured.data()[i]);
                    let carried = self.carried(
                        x,
                        y,
                        &sampler,
                        &ranges,
                        f64::from(source.data()[i]),
                        is_range,
                    );
                    *out = match (carried.is_finite(), seen.is_finite()) {
                        (true, true) => (carried + share * seen) / (1.0 + share),
                        (true, false) => carried,
                        _ => seen,
                    } as f32;
                }
            });
        out
    }

    /// The value that arrives at a pixel, with the window's change and the range's source on the way.
    fn carried(
        &self,
        x: usize,
        y: usize,
        field: &Sampler<'_>,
        ranges: &Sampler<'_>,
        source: f64,
        is_range: bool,
    ) -> f64 {
        let eta = self.grid.ray(x, y);
        let range = f64::from(self.range[(x, y)]);
        if !(range.is_finite() && eta.x.is_finite()) {
            return f64::NAN;
        }
        let middle = (eta - self.velocity(&eta, range) * (0.5 * self.dt_s)).normalize();
        let there = self.pixel(&middle).map_or(range, |p| {
            let sampled = f64::from(ranges.bilinear(&p));
            if sampled.is_finite() { sampled } else { range }
        });
        let foot = (eta - self.velocity(&middle, there) * self.dt_s).normalize();
        let Some(pixel) = self.pixel(&foot) else {
            return f64::NAN;
        };
        let phi = self.window.values()[y * self.grid.width() + x];
        let phi_foot = self.window.at(&pixel);
        let mut value = f64::from(field.bicubic(&pixel)) + source * (phi - phi_foot);
        if is_range {
            value -= 0.5 * (phi + phi_foot) * self.v.dot(&middle) * self.dt_s;
        }
        value
    }

    /// Where the ray is in the image; beyond its border the nearest pixel: the field goes on without
    /// slope where the flow comes in.
    fn pixel(&self, ray: &Vector3<f64>) -> Option<Vector2<f64>> {
        let camera = self.grid.camera();
        let pixel = camera.project(ray)?;
        if self.grid.wraps_around() {
            return Some(pixel);
        }
        let (w, h) = (camera.width() as f64 - 1.0, camera.height() as f64 - 1.0);
        Some(Vector2::new(pixel.x.clamp(0.0, w), pixel.y.clamp(0.0, h)))
    }
}

/// Mean of two images; where one is unknown, the other.
pub fn mean(a: &Plane<f32>, b: &Plane<f32>) -> Plane<f32> {
    Plane::from_fn(a.width(), a.height(), |x, y| {
        let (a, b) = (a[(x, y)], b[(x, y)]);
        if a.is_nan() {
            b
        } else if b.is_nan() {
            a
        } else {
            0.5 * (a + b)
        }
    })
}
