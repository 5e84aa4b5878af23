//! A texture ready to paint neighbouring points: what one of them needs the last one mostly needed.

use super::lattice::{Cells, hashed, split};
use super::{SurfacePoint, Texture};
use std::f64::consts::TAU;

/// Sizes of cells whose corners are kept; more are possible, and hashed anew at each point.
const KEPT: usize = 3;

/// Places of a mosaic that are painted at a time.
const RUN: usize = 64;

/// Length and height of the grain within a brick, metres.
const GRAIN_M: [f64; 2] = [0.035, 0.012];

/// The layer of the lattice whose values bricks have.
const BRICKS: i64 = 7;

/// A texture, and what of it was met last. Any brush paints the same.
#[derive(Clone, Debug)]
pub(crate) struct Brush {
    texture: Texture,
    cells: [Cells; KEPT],
    /// Column and row of the last brick with its random values.
    brick: (i64, i64, [f32; 4]),
}

impl Brush {
    pub(crate) fn new(texture: Texture) -> Self {
        let seed = match texture {
            Texture::Bricks { seed, .. } | Texture::Mosaic { seed, .. } => seed,
            _ => 0,
        };
        let bricks = matches!(texture, Texture::Bricks { .. });
        let cells = std::array::from_fn(|index| match bricks {
            true => Cells::new(seed ^ 0xA5),
            false => Cells::new(octave_seed(seed, index as u32)),
        });
        Self {
            texture,
            cells,
            brick: (0, 0, hashed(seed, [0, 0, BRICKS])),
        }
    }

    /// Colours at places, each averaged over its footprint; see [`Texture::rgb`]. As many places as
    /// footprints and colours.
    pub(crate) fn rgb(&mut self, at: &[SurfacePoint], footprint_m: &[f64], rgb: &mut [[f64; 3]]) {
        match self.texture {
            Texture::Plain { rgb: plain } => rgb.fill(plain),
            Texture::Sinusoid { period_m } => {
                for (rgb, at) in rgb.iter_mut().zip(at) {
                    let [u, v] = at.uv.map(|c| (TAU * c / period_m).sin());
                    *rgb = [128.5 + 63.75 * (u + v); 3];
                }
            }
            Texture::SolidSinusoid { period_m } => {
                for (rgb, at) in rgb.iter_mut().zip(at) {
                    let sum: f64 = at.local.iter().map(|c| (TAU * c / period_m).sin()).sum();
                    *rgb = [128.5 + 42.5 * sum; 3];
                }
            }
            Texture::Checker {
                size_m,
                edge_m,
                colours: [a, b],
            } => {
                for ((rgb, at), footprint_m) in rgb.iter_mut().zip(at).zip(footprint_m) {
                    let width = edge_m.max(*footprint_m) / size_m;
                    let [u, v] = at.uv.map(|c| square_wave(c / size_m, width));
                    let w = 0.5 + 0.5 * u * v * fade(footprint_m / size_m);
                    *rgb = std::array::from_fn(|i| a[i] + w * (b[i] - a[i]));
                }
            }
            Texture::Bricks { .. } => {
                for ((rgb, at), footprint_m) in rgb.iter_mut().zip(at).zip(footprint_m) {
                    *rgb = self.bricks(at.uv, *footprint_m);
                }
            }
            Texture::Mosaic {
                octaves,
                rgb: mean,
                spread,
                ..
            } => {
                let mut sums = [[0.0; 4]; RUN];
                let chunks = at.chunks(RUN).zip(footprint_m.chunks(RUN));
                for ((at, footprint_m), rgb) in chunks.zip(rgb.chunks_mut(RUN)) {
                    let sums = &mut sums[..at.len()];
                    sums.fill([0.0; 4]);
                    for octave in 0..octaves {
                        if !self.add_octave(octave, at, footprint_m, sums) {
                            break; // all smaller cells are averaged away too
                        }
                    }
                    for (rgb, sum) in rgb.iter_mut().zip(sums) {
                        let colour = |i: usize| mean[i] + 1.4 * spread[i] * f64::from(sum[i]);
                        *rgb = [0, 1, 2].map(|i| colour(i).clamp(0.0, 255.0));
                    }
                }
            }
        }
    }

    /// Adds one size of cells of a mosaic; false where none of them can be seen.
    fn add_octave(
        &mut self,
        octave: u32,
        at: &[SurfacePoint],
        footprint_m: &[f64],
        sums: &mut [[f32; 4]],
    ) -> bool {
        let Texture::Mosaic {
            size_m,
            softness,
            solid,
            seed,
            ..
        } = self.texture
        else {
            return false;
        };
        let (per_m, share) = (
            2.0_f64.powi(octave as i32) / size_m,
            0.7_f64.powi(octave as i32),
        );
        let kept = self.cells.get(octave as usize).copied();
        let mut cells = kept.unwrap_or_else(|| Cells::new(octave_seed(seed, octave)));
        let mut any = false;
        for ((sum, at), footprint_m) in sums.iter_mut().zip(at).zip(footprint_m) {
            let footprint = footprint_m * per_m;
            let visible = 0.5 * share * fade(footprint);
            any |= visible > 0.0;
            let per_edge = 1.0 / softness.max(footprint).clamp(1e-3, 1.0);
            let own = if solid {
                cells.space(
                    [at.local.x, at.local.y, at.local.z].map(|c| c * per_m),
                    per_edge,
                )
            } else {
                cells.plane(at.uv[0] * per_m, at.uv[1] * per_m, per_edge)
            };
            // Mostly brightness, some hue.
            let (visible, common) = (visible as f32, 0.7 * own[0]);
            for (total, own) in sum.iter_mut().zip(own) {
                *total += visible * (common + 0.3 * own);
            }
        }
        if let Some(kept) = self.cells.get_mut(octave as usize) {
            *kept = cells;
        }
        any
    }

    #[inline]
    fn bricks(&mut self, [u, v]: [f64; 2], footprint_m: f64) -> [f64; 3] {
        let Texture::Bricks {
            size_m: [length, height],
            joint_m,
            rgb,
            spread,
            seed,
        } = self.texture
        else {
            return [0.0; 3];
        };
        let (row, fv) = split(v / height);
        let shift = if row & 1 == 0 { 0.0 } else { 0.5 };
        let (column, fu) = split(u / length + shift);
        let border = (fu.min(1.0 - fu) * length).min(fv.min(1.0 - fv) * height);
        // 0 in the joint, 1 in the brick, with a ramp as wide as the footprint.
        let ramp_m = footprint_m.max(0.3 * joint_m);
        let solid = ((border - 0.5 * joint_m) / ramp_m + 0.5).clamp(0.0, 1.0);
        if self.brick.0 != column || self.brick.1 != row {
            self.brick = (column, row, hashed(seed, [column, row, BRICKS]));
        }
        let [tone, hue, ..] = self.brick.2.map(f64::from);
        // Averaged away where a pixel is wider than the grain.
        let visible = fade(footprint_m / GRAIN_M[1]);
        let grain = if visible > 0.0 {
            let [grain, ..] = self.cells[0].plane(u / GRAIN_M[0], v / GRAIN_M[1], 2.5);
            visible * f64::from(grain)
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
}

/// Every size of cells has values of its own.
fn octave_seed(seed: u64, octave: u32) -> u64 {
    seed.wrapping_add(u64::from(octave).wrapping_mul(0x5851_F42D))
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
