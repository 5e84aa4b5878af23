//! One view seen from another: range maps rendered forwards, images looked up backwards.

mod render;
#[cfg(test)]
mod tests;

use crate::Camera;
use crate::range::check_size;
use crate::sampling::Sampler;
use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use sphereflow_core::{Error, Plane, Pose, RangeMap, Result};

/// Two cameras of any models and the rigid transform between them.
#[derive(Clone, Debug)]
pub struct Warp {
    src: Camera,
    dst: Camera,
    src_rays: Vec<Vector3<f64>>,
    dst_rays: Vec<Vector3<f64>>,
    dst_from_src: Pose,
}

impl Warp {
    /// From the source view to the destination view; `dst_from_src` takes points of the source
    /// camera's frame to the destination camera's. All rays are computed here, once.
    pub fn new(src: &Camera, dst: &Camera, dst_from_src: Pose) -> Self {
        Self {
            src: src.clone(),
            dst: dst.clone(),
            src_rays: rays(src),
            dst_rays: rays(dst),
            dst_from_src,
        }
    }

    /// The same cameras at another relative pose.
    pub fn set_pose(&mut self, dst_from_src: Pose) {
        self.dst_from_src = dst_from_src;
    }

    /// For each destination pixel of range `dst_range` the source pixel that would see the same
    /// point; NaN where the range is unknown or the point is outside the source image. Whether
    /// something hides it from there is another question: [`Warp::visible`].
    ///
    /// # Errors
    /// [`Error::Shape`] where the map has not the size of the destination image.
    pub fn source_pixels(&self, dst_range: &RangeMap) -> Result<Plane<[f64; 2]>> {
        let pixels = self.gather(dst_range, [f64::NAN; 2], |_, pixel| [pixel.x, pixel.y])?;
        Plane::from_vec(self.dst.width(), self.dst.height(), pixels)
    }

    /// The source image as the destination sees it: each destination pixel of range `dst_range`
    /// takes the bilinear value of the source image where that point is seen. NaN where the range
    /// is unknown, the point is outside the source image, or the image is unknown there.
    ///
    /// # Errors
    /// [`Error::Shape`] where a map or image has not the size of its camera's.
    pub fn look_up(&self, src_image: &Plane<f32>, dst_range: &RangeMap) -> Result<Plane<f32>> {
        check_size("src_image", src_image.size(), &self.src)?;
        let sampler = self.sampler(src_image);
        let values = self.gather(dst_range, f32::NAN, |_, pixel| sampler.bilinear(&pixel))?;
        Plane::from_vec(self.dst.width(), self.dst.height(), values)
    }

    /// True for destination pixels whose point the source sees too: at the source pixel, the
    /// source's range is not shorter than the point's by more than `tolerance` (a share of it).
    /// False where a range is unknown.
    ///
    /// # Errors
    /// [`Error::Shape`] where a map has not the size of its camera's image; [`Error::Value`] for a
    /// tolerance that is negative or not finite.
    pub fn visible(
        &self,
        src_range: &RangeMap,
        dst_range: &RangeMap,
        tolerance: f64,
    ) -> Result<Plane<bool>> {
        check_size("src_range", src_range.size(), &self.src)?;
        check_share("tolerance", tolerance)?;
        // Inverse range: between pixels it is nearer to linear than range is.
        let inverse = src_range.metres().map(|d| 1.0 / d);
        let sampler = self.sampler(&inverse);
        let seen = self.gather(dst_range, false, |point, pixel| {
            let nearest = f64::from(sampler.bilinear(&pixel));
            nearest * point.norm() * (1.0 - tolerance) <= 1.0
        })?;
        Plane::from_vec(self.dst.width(), self.dst.height(), seen)
    }

    fn sampler<'a>(&self, plane: &'a Plane<f32>) -> Sampler<'a> {
        if self.src.wraps_around() {
            Sampler::wrapping(plane)
        } else {
            Sampler::new(plane)
        }
    }

    /// `value(point in the source frame, source pixel)` for each destination pixel, `unknown` where
    /// its range is, or where the point is outside the source image.
    fn gather<T: Copy + Send + Sync>(
        &self,
        dst_range: &RangeMap,
        unknown: T,
        value: impl Fn(Vector3<f64>, Vector2<f64>) -> T + Sync,
    ) -> Result<Vec<T>> {
        check_size("dst_range", dst_range.size(), &self.dst)?;
        let src_from_dst = self.dst_from_src.inverse();
        let rotation = src_from_dst.rotation.to_rotation_matrix();
        let mut out = vec![unknown; self.dst_rays.len()];
        let width = self.dst.width();
        let rows = out
            .par_chunks_mut(width)
            .zip(self.dst_rays.par_chunks(width));
        let rows = rows.zip(dst_range.metres().data().par_chunks(width));
        rows.for_each(|((out, rays), ranges)| {
            for ((out, ray), range) in out.iter_mut().zip(rays).zip(ranges) {
                if range.is_nan() {
                    continue;
                }
                let point = rotation * ray * f64::from(*range) + src_from_dst.translation;
                let pixel = self.src.project(&point).filter(|p| self.src.contains(p));
                if let Some(pixel) = pixel {
                    *out = value(point, pixel);
                }
            }
        });
        Ok(out)
    }
}

/// Unit rays of all pixel centres, NaN where there is none.
fn rays(camera: &Camera) -> Vec<Vector3<f64>> {
    let width = camera.width();
    let mut rays = vec![Vector3::repeat(f64::NAN); width * camera.height()];
    rays.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, ray) in row.iter_mut().enumerate() {
            if let Some(eta) = camera.unproject(&Vector2::new(x as f64, y as f64)) {
                *ray = eta;
            }
        }
    });
    rays
}

/// A share must be a number from 0 upwards.
fn check_share(name: &str, value: f64) -> Result<()> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(Error::value(name, "a finite share, 0 or more", value))
}
