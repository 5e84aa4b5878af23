//! Camera models behind one interface: pixels to unit rays and back.

mod equirectangular;
mod pinhole;

pub use equirectangular::Equirectangular;
pub use pinhole::Pinhole;

use nalgebra::{Matrix2x3, Vector2, Vector3};
use sphereflow_core::{Error, Result};

/// What every camera model can do. Points and rays live in the camera frame (x right, y down,
/// z forward); pixels have their centres at integers. Neither call looks at the image bounds.
pub trait Projection {
    /// The pixel that sees `point`; `None` where the model does not see its direction.
    fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>>;

    /// [`Projection::project`] with the derivative of the pixel by the point.
    fn project_with_jacobian(&self, point: &Vector3<f64>)
    -> Option<(Vector2<f64>, Matrix2x3<f64>)>;

    /// The unit ray of `pixel`; `None` where the model has no ray there.
    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>>;

    /// The same camera with pixels `factor` times as large, for an image `factor` times smaller:
    /// the centre of the first large pixel is the centre of its `factor * factor` small ones.
    fn rescaled(&self, factor: f64) -> Self
    where
        Self: Sized;
}

/// The models. Their parameters are named as in the calibration file.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// Perspective with skew (1.4).
    Pinhole(Pinhole),
    /// Longitude and latitude of the whole sphere.
    Equirectangular(Equirectangular),
}

/// Calls a [`Projection`] method on whichever model is there.
macro_rules! on_model {
    ($model:expr, $m:ident => $call:expr) => {
        match $model {
            Model::Pinhole($m) => $call,
            Model::Equirectangular($m) => $call,
        }
    };
}

/// A camera: a model and the size of its image.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    model: Model,
    width: usize,
    height: usize,
}

impl Camera {
    /// A pinhole camera: focal lengths and principal point in pixels.
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter that is not finite or not positive, or an empty image.
    pub fn pinhole(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        width: usize,
        height: usize,
    ) -> Result<Self> {
        Self::new(
            Model::Pinhole(Pinhole::new(fx, fy, cx, cy, 0.0)?),
            width,
            height,
        )
    }

    /// The whole sphere in an image of `width` x `height`: 360 degrees of longitude across, 180 of
    /// latitude down, the middle of the image looking along +z.
    ///
    /// # Errors
    /// [`Error::Value`] for an empty image.
    pub fn equirectangular(width: usize, height: usize) -> Result<Self> {
        Self::new(
            Model::Equirectangular(Equirectangular::new(width, height)?),
            width,
            height,
        )
    }

    /// From a model and an image size.
    ///
    /// # Errors
    /// [`Error::Value`] for an empty image.
    pub fn new(model: Model, width: usize, height: usize) -> Result<Self> {
        if width == 0 || height == 0 {
            return Err(Error::value(
                "width, height",
                "at least 1x1",
                format!("{width}x{height}"),
            ));
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
        on_model!(&self.model, m => m.project(point))
    }

    /// [`Camera::project`] with the derivative of the pixel by the point.
    pub fn project_with_jacobian(
        &self,
        point: &Vector3<f64>,
    ) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        on_model!(&self.model, m => m.project_with_jacobian(point))
    }

    /// The unit ray of `pixel`, inside the image or not; `None` where the model has no ray there.
    pub fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        on_model!(&self.model, m => m.unproject(pixel))
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
        let model = match &self.model {
            Model::Pinhole(m) => Model::Pinhole(m.rescaled(factor as f64)),
            Model::Equirectangular(m) => Model::Equirectangular(m.rescaled(factor as f64)),
        };
        Self::new(model, width, height)
    }
}

/// The pixel coordinate `u` of a fine image, in an image binned by `factor`.
pub(crate) fn binned_coordinate(u: f64, factor: f64) -> f64 {
    (u + 0.5) / factor - 0.5
}
