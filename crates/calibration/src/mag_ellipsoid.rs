//! Hard and soft iron of a magnetometer from a recording in which it was turned all ways.

use crate::Result;
use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen, Vector3};
use sphereflow_core::Error;
use sphereflow_observers::{Reason, Status};

/// The calibration: `calibrated = correction (reading - hard_iron)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagEllipsoid {
    /// Field of what moves with the sensor, in the readings' unit.
    pub hard_iron_ut: Vector3<f64>,
    /// Symmetric: carries the ellipsoid of the readings to the sphere.
    pub correction: Matrix3<f64>,
    /// Radius of that sphere: the geometric mean of the ellipsoid's half axes.
    pub field_ut: f64,
    /// Root mean square of the radius's error after calibration, in the readings' unit.
    pub residual_ut: f64,
    /// Weak where the readings do not surround the sphere.
    pub status: Status,
}

impl MagEllipsoid {
    /// A calibrated reading.
    pub fn apply(&self, reading: &Vector3<f64>) -> Vector3<f64> {
        self.correction * (reading - self.hard_iron_ut)
    }
}

/// Smallest eigenvalue of the mean of `d d'` over directions d; 1/3 is even coverage.
const COVERED: f64 = 0.08;

/// Least squares of an ellipsoid through the readings, `(N, 3)`.
///
/// # Errors
/// Too few readings, numbers that are not finite, or readings that lie on no ellipsoid: they do
/// not surround a centre.
pub fn mag_ellipsoid(readings: &[Vector3<f64>]) -> Result<MagEllipsoid> {
    if readings.len() < 20 {
        return Err(Error::shape("mag_ut", "at least 20 rows", readings.len()));
    }
    if let Some(i) = readings
        .iter()
        .position(|v| !v.iter().all(|x| x.is_finite()))
    {
        let found = format!("{:?}", readings[i].as_slice());
        return Err(Error::value(
            format!("mag_ut[{i}]"),
            "finite numbers",
            found,
        ));
    }
    let middle = readings.iter().sum::<Vector3<f64>>() / readings.len() as f64;
    let scale = (readings
        .iter()
        .map(|r| (r - middle).norm_squared())
        .sum::<f64>()
        / readings.len() as f64)
        .sqrt();
    let no_ellipsoid = |found: String| -> Error {
        Error::value(
            "mag_ut",
            "readings that surround a centre, turned all ways",
            found,
        )
    };
    if scale <= 0.0 {
        return Err(no_ellipsoid("one and the same reading".into()));
    }
    let scaled: Vec<Vector3<f64>> = readings.iter().map(|r| (r - middle) / scale).collect();
    let (a, b) = quadric(&scaled).ok_or_else(|| no_ellipsoid("readings in a plane".into()))?;
    let centre = -a
        .try_inverse()
        .ok_or_else(|| no_ellipsoid("readings on a cylinder".into()))?
        * b
        * 0.5;
    let level = 1.0 + centre.dot(&(a * centre));
    let eigen = SymmetricEigen::new(a / level);
    if eigen.eigenvalues.min() <= 0.0 {
        return Err(no_ellipsoid(format!(
            "a quadric with eigenvalues {:?}",
            eigen.eigenvalues.as_slice()
        )));
    }
    let radius = scale / eigen.eigenvalues.product().powf(1.0 / 6.0);
    let root = eigen.eigenvectors
        * Matrix3::from_diagonal(&eigen.eigenvalues.map(f64::sqrt))
        * eigen.eigenvectors.transpose();
    let mut found = MagEllipsoid {
        hard_iron_ut: middle + centre * scale,
        correction: root * (radius / scale),
        field_ut: radius,
        residual_ut: 0.0,
        status: Status::Ok,
    };
    let off = |r: &Vector3<f64>| (found.apply(r).norm() - radius).powi(2);
    found.residual_ut = (readings.iter().map(off).sum::<f64>() / readings.len() as f64).sqrt();
    let spread: Matrix3<f64> = readings
        .iter()
        .filter_map(|r| found.apply(r).try_normalize(1e-12))
        .map(|d| d * d.transpose())
        .sum();
    let smallest = (spread / readings.len() as f64).symmetric_eigenvalues();
    let missing = smallest.iter().filter(|v| **v < COVERED).count();
    if missing > 0 {
        found.status = Status::Weak(Reason::Unobservable {
            directions: missing,
        });
    }
    Ok(found)
}

/// `x' A x + b . x = 1`, least squares.
fn quadric(points: &[Vector3<f64>]) -> Option<(Matrix3<f64>, Vector3<f64>)> {
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    let mut right = SVector::<f64, 9>::zeros();
    for p in points {
        let (x, y, z) = (p.x, p.y, p.z);
        let row = SVector::<f64, 9>::from([
            x * x,
            y * y,
            z * z,
            2.0 * x * y,
            2.0 * x * z,
            2.0 * y * z,
            x,
            y,
            z,
        ]);
        normal += row * row.transpose();
        right += row;
    }
    let eigenvalues = normal.symmetric_eigenvalues();
    if eigenvalues.min() <= 1e-9 * eigenvalues.max() {
        return None;
    }
    let s = normal.cholesky()?.solve(&right);
    let a = Matrix3::new(s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]);
    Some((a, Vector3::new(s[6], s[7], s[8])))
}
