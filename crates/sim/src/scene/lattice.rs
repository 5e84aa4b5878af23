//! Hashed random values on a lattice, blended between its points: the ground of natural textures.

/// Whole and fractional part, without a call into the maths library.
#[inline]
pub(super) fn split(x: f64) -> (i64, f64) {
    let truncated = x as i64;
    let whole = truncated - i64::from(x < truncated as f64);
    (whole, x - whole as f64)
}

/// Three independent values in [-1, 1] of a lattice point.
#[inline]
pub(super) fn hashed(seed: u64, x: i64, y: i64, z: i64) -> [f64; 3] {
    let mut h = seed
        ^ (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ (z as u64).wrapping_mul(0x1656_67B1_9E37_79F9);
    h = (h ^ (h >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    h = (h ^ (h >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    h ^= h >> 32;
    let part = |shift: u32| ((h >> shift) & 0x1F_FFFF) as i64 as f64 * (2.0 / 2_097_151.0) - 1.0;
    [part(0), part(21), part(42)]
}

/// Weight of the next cell at fraction `f` of the way between two centres: a ramp of width `edge`
/// (in cells) in the middle.
#[inline]
fn ramp(f: f64, edge: f64) -> f64 {
    ((f - 0.5) / edge + 0.5).clamp(0.0, 1.0)
}

#[inline]
fn blend(a: [f64; 3], b: [f64; 3], w: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + w * (b[i] - a[i]))
}

/// Random cells of unit size in the plane; `edge` is the width of the blend between two, from
/// near 0 (tiles) to 1 (clouds).
#[inline]
pub(super) fn cells_2d(seed: u64, u: f64, v: f64, edge: f64) -> [f64; 3] {
    let ((i, fu), (j, fv)) = (split(u - 0.5), split(v - 0.5));
    let (wu, wv) = (ramp(fu, edge), ramp(fv, edge));
    // Most points of a tile lie in its plateau: one hash instead of four.
    let along = |j: i64| {
        if wu == 0.0 {
            hashed(seed, i, j, 0)
        } else if wu == 1.0 {
            hashed(seed, i + 1, j, 0)
        } else {
            blend(hashed(seed, i, j, 0), hashed(seed, i + 1, j, 0), wu)
        }
    };
    if wv == 0.0 {
        along(j)
    } else if wv == 1.0 {
        along(j + 1)
    } else {
        blend(along(j), along(j + 1), wv)
    }
}

/// Random cells of unit size in space.
#[inline]
pub(super) fn cells_3d(seed: u64, p: [f64; 3], edge: f64) -> [f64; 3] {
    let [(i, fx), (j, fy), (k, fz)] = p.map(|c| split(c - 0.5));
    let [wx, wy, wz] = [fx, fy, fz].map(|f| ramp(f, edge));
    let along = |j: i64, k: i64| match wx {
        0.0 => hashed(seed, i, j, k),
        1.0 => hashed(seed, i + 1, j, k),
        _ => blend(hashed(seed, i, j, k), hashed(seed, i + 1, j, k), wx),
    };
    let across = |k: i64| match wy {
        0.0 => along(j, k),
        1.0 => along(j + 1, k),
        _ => blend(along(j, k), along(j + 1, k), wy),
    };
    match wz {
        0.0 => across(k),
        1.0 => across(k + 1),
        _ => blend(across(k), across(k + 1), wz),
    }
}
