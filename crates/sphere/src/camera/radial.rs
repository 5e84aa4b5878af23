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

/// Coefficients of a polynomial, at most.
const COEFFICIENTS: usize = 16;

/// Almost the largest `x` up to which the polynomial, positive at 0, stays positive; at most
/// `bound`. Up to 16 coefficients.
pub(crate) fn positive_until(coefficients: &[f64], bound: f64) -> f64 {
    if coefficients
        .iter()
        .skip(1)
        .step_by(2)
        .all(|odd| *odd == 0.0)
        && coefficients.len() > 2
    {
        // in the square of x half the degree is left
        let mut even = [0.0; COEFFICIENTS];
        let count = coefficients.len().div_ceil(2);
        for (to, from) in even.iter_mut().zip(coefficients.iter().step_by(2)) {
            *to = *from;
        }
        return positive_until(&even[..count], bound * bound).sqrt();
    }
    let (changes, count) = sign_changes(coefficients, bound);
    match changes[..count].first() {
        Some(root) => root * (1.0 - MARGIN),
        None => bound,
    }
}

/// Where the polynomial changes sign in (0, `bound`), ascending, and how often. Between two
/// neighbouring sign changes of its derivative a polynomial is monotone, so that bisection finds
/// every one.
fn sign_changes(coefficients: &[f64], bound: f64) -> ([f64; COEFFICIENTS], usize) {
    let (mut changes, mut count) = ([0.0; COEFFICIENTS], 0);
    let degree = coefficients.iter().rposition(|c| *c != 0.0).unwrap_or(0);
    let same = |sign: f64| coefficients.iter().all(|c| *c * sign >= 0.0);
    if degree == 0 || same(1.0) || same(-1.0) {
        // coefficients of one sign have no positive root (Descartes)
        return (changes, count);
    }
    let mut derivative = [0.0; COEFFICIENTS];
    for (i, entry) in (1..=degree).zip(&mut derivative) {
        *entry = i as f64 * coefficients[i];
    }
    let (ends, between) = sign_changes(&derivative[..degree], bound);
    let coefficients = &coefficients[..=degree];
    let mut low = 0.0;
    for high in ends[..between].iter().copied().chain([bound]) {
        let rising = polynomial(coefficients, low) < polynomial(coefficients, high);
        let below = |x: f64| (polynomial(coefficients, x) < 0.0) == rising;
        if below(low) && !below(high) {
            changes[count] = bisect(below, low, high);
            count += 1;
        }
        low = high;
    }
    (changes, count)
}

/// The largest number found between `low` and `high` for which `below` still holds.
fn bisect(below: impl Fn(f64) -> bool, mut low: f64, mut high: f64) -> f64 {
    loop {
        // by sizes first: the ends may be decades apart
        let middle = if low == 0.0 {
            1e-3 * high
        } else if high > 4.0 * low {
            low.sqrt() * high.sqrt()
        } else {
            0.5 * (low + high)
        };
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
