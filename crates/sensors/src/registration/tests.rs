//! Registration against a polynomial in floating point, and the parallax of two cameras.

use super::*;

fn plane_of(raw: u16) -> Plane<u16> {
    Plane::filled(640, 480, raw)
}

fn registration(parameters: &RegistrationParameters) -> Registration {
    Registration::new(640, 480, parameters, &DisparityModel::TYPICAL, 0).unwrap()
}

/// Numbers of the size that devices tell: some pixels of offset, a few thousandths of scale.
fn parameters() -> RegistrationParameters {
    let mut values = [0; COEFFICIENTS];
    values[5] = -3000; // about -11.7 pixels at the first column
    values[17] = 200; // by column
    values[19] = -40; // by row
    values[10] = 1500;
    values[18] = 30;
    values[20] = 150;
    values[21] = 2;
    RegistrationParameters::from_values(&values)
}

#[test]
fn registration_without_polynomial_is_the_parallax() {
    let registered = registration(&RegistrationParameters::default());
    let model = DisparityModel::TYPICAL;
    for raw in [500, 700, 800, 950] {
        let depth = model.depth_m(raw).unwrap();
        let mut image = plane_of(NO_READING);
        image.data_mut()[240 * 640 + 320] = raw;
        let out = registered.apply(&image).unwrap();
        let known: Vec<usize> = (0..640 * 480)
            .filter(|i| !out.metres().data()[*i].is_nan())
            .collect();
        // f (1/Z - 1/d) b with b = 2.4 cm and f = 575.8 px, to a pixel of rounding
        let expected = 321.0 + 575.8 * 0.024 * (1.0 / 1.2 - 1.0 / depth);
        assert_eq!(known.len(), 1);
        assert_eq!(known[0] / 640, 241);
        assert!(
            ((known[0] % 640) as f64 - expected).abs() <= 1.0,
            "{raw}: {known:?} {expected}"
        );
    }
}

#[test]
fn registration_keeps_the_nearer_of_two() {
    let mut image = plane_of(NO_READING);
    let registered = registration(&RegistrationParameters::default());
    for x in 300..340 {
        image.data_mut()[240 * 640 + x] = if x % 2 == 0 { 600 } else { 900 };
    }
    let out = registered.apply(&image).unwrap();
    let near = DisparityModel::TYPICAL.depth_m(600).unwrap() as f32;
    let nears = out.metres().data().iter().filter(|z| **z == near).count();
    assert_eq!(nears, 20);
}

#[test]
fn registration_table_is_the_polynomial_within_a_hundredth_of_a_pixel() {
    let tables = registration(&parameters());
    // the differences in floating point, without the fixed point's truncations
    for (x, y) in [(100, 100), (320, 240), (600, 400)] {
        let (column, _) = tables.places[y * 640 + x];
        let (x, y) = (x as f64, y as f64);
        let value = -3000.0 * 512.0
            + (200.0 * x - 40.0 * (y + 1.0)) * 256.0 / 64.0
            + 2.0 * 256.0 / 256.0 * x * (x - 1.0) / 2.0 / 64.0;
        let expected = (x + 1.0 + value / f64::from(1 << 17)) * 256.0;
        assert!(
            (f64::from(column) - expected).abs() < 2.56,
            "{column} {expected}"
        );
    }
}

#[test]
fn registration_of_another_size_is_refused() {
    let registered = registration(&parameters());
    assert!(registered.apply(&Plane::filled(320, 240, 0)).is_none());
}
