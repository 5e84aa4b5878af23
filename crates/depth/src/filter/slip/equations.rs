//! Normal equations of a pair's missing movement, beside errors that all ranges share.

use super::super::pair::Pair;
use super::LARGEST_PX;
use nalgebra::{SMatrix, SVector, Vector3, Vector6};

/// Three numbers each: the rotation, the movement, the error of inverse ranges that grows as they do, and that
/// which does not; the two latter run over the image as a plane does. What looks like these is no movement.
const MODES: usize = 4;

/// The numbers that are looked for.
pub(super) const UNKNOWNS: usize = 3 * MODES;

/// Numbers of the normal equations.
pub(super) const SUMS: usize = UNKNOWNS * (UNKNOWNS + 3) / 2;

/// Those of the rotation and the movement.
const MOVES: usize = 6;

/// Poses that are told to be exact are no better, rad and metres: what is asked for is a variance.
const EXACT: f64 = 1e-6;

/// Errors that ranges share are no larger than this, as shares of themselves and of those in the middle.
const SHARED: f64 = 1.0;

/// What is missing in a step: a rotation (rad) and a movement (metres) of points in the past camera.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Slip {
    moves: Vector6<f64>,
    /// Its squared size over its variance.
    pub chi: f64,
    /// Variances per axis, of rotation and movement, that are left.
    pub left: [f64; 2],
}

impl Slip {
    pub const NONE: Self = Self {
        moves: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        chi: 0.0,
        left: [0.0; 2],
    };

    pub fn rotation(&self) -> Vector3<f64> {
        self.moves.fixed_rows::<3>(0).into_owned()
    }

    pub fn place(&self) -> Vector3<f64> {
        self.moves.fixed_rows::<3>(3).into_owned()
    }
}

/// What is known of a pair's error before its images are compared.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Known {
    rotation_rad: f64,
    place_m: f64,
    /// Inverse ranges, 1/m.
    zeta: f64,
    /// The error that is mended already.
    mended: Vector6<f64>,
    /// False where poses are told to be exact.
    pub told: bool,
}

impl Known {
    /// By what is told of the poses. Those that are told to be exact may still be turned.
    pub fn of(pair: &Pair<'_>, zeta: f64) -> Self {
        let told = pair.drift.rotation > 0.0 || pair.drift.translation > 0.0;
        let sigma = |variance: f32| f64::from(variance).sqrt().max(EXACT);
        let most = LARGEST_PX / f64::from(pair.lattice.focal_px);
        Self {
            rotation_rad: if told {
                sigma(pair.drift.rotation)
            } else {
                most
            },
            place_m: sigma(pair.drift.translation),
            zeta,
            mended: Vector6::zeros(),
            told,
        }
    }

    /// Once a slip is put right.
    pub fn mend(&mut self, slip: &Slip) {
        self.mended += slip.moves;
    }

    /// Squared size per axis of the rotation that is mended, rad^2.
    pub fn turned(&self) -> f64 {
        self.mended.fixed_rows::<3>(0).norm_squared() / 3.0
    }

    /// Standard deviations of the unknowns.
    fn sigma(&self) -> [f64; MODES] {
        [self.rotation_rad, self.place_m, SHARED, SHARED * self.zeta]
    }
}

type Vector = SVector<f64, UNKNOWNS>;
type Matrix = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// Rows of the upper half of the matrix, each followed by its number of the right side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums(pub [f32; SUMS]);

impl Default for Sums {
    fn default() -> Self {
        Self([0.0; SUMS])
    }
}

impl Sums {
    pub fn add(&mut self, other: &Self) {
        for (sum, value) in self.0.iter_mut().zip(other.0) {
            *sum += value;
        }
    }

    /// `None` where the images do not say.
    pub fn solve(&self, known: &Known) -> Option<Slip> {
        let sigma = known.sigma();
        let weight = Vector::from_fn(|i, _| sigma[i / 3].powi(-2));
        let (mut matrix, mut vector) = self.matrix_and_vector();
        for i in 0..UNKNOWNS {
            matrix[(i, i)] += weight[i];
        }
        for i in 0..MOVES {
            vector[i] += weight[i] * known.mended[i];
        }
        let inverse = matrix.cholesky()?.inverse();
        let found = -(inverse * vector);
        let moves: Vector6<f64> = found.fixed_rows::<MOVES>(0).into_owned();
        let covariance = inverse.fixed_view::<MOVES, MOVES>(0, 0).into_owned();
        let chi = moves.dot(&(covariance.try_inverse()? * moves));
        let axis = |first: usize| (first..first + 3).map(|i| covariance[(i, i)]).sum::<f64>() / 3.0;
        chi.is_finite().then_some(Slip {
            moves,
            chi,
            left: [axis(0), axis(3)],
        })
    }

    fn matrix_and_vector(&self) -> (Matrix, Vector) {
        let (mut matrix, mut vector) = (Matrix::zeros(), Vector::zeros());
        let mut sums = self.0.iter().map(|sum| f64::from(*sum));
        for i in 0..UNKNOWNS {
            for j in i..UNKNOWNS {
                let value = sums.next().unwrap_or(0.0);
                (matrix[(i, j)], matrix[(j, i)]) = (value, value);
            }
            vector[i] = sums.next().unwrap_or(0.0);
        }
        (matrix, vector)
    }
}
