//! What the motion shows of the biases.
//!
//! Thesis: Proposition 7. Gravity and the accelerometer's bias are told apart unless the angular
//! velocity stays along one direction of the body that is orthogonal to the field. Thesis: eq. (7.2): the
//! blind error `e = da_b = dg` has `e x omega = 0` and `e . b = 0` at all times.

use nalgebra::{Matrix3, SymmetricEigen, UnitQuaternion, Vector3};
use sphereflow_sphere::lie::so3;

/// The quadratic form `int |e x omega|^2 + (e . b)^2 dt` of a direction e, gathered over a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Excitation {
    form: Matrix3<f64>,
}

/// A direction with less is blind: a turn at 0.2 rad/s about another axis for one second shows it.
const NEEDED: f64 = 0.04;

impl Excitation {
    /// A step of the motion: debiased rate, rad/s, and the field's unit vector where it is used.
    pub fn push(&mut self, omega: &Vector3<f64>, field: Option<&Vector3<f64>>, dt_s: f64) {
        self.form +=
            (Matrix3::identity() * omega.norm_squared() - omega * omega.transpose()) * dt_s;
        if let Some(field) = field {
            self.form += field * field.transpose() * dt_s;
        }
    }

    /// The directions of the body along which the accelerometer's bias cannot be told from gravity:
    /// orthonormal, none where all is well.
    pub fn blind_directions(&self) -> Vec<Vector3<f64>> {
        let eigen = SymmetricEigen::new(self.form);
        (0..3)
            .filter(|i| eigen.eigenvalues[*i] < NEEDED)
            .map(|i| eigen.eigenvectors.column(i).into_owned())
            .collect()
    }

    /// Number of blind directions, 0 to 3, without their vectors.
    pub fn blind_count(&self) -> usize {
        let eigenvalues = self.form.symmetric_eigenvalues();
        eigenvalues.iter().filter(|v| **v < NEEDED).count()
    }
}

/// Window over which the observer's turning counts as recent, seconds. Shorter: slow looking around is
/// not seen; longer: rest is called motion, and the gyro's drift a turn.
const WINDOW_S: f64 = 20.0;
/// The observer (7.4) tells a bias from gravity by how far the body turns, not by how fast: it needs a
/// mean square of the turn, rad^2, across each direction. With 0.04 (0.2 rad rms) it stands still for
/// two minutes within its noise, with 0.16 the error halves in a minute and a half. Lower: divergence
/// is called convergence; higher: slow convergence is called none.
const TURNED: f64 = 0.06;
/// What a unit field along a direction does there as fast as a turn of so many rad^2.
const BY_FIELD: f64 = 5.0;
/// The error falls as exp(-0.03 times this integral), measured with the default gains on hand-held
/// motions of 0.4 to 0.9 rad: by a factor of eight within 70 rad^2 s.
const SETTLED: f64 = 70.0;

/// How far the observer (7.4) can have come, which has no covariance to say so.
///
/// Thesis: Proposition 7, with a measure: a body error `e` of the accelerometer's bias is told from one
/// of gravity by how much `R(t) e` varies.
#[derive(Clone, Copy, Debug)]
pub struct ObserverProgress {
    turned: UnitQuaternion<f64>,
    mean: Matrix3<f64>,
    weight: f64,
    recent_field: Matrix3<f64>,
    gathered: Matrix3<f64>,
}

impl Default for ObserverProgress {
    fn default() -> Self {
        Self {
            turned: UnitQuaternion::identity(),
            mean: Matrix3::identity(),
            weight: 0.0,
            recent_field: Matrix3::zeros(),
            gathered: Matrix3::zeros(),
        }
    }
}

impl ObserverProgress {
    /// A step of the motion, as for [`Excitation::push`].
    pub fn push(&mut self, omega: &Vector3<f64>, field: Option<&Vector3<f64>>, dt_s: f64) {
        self.turned *= so3::exp(&(omega * dt_s));
        self.turned.renormalize_fast();
        self.weight = (self.weight + dt_s).min(WINDOW_S);
        let share = dt_s / self.weight;
        self.mean += (self.turned.to_rotation_matrix().into_inner() - self.mean) * share;
        let by_field = field.map_or_else(Matrix3::zeros, |f| f * f.transpose() * BY_FIELD);
        self.recent_field += (by_field - self.recent_field) * share;
        self.gathered += self.recent() * dt_s;
    }

    /// Mean square of the turn across each direction, lately.
    fn recent(&self) -> Matrix3<f64> {
        let kept = self.mean.transpose() * self.mean;
        Matrix3::identity() - (kept + kept.transpose()) * 0.5 + self.recent_field
    }

    /// The turn is unknown: what comes is compared with what comes.
    pub fn lose_motion(&mut self) {
        let gathered = self.gathered;
        *self = Self {
            gathered,
            ..Self::default()
        };
    }

    /// Directions in which the motion of late leads nowhere, 0 to 3.
    pub fn blind_count(&self) -> usize {
        let values = self.recent().symmetric_eigenvalues();
        values.iter().filter(|v| **v < TURNED).count()
    }

    /// Seconds until the start is forgotten, if the motion goes on as lately; `None` where it is.
    pub fn settling_s(&self) -> Option<f64> {
        let left = SETTLED - self.gathered.symmetric_eigenvalues().min();
        let rate = self.recent().symmetric_eigenvalues().min().max(TURNED);
        (left > 0.0).then_some(left / rate)
    }
}
