//! Order statistics for robust scales: median and median absolute deviation.

use std::cmp::Ordering;

/// Standard deviation of normally distributed values over their median absolute deviation:
/// `1 / Phi^-1(3/4)` to four decimals.
pub const SIGMA_PER_MAD: f64 = 1.4826;

/// A number with a total order: `f32` or `f64`.
pub trait Ordered: Copy {
    /// IEEE 754 total order, so that NaN has a place too (after the numbers).
    fn order(&self, other: &Self) -> Ordering;
}

impl Ordered for f32 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

impl Ordered for f64 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

/// The value at place `len / 2` of the sorted values (the upper of two middle ones); reorders them.
/// `None` where there are none.
pub fn median_mut<T: Ordered>(values: &mut [T]) -> Option<T> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, T::order).1)
}

/// Standard deviation that normally distributed residuals about zero with this median magnitude
/// have: [`SIGMA_PER_MAD`] times the median of `|r|`. Replaces the values by their magnitudes and
/// reorders them; `None` where there are none.
pub fn mad_sigma_mut(residuals: &mut [f64]) -> Option<f64> {
    for value in residuals.iter_mut() {
        *value = value.abs();
    }
    median_mut(residuals).map(|median| SIGMA_PER_MAD * median)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_of_odd_and_even_counts_is_the_upper_middle() {
        assert_eq!(median_mut(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median_mut(&mut [4.0_f32, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(median_mut::<f64>(&mut []), None);
    }

    #[test]
    fn mad_sigma_of_a_uniform_spread_ignores_a_third_of_outliers() {
        let mut residuals: Vec<f64> = (-300..=300).map(|i| f64::from(i) / 300.0).collect();
        let clean = mad_sigma_mut(&mut residuals.clone()).unwrap();
        residuals.extend([1e6; 300]);
        let dirty = mad_sigma_mut(&mut residuals).unwrap();
        // half of the magnitudes are below 0.5; a third of outliers moves that to 0.75
        assert!((clean - SIGMA_PER_MAD * 0.5).abs() < 0.01, "{clean}");
        assert!(dirty < 2.0 * clean, "{dirty}");
        assert_eq!(mad_sigma_mut(&mut []), None);
    }
}
