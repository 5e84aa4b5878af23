//! Similarities: rigid motions with a scale, the gauge of maps made from colour alone.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::so3;

/// `x_target = scale * rotation * x_source + translation`. Tangent vectors are
/// `[omega, v, sigma]`, `sigma` the logarithm of the scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Rotation and translation.
    pub pose: Pose,
    /// Scale, positive.
    pub scale: f64,
}

type Vector7 = SVector<f64, 7>;
type Matrix7 = SMatrix<f64, 7, 7>;

/// Terms of the series of the inverse Jacobian: at the largest angle, pi, the terms fall by 4 from
/// one to the next, so that 26 of them leave 1e-16.
const TERMS: usize = 26;

impl Similarity {
    /// From its parts.
    pub fn new(pose: Pose, scale: f64) -> Self {
        Self { pose, scale }
    }

    /// The identity.
    pub fn identity() -> Self {
        Self::new(Pose::identity(), 1.0)
    }

    /// `source_from_target`.
    pub fn inverse(&self) -> Self {
        let rotation = self.pose.rotation.inverse();
        let scale = 1.0 / self.scale;
        let translation = -(rotation * self.pose.translation) * scale;
        Self::new(Pose::new(rotation, translation), scale)
    }

    /// A point of the source frame, in the target frame.
    pub fn transform(&self, point_in_source: &Vector3<f64>) -> Vector3<f64> {
        self.pose.rotation * point_in_source * self.scale + self.pose.translation
    }

    /// The similarity of a tangent vector kept for a unit of time.
    pub fn exp(tangent: &Vector7) -> Self {
        let (omega, v, sigma) = parts(tangent);
        let pose = Pose::new(so3::exp(&omega), travel(&omega, sigma) * v);
        Self::new(pose, sigma.exp())
    }

    /// The tangent vector of rotation angle at most pi.
    pub fn log(&self) -> Vector7 {
        let (omega, sigma) = (so3::log(&self.pose.rotation), self.scale.ln());
        let travel = travel(&omega, sigma);
        let v = match travel.try_inverse() {
            Some(inverse) => inverse * self.pose.translation,
            None => Vector3::repeat(f64::NAN),
        };
        join(&omega, &v, sigma)
    }

    /// `T exp(x) T^-1 = exp(adjoint(T) x)`.
    pub fn adjoint(&self) -> Matrix7 {
        let (rotation, t) = (so3::adjoint(&self.pose.rotation), self.pose.translation);
        let mut m = Matrix7::zeros();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
        m.fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&(so3::hat(&t) * rotation));
        m.fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&(rotation * self.scale));
        m.fixed_view_mut::<3, 1>(3, 6).copy_from(&-t);
        m[(6, 6)] = 1.0;
        m
    }

    /// `log(T exp(d)) = log(T) + right_jacobian_inverse(log(T)) d` to first order: the series
    /// `sum B_n (-ad)^n / n!` of Bernoulli numbers.
    pub fn right_jacobian_inverse(tangent: &Vector7) -> Matrix7 {
        let ad = small_adjoint(tangent);
        let square = ad * ad;
        let mut power = square;
        let mut sum = Matrix7::identity() + ad * 0.5;
        for n in 1..=TERMS {
            // B_2n / (2n)! = 2 (-1)^(n+1) zeta(2n) / (2 pi)^(2n)
            let sign = if n % 2 == 1 { 2.0 } else { -2.0 };
            let exponent = 2 * n as i32;
            sum += power * (sign * zeta(exponent) / std::f64::consts::TAU.powi(exponent));
            power *= square;
        }
        sum
    }
}

/// `a_from_b * b_from_c = a_from_c`.
impl std::ops::Mul for Similarity {
    type Output = Similarity;

    fn mul(self, other: Similarity) -> Similarity {
        let rotation = (self.pose * other.pose).rotation;
        let translation = self.transform(&other.pose.translation);
        Similarity::new(Pose::new(rotation, translation), self.scale * other.scale)
    }
}

fn parts(tangent: &Vector7) -> (Vector3<f64>, Vector3<f64>, f64) {
    (
        tangent.fixed_rows::<3>(0).into_owned(),
        tangent.fixed_rows::<3>(3).into_owned(),
        tangent[6],
    )
}

fn join(omega: &Vector3<f64>, v: &Vector3<f64>, sigma: f64) -> Vector7 {
    Vector7::from_column_slice(&[omega.x, omega.y, omega.z, v.x, v.y, v.z, sigma])
}

/// The derivative of the adjoint at the identity.
fn small_adjoint(tangent: &Vector7) -> Matrix7 {
    let (omega, v, sigma) = parts(tangent);
    let mut m = Matrix7::zeros();
    let turn = so3::hat(&omega);
    m.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
    m.fixed_view_mut::<3, 3>(3, 0).copy_from(&so3::hat(&v));
    m.fixed_view_mut::<3, 3>(3, 3)
        .copy_from(&(turn + Matrix3::identity() * sigma));
    m.fixed_view_mut::<3, 1>(3, 6).copy_from(&-v);
    m
}

/// Riemann's zeta of an even number.
fn zeta(s: i32) -> f64 {
    let pi2 = std::f64::consts::PI.powi(2);
    match s {
        2 => pi2 / 6.0,
        4 => pi2 * pi2 / 90.0,
        // what is left out is below 40^(1 - s) / (s - 1) < 1e-8; with the coefficient below 1e-12
        _ => (1..40).rev().map(|k| f64::from(k).powi(-s)).sum(),
    }
}

/// The integral of `exp(s (sigma + [omega]_))` over s from 0 to 1: how the translation follows v.
fn travel(omega: &Vector3<f64>, sigma: f64) -> Matrix3<f64> {
    let hat = so3::hat(omega);
    let angle = omega.norm();
    // A = sigma I + [omega]; the integral is sum A^k / (k+1)!; halved until the series is short,
    // then doubled: F(2A) = F(A) (I + exp(A)) / 2
    let size = sigma.abs() + angle;
    let halvings = if size > 0.5 {
        (size / 0.5).log2().ceil() as i32
    } else {
        0
    };
    let a = (hat + Matrix3::identity() * sigma) * 0.5_f64.powi(halvings);
    let (mut term, mut f) = (Matrix3::identity(), Matrix3::identity());
    for k in 1..16 {
        term = term * a / f64::from(k + 1);
        f += term;
    }
    let mut scale = 0.5_f64.powi(halvings);
    for _ in 0..halvings {
        let turn = so3::adjoint(&so3::exp(&(omega * scale))) * (sigma * scale).exp();
        f = f * (Matrix3::identity() + turn) * 0.5;
        scale *= 2.0;
    }
    f
}

#[cfg(test)]
mod tests {
    use super::*;

    // rounding of a few dozen products
    const ROUNDING: f64 = 1e-12;
    // central differences with a step of 1e-6
    const DIFFERENCE: f64 = 1e-8;

    fn samples() -> Vec<Vector7> {
        let base = Vector7::from_column_slice(&[0.4, -0.7, 1.1, 2.0, -1.0, 0.3, 0.25]);
        let mut all: Vec<Vector7> = [0.0, 1e-9, 0.1, 1.0, 2.0]
            .iter()
            .map(|k| base * *k)
            .collect();
        all.push(Vector7::from_column_slice(&[
            0.0, 0.0, 0.0, 1.0, 2.0, 3.0, -0.8,
        ]));
        all.push(Vector7::from_column_slice(&[
            0.3, 0.2, 0.1, 1.0, 2.0, 3.0, 0.0,
        ]));
        all
    }

    #[test]
    fn log_of_exp_is_the_tangent() {
        for x in samples() {
            assert!((Similarity::exp(&x).log() - x).norm() < ROUNDING * (1.0 + x.norm()));
        }
    }

    #[test]
    fn exp_is_a_one_parameter_group_and_rigid_without_scale() {
        for x in samples() {
            let (half, whole) = (Similarity::exp(&(x * 0.5)), Similarity::exp(&x));
            let p = Vector3::new(0.3, -1.0, 2.0);
            let twice = (half * half).transform(&p);
            assert!((twice - whole.transform(&p)).norm() < ROUNDING * 10.0);
        }
        let x = samples()[6];
        let twist = x.fixed_rows::<6>(0).into_owned();
        let rigid = sphereflow_sphere::lie::se3::exp(&twist);
        let (distance, angle) = Similarity::exp(&x).pose.distance_and_angle(&rigid);
        assert!(distance < ROUNDING && angle < 1e-7);
    }

    #[test]
    fn adjoint_moves_tangents() {
        let t = Similarity::exp(&samples()[3]);
        let x = samples()[2];
        let moved = (t * Similarity::exp(&x) * t.inverse()).log();
        assert!((moved - t.adjoint() * x).norm() < ROUNDING * 10.0);
    }

    #[test]
    fn right_jacobian_inverse_equals_differences() {
        for x in samples() {
            let (here, analytic) = (Similarity::exp(&x), Similarity::right_jacobian_inverse(&x));
            for k in 0..7 {
                let d = Vector7::ith(k, 1e-6);
                let moved = |d: Vector7| (here * Similarity::exp(&d)).log();
                let numeric = (moved(d) - moved(-d)) / 2e-6;
                let error = (numeric - analytic.column(k)).norm();
                assert!(error < DIFFERENCE * (1.0 + x.norm()), "{x} {k} {error:e}");
            }
        }
    }
}
