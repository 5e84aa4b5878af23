//! Camera models behind one interface: pixels to unit rays and back.

mod constructors;
mod double_sphere;
mod equirectangular;
mod focal;
mod fov;
mod inverse_polynomial;
mod kannala_brandt;
mod lens;
mod model;
mod named;
mod opencv;
mod pinhole;
mod radial;
#[cfg(test)]
mod tests;
mod unified;

pub use double_sphere::DoubleSphere;
pub use equirectangular::Equirectangular;
pub use focal::Focal;
pub use fov::Fov;
pub use inverse_polynomial::InversePolynomial;
pub use kannala_brandt::KannalaBrandt;
pub use lens::{Bend, Lens};
pub use model::Model;
pub use named::MODEL_NAMES;
pub use opencv::Opencv;
pub use pinhole::Pinhole;
pub use unified::Unified;

use nalgebra::{Matrix2x3, Vector2, Vector3};
use sphereflow_core::{Error, Result};

/// What every camera model can do. Points and rays live in the camera frame (x right, y down,
/// z forward); pixels have their centres at integers. Neither call looks at the image bounds.
pub trait Projection {
    /// The pixel that sees `point`; `None` where the model does not see its direction.
    fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>>;

    /// [`Projection::project`] with the derivative of the pixel by the point; `None` also where there
    /// is no derivative (a pole, the very edge of a fold).
    fn project_with_jacobian(&self, point: &Vector3<f64>)
    -> Option<(Vector2<f64>, Matrix2x3<f64>)>;

    /// The unit ray of `pixel`; `None` where the model has no ray there.
    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>>;

    /// The same camera with pixels `factor` times as large, for an image `factor` times smaller:
    /// the centre of the first large pixel is the centre of its `factor * factor` small ones.
    fn rescaled(&self, factor: f64) -> Self
    where
        Self: Sized;

    /// The camera of a part of the image, whose first pixel is the pixel (`x0`, `y0`) here; `None`
    /// where a part of the image is not of this model.
    fn shifted(&self, x0: f64, y0: f64) -> Option<Self>
    where
        Self: Sized;

    /// Names and values of the parameters, as in a calibration file.
    fn named(&self) -> Vec<(&'static str, f64)>;
}

/// A camera: a model and the size of its image.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    model: Model,
    width: usize,
    height: usize,
}

impl Camera {
    /// From a model and an image size.
    ///
    /// # Errors
    /// [`Error::Value`] for an empty image, or an equirectangular model made for another size.
    pub fn new(model: Model, width: usize, height: usize) -> Result<Self> {
        if width == 0 || height == 0 {
            return Err(Error::value(
                "width, height",
                "at least 1x1",
                format!("{width}x{height}"),
            ));
        }
        if let Model::Equirectangular(sphere) = &model {
            let (found, expected) = (sphere.image_size(), (width as f64, height as f64));
            // to the rounding of the pixels per radian
            if (found.0 - expected.0).hypot(found.1 - expected.1) > 1e-6 {
                return Err(Error::value(
                    "width, height",
                    format!("{}x{} pixels, the whole sphere", found.0, found.1),
                    format!("{width}x{height}"),
                ));
            }
        }
        Ok(Self {
            model,
            width,
            height,
        })
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Pixels per row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The pixel that sees `point` (camera frame), inside the image or not; `None` where the model
    /// does not see its direction.
    pub fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.model.project(point)
    }

    /// [`Camera::project`] with the derivative of the pixel by the point.
    pub fn project_with_jacobian(
        &self,
        point: &Vector3<f64>,
    ) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        self.model.project_with_jacobian(point)
    }

    /// The unit ray of `pixel`, inside the image or not; `None` where the model has no ray there.
    pub fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        self.model.unproject(pixel)
    }

    /// True within the image: from -0.5 to width - 0.5 and height - 0.5.
    pub fn contains(&self, pixel: &Vector2<f64>) -> bool {
        let inside = |v: f64, n: usize| v >= -0.5 && v < n as f64 - 0.5;
        inside(pixel.x, self.width) && inside(pixel.y, self.height)
    }

    /// True where the left and right image borders are the same meridian.
    pub fn wraps_around(&self) -> bool {
        matches!(self.model, Model::Equirectangular(_))
    }

    /// The camera of the image binned `factor` x `factor`; rows and columns that do not fill a bin
    /// are dropped.
    ///
    /// # Errors
    /// [`Error::Value`] where `factor` is 0 or larger than the image, or does not divide a
    /// 360-degree image.
    pub fn binned(&self, factor: usize) -> Result<Self> {
        let (width, height) = match factor {
            0 => (0, 0),
            f => (self.width / f, self.height / f),
        };
        let ragged = width * factor != self.width || height * factor != self.height;
        if width == 0 || height == 0 || (ragged && self.wraps_around()) {
            return Err(Error::value(
                "factor",
                format!("a bin that fits into {}x{} pixels", self.width, self.height),
                factor,
            ));
        }
        Self::new(self.model.rescaled(factor as f64), width, height)
    }

    /// The camera of the part of the image of `width` x `height` pixels whose first pixel is
    /// (`x0`, `y0`).
    ///
    /// # Errors
    /// [`Error::Value`] where the part is empty or reaches out of the image, or the image is of the
    /// whole sphere.
    pub fn cropped(&self, x0: usize, y0: usize, width: usize, height: usize) -> Result<Self> {
        let ends_within = |start: usize, length: usize, whole: usize| {
            start.checked_add(length).is_some_and(|end| end <= whole)
        };
        if !(ends_within(x0, width, self.width) && ends_within(y0, height, self.height)) {
            return Err(Error::value(
                "x0, y0, width, height",
                format!("a part of {}x{} pixels", self.width, self.height),
                format!("{width}x{height} from ({x0}, {y0})"),
            ));
        }
        let Some(model) = self.model.shifted(x0 as f64, y0 as f64) else {
            return Err(Error::value(
                "camera model",
                "one whose image can be cropped",
                self.model_name(),
            ));
        };
        Self::new(model, width, height)
    }
}

/// The pixel coordinate `u` of a fine image, in an image binned by `factor`.
pub(crate) fn binned_coordinate(u: f64, factor: f64) -> f64 {
    (u + 0.5) / factor - 0.5
}
