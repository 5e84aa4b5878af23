//! The table of section 6.3: edges and areas of rectangles in the image of the FOV fish-eye (1.6).
//!
//! Image plane coordinates as in [`super::pinhole`], `w` the lens's field of view in radians, and
//! `r^2 = z1^2 + z2^2`. Printed wrong and corrected here: on the side `z1` low, the second
//! component of `(eta x n) dl` has the square of the *lower* z1, and every bare z1 there is the
//! lower one. The printed quotients are 0/0 at the centre; the same expressions are written with
//! quotients that have a limit.

use super::edge::{EdgeElement, Side};
use nalgebra::Vector3;

/// The radial functions of the table, all finite at r = 0, in its notation: `C_w, S_w` of w/2 and
/// `C_r, S_r` of r w.
struct Radial {
    c_w: f64,
    s_w: f64,
    c_r: f64,
    /// `S_r / r`
    s_by_r: f64,
    /// `4 S_w^2 C_r^2 + C_w^2 S_r^2`
    q2: f64,
    /// `(S_r C_r - w r) / r^3`
    mixed: f64,
}

impl Radial {
    fn new(w: f64, z1: f64, z2: f64) -> Self {
        let r = z1.hypot(z2);
        let a = r * w;
        let ((s_w, c_w), (s_r, c_r)) = ((0.5 * w).sin_cos(), a.sin_cos());
        Self {
            c_w,
            s_w,
            c_r,
            s_by_r: w * sine_quotient(a),
            q2: 4.0 * (s_w * c_r).powi(2) + (c_w * s_r).powi(2),
            mixed: -4.0 * w.powi(3) * third(2.0 * a),
        }
    }
}

/// `sin t / t`
fn sine_quotient(t: f64) -> f64 {
    if t < 1e-4 {
        1.0 - t * t / 6.0 // the next term is below 1e-18
    } else {
        t.sin() / t
    }
}

/// `(t - sin t) / t^3`
fn third(t: f64) -> f64 {
    /// Below, the difference loses digits; the series loses none.
    const SMALL: f64 = 1.0;
    if t >= SMALL {
        return (t - t.sin()) / (t * t * t);
    }
    let s = t * t;
    // 1/3! - s/5! + s^2/7! - ...; the first term left out is below 1/23!
    let nested = (0..9).rev().fold(1.0, |inner, k| {
        let n = f64::from(2 * k + 4);
        1.0 - s * inner / (n * (n + 1.0))
    });
    nested / 6.0
}

/// Thesis: section 6.3. `d sigma / (dz1 dz2)`, steradian per unit of image plane, with its limit
/// at the centre.
pub fn area(w: f64, z1: f64, z2: f64) -> f64 {
    let q = Radial::new(w, z1, z2);
    2.0 * w * q.s_by_r * q.c_w.powi(2) * q.s_w * q.q2.powf(-1.5)
}

/// Thesis: section 6.3. The row of `side`, at a point of it. Valid within `r w < pi/2`, which is
/// what the lens sees.
pub fn edge(w: f64, side: Side, z1: f64, z2: f64) -> EdgeElement {
    let q = Radial::new(w, z1, z2);
    // (C_w^2 S_r^3 + 4 S_w^2 C_r (C_r S_r - w r)) / r^3
    let mixed = q.c_w.powi(2) * q.s_by_r.powi(3) + 4.0 * q.s_w.powi(2) * q.c_r * q.mixed;
    // The printed z2^2 S_r q2 + 4 w r z1^2 S_w^2 C_r is r^2 S_r q2 - z1^2 (...), the mixed term.
    let along = |z: f64| q.s_by_r * q.q2 - z * z * mixed;
    let across = |z: f64| q.s_by_r * q.c_r - z * z * q.mixed;
    let off_plane = 2.0 * w * q.c_w * q.s_w * q.s_by_r;
    let axial = q.c_w * q.s_by_r.powi(2);
    let (tangent, normal) = if side.is_level() {
        (
            Vector3::new(-along(z1), z1 * z2 * mixed, z1 * off_plane),
            Vector3::new(
                2.0 * z1 * z2 * q.s_w * q.mixed,
                2.0 * q.s_w * across(z1),
                -z2 * axial,
            ),
        )
    } else {
        (
            Vector3::new(-z1 * z2 * mixed, along(z2), -z2 * off_plane),
            Vector3::new(
                2.0 * q.s_w * across(z2),
                2.0 * z1 * z2 * q.s_w * q.mixed,
                -z1 * axial,
            ),
        )
    };
    EdgeElement {
        tangent: tangent * (side.sign() * q.c_w * q.q2.powf(-1.5)),
        normal: normal * (side.sign() * q.c_w / q.q2),
    }
}

#[cfg(test)]
#[path = "fov_tests.rs"]
mod tests;
