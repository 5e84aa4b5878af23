//! Hashed random values on a lattice, blended between its points: the ground of natural textures.

/// Values of a lattice point before they are brought to [-1, 1]: whole numbers up to [`LARGEST`].
/// Four of them fill one vector register; blending is linear, so the scale can wait.
type Raw = [f32; 4];

const LARGEST: f32 = 65_535.0;

/// Whole and fractional part, without a call into the maths library.
#[inline]
pub(super) fn split(x: f64) -> (i64, f64) {
    let truncated = x as i64;
    let whole = truncated - i64::from(x < truncated as f64);
    (whole, x - whole as f64)
}

#[inline]
fn raw(seed: u64, x: i64, y: i64, z: i64) -> Raw {
    let mut h = seed
        ^ (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ (z as u64).wrapping_mul(0x1656_67B1_9E37_79F9);
    h = (h ^ (h >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    h = (h ^ (h >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    h ^= h >> 32;
    [0, 16, 32, 48].map(|shift| ((h >> shift) & 0xFFFF) as i32 as f32)
}

/// Three values in [-1, 1].
#[inline]
fn scaled([a, b, c, _]: Raw) -> [f64; 3] {
    [a, b, c].map(|v| f64::from(v * (2.0 / LARGEST) - 1.0))
}

/// Three independent values in [-1, 1] of a lattice point.
#[inline]
pub(super) fn hashed(seed: u64, x: i64, y: i64, z: i64) -> [f64; 3] {
    scaled(raw(seed, x, y, z))
}

/// Weight of the next cell at fraction `f` of the way between two centres: a ramp of width `edge`
/// (in cells) in the middle.
#[inline]
fn ramp(f: f64, edge: f64) -> f32 {
    ((f - 0.5) / edge + 0.5).clamp(0.0, 1.0) as f32
}

/// `a` at weight 0, `b` at weight 1. Most points of a tile lie on its plateau and need one of them.
#[inline]
fn blend(w: f32, a: impl FnOnce() -> Raw, b: impl FnOnce() -> Raw) -> Raw {
    if w == 0.0 {
        return a();
    }
    if w == 1.0 {
        return b();
    }
    let (a, b) = (a(), b());
    std::array::from_fn(|i| a[i] + w * (b[i] - a[i]))
}

/// Random cells of unit size in the plane; `edge` is the width of the blend between two, from
/// near 0 (tiles) to 1 (clouds).
#[inline]
pub(super) fn cells_2d(seed: u64, u: f64, v: f64, edge: f64) -> [f64; 3] {
    let ((i, fu), (j, fv)) = (split(u - 0.5), split(v - 0.5));
    let (wu, wv) = (ramp(fu, edge), ramp(fv, edge));
    let along = |j: i64| blend(wu, || raw(seed, i, j, 0), || raw(seed, i + 1, j, 0));
    scaled(blend(wv, || along(j), || along(j + 1)))
}

/// Random cells of unit size in space.
#[inline]
pub(super) fn cells_3d(seed: u64, p: [f64; 3], edge: f64) -> [f64; 3] {
    let [(i, fx), (j, fy), (k, fz)] = p.map(|c| split(c - 0.5));
    let [wx, wy, wz] = [fx, fy, fz].map(|f| ramp(f, edge));
    let along = |j: i64, k: i64| blend(wx, || raw(seed, i, j, k), || raw(seed, i + 1, j, k));
    let across = |k: i64| blend(wy, || along(j, k), || along(j + 1, k));
    scaled(blend(wz, || across(k), || across(k + 1)))
}
