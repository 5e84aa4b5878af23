//! The optical flow constraint with known motion: one equation per pixel for the inverse range.

use crate::rays::{finite_twist, parts};
use crate::{PixelRays, Result};
use sphereflow_core::checks::positive;
use sphereflow_core::{Plane, Twist};
use sphereflow_raster::{Derivatives, is_blank, same_size};

/// F + G / D = 0 in every pixel, grey levels per second.
///
/// Thesis: eq. (2.15). Where brightness or ray are unknown, both are zero: nothing is said there.
#[derive(Clone, Debug, PartialEq)]
pub struct DataTerm {
    /// F, grey levels per second.
    pub f: Plane<f32>,
    /// G, grey levels metres per second.
    pub g: Plane<f32>,
}

impl DataTerm {
    /// Of two images `dt_s` apart, with the motion at the middle of their times. Silent where one of the
    /// images is blank.
    ///
    /// # Errors
    /// Shape errors naming the image; value errors for a motion or a time that is not finite.
    pub fn of_pair(
        rays: &PixelRays,
        image0: &Plane<f32>,
        image1: &Plane<f32>,
        twist: &Twist,
        dt_s: f64,
    ) -> Result<Self> {
        same_size("image0", rays.size(), image0.size())?;
        let derivatives = Derivatives::of_pair(image0, image1)?;
        let mut term = Self::of_derivatives(rays, &derivatives, twist, dt_s)?;
        // Against a black or saturated image every edge of the other would be a motion.
        if is_blank(image0) || is_blank(image1) {
            term.f.data_mut().fill(0.0);
            term.g.data_mut().fill(0.0);
        }
        Ok(term)
    }

    /// Of derivatives of brightness.
    ///
    /// # Errors
    /// As [`DataTerm::of_pair`].
    pub fn of_derivatives(
        rays: &PixelRays,
        derivatives: &Derivatives,
        twist: &Twist,
        dt_s: f64,
    ) -> Result<Self> {
        same_size("derivatives", rays.size(), derivatives.x.size())?;
        finite_twist(twist)?;
        positive("dt_s", dt_s)?;
        let (omega, v) = parts(twist);
        let rate = (1.0 / dt_s) as f32;
        let (width, height) = rays.size();
        let mut term = Self {
            f: Plane::filled(width, height, 0.0),
            g: Plane::filled(width, height, 0.0),
        };
        let out = term.f.data_mut().iter_mut().zip(term.g.data_mut());
        for (i, (f, g)) in out.enumerate() {
            let motion = rays.motion(i, &omega, &v);
            let [yx, yy] = [derivatives.x.data()[i], derivatives.y.data()[i]];
            let along = |[a, b]: [f32; 2]| yx * a + yy * b;
            let (own_f, own_g) = (
                derivatives.t.data()[i] * rate + along(motion.rotation),
                along(motion.translation),
            );
            if own_f.is_finite() && own_g.is_finite() {
                (*f, *g) = (own_f, own_g);
            }
        }
        Ok(term)
    }

    /// True where no pixel says anything about depth: no translation, or an image without slopes.
    pub fn is_silent(&self) -> bool {
        self.g.data().iter().all(|g| *g == 0.0)
    }
}
