//! Curves of a radial distortion: where they stop increasing, how they are inverted, what they do
//! to a point of the image plane.

use nalgebra::{Matrix2, Vector2};

/// Image-plane radii (tangents of the angle to the axis) beyond this are not told from 90 degrees.
pub(crate) const FARTHEST: f64 = 1e9;

/// Largest residual, relative to 1 + target, with which an inverse counts as found: 1e-13 is a
/// tenth of a nanopixel at a focal length of 1000 px.
pub(crate) const INVERSE_RESIDUAL: f64 = 1e-13;

/// The value at `x` of the polynomial with ascending `coefficients`.
pub(crate) fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Kept away from a root, relatively, so that rounding does not change the sign before it.
const MARGIN: f64 = 1e-12;

/// Almost the largest `x` up to which the polynomial, positive at 0, stays positive; at most
/// `bound`.
pub(crate) fn positive_until(coefficients: &[f64], bound: f64) -> f64 {
    match sign_changes(coefficients, bound).first() {
        Some(root) => root * (1.0 - MARGIN),
        None => bound,
    }
}

/// Where the polynomial changes sign in (0, `bound`), ascending. Between two neighbouring sign
/// changes of its derivative a polynomial is monotone, so that bisection finds every one.
fn sign_changes(coefficients: &[f64], bound: f64) -> Vec<f64> {
    let degree = coefficients.iter().rposition(|c| *c != 0.0).unwrap_or(0);
    if degree == 0 {
        return Vec::new();
    }
    let derivative: Vec<f64> = (1..=degree).map(|i| i as f64 * coefficients[i]).collect();
    let mut ends = sign_changes(&derivative, bound);
    ends.push(bound);
    let mut changes = Vec::new();
    let mut low = 0.0;
    for high in ends {
        let rising = polynomial(coefficients, low) < polynomial(coefficients, high);
        let below = |x: f64| (polynomial(coefficients, x) < 0.0) == rising;
        if below(low) && !below(high) {
            changes.push(bisect(below, low, high));
        }
        low = high;
    }
    changes
}

/// The largest number found between `low` and `high` for which `below` still holds.
fn bisect(below: impl Fn(f64) -> bool, mut low: f64, mut high: f64) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return low;
        }
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// Solves `curve(x) = target` on [0, `limit`] for a `curve` (value, slope) that increases there
/// from 0 to `top`: Newton, kept inside a shrinking bracket. `None` where the curve does not reach
/// `target`.
pub(crate) fn invert_increasing(
    curve: impl Fn(f64) -> (f64, f64),
    (limit, top): (f64, f64),
    target: f64,
) -> Option<f64> {
    let tolerance = INVERSE_RESIDUAL * (1.0 + target);
    let (mut low, mut high) = (0.0, limit);
    if !(target >= 0.0 && top >= target) {
        return (target - top <= tolerance).then_some(limit);
    }
    let (mut x, mut nearest) = (target.min(limit), f64::INFINITY);
    for _ in 0..200 {
        let (value, slope) = curve(x);
        let gap = value - target;
        nearest = gap.abs();
        if nearest <= f64::EPSILON * target {
            return Some(x);
        }
        if gap < 0.0 {
            low = x;
        } else {
            high = x;
        }
        let newton = x - gap / slope;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - x).abs() <= f64::EPSILON * x {
            break; // rounding of the curve keeps it off the target
        }
        x = next;
    }
    (nearest <= tolerance).then_some(x)
}

/// `e` moved along itself to the length `radius`: `radius / |e| * e`, for a radius that grows like
/// `by_rho * |e|` at the centre.
pub(crate) fn to_radius(e: &Vector2<f64>, radius: f64, by_rho: f64) -> Vector2<f64> {
    let rho = e.norm();
    if rho > 0.0 {
        e * (radius / rho)
    } else {
        e * by_rho
    }
}

/// Derivative of [`to_radius`] by `e`, where `by_rho` is the derivative of the radius by `|e|`.
pub(crate) fn to_radius_by_e(e: &Vector2<f64>, radius: f64, by_rho: f64) -> Matrix2<f64> {
    let rho = e.norm();
    if rho > 0.0 {
        let along = e / rho;
        let across = radius / rho;
        Matrix2::identity() * across + along * along.transpose() * (by_rho - across)
    } else {
        Matrix2::identity() * by_rho
    }
}
