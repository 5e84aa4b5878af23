//! Hashed random values on a lattice, blended between its points: the ground of natural textures.

/// Values of a lattice point before they are brought to [-1, 1]: whole numbers up to [`LARGEST`].
/// Four of them fill one vector register; blending is linear, so the scale can wait.
type Raw = [f32; 4];

const LARGEST: f32 = 65_535.0;

/// 1.5 * 2^52: added to a smaller number it leaves it rounded to even in the lowest bits.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// The nearest whole number and what is beyond it, -1/2 to 1/2, without branches or calls. Numbers
/// above 2^51 have no whole number left to speak of: some value, no panic.
#[inline]
fn nearest(x: f64) -> (i64, f64) {
    let shifted = x + SHIFT;
    let whole = shifted.to_bits().wrapping_sub(SHIFT.to_bits());
    (whole as i64, x - (shifted - SHIFT))
}

/// Whole and fractional part, 0 to 1; a whole number may be taken for the end of the interval
/// before it.
#[inline]
pub(super) fn split(x: f64) -> (i64, f64) {
    let (whole, beyond) = nearest(x - 0.5);
    (whole, beyond + 0.5)
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

/// Weight of the next cell at `beyond` from the border between two (-1/2 and 1/2 are the centres):
/// a ramp of width `1 / per_edge` (in cells).
#[inline]
fn ramp(beyond: f64, per_edge: f64) -> f32 {
    (beyond * per_edge + 0.5).clamp(0.0, 1.0) as f32
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
    /// Values `k & 1`, `k >> 1 & 1`, `k >> 2` steps from `first` along x, y, z.
    corners: [Raw; 8],
    /// How many of them are known.
    known: usize,
}

impl Cells {
    pub(super) fn new(seed: u64) -> Self {
        Self {
            seed,
            first: [0; 3],
            corners: [[0.0; 4]; 8],
            known: 0,
        }
    }

    /// Values in [-1, 1] in the plane; `per_edge` is the inverse of the width of the blend between
    /// two cells, from 1 (clouds) to far above (tiles).
    #[inline(always)]
    pub(super) fn plane(&mut self, u: f64, v: f64, per_edge: f64) -> [f32; 4] {
        let ((i, fu), (j, fv)) = (nearest(u), nearest(v));
        self.move_to([i.wrapping_sub(1), j.wrapping_sub(1), 0], 4);
        let [wu, wv] = [fu, fv].map(|f| ramp(f, per_edge));
        scaled(self.across([wu, wv], 0))
    }

    /// Values in [-1, 1] in space; see [`Cells::plane`].
    #[inline]
    pub(super) fn space(&mut self, p: [f64; 3], per_edge: f64) -> [f32; 4] {
        let [(i, fx), (j, fy), (k, fz)] = p.map(nearest);
        self.move_to([i, j, k].map(|c| c.wrapping_sub(1)), 8);
        let [wx, wy, wz] = [fx, fy, fz].map(|f| ramp(f, per_edge));
        scaled(mix(wz, self.across([wx, wy], 0), self.across([wx, wy], 4)))
    }

    /// Number by number: as arrays they would be written to memory and read back in one piece, for
    /// which the processor waits.
    #[inline]
    fn move_to(&mut self, [x, y, z]: [i64; 3], corners: usize) {
        let [a, b, c] = self.first;
        if x != a || y != b || z != c || self.known < corners {
            (self.first, self.known) = ([x, y, z], corners);
            for (k, corner) in self.corners.iter_mut().enumerate().take(corners) {
                let step = |from: i64, bit: usize| from.wrapping_add((k >> bit & 1) as i64);
                *corner = raw(self.seed, [step(x, 0), step(y, 1), step(z, 2)]);
            }
        }
    }

    /// Between corner `k` and the three next to it along x and y.
    #[inline]
    fn across(&self, [wx, wy]: [f32; 2], k: usize) -> Raw {
        let corner = |step: usize| self.corners[(k + step) & 7];
        let (near, far) = (mix(wx, corner(0), corner(1)), mix(wx, corner(2), corner(3)));
        mix(wy, near, far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattice_split_is_floor_and_fraction() {
        for k in -4000..4000 {
            let x = f64::from(k) * 0.013 + 0.000_37; // no whole number, no half
            let (whole, fraction) = split(x);
            assert_eq!(whole, x.floor() as i64, "{x}");
            // One rounding at 52.
            assert!((fraction - (x - x.floor())).abs() < 1e-14, "{x}");
            let (whole, beyond) = nearest(x);
            assert_eq!(whole, x.round_ties_even() as i64, "{x}");
            assert!((beyond - (x - x.round_ties_even())).abs() < 1e-14, "{x}");
        }
    }

    #[test]
    fn lattice_cells_do_not_depend_on_where_the_last_point_was() {
        let mut used = Cells::new(3);
        for k in 0..3000 {
            let (u, v) = (
                7.0 * (0.37 * f64::from(k)).sin(),
                5.0 * (0.11 * f64::from(k)).cos(),
            );
            let per_edge = 1.0 + f64::from(k % 9);
            assert_eq!(
                used.plane(u, v, per_edge),
                Cells::new(3).plane(u, v, per_edge)
            );
            let p = [u, v, u - v];
            assert_eq!(used.space(p, per_edge), Cells::new(3).space(p, per_edge));
        }
    }

    #[test]
    fn lattice_cells_have_their_value_on_the_plateau_and_blend_continuously() {
        let mut cells = Cells::new(9);
        // The centre of cell (2, -4) is at half of each.
        let value = hashed(9, [2, -4, 0]);
        for (u, v) in [(2.5, -3.5), (2.1, -3.9), (2.9, -3.1)] {
            assert_eq!(cells.plane(u, v, 10.0), value);
        }
        let mut last = cells.plane(0.0, 0.3, 2.0);
        for k in 1..5000 {
            let next = cells.plane(1e-3 * f64::from(k), 0.3, 2.0);
            for (a, b) in last.iter().zip(next) {
                // A step of 1/1000 cell on a ramp half a cell wide between -1 and 1.
                assert!((a - b).abs() < 0.0041, "{k}: {a} {b}");
            }
            last = next;
        }
    }
}
