//! The update of a Kalman filter, once for all filters: gated, in Joseph's form, positive definite.

use nalgebra::{SMatrix, SVector};

/// Each variance grows by this share at a prediction, and no measurement is taken for more exact than
/// this share of what was known before: rounding (1e-16 times the terms of a sum) then never decides
/// over a sign. Lower: covariances lose their definiteness after hours without a measurement;
/// higher: knowledge fades, at 200 Hz by 1e-12 * 7e5 = 7e-7 an hour.
const RELATIVE_FLOOR: f64 = 1e-12;

/// A measurement of `M` numbers with Jacobian `h` of the `N` errors: the step of the errors, and the
/// covariance after it in Joseph's form.
///
/// # Errors
/// The squared distance of the residual in units of its covariance where it lies beyond `gate`, or
/// infinity where the covariances cannot be inverted; the covariance then stays as it was.
pub fn update<const N: usize, const M: usize>(
    covariance: &mut SMatrix<f64, N, N>,
    h: &SMatrix<f64, M, N>,
    residual: &SVector<f64, M>,
    noise: &SMatrix<f64, M, M>,
    gate: f64,
) -> Result<SVector<f64, N>, f64> {
    let cross = *covariance * h.transpose();
    let predicted = h * cross;
    let mut noise = *noise;
    for i in 0..M {
        noise[(i, i)] += RELATIVE_FLOOR * predicted[(i, i)].abs();
    }
    let Some(inverse) = (predicted + noise).try_inverse() else {
        return Err(f64::INFINITY);
    };
    let distance = residual.dot(&(inverse * residual));
    if distance > gate || distance.is_nan() || distance < 0.0 {
        return Err(if distance > gate {
            distance
        } else {
            f64::INFINITY
        });
    }
    let gain = cross * inverse;
    let left = SMatrix::<f64, N, N>::identity() - gain * h;
    let kept = left * *covariance * left.transpose() + gain * noise * gain.transpose();
    let step = gain * residual;
    if !(kept.iter().chain(&step).all(|v| v.is_finite())) {
        return Err(f64::INFINITY);
    }
    *covariance = kept;
    symmetrise(covariance);
    Ok(step)
}

/// After a prediction: symmetric, and each variance a trifle larger.
pub fn settle<const N: usize>(covariance: &mut SMatrix<f64, N, N>) {
    symmetrise(covariance);
    for i in 0..N {
        covariance[(i, i)] *= 1.0 + RELATIVE_FLOOR;
    }
}

/// No variance above its limit: rows and columns are scaled together, so that correlations stay.
pub fn bounded<const N: usize>(covariance: &mut SMatrix<f64, N, N>, largest: &SVector<f64, N>) {
    for i in 0..N {
        let own = covariance[(i, i)];
        if own > largest[i] {
            let factor = (largest[i] / own).sqrt();
            covariance.row_mut(i).scale_mut(factor);
            covariance.column_mut(i).scale_mut(factor);
        }
    }
}

fn symmetrise<const N: usize>(covariance: &mut SMatrix<f64, N, N>) {
    for i in 0..N {
        for j in 0..i {
            let mean = 0.5 * (covariance[(i, j)] + covariance[(j, i)]);
            covariance[(i, j)] = mean;
            covariance[(j, i)] = mean;
        }
    }
}

/// For tests: true where the covariance is finite and positive definite, as correlations, so that
/// units do not matter.
#[cfg(test)]
pub fn is_sound<const N: usize>(covariance: &SMatrix<f64, N, N>) -> bool {
    let spread: Vec<f64> = (0..N).map(|i| covariance[(i, i)].sqrt()).collect();
    let positive = spread.iter().all(|s| s.is_finite() && *s > 0.0);
    let correlation =
        SMatrix::<f64, N, N>::from_fn(|i, j| covariance[(i, j)] / (spread[i] * spread[j]));
    let symmetric = (covariance - covariance.transpose()).amax() <= 1e-9 * covariance.amax();
    positive && symmetric && correlation.cholesky().is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix1, Matrix1x2, Matrix2, Vector1, Vector2};

    #[test]
    fn update_of_two_states_is_that_of_the_textbook() {
        let mut p = Matrix2::new(4.0, 1.0, 1.0, 2.0);
        let h = Matrix1x2::new(1.0, 0.0);
        let step = update(&mut p, &h, &Vector1::new(2.0), &Matrix1::new(1.0), 30.0).unwrap();
        assert!((step - Vector2::new(1.6, 0.4)).norm() < 1e-9);
        assert!((p - Matrix2::new(0.8, 0.2, 0.2, 1.8)).norm() < 1e-9);
    }

    #[test]
    fn update_beyond_the_gate_or_without_sense_changes_nothing() {
        let before = Matrix2::identity();
        for (residual, noise) in [(100.0, 1.0), (f64::NAN, 1.0), (1e300, 1e-300), (1.0, -5.0)] {
            let mut p = before;
            let h = Matrix1x2::new(1.0, 0.0);
            let found = update(
                &mut p,
                &h,
                &Vector1::new(residual),
                &Matrix1::new(noise),
                30.0,
            );
            assert!(
                found.is_err() && p == before,
                "{residual} {noise}: {found:?}"
            );
        }
    }

    #[test]
    fn covariance_after_sharp_updates_of_a_vast_one_stays_positive_definite() {
        let mut p = Matrix2::new(1e18, 9e17, 9e17, 1e18);
        for h in [
            Matrix1x2::new(1.0, 0.0),
            Matrix1x2::new(1.0, 1.0),
            Matrix1x2::new(0.0, 1.0),
        ] {
            update(&mut p, &h, &Vector1::new(1.0), &Matrix1::new(1e-18), 30.0).unwrap();
            assert!(is_sound(&p), "{p}");
        }
    }
}
