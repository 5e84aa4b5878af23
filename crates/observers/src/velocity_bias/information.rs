//! Pose since a reference image and the biases, as one Gaussian: images correct the pose, and what
//! they correct it by, time after time, is the bias.
//!
//! It knows nothing of images: whoever aligns an image with its reference hands over normal
//! equations. As long as the reference stays, the errors of alignments do not add up: the biases are
//! as well known as the noise of the velocity readings allows. Order of twists [angular, linear].

use crate::kalman;
use nalgebra::{Matrix6, SMatrix, SVector, Vector6};
use sphereflow_core::Pose;
use sphereflow_sphere::lie::se3;

/// The normal equations of an alignment: `information xi = gradient` for the missing twist of the
/// pose, `pose exp(xi)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseInformation {
    /// `sum w s s'`.
    pub information: Matrix6<f64>,
    /// `-sum w s r`.
    pub gradient: Vector6<f64>,
}

/// What is known of sensors and start, standard deviations [angular, linear].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasPrior {
    /// Of the biases at the start, rad/s and m/s.
    pub start: [f64; 2],
    /// Of one velocity reading, rad/s and m/s.
    pub reading: [f64; 2],
    /// Time constant of forgetting, seconds.
    pub forget_s: f64,
}

/// Covariance of [pose error, bias error].
type Matrix12 = SMatrix<f64, 12, 12>;

/// The accumulated knowledge.
#[derive(Clone, Debug, PartialEq)]
pub struct BiasInformation {
    prior: BiasPrior,
    pose: Pose,
    bias: Vector6<f64>,
    covariance: Matrix12,
}

/// Without a measured linear velocity the camera's own takes the bias's place (with a reading of
/// zero), and changes by so much, m/s^2.
const UNKNOWN_ACCEL: f64 = 5.0;

/// Speed of what carries a camera where nothing measures it, m/s, standard deviation.
const UNKNOWN_SPEED: f64 = 30.0;
/// Eigenvalues of an alignment's information below this part of the largest are zero but for rounding.
const LEAST_EIGENVALUE: f64 = 1e-10;
/// No alignment is better than a micrometre or a microradian.
const MOST_INFORMATION: f64 = 1e12;
/// Where nothing aligns the pose is unknown within this, rad and m.
const LOST: [f64; 2] = [3.0, 1e3];

fn squares([a, v]: [f64; 2]) -> Matrix6<f64> {
    Matrix6::from_diagonal(&Vector6::new(a, a, a, v, v, v).map(|s| s * s))
}

impl BiasInformation {
    /// At the reference, with nothing known of the biases but their size.
    pub fn new(prior: BiasPrior) -> Self {
        let mut covariance = Matrix12::zeros();
        let mut corner = covariance.fixed_view_mut::<6, 6>(6, 6);
        corner.copy_from(&squares(prior.start));
        Self {
            prior,
            pose: Pose::identity(),
            bias: Vector6::zeros(),
            covariance,
        }
    }

    /// The pose, first reference from camera.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// The biases; the linear one is minus the velocity where none is measured.
    pub fn bias(&self) -> &Vector6<f64> {
        &self.bias
    }

    /// Covariance of the biases.
    pub fn covariance(&self) -> Matrix6<f64> {
        self.covariance.fixed_view::<6, 6>(6, 6).into_owned()
    }

    /// Covariance of the pose's twist.
    pub fn pose_covariance(&self) -> Matrix6<f64> {
        self.covariance.fixed_view::<6, 6>(0, 0).into_owned()
    }

    /// Forward by `dt_s` with the measured velocities; `linear` is false where none was measured.
    /// Thesis: eq. (5.1).
    pub fn predict(&mut self, measured: &Vector6<f64>, linear: bool, dt_s: f64) {
        self.forget(linear, dt_s);
        let step = (measured - self.bias) * dt_s;
        self.pose = self.pose * se3::exp(&step);
        // exp(xi) exp(step) = exp(step) exp(Ad^-1 xi); a bias too small turns too far.
        let carried = se3::adjoint(&se3::exp(&-step));
        let by_bias = se3::right_jacobian(&step) * -dt_s;
        let mut f = Matrix12::identity();
        f.fixed_view_mut::<6, 6>(0, 0).copy_from(&carried);
        f.fixed_view_mut::<6, 6>(0, 6).copy_from(&by_bias);
        self.covariance = f * self.covariance * f.transpose();
        let noise = by_bias * squares(self.prior.reading) * by_bias.transpose();
        let mut corner = self.covariance.fixed_view_mut::<6, 6>(0, 0);
        corner += noise;
        if !linear {
            for i in 9..12 {
                self.covariance[(i, i)] += (UNKNOWN_ACCEL * dt_s).powi(2);
            }
        }
        self.settle();
    }

    /// Finite and positive definite.
    fn settle(&mut self) {
        let [a, v] = self.prior.start;
        let speed = v.max(UNKNOWN_SPEED);
        let sigmas = [LOST[0], LOST[1], a, speed];
        let largest = SVector::<f64, 12>::from_fn(|i, _| sigmas[i / 3].powi(2));
        kalman::bounded(&mut self.covariance, &largest);
        kalman::settle(&mut self.covariance);
    }

    /// Old knowledge of the biases fades, but never below what was known at the start.
    fn forget(&mut self, linear: bool, dt_s: f64) {
        let grown = (dt_s / self.prior.forget_s).exp();
        let start = squares(self.prior.start);
        for i in 0..(if linear { 6 } else { 3 }) {
            let own = self.covariance[(6 + i, 6 + i)];
            let factor = grown.min(start[(i, i)] / own).max(1.0).sqrt();
            self.covariance.row_mut(6 + i).scale_mut(factor);
            self.covariance.column_mut(6 + i).scale_mut(factor);
        }
    }

    /// The step from `xi` towards the best pose of readings and images together, for an alignment
    /// at `pose exp(xi)` whose images are off by `noise` beyond what their residuals show.
    pub fn step_from(
        &self,
        xi: &Vector6<f64>,
        found: &PoseInformation,
        noise: &Matrix6<f64>,
    ) -> Option<Vector6<f64>> {
        // (P^-1 + A)^-1 (g - P^-1 xi), defined for every P and A
        let p = self.pose_covariance() + noise;
        let whole = Matrix6::identity() + p * found.information;
        whole.lu().solve(&(p * found.gradient - xi))
    }

    /// Take in an alignment at `pose exp(xi)`.
    ///
    /// # Errors
    /// How far its best pose lies from that of the readings, in units of both their covariances and of
    /// `noise`, squared, where that is beyond `gate`; infinity where it makes no sense.
    pub fn correct(
        &mut self,
        xi: &Vector6<f64>,
        found: &PoseInformation,
        noise: &Matrix6<f64>,
        gate: f64,
    ) -> Result<(), f64> {
        // Each eigenvector of the information measures one number of the pose's twist.
        let eigen = found.information.symmetric_eigen();
        let least = LEAST_EIGENVALUE * eigen.eigenvalues.max();
        let mut h = SMatrix::<f64, 6, 12>::zeros();
        let mut own = Matrix6::identity();
        let mut residual = *xi;
        for i in 0..6 {
            let (value, direction) = (eigen.eigenvalues[i], eigen.eigenvectors.column(i));
            residual[i] = 0.0;
            if value > least {
                h.fixed_view_mut::<1, 6>(i, 0)
                    .copy_from(&direction.transpose());
                own[(i, i)] = 1.0 / value.min(MOST_INFORMATION);
                residual[i] = direction.dot(xi) + direction.dot(&found.gradient) / value;
            }
        }
        let seen = h.fixed_view::<6, 6>(0, 0).into_owned();
        let whole = own + seen * noise * seen.transpose();
        let step = kalman::update(&mut self.covariance, &h, &residual, &whole, gate)?;
        self.pose = self.pose * se3::exp(&step.fixed_rows::<6>(0).into_owned());
        self.bias += step.fixed_rows::<6>(6);
        Ok(())
    }

    /// The present image becomes a reference: what is not known of the pose is once more unknown of
    /// all that is seen from there, and so is by how much the image's own stamp is off.
    pub fn add_reference(&mut self, noise: &Matrix6<f64>) {
        let own = self.pose_covariance() + noise;
        let mut corner = self.covariance.fixed_view_mut::<6, 6>(0, 0);
        corner += own;
    }

    /// The present image becomes the only reference: the pose is what it is by definition, but for
    /// the image's own stamp.
    pub fn restart(&mut self, noise: &Matrix6<f64>) {
        for i in 0..6 {
            self.covariance.row_mut(i).fill(0.0);
            self.covariance.column_mut(i).fill(0.0);
        }
        let mut corner = self.covariance.fixed_view_mut::<6, 6>(0, 0);
        corner += noise;
    }

    /// A linear velocity is measured for the first time: of its bias nothing is known.
    pub fn begin_linear(&mut self) {
        self.bias.fixed_rows_mut::<3>(3).fill(0.0);
        for i in 9..12 {
            self.covariance.row_mut(i).fill(0.0);
            self.covariance.column_mut(i).fill(0.0);
            self.covariance[(i, i)] = self.prior.start[1].powi(2);
        }
    }
}
