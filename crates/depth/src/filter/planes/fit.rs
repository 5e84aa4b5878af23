//! The plane of a cell, from its moments and the coarser plane around it.

use super::moments::Moments;
use crate::filter::surfaces::SLOPE_PER_RAD;
use nalgebra::Vector3;

/// The plane of a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub plane: Vector3<f64>,
    /// Variance of the pixels' zeta about the plane, beyond what noise explains.
    pub misfit: f64,
    /// Variance of the plane's zeta in the middle of the cell.
    pub variance: f64,
}

/// Relative deviation of a plane that is only continued from its neighbours: now and then it is another surface, a
/// third nearer or farther.
pub(super) const OTHER: f64 = 0.06;

impl Fit {
    pub const UNKNOWN: Self = Self {
        plane: Vector3::new(0.0, 0.0, 0.0),
        misfit: 1.0,
        variance: 1.0,
    };

    /// The plane that fits the moments with a prior plane of variance `spread` in the cell.
    /// `pixel_noise` is the share of a pixel's nominal variance that noise is expected to have: smoothed
    /// images repeat their noise in neighbouring pixels, so that fits misfit less than by independent noise.
    pub fn new(
        moments: &Moments,
        prior: &Vector3<f64>,
        spread: f64,
        pixel_noise: f64,
    ) -> Option<Self> {
        if moments.pixels == 0.0 {
            return None;
        }
        let shape = moments.shape / moments.pixels;
        // The prior counts as one measurement of each of the plane's three numbers.
        let hold = shape / spread;
        let matrix = moments.matrix + hold;
        let inverse = matrix.try_inverse()?;
        let plane = inverse * (moments.vector + hold * prior);
        let plane = no_cliff(&plane, &(matrix * moments.ray()));
        let residual = moments.square - 2.0 * plane.dot(&moments.vector)
            + plane.dot(&(moments.matrix * plane));
        let misfit = if moments.weight > 0.0 {
            ((residual - pixel_noise * moments.pixels) / moments.weight).max(0.0)
        } else {
            spread
        };
        let variance = (inverse * shape).trace() / 3.0;
        // What comes into view may be another surface, as long as its own pixels have not spoken.
        let zeta2 = plane.dot(&(shape * plane));
        let other = OTHER * OTHER * zeta2;
        let variance = variance + other / (1.0 + moments.weight * other).powi(4);
        plane.iter().all(|v| v.is_finite()).then_some(Self {
            plane,
            misfit,
            variance: variance.max(0.0),
        })
    }
}

/// What little is known of a slope must not become a cliff where it is continued: the plane is turned about the
/// middle of what is known until its zeta changes by no more than this share per radian.
fn no_cliff(plane: &Vector3<f64>, weighted_rays: &Vector3<f64>) -> Vector3<f64> {
    let middle = weighted_rays.normalize();
    let along = plane.dot(&middle);
    let across = plane - middle * along;
    let most = f64::from(SLOPE_PER_RAD) * along.abs();
    let steep = across.norm();
    match steep > most {
        true => middle * along + across * (most / steep),
        false => *plane,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Double precision.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn no_cliff_keeps_gentle_planes_and_turns_steep_ones_about_the_middle() {
        let middle = Vector3::new(0.1, -0.2, 1.0).normalize();
        let gentle = Vector3::new(0.3, 0.2, 0.5);
        assert!((no_cliff(&gentle, &(3.0 * middle)) - gentle).norm() < ROUNDING);
        let steep = Vector3::new(4.0, -1.0, 0.5);
        let turned = no_cliff(&steep, &(3.0 * middle));
        let along = steep.dot(&middle);
        assert!((turned.dot(&middle) - along).abs() < ROUNDING);
        let across = (turned - middle * along).norm();
        assert!((across - f64::from(SLOPE_PER_RAD) * along.abs()).abs() < 1e-9);
    }
}
