//! Paint: colour as a function of the place on a surface, averaged over a pixel's footprint.

use super::SurfacePoint;
use super::brush::Brush;

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
    pub fn rgb(&self, at: &SurfacePoint, footprint_m: f64) -> [f64; 3] {
        let mut rgb = [[0.0; 3]];
        Brush::new(*self).rgb(std::slice::from_ref(at), &[footprint_m], &mut rgb);
        rgb[0]
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
}
