//! Projection in single precision for the cameras that most depth images come from.

use sphereflow_sphere::Camera;
use sphereflow_sphere::camera::{Bend, Model, Projection};

/// A camera with an image plane: pinhole, or OpenCV's polynomial distortion. Other models go
/// through the camera itself, which is exact and slower.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneProjection {
    fx: f32,
    fy: f32,
    cx: f32,
    cy: f32,
    skew: f32,
    /// k1, k2, k3 of the numerator and k4, k5, k6 of the denominator.
    radial: [f32; 3],
    quotient: [f32; 3],
    /// p1, p2.
    tangential: [f32; 2],
    /// Square of the largest radius on the plane on which the distortion is one to one.
    limit: f32,
    straight: bool,
}

impl PlaneProjection {
    /// `None` for a camera of another kind.
    pub fn new(camera: &Camera) -> Option<Self> {
        let mut fast = Self {
            fx: 0.0,
            fy: 0.0,
            cx: 0.0,
            cy: 0.0,
            skew: 0.0,
            radial: [0.0; 3],
            quotient: [0.0; 3],
            tangential: [0.0; 2],
            limit: f32::INFINITY,
            straight: true,
        };
        match camera.model() {
            Model::Pinhole(_) => {}
            Model::Opencv(lens) => {
                fast.limit = (lens.bend.limit() as f32).powi(2);
                fast.straight = lens.bend.named().iter().all(|(_, value)| *value == 0.0);
            }
            _ => return None,
        }
        for (name, value) in camera.model().named() {
            let slot = match name {
                "fx" => &mut fast.fx,
                "fy" => &mut fast.fy,
                "cx" => &mut fast.cx,
                "cy" => &mut fast.cy,
                "skew" => &mut fast.skew,
                "k1" => &mut fast.radial[0],
                "k2" => &mut fast.radial[1],
                "k3" => &mut fast.radial[2],
                "k4" => &mut fast.quotient[0],
                "k5" => &mut fast.quotient[1],
                "k6" => &mut fast.quotient[2],
                "p1" => &mut fast.tangential[0],
                "p2" => &mut fast.tangential[1],
                _ => return None, // a parameter that this projection does not know
            };
            *slot = value as f32;
        }
        Some(fast)
    }

    /// Pixel of the point `(x, y, 1)`; NaN where the camera does not see it.
    #[inline(always)]
    pub fn pixel(&self, x: f32, y: f32) -> (f32, f32) {
        let (mut m1, mut m2) = (x, y);
        if !self.straight {
            let s = x * x + y * y;
            let [k1, k2, k3] = self.radial;
            let [k4, k5, k6] = self.quotient;
            let [p1, p2] = self.tangential;
            let over = 1.0 + s * (k1 + s * (k2 + s * k3));
            let under = 1.0 + s * (k4 + s * (k5 + s * k6));
            let seen = if s < self.limit { 0.0 } else { f32::NAN };
            let (radial, cross) = (over / under + seen, 2.0 * (p2 * x + p1 * y));
            m1 = x * (radial + cross) + s * p2;
            m2 = y * (radial + cross) + s * p1;
        }
        (
            self.fx * m1 + self.skew * m2 + self.cx,
            self.fy * m2 + self.cy,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector2, Vector3};

    /// Pixels: single precision at coordinates of some hundreds.
    const ROUNDING: f64 = 2e-4;

    #[test]
    fn pixel_is_that_of_the_camera() {
        let lens = [0.26, -0.95, -0.005, 0.003, 1.16, 0.01, -0.02, 0.03];
        let cameras = [
            Camera::pinhole(525.0, 520.0, 319.5, 241.5, 640, 480).unwrap(),
            Camera::opencv(517.0, 516.0, 318.0, 255.0, lens, 640, 480).unwrap(),
        ];
        for camera in cameras {
            let fast = PlaneProjection::new(&camera).unwrap();
            for i in 0..200 {
                let (x, y) = (
                    (i as f64 * 0.37).sin() * 0.6,
                    (i as f64 * 0.71).cos() * 0.45,
                );
                let exact = camera.project(&Vector3::new(x, y, 1.0)).unwrap();
                let (u, v) = fast.pixel(x as f32, y as f32);
                let found = Vector2::new(f64::from(u), f64::from(v));
                assert!((found - exact).norm() < ROUNDING, "{exact} {found}");
            }
        }
    }

    #[test]
    fn pixel_beyond_the_fold_is_unknown() {
        let lens = [-0.4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let camera = Camera::opencv(300.0, 300.0, 319.5, 239.5, lens, 640, 480).unwrap();
        let fast = PlaneProjection::new(&camera).unwrap();
        assert!(camera.project(&Vector3::new(3.0, 0.0, 1.0)).is_none());
        assert!(fast.pixel(3.0, 0.0).0.is_nan());
    }

    #[test]
    fn cameras_without_an_image_plane_have_none() {
        assert!(PlaneProjection::new(&Camera::equirectangular(64, 32).unwrap()).is_none());
    }
}
