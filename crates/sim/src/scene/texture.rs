//! Paint: colour as a function of the place on a surface, averaged over a pixel's footprint.

use super::SurfacePoint;
use super::lattice::{cells_2d, cells_3d, hashed, split};
use std::f64::consts::TAU;

/// Colour of a surface. Lengths are metres, colours nominally 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Texture {
    /// One colour.
    Plain {
        /// The colour.
        rgb: [f64; 3],
    },
    /// Thesis: section 4.1.1. `128.5 + 63.75 (sin 2 pi u/period + sin 2 pi v/period)`: 1 to 256.
    Sinusoid {
        /// Period along the surface, metres.
        period_m: f64,
    },
    /// The same in space, for curved surfaces: `128.5 + 42.5` times the sum of three sines.
    SolidSinusoid {
        /// Period along each axis, metres.
        period_m: f64,
    },
    /// A chessboard with edges `edge_m` wide.
    Checker {
        /// Side of a field.
        size_m: f64,
        /// Width of the soft edge.
        edge_m: f64,
        /// Colours of the two fields.
        colours: [[f64; 3]; 2],
    },
    /// Bricks or planks, every other row shifted by half a brick.
    Bricks {
        /// Length and height of a brick.
        size_m: [f64; 2],
        /// Width of the joint.
        joint_m: f64,
        /// Mean colour of the bricks.
        rgb: [f64; 3],
        /// How much bricks differ, and the grain within a brick.
        spread: f64,
        /// Which bricks.
        seed: u64,
    },
    /// Random cells of several sizes on one another, each half as large as the one before.
    Mosaic {
        /// Side of the largest cells.
        size_m: f64,
        /// Number of sizes.
        octaves: u32,
        /// Blend between cells as a share of a cell: near 0 tiles full of corners, 1 clouds.
        softness: f64,
        /// Mean colour.
        rgb: [f64; 3],
        /// Largest deviation of each channel.
        spread: [f64; 3],
        /// True for cells in space (curved surfaces), false for cells along the surface.
        solid: bool,
        /// Which cells.
        seed: u64,
    },
}

impl Texture {
    /// Colour at a place, averaged over about `footprint_m` (0 for the paint itself). The
    /// thesis's sinusoids are never averaged: their formula is exact.
    #[inline]
    pub fn rgb(&self, at: &SurfacePoint, footprint_m: f64) -> [f64; 3] {
        match *self {
            Self::Plain { rgb } => rgb,
            Self::Sinusoid { period_m } => {
                let [u, v] = at.uv.map(|c| (TAU * c / period_m).sin());
                [128.5 + 63.75 * (u + v); 3]
            }
            Self::SolidSinusoid { period_m } => {
                let sum: f64 = at.local.iter().map(|c| (TAU * c / period_m).sin()).sum();
                [128.5 + 42.5 * sum; 3]
            }
            Self::Checker {
                size_m,
                edge_m,
                colours: [a, b],
            } => {
                let width = edge_m.max(footprint_m) / size_m;
                let [u, v] = at.uv.map(|c| square_wave(c / size_m, width));
                let w = 0.5 + 0.5 * u * v * fade(footprint_m / size_m);
                std::array::from_fn(|i| a[i] + w * (b[i] - a[i]))
            }
            Self::Bricks {
                size_m,
                joint_m,
                rgb,
                spread,
                seed,
            } => bricks(at.uv, size_m, joint_m, rgb, spread, seed, footprint_m),
            Self::Mosaic { .. } => self.mosaic(at, footprint_m),
        }
    }

    /// The length that is not a positive number, if any, and its value.
    pub(super) fn check(&self) -> Result<(), (&'static str, f64)> {
        let lengths: &[(&'static str, f64)] = match *self {
            Self::Plain { .. } => &[],
            Self::Sinusoid { period_m } | Self::SolidSinusoid { period_m } => {
                &[("period_m", period_m)]
            }
            Self::Checker { size_m, .. } | Self::Mosaic { size_m, .. } => &[("size_m", size_m)],
            Self::Bricks {
                size_m, joint_m, ..
            } => &[
                ("size_m", size_m[0]),
                ("size_m", size_m[1]),
                ("joint_m", joint_m),
            ],
        };
        let bad = lengths.iter().find(|(_, l)| !(l.is_finite() && *l > 0.0));
        bad.map_or(Ok(()), |&wrong| Err(wrong))
    }

    #[inline]
    fn mosaic(&self, at: &SurfacePoint, footprint_m: f64) -> [f64; 3] {
        let &Self::Mosaic {
            size_m,
            octaves,
            softness,
            rgb,
            spread,
            solid,
            seed,
        } = self
        else {
            return [0.0; 3];
        };
        let (mut sum, mut per_m, mut share) = ([0.0; 3], 1.0 / size_m, 0.5);
        for octave in 0..octaves {
            let visible = share * fade(footprint_m * per_m);
            if visible == 0.0 {
                break; // all smaller cells are averaged away too
            }
            let edge = softness.max(footprint_m * per_m).clamp(1e-3, 1.0);
            let cell_seed = seed.wrapping_add(u64::from(octave).wrapping_mul(0x5851_F42D));
            let [a, b, c] = if solid {
                cells_3d(
                    cell_seed,
                    [at.local.x, at.local.y, at.local.z].map(|x| x * per_m),
                    edge,
                )
            } else {
                cells_2d(cell_seed, at.uv[0] * per_m, at.uv[1] * per_m, edge)
            };
            // Mostly brightness, some hue.
            for (total, own) in sum.iter_mut().zip([a, b, c]) {
                *total += visible * (0.7 * a + 0.3 * own);
            }
            per_m *= 2.0;
            share *= 0.7;
        }
        std::array::from_fn(|i| (rgb[i] + 1.4 * spread[i] * sum[i]).clamp(0.0, 255.0))
    }
}

/// +1 and -1 in alternate unit intervals, with ramps of `width` centred on the borders.
#[inline]
fn square_wave(x: f64, width: f64) -> f64 {
    let (whole, fraction) = split(x);
    let border = fraction.min(1.0 - fraction); // distance to the nearest border
    let height = (2.0 * border / width.max(1e-9)).min(1.0);
    if whole & 1 == 0 { height } else { -height }
}

/// What is left of a pattern of a size, `ratio` footprints large.
#[inline]
fn fade(ratio: f64) -> f64 {
    (1.5 - ratio).clamp(0.0, 1.0)
}

/// Length and height of the grain within a brick, metres.
const GRAIN_M: [f64; 2] = [0.035, 0.012];

#[inline]
fn bricks(
    [u, v]: [f64; 2],
    [length, height]: [f64; 2],
    joint_m: f64,
    rgb: [f64; 3],
    spread: f64,
    seed: u64,
    footprint_m: f64,
) -> [f64; 3] {
    let (row, fv) = split(v / height);
    let shift = if row & 1 == 0 { 0.0 } else { 0.5 };
    let (column, fu) = split(u / length + shift);
    let border = (fu.min(1.0 - fu) * length).min(fv.min(1.0 - fv) * height);
    // 0 in the joint, 1 in the brick, with a ramp as wide as the footprint.
    let ramp_m = footprint_m.max(0.3 * joint_m);
    let solid = ((border - 0.5 * joint_m) / ramp_m + 0.5).clamp(0.0, 1.0);
    let [tone, hue, _] = hashed(seed, column, row, 7);
    // Averaged away where a pixel is wider than the grain.
    let visible = fade(footprint_m / GRAIN_M[1]);
    let grain = if visible > 0.0 {
        visible * cells_2d(seed ^ 0xA5, u / GRAIN_M[0], v / GRAIN_M[1], 0.4)[0]
    } else {
        0.0
    };
    let deviation = spread * (tone + 0.4 * grain) * fade(footprint_m / height);
    let brick = [
        rgb[0] + deviation + 0.25 * spread * hue,
        rgb[1] + deviation,
        rgb[2] + deviation - 0.25 * spread * hue,
    ];
    brick.map(|c| (0.45 * c + solid * 0.55 * c).clamp(0.0, 255.0))
}
