//! Cameras from the parameters of each model.

use super::{
    Camera, DoubleSphere, Equirectangular, Focal, Fov, InversePolynomial, KannalaBrandt, Lens,
    Model, Opencv, Pinhole, Unified,
};
use sphereflow_core::{Error, Result};

/// Focal lengths and principal point are in pixels, of an image of `width` x `height` pixels. Each
/// returns [`Error::Value`] naming the parameter that is outside its domain, or an empty image.
impl Camera {
    /// A pinhole camera.
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
        Self::pinhole_with_skew(fx, fy, cx, cy, 0.0, width, height)
    }

    /// Thesis: eq. (1.4). A pinhole camera with skew in pixels.
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter that is not finite or not positive, or an empty image.
    pub fn pinhole_with_skew(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        skew: f64,
        width: usize,
        height: usize,
    ) -> Result<Self> {
        let model = Model::Pinhole(Pinhole::new(fx, fy, cx, cy, skew)?);
        Self::new(model, width, height)
    }

    /// OpenCV's model; `distortion` is k1, k2, p1, p2, k3, k4, k5, k6, in OpenCV's order.
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter outside its domain, or an empty image.
    pub fn opencv(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        distortion: [f64; 8],
        width: usize,
        height: usize,
    ) -> Result<Self> {
        let lens = Lens::new(Focal::new(fx, fy, cx, cy)?, Opencv::new(distortion)?);
        Self::new(Model::Opencv(lens), width, height)
    }

    /// Thesis: eq. (1.5). `k` are the coefficients of r_d^2, r_d^4, r_d^6, r_d^8 in r_u / r_d.
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter outside its domain, or an empty image.
    pub fn inverse_polynomial(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        k: [f64; 4],
        width: usize,
        height: usize,
    ) -> Result<Self> {
        let bend = InversePolynomial::new(k, [0.0; 2])?;
        let lens = Lens::new(Focal::new(fx, fy, cx, cy)?, bend);
        Self::new(Model::InversePolynomial(lens), width, height)
    }

    /// Thesis: eq. (1.6). The fish-eye with parameter `w` in radians.
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter outside its domain, or an empty image.
    pub fn fov(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        w: f64,
        width: usize,
        height: usize,
    ) -> Result<Self> {
        let lens = Lens::new(Focal::new(fx, fy, cx, cy)?, Fov::new(w, [0.0; 2])?);
        Self::new(Model::Fov(lens), width, height)
    }

    /// Kannala and Brandt's fish-eye with k1..k4.
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter outside its domain, or an empty image.
    pub fn kannala_brandt(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        k: [f64; 4],
        width: usize,
        height: usize,
    ) -> Result<Self> {
        let lens = Lens::new(Focal::new(fx, fy, cx, cy)?, KannalaBrandt::new(k)?);
        Self::new(Model::KannalaBrandt(lens), width, height)
    }

    /// The unified catadioptric model with `alpha` in [0, 1].
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter outside its domain, or an empty image.
    pub fn unified(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        alpha: f64,
        width: usize,
        height: usize,
    ) -> Result<Self> {
        let lens = Lens::new(Focal::new(fx, fy, cx, cy)?, Unified::new(alpha)?);
        Self::new(Model::Unified(lens), width, height)
    }

    /// The unified catadioptric model as Mei and Rives write it, `m = (x, y) / (z + xi |X|)` with
    /// `xi >= 0` and their focal lengths: alpha is xi / (1 + xi), the focal lengths are divided by
    /// 1 + xi.
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter outside its domain, or an empty image.
    pub fn unified_from_xi(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        xi: f64,
        width: usize,
        height: usize,
    ) -> Result<Self> {
        if !(xi >= 0.0 && xi.is_finite()) {
            return Err(Error::value("xi", "a finite number, 0 or more", xi));
        }
        let focal = Focal::new(fx, fy, cx, cy)?;
        let (fx, fy) = (focal.fx / (1.0 + xi), focal.fy / (1.0 + xi));
        Self::unified(fx, fy, cx, cy, xi / (1.0 + xi), width, height)
    }

    /// The double sphere model; `xi_alpha` is xi in (-1, 1) and alpha in [0, 1].
    ///
    /// # Errors
    /// [`Error::Value`] naming the parameter outside its domain, or an empty image.
    pub fn double_sphere(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        xi_alpha: [f64; 2],
        width: usize,
        height: usize,
    ) -> Result<Self> {
        let bend = DoubleSphere::new(xi_alpha[0], xi_alpha[1])?;
        let lens = Lens::new(Focal::new(fx, fy, cx, cy)?, bend);
        Self::new(Model::DoubleSphere(lens), width, height)
    }

    /// The whole sphere in an image of `width` x `height`: 360 degrees of longitude across, 180 of
    /// latitude down, the middle of the image looking along +z.
    ///
    /// # Errors
    /// [`Error::Value`] for an empty image.
    pub fn equirectangular(width: usize, height: usize) -> Result<Self> {
        let model = Model::Equirectangular(Equirectangular::new(width, height)?);
        Self::new(model, width, height)
    }

    /// The same camera with its distortion centred on (dx, dy), image-plane coordinates relative
    /// to the principal point: `inverse_polynomial` and `fov` only.
    ///
    /// # Errors
    /// [`Error::Value`] for another model, or a number that is not finite.
    pub fn with_distortion_centre(&self, dx: f64, dy: f64) -> Result<Self> {
        let model = match self.model() {
            Model::InversePolynomial(lens) => Model::InversePolynomial(Lens::new(
                lens.focal,
                InversePolynomial::new(lens.bend.coefficients(), [dx, dy])?,
            )),
            Model::Fov(lens) => {
                Model::Fov(Lens::new(lens.focal, Fov::new(lens.bend.w(), [dx, dy])?))
            }
            other => {
                return Err(Error::value(
                    "dx, dy",
                    "a model with a distortion centre: inverse_polynomial or fov",
                    other.name(),
                ));
            }
        };
        Self::new(model, self.width(), self.height())
    }
}
