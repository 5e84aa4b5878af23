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
    /// The low-passed rotation (column after column) and the horizontal bias seen through it.
    low_pass: LowPass<11>,
}

/// The rotation and the horizontal bias seen through it, both as the accelerometer's low-pass has them.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    rotation: Matrix3<f64>,
    bias: [f64; 2],
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
        let weights = Vector3::repeat(noise.rest);
        self.update(&error, &Matrix3::identity(), &weights, clip);
    }

    /// In motion: what [`BiasFilter::follow`] said of this step, and the rate at which the
    /// inclination was corrected (earth frame, horizontal, rad/s).
    #[inline]
    pub fn in_motion(&mut self, seen: &Seen, corrected: [f64; 2], clip: f64, noise: &BiasNoise) {
        let now = seen.rotation * self.bias;
        let error = Vector3::new(
            corrected[0] + seen.bias[0] - now.x,
            corrected[1] + seen.bias[1] - now.y,
            -now.z,
        );
        let weights = Vector3::new(noise.motion, noise.motion, noise.motion / VERTICAL);
        self.update(&error, &seen.rotation, &weights, clip);
    }

    /// The low-passes of every step, whichever update follows.
    #[inline]
    pub fn follow(&mut self, r: &Matrix3<f64>, decay: &Decay) -> Seen {
        let seen = r * self.bias;
        let v = self.low_pass.step(
            &[
                r.m11, r.m21, r.m31, r.m12, r.m22, r.m32, r.m13, r.m23, r.m33, seen.x, seen.y,
            ],
            decay,
        );
        Seen {
            rotation: Matrix3::from_column_slice(&v[..9]),
            bias: [v[9], v[10]],
        }
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
        let mut innovation = symmetric(rotation, &cross);
        innovation.m11 += weights.x;
        innovation.m22 += weights.y;
        innovation.m33 += weights.z;
        let Some(inverse) = inverse(&innovation) else {
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
    let xx = a.m11 * b.m11 + a.m12 * b.m21 + a.m13 * b.m31;
    let xy = a.m11 * b.m12 + a.m12 * b.m22 + a.m13 * b.m32;
    let xz = a.m11 * b.m13 + a.m12 * b.m23 + a.m13 * b.m33;
    let yy = a.m21 * b.m12 + a.m22 * b.m22 + a.m23 * b.m32;
    let yz = a.m21 * b.m13 + a.m22 * b.m23 + a.m23 * b.m33;
    let zz = a.m31 * b.m13 + a.m32 * b.m23 + a.m33 * b.m33;
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Inverse of a symmetric matrix by its cofactors.
#[inline]
fn inverse(m: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let (a, b, c, d, e, f) = (m.m11, m.m12, m.m13, m.m22, m.m23, m.m33);
    let (aa, ab, ac) = (d * f - e * e, c * e - b * f, b * e - c * d);
    let determinant = a * aa + b * ab + c * ac;
    if determinant <= 0.0 || determinant.is_nan() {
        return None;
    }
    let scale = 1.0 / determinant;
    let (bb, bc, cc) = (a * f - c * c, b * c - a * e, a * d - b * b);
    Some(Matrix3::new(aa, ab, ac, ab, bb, bc, ac, bc, cc) * scale)
}
