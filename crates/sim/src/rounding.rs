//! Rounding without the instruction that not every processor has: without it `round` is a call.

/// 1.5 * 2^23: added to a smaller number it leaves it rounded to even in the lowest bits.
const SHIFT: f32 = 12_582_912.0;

/// The nearest whole number, halves to even; beyond 4 million, where `f32` has no digits to spare,
/// one of the nearest.
#[inline]
pub(crate) fn nearest(value: f32) -> f32 {
    (value + SHIFT) - SHIFT
}

/// A grey level rounded and clamped to 0..=255.
#[inline]
pub(crate) fn byte(level: f32) -> u8 {
    (level.clamp(0.0, 255.0) + SHIFT).to_bits() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_that_of_the_standard_library() {
        for k in -3000..3000 {
            let value = k as f32 * 0.125;
            assert_eq!(nearest(value), value.round_ties_even(), "{value}");
            assert_eq!(byte(value), value.round_ties_even() as u8, "{value}");
        }
        assert!(nearest(f32::NAN).is_nan() && nearest(f32::INFINITY).is_infinite());
    }
}
