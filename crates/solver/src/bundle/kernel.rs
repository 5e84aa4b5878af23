//! The small products that most of the time goes into.

/// `s -= y w^T` with `y`, `w` 6 x 3 and `s` 6 x 6, all by columns.
#[inline(always)]
pub(super) fn subtract_6_6(s: &mut [f64; 36], y: &[f64; 18], w: &[f64; 18]) {
    for c in 0..6 {
        for r in 0..6 {
            s[6 * c + r] -= y[r] * w[c] + y[6 + r] * w[6 + c] + y[12 + r] * w[12 + c];
        }
    }
}

/// `s -= y w^T` with `y` rows x 3, `w` columns x 3 and `s` rows x columns, all by columns.
#[inline(always)]
pub(super) fn subtract(s: &mut [f64], y: &[f64], w: &[f64], rows: usize, columns: usize) {
    if rows == 6
        && columns == 6
        && let (Some(s), Some(y), Some(w)) = (s.first_chunk_mut(), y.first_chunk(), w.first_chunk())
    {
        subtract_6_6(s, y, w);
        return;
    }
    for c in 0..columns {
        for r in 0..rows {
            let sum =
                y[r] * w[c] + y[rows + r] * w[columns + c] + y[2 * rows + r] * w[2 * columns + c];
            s[rows * c + r] -= sum;
        }
    }
}

/// Inverse of the symmetric 3 x 3 matrix `[xx, xy, xz, yy, yz, zz]`, in the same order; `None`
/// where it is not positive definite.
#[inline(always)]
pub(super) fn inverse_symmetric(v: &[f64; 6]) -> Option<[f64; 6]> {
    let [xx, xy, xz, yy, yz, zz] = *v;
    // Cholesky first: the cofactors of a matrix that is almost singular are not to be trusted
    let l00 = xx;
    let d1 = yy - xy * xy / l00;
    let m = yz - xy * xz / l00;
    let d2 = zz - xz * xz / l00 - m * m / d1;
    if !(l00 > 0.0 && d1 > 0.0 && d2 > 0.0) {
        return None;
    }
    // A = L D L^T with unit L; A^-1 = L^-T D^-1 L^-1
    let (a, b, c) = (xy / l00, xz / l00, m / d1);
    let e = a * c - b; // entry (2, 0) of L^-1
    let (i0, i1, i2) = (1.0 / l00, 1.0 / d1, 1.0 / d2);
    Some([
        i0 + a * a * i1 + e * e * i2,
        -a * i1 - e * c * i2,
        e * i2,
        i1 + c * c * i2,
        -c * i2,
        i2,
    ])
}

/// `y = w v` with `w` rows x 3 by columns and `v` symmetric.
#[inline(always)]
pub(super) fn times_symmetric(y: &mut [f64], w: &[f64], v: &[f64; 6], rows: usize) {
    let [xx, xy, xz, yy, yz, zz] = *v;
    for r in 0..rows {
        let (a, b, c) = (w[r], w[rows + r], w[2 * rows + r]);
        y[r] = a * xx + b * xy + c * xz;
        y[rows + r] = a * xy + b * yy + c * yz;
        y[2 * rows + r] = a * xz + b * yz + c * zz;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, Matrix3};

    // rounding of a few products of numbers of size 1
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn inverse_symmetric_times_matrix_is_identity() {
        let a = Matrix3::new(1.0, 0.3, -0.2, 0.7, 1.9, 0.5, -0.4, 0.1, 2.0);
        let spd = a * a.transpose();
        let packed = |m: &Matrix3<f64>| [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33];
        let i = inverse_symmetric(&packed(&spd)).unwrap();
        let inverse = Matrix3::new(i[0], i[1], i[2], i[1], i[3], i[4], i[2], i[4], i[5]);
        assert!((inverse * spd - Matrix3::identity()).norm() < ROUNDING);
        assert_eq!(inverse_symmetric(&[1.0, 0.0, 0.0, 1.0, 1.0, 1.0]), None);
        assert_eq!(inverse_symmetric(&[f64::NAN; 6]), None);
    }

    #[test]
    fn subtracted_products_equal_matrix_products() {
        for (rows, columns) in [(6, 6), (6, 3), (4, 6), (2, 2)] {
            let y = DMatrix::from_fn(rows, 3, |r, c| (r as f64 - 1.5) * 0.3 + c as f64);
            let w = DMatrix::from_fn(columns, 3, |r, c| (r * c) as f64 * 0.2 - 0.7);
            let mut s = DMatrix::from_element(rows, columns, 0.5);
            let expected = &s - &y * w.transpose();
            subtract(s.as_mut_slice(), y.as_slice(), w.as_slice(), rows, columns);
            assert!((s - expected).norm() < ROUNDING);
        }
    }
}
