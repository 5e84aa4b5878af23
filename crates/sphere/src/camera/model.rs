//! The camera models, as one type.

use super::{
    DoubleSphere, Equirectangular, Fov, InversePolynomial, KannalaBrandt, Lens, Opencv, Pinhole,
    Projection, Unified,
};
use nalgebra::{Matrix2x3, Vector2, Vector3};

/// The models. Their parameters are named as in the calibration file.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// Perspective with skew (1.4).
    Pinhole(Pinhole),
    /// OpenCV's rational radial and tangential distortion.
    Opencv(Lens<Opencv>),
    /// The thesis's polynomial distortion (1.5).
    InversePolynomial(Lens<InversePolynomial>),
    /// The thesis's fish-eye (1.6).
    Fov(Lens<Fov>),
    /// Fish-eye by polynomials of the angle.
    KannalaBrandt(Lens<KannalaBrandt>),
    /// Unified catadioptric.
    Unified(Lens<Unified>),
    /// Double sphere.
    DoubleSphere(Lens<DoubleSphere>),
    /// Longitude and latitude of the whole sphere.
    Equirectangular(Equirectangular),
}

/// Calls a [`Projection`] method on whichever model is there.
macro_rules! on_model {
    ($model:expr, $m:ident => $call:expr) => {
        match $model {
            Model::Pinhole($m) => $call,
            Model::Opencv($m) => $call,
            Model::InversePolynomial($m) => $call,
            Model::Fov($m) => $call,
            Model::KannalaBrandt($m) => $call,
            Model::Unified($m) => $call,
            Model::DoubleSphere($m) => $call,
            Model::Equirectangular($m) => $call,
        }
    };
}

/// Makes the same kind of model from whichever is there.
macro_rules! map_model {
    ($model:expr, $m:ident => $call:expr) => {
        match $model {
            Model::Pinhole($m) => Model::Pinhole($call),
            Model::Opencv($m) => Model::Opencv($call),
            Model::InversePolynomial($m) => Model::InversePolynomial($call),
            Model::Fov($m) => Model::Fov($call),
            Model::KannalaBrandt($m) => Model::KannalaBrandt($call),
            Model::Unified($m) => Model::Unified($call),
            Model::DoubleSphere($m) => Model::DoubleSphere($call),
            Model::Equirectangular($m) => Model::Equirectangular($call),
        }
    };
}

impl Model {
    /// The name in a calibration file.
    pub fn name(&self) -> &'static str {
        match self {
            Model::Pinhole(_) => "pinhole",
            Model::Opencv(_) => "opencv",
            Model::InversePolynomial(_) => "inverse_polynomial",
            Model::Fov(_) => "fov",
            Model::KannalaBrandt(_) => "kannala_brandt",
            Model::Unified(_) => "unified",
            Model::DoubleSphere(_) => "double_sphere",
            Model::Equirectangular(_) => "equirectangular",
        }
    }
}

impl Projection for Model {
    fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        on_model!(self, m => m.project(point))
    }

    fn project_with_jacobian(
        &self,
        point: &Vector3<f64>,
    ) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        on_model!(self, m => m.project_with_jacobian(point))
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        on_model!(self, m => m.unproject(pixel))
    }

    fn rescaled(&self, factor: f64) -> Self {
        map_model!(self, m => m.rescaled(factor))
    }

    fn shifted(&self, x0: f64, y0: f64) -> Option<Self> {
        Some(map_model!(self, m => m.shifted(x0, y0)?))
    }

    fn named(&self) -> Vec<(&'static str, f64)> {
        on_model!(self, m => m.named())
    }
}
