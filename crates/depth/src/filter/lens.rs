//! How points become pixels in the filter's loops: fast for a pinhole, general for every camera.

use nalgebra::Vector3;
use sphereflow_sphere::Camera;
use sphereflow_sphere::camera::Model;

/// Projection in single precision, and the gauge in which planes are linear.
///
/// The filter's state is zeta = 1/gauge(X) of the point X = b/zeta, with b the pixel's ray scaled to
/// gauge 1. With gauge Z for a pinhole and |X| otherwise, zeta = a . b on every plane a . X = 1.
pub(super) trait Lens: Sync {
    /// Z or |X|.
    fn gauge(&self, point: &Vector3<f32>) -> f32;

    /// The pixel, NaN where there is none.
    fn project(&self, point: &Vector3<f32>) -> [f32; 2];

    /// The pixel, and its derivative as the point moves along `step`; NaN where there is none.
    fn project_along(&self, point: &Vector3<f32>, step: &Vector3<f32>) -> ([f32; 2], [f32; 2]);
}

/// A pinhole.
#[derive(Clone, Copy, Debug)]
pub(super) struct PinholeLens {
    fx: f32,
    skew: f32,
    cx: f32,
    fy: f32,
    cy: f32,
}

/// Any camera, slower.
#[derive(Clone, Debug)]
pub(super) struct GeneralLens(pub Camera);

/// Points nearer to the plane of the camera than this share of their size have no pixel.
const LEAST_Z: f32 = 0.05;

impl PinholeLens {
    /// Where the camera is a pinhole.
    pub fn of(camera: &Camera) -> Option<Self> {
        if !matches!(camera.model(), Model::Pinhole(_)) {
            return None;
        }
        let pixel = |x: f64, y: f64| camera.project(&Vector3::new(x, y, 1.0));
        let (origin, right, below) = (pixel(0.0, 0.0)?, pixel(1.0, 0.0)?, pixel(0.0, 1.0)?);
        Some(Self {
            fx: (right.x - origin.x) as f32,
            skew: (below.x - origin.x) as f32,
            cx: origin.x as f32,
            fy: (below.y - origin.y) as f32,
            cy: origin.y as f32,
        })
    }
}

/// 1/Z, NaN where there is no pixel: chosen without a branch, so that loops over points are vectorised.
#[inline(always)]
fn per_depth(z: f32) -> f32 {
    if z < LEAST_Z { f32::NAN } else { 1.0 / z }
}

impl Lens for PinholeLens {
    #[inline(always)]
    fn gauge(&self, point: &Vector3<f32>) -> f32 {
        point.z
    }

    #[inline(always)]
    fn project(&self, point: &Vector3<f32>) -> [f32; 2] {
        let scale = per_depth(point.z);
        let (x, y) = (point.x * scale, point.y * scale);
        [self.fx * x + self.skew * y + self.cx, self.fy * y + self.cy]
    }

    #[inline(always)]
    fn project_along(&self, point: &Vector3<f32>, step: &Vector3<f32>) -> ([f32; 2], [f32; 2]) {
        let scale = per_depth(point.z);
        let (x, y) = (point.x * scale, point.y * scale);
        let (dx, dy) = ((step.x - x * step.z) * scale, (step.y - y * step.z) * scale);
        (
            [self.fx * x + self.skew * y + self.cx, self.fy * y + self.cy],
            [self.fx * dx + self.skew * dy, self.fy * dy],
        )
    }
}

impl Lens for GeneralLens {
    fn gauge(&self, point: &Vector3<f32>) -> f32 {
        point.norm()
    }

    fn project(&self, point: &Vector3<f32>) -> [f32; 2] {
        let pixel = self.0.project(&point.cast());
        pixel.map_or([f32::NAN; 2], |p| [p.x as f32, p.y as f32])
    }

    fn project_along(&self, point: &Vector3<f32>, step: &Vector3<f32>) -> ([f32; 2], [f32; 2]) {
        match self.0.project_with_jacobian(&point.cast()) {
            Some((pixel, jacobian)) => {
                let along = jacobian * step.cast::<f64>();
                (
                    [pixel.x as f32, pixel.y as f32],
                    [along.x as f32, along.y as f32],
                )
            }
            None => ([f32::NAN; 2], [f32::NAN; 2]),
        }
    }
}
