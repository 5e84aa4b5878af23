//! Whether an image shows anything that could be seen to move.

use sphereflow_core::Plane;

/// True where all known pixels are the same: black, saturated, or none known. What moves there cannot be
/// told, whatever a prior makes of it.
pub fn is_blank(image: &Plane<f32>) -> bool {
    let mut known = image.data().iter().filter(|value| value.is_finite());
    let Some(first) = known.next() else {
        return true;
    };
    known.all(|value| value == first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blank_is_one_brightness_or_none_known() {
        let mut image = Plane::filled(3, 2, 7.0);
        assert!(is_blank(&image));
        assert!(is_blank(&Plane::filled(3, 2, f32::NAN)));
        image[(1, 1)] = f32::NAN;
        assert!(is_blank(&image));
        image[(2, 1)] = 7.5;
        assert!(!is_blank(&image));
    }
}
