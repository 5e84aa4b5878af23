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
fn raw(seed: u64, [x, y, z]: [i64; 3]) -> Raw {
    let mut h = seed
        ^ (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ (z as u64).wrapping_mul(0x1656_67B1_9E37_79F9);
    h = (h ^ (h >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    h = (h ^ (h >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    h ^= h >> 32;
    [0, 16, 32, 48].map(|shift| ((h >> shift) & 0xFFFF) as i32 as f32)
}

/// Four values in [-1, 1].
#[inline]
fn scaled(values: Raw) -> [f32; 4] {
    values.map(|v| v * (2.0 / LARGEST) - 1.0)
}

/// Four independent values in [-1, 1] of a lattice point.
#[inline]
pub(super) fn hashed(seed: u64, point: [i64; 3]) -> [f32; 4] {
    scaled(raw(seed, point))
}

/// Weight of the next cell at fraction `f` of the way between two centres: a ramp in the middle of
/// width `1 / per_edge` (in cells).
#[inline]
fn ramp(f: f64, per_edge: f64) -> f32 {
    ((f - 0.5) * per_edge + 0.5).clamp(0.0, 1.0) as f32
}

/// `a` at weight 0, `b` at weight 1.
#[inline]
fn mix(w: f32, a: Raw, b: Raw) -> Raw {
    std::array::from_fn(|i| a[i] + w * (b[i] - a[i]))
}

/// Random cells of unit size. The corners around the last point are kept: the next point mostly
/// lies between the same ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    seed: u64,
    first: [i64; 3],
    /// Bit `k` tells that `corners[k]` is known: the one `k & 1`, `k >> 1 & 1`, `k >> 2` steps from
    /// `first` along x, y, z.
    known: u8,
    corners: [Raw; 8],
}

impl Cells {
    pub(super) fn new(seed: u64) -> Self {
        Self {
            seed,
            first: [0; 3],
            known: 0,
            corners: [[0.0; 4]; 8],
        }
    }

    /// Values in [-1, 1] in the plane; `per_edge` is the inverse of the width of the blend between
    /// two cells, from 1 (clouds) to far above (tiles).
    #[inline]
    pub(super) fn plane(&mut self, u: f64, v: f64, per_edge: f64) -> [f32; 4] {
        let ((i, fu), (j, fv)) = (split(u - 0.5), split(v - 0.5));
        self.move_to([i, j, 0]);
        scaled(self.across([fu, fv].map(|f| ramp(f, per_edge)), 0))
    }

    /// Values in [-1, 1] in space; see [`Cells::plane`].
    #[inline]
    pub(super) fn space(&mut self, p: [f64; 3], per_edge: f64) -> [f32; 4] {
        let [(i, fx), (j, fy), (k, fz)] = p.map(|c| split(c - 0.5));
        self.move_to([i, j, k]);
        let [wx, wy, wz] = [fx, fy, fz].map(|f| ramp(f, per_edge));
        scaled(if wz == 0.0 {
            self.across([wx, wy], 0)
        } else if wz == 1.0 {
            self.across([wx, wy], 4)
        } else {
            mix(wz, self.across([wx, wy], 0), self.across([wx, wy], 4))
        })
    }

    #[inline]
    fn move_to(&mut self, first: [i64; 3]) {
        // Number by number: as arrays they would be written to memory and read back in one piece,
        // for which the processor waits.
        let [a, b, c] = first;
        if a != self.first[0] || b != self.first[1] || c != self.first[2] {
            (self.first, self.known) = (first, 0);
        }
    }

    /// Between corner `k` and the three next to it along x and y. Most points of a tile lie on its
    /// plateau and need one corner.
    #[inline]
    fn across(&mut self, [wx, wy]: [f32; 2], k: usize) -> Raw {
        if wy == 0.0 {
            self.along(wx, k)
        } else if wy == 1.0 {
            self.along(wx, k + 2)
        } else {
            mix(wy, self.along(wx, k), self.along(wx, k + 2))
        }
    }

    #[inline]
    fn along(&mut self, w: f32, k: usize) -> Raw {
        if w == 0.0 {
            self.corner(k)
        } else if w == 1.0 {
            self.corner(k + 1)
        } else {
            mix(w, self.corner(k), self.corner(k + 1))
        }
    }

    #[inline]
    fn corner(&mut self, k: usize) -> Raw {
        let k = k & 7;
        if self.known & (1 << k) == 0 {
            let step = |bit: usize| (k >> bit & 1) as i64;
            // Saturated whole numbers must not stop the program.
            let point = [0, 1, 2].map(|axis| self.first[axis].wrapping_add(step(axis)));
            self.corners[k] = raw(self.seed, point);
            self.known |= 1 << k;
        }
        self.corners[k]
    }
}
