//! A lens: how a model bends rays onto the image plane, and the pixels behind it.

use super::{Focal, Projection};
use nalgebra::{Matrix2x3, Vector2, Vector3};

/// How a camera model maps points to the image plane of focal length 1, before pixels.
pub trait Bend {
    /// The image-plane point that sees `point`; `None` where the model does not see it.
    fn bend(&self, point: &Vector3<f64>) -> Option<Vector2<f64>>;

    /// [`Bend::bend`] with the derivative of the image-plane point by the point.
    fn bend_with_jacobian(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)>;

    /// The unit ray seen at an image-plane point; `None` where there is none.
    fn straighten(&self, m: &Vector2<f64>) -> Option<Vector3<f64>>;

    /// The model's own parameters, as named in a calibration file.
    fn named(&self) -> Vec<(&'static str, f64)>;
}

/// A camera model: a [`Bend`] with focal lengths and principal point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens<B> {
    /// Image plane to pixels.
    pub focal: Focal,
    /// Rays to image plane.
    pub bend: B,
}

impl<B: Bend> Lens<B> {
    /// From its two parts.
    pub fn new(focal: Focal, bend: B) -> Self {
        Self { focal, bend }
    }
}

impl<B: Bend + Copy> Projection for Lens<B> {
    fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.focal.pixel(&self.bend.bend(point)?)
    }

    fn project_with_jacobian(
        &self,
        point: &Vector3<f64>,
    ) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let (m, m_by_point) = self.bend.bend_with_jacobian(point)?;
        let jacobian = self.focal.scale_rows(&m_by_point);
        let finite = jacobian.iter().all(|v| v.is_finite());
        finite.then_some((self.focal.pixel(&m)?, jacobian))
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        self.bend.straighten(&self.focal.plane(pixel)?)
    }

    fn rescaled(&self, factor: f64) -> Self {
        Self::new(self.focal.rescaled(factor), self.bend)
    }

    fn shifted(&self, x0: f64, y0: f64) -> Option<Self> {
        Some(Self::new(self.focal.shifted(x0, y0), self.bend))
    }

    fn named(&self) -> Vec<(&'static str, f64)> {
        let mut all = self.focal.named().to_vec();
        all.extend(self.bend.named());
        all
    }
}
