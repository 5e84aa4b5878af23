//! What the plane's Laplacian misses of the sphere's.

/// Thesis: Figure 2.1. The relative difference `|Delta_E - Delta_R| / |Delta_E|`, in percent, of
/// the Euclidean and the Riemannian Laplacian of the inverse range 1/D of a wall orthogonal to the
/// optical axis, at pinhole coordinates `(z1, z2)` (tangents of the angles to the axis).
///
/// With r^2 = z1^2 + z2^2, `Delta_E = (r^2 - 2) / (1 + r^2)^(5/2)` and
/// `Delta_R = -2 / (1 + r^2)^(1/2)`; infinite where `Delta_E` vanishes (r^2 = 2).
pub fn laplacian_discrepancy(z1: f64, z2: f64) -> f64 {
    let r2 = z1 * z1 + z2 * z2;
    100.0 * (r2 * (5.0 + 2.0 * r2) / (r2 - 2.0)).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The figures below are given to the last digit printed.
    const PRINTED: f64 = 0.5;

    fn half_fields(across: f64, down: f64) -> (f64, f64) {
        let tan = |degrees: f64| (0.5 * degrees).to_radians().tan();
        (tan(across), tan(down))
    }

    fn median(z1: f64, z2: f64) -> f64 {
        let steps = 200;
        let at = |i: i32, z: f64| z * (f64::from(i) + 0.5) / f64::from(steps);
        let pairs = (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j)));
        let mut all: Vec<_> = pairs
            .map(|(i, j)| laplacian_discrepancy(at(i, z1), at(j, z2)))
            .collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    }

    #[test]
    fn discrepancy_of_60_by_50_degrees_reaches_200_percent_in_the_corner() {
        // Thesis: Figure 2.1: "reaches 200 % in the corners".
        let (z1, z2) = half_fields(60.0, 50.0);
        let expected = [(z1, z2, 231.9), (z1, 0.0, 113.0), (0.0, z2, 66.0)];
        for (z1, z2, percent) in expected {
            assert!((laplacian_discrepancy(z1, z2) - percent).abs() < PRINTED);
        }
        assert!((median(z1, z2) - 50.0).abs() < PRINTED);
    }

    #[test]
    fn discrepancy_of_50_by_40_degrees_reaches_120_percent_in_the_corner() {
        // Thesis: Figure 2.1, at the field of view of chapter 4.
        let (z1, z2) = half_fields(50.0, 40.0);
        assert!((laplacian_discrepancy(z1, z2) - 121.0).abs() < PRINTED);
        assert!((median(z1, z2) - 30.0).abs() < PRINTED);
    }

    #[test]
    fn discrepancy_vanishes_on_the_axis_and_is_infinite_where_the_plane_has_no_laplacian() {
        assert_eq!(laplacian_discrepancy(0.0, 0.0), 0.0);
        assert!(laplacian_discrepancy(1.0, 1.0).is_infinite());
    }
}
