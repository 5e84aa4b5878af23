//! The rays of a camera's pixels, and how pixels move when rays do.

use crate::{Error, Result};
use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use sphereflow_core::Twist;
use sphereflow_core::checks::all_finite;
use sphereflow_sphere::Camera;

/// Per pixel: the ray, and the derivative of the pixel by the ray. For any central camera.
///
/// A tangent vector w of the sphere at the ray eta moves the pixel by `(jx . w, jy . w)`; this is all
/// that the equations of the sphere need to be written in pixels. Pixel `(x, y)` has index
/// `y * width + x`. Pixels without a ray have NaN.
#[derive(Clone, Debug)]
pub struct PixelRays {
    camera: Camera,
    ray: Vec<Vector3<f32>>,
    jx: Vec<Vector3<f32>>,
    jy: Vec<Vector3<f32>>,
}

/// What a known motion does to the pixels: flow = rotation + (1/D) translation, pixels per second.
///
/// Thesis: eq. (2.10), (2.11), (3.1), (3.2), in pixels and for any camera: f = eta x omega and
/// g = eta x (eta x v), brought to the image by the derivative of the pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionField {
    /// (f1, f2): flow by rotation, pixels per second.
    pub rotation: [f32; 2],
    /// (g1, g2): flow by translation at a range of one metre, pixels metres per second.
    pub translation: [f32; 2],
}

impl PixelRays {
    /// Of a camera.
    ///
    /// # Errors
    /// A value error where no pixel has a ray.
    pub fn new(camera: &Camera) -> Result<Self> {
        let (width, height) = (camera.width(), camera.height());
        let nan = Vector3::repeat(f32::NAN);
        let all: Vec<[Vector3<f32>; 3]> = (0..width * height)
            .into_par_iter()
            .map(|i| {
                let pixel = Vector2::new((i % width) as f64, (i / width) as f64);
                let found = camera.unproject(&pixel).and_then(|ray| {
                    let (_, j) = camera.project_with_jacobian(&ray)?;
                    let [jx, jy] = [j.row(0).transpose(), j.row(1).transpose()];
                    let parts = [ray, jx, jy].map(|v| v.cast::<f32>());
                    parts
                        .iter()
                        .flatten()
                        .all(|v| v.is_finite())
                        .then_some(parts)
                });
                found.unwrap_or([nan; 3])
            })
            .collect();
        if all.iter().all(|parts| parts[0].x.is_nan()) {
            let found = format!("none in {width}x{height} pixels");
            return Err(Error::value("camera", "rays for at least one pixel", found));
        }
        let take = |part: usize| all.iter().map(|parts| parts[part]).collect();
        Ok(Self {
            camera: camera.clone(),
            ray: take(0),
            jx: take(1),
            jy: take(2),
        })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// `(width, height)`.
    pub fn size(&self) -> (usize, usize) {
        (self.camera.width(), self.camera.height())
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.ray.len()
    }

    /// True for no pixels, which no camera has.
    pub fn is_empty(&self) -> bool {
        self.ray.is_empty()
    }

    /// True where the first and the last column are neighbours.
    pub fn wraps_around(&self) -> bool {
        self.camera.wraps_around()
    }

    /// Unit rays, camera frame; NaN where there are none.
    pub fn rays(&self) -> &[Vector3<f32>] {
        &self.ray
    }

    /// True where pixel `index` has a ray.
    #[inline]
    pub fn is_valid(&self, index: usize) -> bool {
        !self.ray[index].x.is_nan()
    }

    /// Inverse metric `[a11, a12, a22]`, pixels squared per radian squared: the squared length of the
    /// gradient on the sphere of a field with slopes (fx, fy) per pixel is
    /// `a11 fx^2 + 2 a12 fx fy + a22 fy^2`.
    #[inline]
    pub fn inverse_metric(&self, index: usize) -> [f32; 3] {
        let (jx, jy) = (&self.jx[index], &self.jy[index]);
        [jx.dot(jx), jx.dot(jy), jy.dot(jy)]
    }

    /// Solid angle of pixel `index`, steradians (to second order in its size).
    #[inline]
    pub fn solid_angle(&self, index: usize) -> f32 {
        let [a, b, c] = self.inverse_metric(index);
        1.0 / (a * c - b * b).sqrt()
    }

    /// What the motion does to pixel `index`.
    #[inline]
    pub fn motion(&self, index: usize, omega: &Vector3<f32>, v: &Vector3<f32>) -> MotionField {
        let (eta, jx, jy) = (&self.ray[index], &self.jx[index], &self.jy[index]);
        let turn = eta.cross(omega);
        // eta x (eta x v) = eta (eta . v) - v, and the derivative of the pixel along eta is zero.
        MotionField {
            rotation: [jx.dot(&turn), jy.dot(&turn)],
            translation: [-jx.dot(v), -jy.dot(v)],
        }
    }

    /// The tangent vector of the sphere that moves pixel `index` by `(u, v)`.
    #[inline]
    pub fn tangent(&self, index: usize, u: f32, v: f32) -> Vector3<f32> {
        let (jx, jy) = (&self.jx[index], &self.jy[index]);
        let [a, b, c] = self.inverse_metric(index);
        let scale = 1.0 / (a * c - b * b);
        jx * ((c * u - b * v) * scale) + jy * ((a * v - b * u) * scale)
    }
}

/// The parts of a twist in single precision.
pub(crate) fn parts(twist: &Twist) -> (Vector3<f32>, Vector3<f32>) {
    (twist.angular_rad_s.cast(), twist.linear_m_s.cast())
}

/// Refuses a motion that is not finite.
pub(crate) fn finite_twist(twist: &Twist) -> Result<()> {
    all_finite("twist", &twist.vector())
}
