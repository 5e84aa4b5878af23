//! Frames with flaws of any size: state and covariance stay finite, the covariance positive definite.

use super::*;
use crate::flaws::Flaws;
use crate::kalman::is_sound;

const FRAMES: usize = 3000;

/// A small camera that sways before a wall.
fn frame(
    grid: &SphereGrid,
    x_m: f64,
    z_m: f64,
    noise: &mut impl FnMut() -> f64,
) -> [Plane<f32>; 2] {
    let (w, h) = (grid.width(), grid.height());
    let range = Plane::from_fn(w, h, |x, y| {
        ((2.0 - z_m) / grid.ray(x, y).z + 0.002 * noise()) as f32
    });
    let grey = Plane::from_fn(w, h, |x, y| {
        let ray = grid.ray(x, y);
        let at = ray.x / ray.z * (2.0 - z_m) + x_m;
        (100.0 + 50.0 * (9.0 * at).sin() + noise()) as f32
    });
    [grey, range]
}

#[test]
fn frames_with_flaws_of_any_size_leave_a_positive_covariance() {
    let camera = camera(40, 30);
    let grid = SphereGrid::new(&camera).unwrap();
    for method in [
        BiasMethod::Information,
        BiasMethod::Normalised,
        BiasMethod::Observer,
    ] {
        let config = VelocityBiasConfig {
            method,
            ..VelocityBiasConfig::default()
        };
        let mut estimator = VelocityBiasEstimator::new(&camera, config).unwrap();
        let mut flaws = Flaws::new(11, 0.03);
        let mut rng = ChaCha8Rng::seed_from_u64(12);
        let mut noise = || StandardNormal.sample(&mut rng);
        for i in 0..FRAMES {
            let t = i as f64 / 30.0;
            let [mut grey, mut range] = frame(&grid, 0.2 * t.sin(), 0.1 * t.cos(), &mut noise);
            for plane in [&mut grey, &mut range] {
                if flaws.strikes() {
                    let from = (i * 37) % 1000;
                    let bad = flaws.number() as f32;
                    plane.data_mut()[from..from + 200].fill(bad);
                }
            }
            let mut angular = Vector3::new(0.02, 0.0, -0.01);
            let mut linear = Vector3::new(0.2 * t.cos() + 0.1, 0.05, -0.1 * t.sin());
            flaws.vector(&mut angular);
            flaws.vector(&mut linear);
            let velocity = ImageVelocity {
                angular_rad_s: angular,
                linear_m_s: (!flaws.strikes()).then_some(linear),
            };
            let dt_s = flaws.step(1.0 / 30.0);
            let state = estimator
                .step(&grey, &RangeMap::new(range), &velocity, dt_s)
                .unwrap();
            let what = format!("{method:?}, frame {i}: {}", state.status);
            let sum = state.angular_rad_s.sum() + state.linear_m_s.unwrap_or_default().sum();
            assert!(sum.is_finite(), "{what}");
            assert!(
                state
                    .blind_directions
                    .iter()
                    .flatten()
                    .all(|v| v.is_finite()),
                "{what}"
            );
            if let Some(covariance) = &state.covariance {
                assert!(is_sound(covariance), "{what}: {covariance}");
            }
        }
        assert!(estimator.refused() > 20, "{}", estimator.refused());
    }
}
