//! Names for directions of motion: a translation along an axis, a rotation about one, or a screw.

use nalgebra::{DMatrix, SymmetricEigen, Vector3, Vector6};
use std::fmt;

/// A part of a motion smaller than this share of it is left out of its name.
const NEGLIGIBLE: f64 = 0.05;

/// A direction of motion in words, in the camera's frame (x right, y down, z forward). Its
/// `Display` is the text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DirectionName {
    /// All points alike.
    Translation {
        /// Unit vector, its largest component positive.
        along: Vector3<f64>,
    },
    /// About an axis that stays where it is.
    Rotation {
        /// Unit vector, its largest component positive.
        about: Vector3<f64>,
        /// The point of the axis that is nearest to the camera, metres; zero where the axis goes
        /// through the camera.
        through_m: Vector3<f64>,
    },
    /// A rotation and a translation along its axis.
    Screw {
        /// Unit vector, its largest component positive.
        about: Vector3<f64>,
        /// The point of the axis that is nearest to the camera, metres; zero where the axis goes
        /// through the camera.
        through_m: Vector3<f64>,
        /// Along the axis, metres per radian.
        pitch_m_per_rad: f64,
    },
}

/// The name of a direction `[omega, v]` of unit length once omega is multiplied by the scene's
/// mean range, as [`crate::WeakDirection::direction`] and [`crate::Information::unseen`] have it.
/// Parts below 5 % of the whole are left out. `None` where the direction is zero or not finite.
pub fn direction_name(direction: &Vector6<f64>) -> Option<DirectionName> {
    let omega: Vector3<f64> = direction.fixed_rows::<3>(0).into();
    let v: Vector3<f64> = direction.fixed_rows::<3>(3).into();
    let (rate, speed) = (omega.norm(), v.norm());
    if !(rate.is_finite() && speed.is_finite() && rate + speed > 0.0) {
        return None;
    }
    let turning = (1.0 - speed * speed).max(0.0).sqrt(); // mean range times rate
    if rate == 0.0 || turning < NEGLIGIBLE {
        return Some(DirectionName::Translation {
            along: positive(v / speed),
        });
    }
    // The camera moves with omega, v: the points X of the axis have v + omega x X along omega.
    let mut through_m = omega.cross(&v) / (rate * rate);
    let aside = v - omega * (v.dot(&omega) / (rate * rate));
    if aside.norm() < NEGLIGIBLE {
        through_m = Vector3::zeros();
    }
    let about = positive(omega / rate);
    let pitch_m_per_rad = v.dot(&omega) / (rate * rate);
    Some(if (v.dot(&omega) / rate).abs() < NEGLIGIBLE {
        DirectionName::Rotation { about, through_m }
    } else {
        DirectionName::Screw {
            about,
            through_m,
            pitch_m_per_rad,
        }
    })
}

/// Another orthonormal basis of what `directions` (orthonormal, omega scaled) span: as many
/// translations as there are come first, the vectors that turn most come last. Where several
/// motions go unseen together, the eigenvectors are any mixture of them.
pub(crate) fn simplest_basis(directions: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
    let count = directions.len();
    if count == 0 {
        return Vec::new();
    }
    let turning = |i: usize, j: usize| {
        let (a, b) = (&directions[i], &directions[j]);
        a.fixed_rows::<3>(0).dot(&b.fixed_rows::<3>(0))
    };
    let eigen = SymmetricEigen::new(DMatrix::from_fn(count, count, turning));
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let mix = |column: usize| {
        let shares = eigen.eigenvectors.column(column);
        let parts = directions.iter().zip(shares.iter());
        parts.map(|(direction, share)| direction * *share).sum()
    };
    order.into_iter().map(mix).collect()
}

/// The same axis with its largest component positive.
fn positive(axis: Vector3<f64>) -> Vector3<f64> {
    if axis[axis.iamax()] < 0.0 {
        -axis
    } else {
        axis
    }
}

/// Two decimals, without "-0.00".
struct Triple<'a>(&'a Vector3<f64>);

impl fmt::Display for Triple<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded = self.0.map(|v| (v * 100.0).round() / 100.0 + 0.0);
        write!(f, "({:.2}, {:.2}, {:.2})", rounded.x, rounded.y, rounded.z)
    }
}

impl fmt::Display for DirectionName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = |f: &mut fmt::Formatter<'_>, about: &Vector3<f64>, through: &Vector3<f64>| {
            write!(f, "about {}", Triple(about))?;
            if *through == Vector3::zeros() {
                write!(f, " through the camera")
            } else {
                write!(f, " through {} m", Triple(through))
            }
        };
        match self {
            Self::Translation { along } => write!(f, "translation along {}", Triple(along)),
            Self::Rotation { about, through_m } => {
                write!(f, "rotation ")?;
                axis(f, about, through_m)
            }
            Self::Screw {
                about,
                through_m,
                pitch_m_per_rad,
            } => {
                write!(f, "screw ")?;
                axis(f, about, through_m)?;
                write!(f, ", {pitch_m_per_rad:.2} m/rad")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RANGE_M: f64 = 2.0;

    /// `[omega, v]` of unit length with omega scaled by [`RANGE_M`].
    fn unit(omega: Vector3<f64>, v: Vector3<f64>) -> Vector6<f64> {
        let size = (omega.norm_squared() * RANGE_M * RANGE_M + v.norm_squared()).sqrt();
        Vector6::new(omega.x, omega.y, omega.z, v.x, v.y, v.z) / size
    }

    fn text(omega: Vector3<f64>, v: Vector3<f64>) -> String {
        direction_name(&unit(omega, v)).unwrap().to_string()
    }

    #[test]
    fn direction_name_says_translation_rotation_or_screw() {
        let zero = Vector3::zeros();
        assert_eq!(
            text(zero, -Vector3::z()),
            "translation along (0.00, 0.00, 1.00)"
        );
        assert_eq!(
            text(-Vector3::y(), zero),
            "rotation about (0.00, 1.00, 0.00) through the camera"
        );
        let centre = Vector3::new(0.5, 0.0, 1.0);
        let about_centre = -Vector3::y().cross(&centre);
        assert_eq!(
            text(Vector3::y(), about_centre),
            "rotation about (0.00, 1.00, 0.00) through (0.50, 0.00, 1.00) m"
        );
        assert_eq!(
            text(Vector3::y(), about_centre + 0.3 * Vector3::y()),
            "screw about (0.00, 1.00, 0.00) through (0.50, 0.00, 1.00) m, 0.30 m/rad"
        );
    }

    #[test]
    fn direction_name_leaves_out_what_is_negligible() {
        let name = direction_name(&unit(Vector3::x() * 0.01, Vector3::y())).unwrap();
        assert_eq!(
            name,
            DirectionName::Translation {
                along: Vector3::y()
            }
        );
        let name = direction_name(&unit(Vector3::x(), Vector3::x() * 0.02)).unwrap();
        assert!(matches!(name, DirectionName::Rotation { .. }));
        // a hundredth of a metre of a camera's range of two is no axis beside it
        let name = direction_name(&unit(Vector3::x(), Vector3::y() * 0.02)).unwrap();
        let through_m = Vector3::zeros();
        let about = Vector3::x();
        assert_eq!(name, DirectionName::Rotation { about, through_m });
    }

    #[test]
    fn direction_name_does_not_depend_on_the_sign() {
        let direction = unit(Vector3::new(0.1, -0.7, 0.2), Vector3::new(0.3, 0.1, 0.5));
        assert_eq!(direction_name(&direction), direction_name(&-direction));
    }

    #[test]
    fn direction_name_of_nothing_is_none() {
        assert_eq!(direction_name(&Vector6::zeros()), None);
        assert_eq!(direction_name(&Vector6::repeat(f64::NAN)), None);
    }

    #[test]
    fn simplest_basis_separates_the_translations() {
        let e = |i: usize| Vector6::ith(i, 1.0);
        let (s, c) = 0.6_f64.sin_cos();
        let mixed = [
            e(2) * c + e(3) * s,
            (e(2) * -s + e(3) * c) * s + e(4) * c,
            (e(2) * -s + e(3) * c) * c - e(4) * s,
        ];
        let basis = simplest_basis(&mixed);
        assert!(basis[0].fixed_rows::<3>(0).norm() < 1e-12, "{basis:?}");
        assert!(basis[1].fixed_rows::<3>(0).norm() < 1e-12, "{basis:?}");
        assert!((basis[2][2].abs() - 1.0).abs() < 1e-12, "{basis:?}");
        assert!(simplest_basis(&[]).is_empty());
    }
}
