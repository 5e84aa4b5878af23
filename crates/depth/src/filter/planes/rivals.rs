//! Which plane a surface goes on with: that of the coarser cells around it, or another one beside it.
//!
//! Coarser cells know most of the surface with most paint, and go on with its plane where another begins, of which less
//! is seen. All pixels of a finer cell together may tell the two apart, long before each of them can by itself.

use super::fit::Fit;
use super::moments::Moments;
use crate::filter::surfaces::ONE_SURFACE;
use nalgebra::Vector3;

/// A plane that a surface is expected to be on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior {
    pub plane: Vector3<f64>,
    /// Variance of zeta about it over a cell, 1/m^2.
    pub spread: f64,
}

/// A rival has to explain a surface's pixels better by this much, as a sum of squares over their variances.
const BETTER: f64 = 1.5;

impl Prior {
    pub const UNKNOWN: Self = Self {
        plane: Vector3::new(0.0, 0.0, 0.0),
        spread: 1.0,
    };

    /// That a surface goes on as one beside it; `rough` is what neighbours differ by, 1/m^2.
    pub fn of(fit: &Fit, rough: f64) -> Self {
        Self {
            plane: fit.plane,
            spread: fit.misfit + fit.variance + rough,
        }
    }

    /// Squares over variances that are left by the plane of this prior which fits the moments best, up to a number
    /// that is the moments' own.
    ///
    /// Without the determinant that a likelihood would have: it favours narrow priors, and those that are wrong are
    /// the narrow ones.
    fn misfit(&self, moments: &Moments) -> Option<f64> {
        let away = moments.vector - moments.matrix * self.plane;
        let hold = moments.shape / (moments.pixels * self.spread);
        let inverse = (moments.matrix + hold).try_inverse()?;
        let as_it_is =
            self.plane.dot(&(moments.matrix * self.plane)) - 2.0 * self.plane.dot(&moments.vector);
        Some(as_it_is - away.dot(&(inverse * away)))
    }
}

/// What explains the moments best: a rival only where it does so clearly.
pub(super) fn best<T: Copy>(
    own: T,
    rivals: impl Iterator<Item = T>,
    prior: impl Fn(T) -> Prior,
    moments: &Moments,
) -> T {
    if moments.weight <= 0.0 {
        return own;
    }
    let expected = prior(own);
    let ray = moments.ray();
    let here = expected.plane.dot(&ray);
    let (mut found, mut least) = (own, None);
    for rival in rivals {
        let other = prior(rival);
        let same = (other.plane.dot(&ray) - here).abs() <= ONE_SURFACE * here;
        if same {
            continue;
        }
        // Most surfaces have no rival at all.
        let most = least.or_else(|| Some(expected.misfit(moments)? - BETTER));
        let (Some(most), Some(misfit)) = (most, other.misfit(moments)) else {
            continue;
        };
        least = Some(most);
        if misfit < most {
            (found, least) = (rival, Some(misfit));
        }
    }
    found
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::super::moments::{Cell, basis};
    use super::*;
    use crate::filter::lattice::Lattice;
    use sphereflow_sphere::Camera;

    /// Double precision of a few sums, and single precision of the moments.
    const ROUNDING: f64 = 1e-5;
    const WALL: Vector3<f64> = Vector3::new(0.1, -0.05, 0.5);

    /// Moments of a cell whose pixels are on a plane, known to a share of it.
    fn moments(plane: &Vector3<f64>, deviation: f64) -> Moments {
        let camera = Camera::pinhole(60.0, 60.0, 7.5, 7.5, 16, 16).unwrap();
        let lattice = Lattice::new(&camera).unwrap();
        let information = (deviation * 0.5).powi(-2) as f32;
        let node = |ray: &Vector3<f32>| {
            let zeta = plane.dot(&ray.cast::<f64>()) as f32;
            [zeta, 0.0, information, 1.0 / information]
        };
        let nodes: Vec<_> = lattice.ray.iter().map(node).collect();
        let base = basis(&lattice, 1, 2);
        let cell = Cell {
            lattice: &lattice,
            nodes: &nodes,
            column: 1,
            row: 2,
            base: &base,
        };
        cell.moments()
    }

    /// A plane that lies apart by a share.
    fn apart(share: f64) -> Prior {
        Prior {
            plane: WALL * (1.0 + share),
            spread: 1e-5,
        }
    }

    #[test]
    fn misfit_is_the_least_of_data_and_prior_together() {
        let of = moments(&WALL, 0.3);
        let prior = apart(0.2);
        let hold = of.shape / (of.pixels * prior.spread);
        let squares = |plane: Vector3<f64>| {
            let away = plane - prior.plane;
            plane.dot(&(of.matrix * plane)) - 2.0 * plane.dot(&of.vector) + away.dot(&(hold * away))
        };
        let fitted = (of.matrix + hold).try_inverse().unwrap() * (of.vector + hold * prior.plane);
        let misfit = prior.misfit(&of).unwrap();
        let least = squares(fitted);
        assert!((misfit - least).abs() < ROUNDING * least.abs());
        for axis in 0..3 {
            for way in [-0.01, 0.01] {
                let mut moved = fitted;
                moved[axis] += way;
                assert!(squares(moved) > least);
            }
        }
    }

    #[test]
    fn a_rival_is_taken_where_it_explains_the_pixels_clearly_better() {
        let choose = |own: Prior, rivals: &[Prior], of: &Moments| {
            best(own, rivals.iter().copied(), |prior| prior, of).plane
        };
        // Sixteen pixels of a deviation of 20 % speak of a twentieth: 0.2 is 16 squares away.
        let of = moments(&WALL, 0.2);
        let (right, other, wrong) = (apart(0.0), apart(0.1), apart(0.2));
        assert_eq!(choose(wrong, &[right], &of), right.plane);
        assert_eq!(choose(wrong, &[other, right], &of), right.plane);
        assert_eq!(choose(wrong, &[right, other], &of), right.plane);
        assert_eq!(choose(right, &[other, wrong], &of), right.plane);
        // One that is the same surface is none, and where pixels say little none is better.
        assert_eq!(choose(apart(0.01), &[right], &of), apart(0.01).plane);
        assert_eq!(choose(wrong, &[right], &moments(&WALL, 2.0)), wrong.plane);
        assert_eq!(choose(wrong, &[right], &Moments::NOTHING), wrong.plane);
    }
}
