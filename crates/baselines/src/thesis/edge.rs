//! One side of a rectangle of the image plane, and what the contour integrals need of it.

use nalgebra::Vector3;

/// The sides of a rectangle `z1 in (low, high)`, `z2 in (low, high)` of the image plane, in the
/// order of the thesis's tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// `z2` at its lower end: the upper side of the image.
    LowZ2,
    /// `z1` at its upper end: the right side.
    HighZ1,
    /// `z2` at its upper end: the lower side.
    HighZ2,
    /// `z1` at its lower end: the left side.
    LowZ1,
}

/// `(eta x n) dl` and `n dl` on the unit sphere, per unit of length of the image plane: positive
/// lengths, `n` points out of the rectangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EdgeElement {
    /// `(eta x n) dl / dz`: with D^3, the coefficient of omega.
    pub tangent: Vector3<f64>,
    /// `n dl / dz`: with 3/2 D^2, the coefficient of v.
    pub normal: Vector3<f64>,
}

impl EdgeElement {
    /// The element for a length `dz` of the image plane.
    pub fn times(self, dz: f64) -> Self {
        Self {
            tangent: self.tangent * dz,
            normal: self.normal * dz,
        }
    }
}

impl Side {
    /// All four, in the order of the tables.
    pub const ALL: [Self; 4] = [Self::LowZ2, Self::HighZ1, Self::HighZ2, Self::LowZ1];

    /// -1 for the lower sides, whose outward normal points to smaller coordinates.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::LowZ2 | Self::LowZ1 => -1.0,
            Self::HighZ1 | Self::HighZ2 => 1.0,
        }
    }

    /// True where z1 runs along the side.
    pub(crate) fn is_level(self) -> bool {
        matches!(self, Self::LowZ2 | Self::HighZ2)
    }
}

/// The true curves, drawn with a camera's own rays: what the tables are tested against.
#[cfg(test)]
pub(crate) mod contour {
    use super::*;

    /// Points and weights of Gauss's rule of eight points on (-1, 1).
    const GAUSS: [(f64, f64); 4] = [
        (0.183_434_642_495_649_8, 0.362_683_783_378_362),
        (0.525_532_409_916_329, 0.313_706_645_877_887_3),
        (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
        (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
    ];

    /// Integral of `f` from `a` to `b`.
    pub(crate) fn gauss(a: f64, b: f64, f: impl Fn(f64) -> Vector3<f64>) -> Vector3<f64> {
        const PANELS: usize = 40;
        let half = (b - a) / (2 * PANELS) as f64;
        let mut sum = Vector3::zeros();
        for panel in 0..PANELS {
            let middle = a + (2 * panel + 1) as f64 * half;
            for (x, w) in GAUSS {
                sum += (f(middle + half * x) + f(middle - half * x)) * (w * half);
            }
        }
        sum
    }

    /// The point of a side of a rectangle `[z1 low, z1 high, z2 low, z2 high]` at coordinate `t`.
    pub(crate) fn point(side: Side, [a1, b1, a2, b2]: [f64; 4], t: f64) -> (f64, f64) {
        match side {
            Side::LowZ2 => (t, a2),
            Side::HighZ1 => (b1, t),
            Side::HighZ2 => (t, b2),
            Side::LowZ1 => (a1, t),
        }
    }

    /// Ends of the coordinate that runs along the side.
    pub(crate) fn range(side: Side, [a1, b1, a2, b2]: [f64; 4]) -> (f64, f64) {
        if side.is_level() { (a1, b1) } else { (a2, b2) }
    }

    /// The integrals of `eta x n` and `n` along the curve that the side is on the sphere, from
    /// rays alone: `eta x n` is the unit tangent, so that it integrates to the chord, and
    /// `n dl = d eta x eta`, each with the sense in which the outward normal lies on the right.
    pub(crate) fn of_rays(
        side: Side,
        rectangle: [f64; 4],
        ray: impl Fn(f64, f64) -> Vector3<f64>,
    ) -> EdgeElement {
        let at = |t: f64| {
            let (z1, z2) = point(side, rectangle, t);
            ray(z1, z2)
        };
        let (from, to) = range(side, rectangle);
        // Counter-clockwise about eta with z1 to the right and z2 down: d eta along +z1 has
        // eta x n on the upper side, along +z2 on the right side.
        let sense = match side {
            Side::LowZ2 | Side::HighZ1 => 1.0,
            Side::HighZ2 | Side::LowZ1 => -1.0,
        };
        EdgeElement {
            tangent: (at(to) - at(from)) * sense,
            normal: gauss(from, to, |t| derivative(at, t).cross(&at(t))) * sense,
        }
    }

    /// Eighth-order differences: 1e-13 for curves of the size of the image plane.
    fn derivative(f: impl Fn(f64) -> Vector3<f64>, t: f64) -> Vector3<f64> {
        const STEP: f64 = 5e-3;
        let pair = |k: f64| f(t + k * STEP) - f(t - k * STEP);
        (pair(1.0) * 0.8 - pair(2.0) * 0.2 + pair(3.0) * (4.0 / 105.0) - pair(4.0) / 280.0) / STEP
    }
}
