//! The products and divisions of small blocks that a factorisation by blocks consists of.

/// `c -= a b^T` with `a` height x inner, `b` width x inner, all by columns.
#[inline(always)]
pub(super) fn subtract(c: &mut [f64], a: &[f64], b: &[f64], height: usize, width: usize) {
    let square = (
        height == 6 && width == 6 && a.len() == 36,
        c.first_chunk_mut(),
    );
    if let (true, Some(c)) = square
        && let (Some(a), Some(b)) = (a.first_chunk(), b.first_chunk())
    {
        subtract_6(c, a, b);
        return;
    }
    for (a, b) in a.chunks_exact(height).zip(b.chunks_exact(width)) {
        for (c, b) in c.chunks_exact_mut(height).zip(b) {
            for (c, a) in c.iter_mut().zip(a) {
                *c -= a * b;
            }
        }
    }
}

#[inline(always)]
fn subtract_6(c: &mut [f64; 36], a: &[f64; 36], b: &[f64; 36]) {
    for column in 0..6 {
        let mut sum: [f64; 6] = std::array::from_fn(|r| c[6 * column + r]);
        for k in 0..6 {
            let factor = b[6 * k + column];
            for r in 0..6 {
                sum[r] -= a[6 * k + r] * factor;
            }
        }
        c[6 * column..6 * column + 6].copy_from_slice(&sum);
    }
}

/// The lower factor of a symmetric block in place, by columns; false where it is not positive.
#[inline(always)]
pub(super) fn factor_diagonal(a: &mut [f64], reciprocals: &mut [f64]) -> bool {
    let n = reciprocals.len();
    for c in 0..n {
        let (before, column) = a.split_at_mut(c * n);
        for k in 0..c {
            let factor = before[k * n + c];
            for r in c..n {
                column[r] -= before[k * n + r] * factor;
            }
        }
        let pivot = column[c];
        // a NaN is not positive either
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let pivot = pivot.sqrt();
        reciprocals[c] = 1.0 / pivot;
        column[c] = pivot;
        for entry in &mut column[c + 1..n] {
            *entry *= reciprocals[c];
        }
    }
    true
}

/// `b L^-T` in place, `b` of this height by columns.
#[inline(always)]
pub(super) fn divide(b: &mut [f64], l: &[f64], reciprocals: &[f64], height: usize) {
    let n = reciprocals.len();
    for c in 0..n {
        let (before, column) = b.split_at_mut(c * height);
        let column = &mut column[..height];
        for k in 0..c {
            let factor = l[k * n + c];
            for (to, from) in column.iter_mut().zip(&before[k * height..]) {
                *to -= from * factor;
            }
        }
        for entry in column {
            *entry *= reciprocals[c];
        }
    }
}
