//! The filter's pixels: rays in the gauge, and reading between them.

use super::lens::{GeneralLens, Lens, PinholeLens};
use crate::Result;
use crate::error::Error;
use nalgebra::{Vector2, Vector3};
use sphereflow_sphere::Camera;

/// The pixels of the binned camera.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    pub width: usize,
    pub height: usize,
    pub wraps: bool,
    /// Rays of gauge 1; NaN where there are none.
    pub ray: Vec<Vector3<f32>>,
    pub lens: AnyLens,
    /// Pixels per radian in the middle of the image.
    pub focal_px: f32,
}

/// Which of both lenses.
#[derive(Clone, Debug)]
pub(super) enum AnyLens {
    Pinhole(PinholeLens),
    General(GeneralLens),
}

impl Lattice {
    pub fn new(camera: &Camera) -> Result<Self> {
        let (width, height) = (camera.width(), camera.height());
        if width < 16 || height < 16 {
            let found = format!("{width}x{height} after binning");
            return Err(Error::value("camera", "at least 16x16 pixels", found));
        }
        let lens = match PinholeLens::of(camera) {
            Some(lens) => AnyLens::Pinhole(lens),
            None => AnyLens::General(GeneralLens(camera.clone())),
        };
        let ray = (0..width * height)
            .map(|i| Self::gauge_ray(camera, (i % width) as f64, (i / width) as f64))
            .collect::<Vec<_>>();
        let middle = height / 2 * width + width / 2;
        let step = (unit(&ray[middle + 1]) - unit(&ray[middle])).norm();
        Ok(Self {
            width,
            height,
            wraps: camera.wraps_around(),
            focal_px: if step > 0.0 { 1.0 / step } else { width as f32 },
            ray,
            lens,
        })
    }

    /// The ray of a pixel in the gauge of its camera, NaN where there is none.
    pub fn gauge_ray(camera: &Camera, x: f64, y: f64) -> Vector3<f32> {
        let nan = Vector3::repeat(f32::NAN);
        let Some(ray) = camera.unproject(&Vector2::new(x, y)) else {
            return nan;
        };
        match camera.model() {
            sphereflow_sphere::camera::Model::Pinhole(_) => (ray / ray.z).cast(),
            _ => ray.cast(),
        }
    }

    /// The four pixels around a place and the shares of the right and lower ones; `None` outside.
    #[inline(always)]
    pub fn around(&self, [x, y]: [f32; 2]) -> Option<([usize; 4], f32, f32)> {
        let last_y = (self.height - 1) as f32;
        if self.wraps {
            let y = y.clamp(0.0, last_y);
            let x = x.rem_euclid(self.width as f32);
            if x.is_nan() {
                return None;
            }
            let x0 = (x as usize).min(self.width - 1);
            let x1 = if x0 + 1 == self.width { 0 } else { x0 + 1 };
            let y0 = (y as usize).min(self.height - 2);
            let (top, bottom) = (y0 * self.width, (y0 + 1) * self.width);
            let four = [top + x0, top + x1, bottom + x0, bottom + x1];
            return Some((four, x - x0 as f32, y - y0 as f32));
        }
        let last_x = (self.width - 1) as f32;
        let inside = x >= 0.0 && y >= 0.0 && x <= last_x && y <= last_y;
        if !inside {
            return None;
        }
        let x0 = (x as usize).min(self.width - 2);
        let y0 = (y as usize).min(self.height - 2);
        let top = y0 * self.width + x0;
        let four = [top, top + 1, top + self.width, top + self.width + 1];
        Some((four, x - x0 as f32, y - y0 as f32))
    }
}

/// Bilinear mix of four values with four components each.
#[inline(always)]
pub(super) fn mix(data: &[[f32; 4]], four: [usize; 4], s: f32, t: f32) -> [f32; 4] {
    let [a, b, c, d] = four.map(|i| data[i]);
    std::array::from_fn(|k| {
        let top = a[k] + s * (b[k] - a[k]);
        let bottom = c[k] + s * (d[k] - c[k]);
        top + t * (bottom - top)
    })
}

/// An image's `[brightness, slopes by column and row, variance]` between four pixels. Brightness goes through the
/// pixels' own slopes (a Hermite cubic along each axis): the error of a bilinear one would be taken for depth.
#[inline(always)]
pub(super) fn read(image: &[[f32; 4]], four: [usize; 4], s: f32, t: f32) -> [f32; 4] {
    let [a, b, c, d] = four.map(|i| image[i]);
    let (left, above) = (1.0 - s, 1.0 - t);
    let (top, bottom) = (
        std::array::from_fn::<f32, 4, _>(|k| a[k] + s * (b[k] - a[k])),
        std::array::from_fn::<f32, 4, _>(|k| c[k] + s * (d[k] - c[k])),
    );
    let mut out: [f32; 4] = std::array::from_fn(|k| top[k] + t * (bottom[k] - top[k]));
    // What the slopes at both ends say beyond the chord.
    let across = |from: &[f32; 4], to: &[f32; 4]| {
        let chord = to[0] - from[0];
        left * (from[1] - chord) - s * (to[1] - chord)
    };
    let down = |from: &[f32; 4], to: &[f32; 4]| {
        let chord = to[0] - from[0];
        above * (from[2] - chord) - t * (to[2] - chord)
    };
    let (upper, lower) = (across(&a, &b), across(&c, &d));
    let (west, east) = (down(&a, &c), down(&b, &d));
    out[0] += s * left * (upper + t * (lower - upper)) + t * above * (west + s * (east - west));
    out
}

fn unit(v: &Vector3<f32>) -> Vector3<f32> {
    v / v.norm()
}

impl AnyLens {
    /// Calls `f` with the lens itself, so that loops are compiled for each.
    pub fn with<T>(&self, f: impl LensCall<T>) -> T {
        match self {
            Self::Pinhole(lens) => f.call(lens),
            Self::General(lens) => f.call(lens),
        }
    }
}

/// A computation for any lens.
pub(super) trait LensCall<T> {
    fn call<L: Lens>(self, lens: &L) -> T;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Single precision of brightness up to some hundreds.
    const ROUNDING: f32 = 2e-3;

    #[test]
    fn reading_between_pixels_is_exact_for_a_sum_of_parabolas() {
        let value = |x: f32, y: f32| 40.0 + 3.0 * x - 2.0 * y + 1.5 * x * x - 0.7 * y * y;
        let at = |x: f32, y: f32| {
            let gx = 0.5 * (value(x + 1.0, y) - value(x - 1.0, y));
            let gy = 0.5 * (value(x, y + 1.0) - value(x, y - 1.0));
            [value(x, y), gx, gy, 0.0]
        };
        let image = [at(2.0, 3.0), at(3.0, 3.0), at(2.0, 4.0), at(3.0, 4.0)];
        for (s, t) in [(0.0, 0.0), (0.3, 0.8), (0.5, 0.5), (1.0, 0.2)] {
            let [found, gx, gy, _] = read(&image, [0, 1, 2, 3], s, t);
            assert!((found - value(2.0 + s, 3.0 + t)).abs() < ROUNDING);
            assert!((gx - (3.0 + 3.0 * (2.0 + s))).abs() < ROUNDING);
            assert!((gy - (-2.0 - 1.4 * (3.0 + t))).abs() < ROUNDING);
        }
    }
}
