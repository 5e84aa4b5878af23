//! The covariance that the filter tells, against its errors: many recordings with biases drawn from
//! what the filter believes at the start.

use super::*;
use nalgebra::SVector;

const RUNS: u64 = 40;

/// How the body moves.
#[derive(Clone, Copy, PartialEq)]
enum Moves {
    Touring,
    AtRest,
    /// A tour whose last ten seconds nothing sees.
    Blind,
}

/// Mean over the runs of the squared error in units of the covariance, per freedom: of all fifteen
/// states, and of the accelerometer's bias along gravity.
fn normalised(moves: Moves, steps: usize) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for seed in 0..RUNS {
        let mut tour = Tour::new(500 + seed);
        let config = NavigationConfig {
            gyro_sigma_rad_s: GYRO_SIGMA,
            accel_sigma_m_s2: ACCEL_SIGMA,
            // The biases of these recordings are constant.
            gyro_walk: 1e-8,
            accel_walk: 1e-7,
            ..NavigationConfig::default()
        };
        let bias = [
            tour.normal(config.gyro_bias_sigma),
            tour.normal(config.accel_bias_sigma),
        ];
        if moves == Moves::AtRest {
            tour.motion = Motion::still();
        }
        let mut filter = NavigationFilter::new(config).unwrap();
        for step in 0..steps {
            let mut sample = tour.imu(step);
            sample.gyro_rad_s += bias[0] - GYRO_BIAS;
            sample.accel_m_s2 += bias[1] - ACCEL_BIAS;
            filter.push_imu(&sample);
            if step % 7 == 0 && (moves != Moves::Blind || step + 2000 < steps) {
                let pose = tour.pose(step);
                filter.push_pose(sample.stamp, &pose, &pose_covariance());
            }
        }
        let state = filter.state(Tour::stamp(steps - 1)).unwrap();
        let mut e = SVector::<f64, 15>::zeros();
        e.fixed_rows_mut::<9>(0)
            .copy_from(&error(&tour, steps - 1, &state));
        e.fixed_rows_mut::<3>(9)
            .copy_from(&(bias[0] - state.nominal.gyro_bias_rad_s));
        e.fixed_rows_mut::<3>(12)
            .copy_from(&(bias[1] - state.nominal.accel_bias_m_s2));
        let p = state.covariance;
        sums[0] += e.dot(&(p.try_inverse().unwrap() * e)) / 15.0;
        let down = tour.truth(steps - 1).rotation.inverse() * DOWN.normalize();
        let own = p.fixed_view::<3, 3>(12, 12).into_owned();
        let off: Vector3<f64> = bias[1] - state.nominal.accel_bias_m_s2;
        sums[1] += off.dot(&down).powi(2) / down.dot(&(own * down));
    }
    sums.map(|sum| sum / RUNS as f64)
}

/// 95 % of a chi square with 15 * 40 degrees of freedom, per degree, lies within 1 +- this.
const BOUND: f64 = 0.113;
/// The same of 40 degrees, such that all of three lie within with 95 %: the three share their biases.
const BOUNDS_OF_ONE: std::ops::Range<f64> = 0.52..1.65;

fn check(moves: Moves, steps: usize, name: &str) {
    let [all, vertical] = normalised(moves, steps);
    println!("{name}: {all:.3} per freedom, {vertical:.3} of the vertical bias");
    assert!((all - 1.0).abs() < BOUND, "{name}: {all}");
    assert!(BOUNDS_OF_ONE.contains(&vertical), "{name}: {vertical}");
}

#[test]
fn covariance_on_a_tour_is_that_of_the_errors() {
    check(Moves::Touring, 4000, "tour");
}

#[test]
fn covariance_at_rest_is_that_of_the_errors() {
    check(Moves::AtRest, 4000, "at rest");
}

#[test]
fn covariance_without_vision_is_that_of_the_errors() {
    check(Moves::Blind, 4000, "ten seconds without vision");
}
