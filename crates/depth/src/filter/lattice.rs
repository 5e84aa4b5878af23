//! The filter's pixels: rays in the gauge, and reading between them.

use super::lens::{GeneralLens, Lens, PinholeLens};
use super::surfaces::same_surface;
use crate::{Error, Result};
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
    /// Neighbours whose zeta differs by less than this share are of one surface: noise, and a slope over a pixel.
    pub same_surface: f32,
}

/// Pixels that are worked on together: their numbers stay in registers and the first cache.
pub(super) const TOGETHER: usize = 64;

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
        let focal_px = if step > 0.0 { 1.0 / step } else { width as f32 };
        Ok(Self {
            width,
            height,
            wraps: camera.wraps_around(),
            focal_px,
            same_surface: same_surface(focal_px),
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
        let mut around = Around::<1>::new();
        self.around_each(&[[x], [y]], &mut around);
        let inside = !around.across[0].is_nan();
        inside.then(|| (around.four(self.width, 0), around.across[0], around.down[0]))
    }

    /// [`Lattice::around`] of many places, without branches: compiled for wide vectors where the caller is.
    #[inline(always)]
    pub fn around_each<const N: usize>(&self, place: &[[f32; N]; 2], out: &mut Around<N>) {
        let (width, last_y) = (self.width as f32, (self.height - 1) as f32);
        let limit_x = if self.wraps { width } else { width - 1.0 };
        let columns = self.width as i32;
        let most_x = columns - if self.wraps { 1 } else { 2 };
        let most_y = self.height as i32 - 2;
        for (i, (x, y)) in place[0].iter().zip(&place[1]).enumerate() {
            let (mut x, mut y) = (*x, *y);
            if self.wraps {
                x -= (x / width).floor() * width;
                y = y.clamp(0.0, last_y);
            }
            let inside = (x >= 0.0) & (y >= 0.0) & (x <= limit_x) & (y <= last_y);
            // Also the numbers of places outside are to be those of pixels.
            let x = if inside { x } else { f32::NAN };
            let (x0, y0) = (whole(x).clamp(0, most_x), whole(y).clamp(0, most_y));
            let x1 = if x0 + 1 == columns { 0 } else { x0 + 1 };
            let (s, t) = (x - x0 as f32, y - y0 as f32);
            let nearest = if s > 0.5 { x1 } else { x0 } + if t > 0.5 { columns } else { 0 };
            out.left[i] = (y0 * columns + x0) as u32;
            out.right[i] = (y0 * columns + x1) as u32;
            out.nearest[i] = (y0 * columns + nearest) as u32;
            (out.across[i], out.down[i]) = (s, t);
        }
    }
}

/// Between which pixels places lie.
pub(super) struct Around<const N: usize> {
    /// The upper pixels, left and right.
    left: [u32; N],
    right: [u32; N],
    /// The nearest of the four.
    pub nearest: [u32; N],
    /// Shares of the right and of the lower pixels; NaN (the first) outside.
    pub across: [f32; N],
    pub down: [f32; N],
}

impl<const N: usize> Around<N> {
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            left: [0; N],
            right: [0; N],
            nearest: [0; N],
            across: [f32::NAN; N],
            down: [f32::NAN; N],
        }
    }

    /// The four pixels around the place.
    #[inline(always)]
    pub fn four(&self, width: usize, i: usize) -> [usize; 4] {
        let (left, right) = (self.left[i] as usize, self.right[i] as usize);
        [left, right, left + width, right + width]
    }
}

/// The whole number below a place in an image, anything for others. From the digits of a sum: the checks of `as`
/// are not vectorised.
#[inline(always)]
fn whole(place: f32) -> i32 {
    /// Sums with it have no digits behind the point: 2^23.
    const WHOLE: f32 = 8_388_608.0;
    (place.floor() + WHOLE).to_bits() as i32 - WHOLE.to_bits() as i32
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
    let chords = [
        above * (b[0] - a[0]) + t * (d[0] - c[0]),
        left * (c[0] - a[0]) + s * (d[0] - b[0]),
    ];
    let by = |weight: f32, pixel: [f32; 4]| pixel.map(|value| weight * value);
    let (a, b) = (by(left * above, a), by(s * above, b));
    let (c, d) = (by(left * t, c), by(s * t, d));
    let mut out: [f32; 4] = std::array::from_fn(|k| (a[k] + c[k]) + (b[k] + d[k]));
    // What the slopes at both ends say beyond the chords, across and down.
    let across = (a[1] + c[1]) - (b[1] + d[1]) - (left - s) * chords[0];
    let down = (a[2] + b[2]) - (c[2] + d[2]) - (above - t) * chords[1];
    out[0] += s * left * across + t * above * down;
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
