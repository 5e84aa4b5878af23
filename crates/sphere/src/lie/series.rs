//! The coefficients of the exponential and its derivatives, without cancellation from angle 0 on.

/// Below this angle the closed forms lose digits and the series, with [`TERMS`] terms, lose none.
const SMALL: f64 = 1.0;
/// At angle 1 the first term left out is below 1e-22.
const TERMS: u32 = 10;

/// `sum_k (-1)^k weight(k) s^k / (2 k + offset)!`
fn alternating(s: f64, offset: u32, weight: impl Fn(f64) -> f64) -> f64 {
    let mut term = 1.0 / (1..=offset).map(f64::from).product::<f64>();
    let mut sum = 0.0;
    for k in 0..TERMS {
        sum += weight(f64::from(k)) * term;
        let next = f64::from(2 * k + offset);
        term *= -s / ((next + 1.0) * (next + 2.0));
    }
    sum
}

/// sin(t) / t
pub(super) fn sinc(t: f64) -> f64 {
    if t < SMALL {
        alternating(t * t, 1, |_| 1.0)
    } else {
        t.sin() / t
    }
}

/// (1 - cos t) / t^2
pub(super) fn versine(t: f64) -> f64 {
    let half = sinc(0.5 * t);
    0.5 * half * half
}

/// (t - sin t) / t^3
pub(super) fn third(t: f64) -> f64 {
    if t < SMALL {
        alternating(t * t, 3, |_| 1.0)
    } else {
        (t - t.sin()) / (t * t * t)
    }
}

/// (t^2 / 2 + cos t - 1) / t^4
pub(super) fn fourth(t: f64) -> f64 {
    if t < SMALL {
        alternating(t * t, 4, |_| 1.0)
    } else {
        (0.5 * t * t + t.cos() - 1.0) / (t * t * t * t)
    }
}

/// (2 t - 3 sin t + t cos t) / (2 t^5)
pub(super) fn fifth(t: f64) -> f64 {
    if t < SMALL {
        alternating(t * t, 5, |k| k + 1.0)
    } else {
        (2.0 * t - 3.0 * t.sin() + t * t.cos()) / (2.0 * t * t * t * t * t)
    }
}

/// (1 - (t/2) cot(t/2)) / t^2; infinite at the full turn.
pub(super) fn inverse(t: f64) -> f64 {
    if t < SMALL {
        alternating(t * t, 4, |k| k + 1.0) / versine(t)
    } else {
        (1.0 - 0.5 * t / (0.5 * t).tan()) / (t * t)
    }
}
