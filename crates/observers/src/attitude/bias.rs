//! The gyro's bias as a Kalman filter of three constants: measured at rest by the gyro itself, in
//! motion by how the inclination had to be corrected.

use super::config::AttitudeConfig;
use super::low_pass::{Decay, LowPass};
use nalgebra::{Matrix3, Vector3};

/// Standard deviation whose square the bias wins back in the forgetting time: 0.1 deg/s.
const FORGOTTEN: f64 = 0.1 * std::f64::consts::PI / 180.0;
/// The vertical component is only kept from drifting in motion: its weight against the others.
const VERTICAL: f64 = 1e-4;

/// Estimates the bias.
#[derive(Clone, Debug)]
pub struct BiasFilter {
    bias: Vector3<f64>,
    covariance: Matrix3<f64>,
    start: f64,
    /// The low-passed rotation (row after row) and the horizontal bias seen through it.
    low_pass: LowPass<11>,
}

/// The noise of one step; depends on the step only.
#[derive(Clone, Copy, Debug)]
pub struct BiasNoise {
    grown: f64,
    motion: f64,
    rest: f64,
}

impl BiasNoise {
    /// Measurement variances for which the filter settles at the wanted standard deviations.
    pub fn new(config: &AttitudeConfig, dt_s: f64) -> Self {
        let grown = FORGOTTEN * FORGOTTEN * dt_s / config.bias_forgetting_s;
        let settled = |sigma: f64| sigma.powi(4) / grown + sigma * sigma;
        Self {
            grown,
            motion: settled(config.bias_sigma_motion_rad_s),
            rest: settled(config.bias_sigma_rest_rad_s),
        }
    }
}

impl BiasFilter {
    /// At zero.
    pub fn new(config: &AttitudeConfig) -> Self {
        let start = config.bias_sigma_start_rad_s * config.bias_sigma_start_rad_s;
        Self {
            bias: Vector3::zeros(),
            covariance: Matrix3::identity() * start,
            start,
            low_pass: LowPass::new(),
        }
    }

    /// The bias, rad/s.
    pub fn bias(&self) -> Vector3<f64> {
        self.bias
    }

    /// At rest the gyro's mean is the bias.
    pub fn at_rest(&mut self, mean_gyro: &Vector3<f64>, clip: f64, noise: &BiasNoise) {
        let error = mean_gyro - self.bias;
        self.update(
            &error,
            &Matrix3::identity(),
            &Vector3::repeat(noise.rest),
            clip,
        );
    }

    /// In motion: `earth_from_body`, and the rate at which the inclination was corrected (earth
    /// frame, horizontal, rad/s), both of this step.
    pub fn in_motion(&mut self, corrected: [f64; 2], clip: f64, noise: &BiasNoise) {
        let v = self.low_pass.value();
        let rotation = Matrix3::from_row_slice(&v[..9]);
        let seen = rotation * self.bias;
        let error = Vector3::new(
            corrected[0] + v[9] - seen.x,
            corrected[1] + v[10] - seen.y,
            -seen.z,
        );
        let weights = Vector3::new(noise.motion, noise.motion, noise.motion / VERTICAL);
        self.update(&error, &rotation, &weights, clip);
    }

    /// The low-passes of every step, whichever update follows.
    #[inline]
    pub fn follow(&mut self, rotation: &Matrix3<f64>, decay: &Decay) {
        let seen = rotation * self.bias;
        let r = rotation;
        let input = [
            r[(0, 0)],
            r[(0, 1)],
            r[(0, 2)],
            r[(1, 0)],
            r[(1, 1)],
            r[(1, 2)],
            r[(2, 0)],
            r[(2, 1)],
            r[(2, 2)],
            seen.x,
            seen.y,
        ];
        self.low_pass.step(&input, decay);
    }

    /// Forget a little: called once a step.
    #[inline]
    pub fn grow(&mut self, noise: &BiasNoise) {
        for i in 0..3 {
            if self.covariance[(i, i)] < self.start {
                self.covariance[(i, i)] += noise.grown;
            }
        }
    }

    /// Both the innovation's and the bias's covariance are symmetric: half of each is computed.
    #[inline]
    fn update(
        &mut self,
        error: &Vector3<f64>,
        rotation: &Matrix3<f64>,
        weights: &Vector3<f64>,
        clip: f64,
    ) {
        let error = error.map(|e| e.clamp(-clip, clip));
        let cross = self.covariance * rotation.transpose();
        let innovation = symmetric(rotation, &cross);
        let Some(inverse) = inverse(&(innovation + Matrix3::from_diagonal(weights))) else {
            return;
        };
        let gain = cross * inverse;
        self.bias = (self.bias + gain * error).map(|b| b.clamp(-clip, clip));
        self.covariance -= symmetric(&gain, &cross.transpose());
    }
}

/// `a b` where that is known to be symmetric.
#[inline]
fn symmetric(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    let part =
        |i: usize, j: usize| a[(i, 0)] * b[(0, j)] + a[(i, 1)] * b[(1, j)] + a[(i, 2)] * b[(2, j)];
    let (xy, xz, yz) = (part(0, 1), part(0, 2), part(1, 2));
    Matrix3::new(part(0, 0), xy, xz, xy, part(1, 1), yz, xz, yz, part(2, 2))
}

/// Inverse of a symmetric matrix by its cofactors.
#[inline]
fn inverse(m: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let (a, b, c) = (m[(0, 0)], m[(0, 1)], m[(0, 2)]);
    let (d, e, f) = (m[(1, 1)], m[(1, 2)], m[(2, 2)]);
    let (aa, ab, ac) = (d * f - e * e, c * e - b * f, b * e - c * d);
    let determinant = a * aa + b * ab + c * ac;
    if determinant <= 0.0 || determinant.is_nan() {
        return None;
    }
    let scale = 1.0 / determinant;
    let (bb, bc, cc) = (a * f - c * c, b * c - a * e, a * d - b * b);
    Some(Matrix3::new(aa, ab, ac, ab, bb, bc, ac, bc, cc) * scale)
}
