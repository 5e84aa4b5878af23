//! Optical flow: how far each pixel's content moves between two images (Chapter 2).
//!
//! [`horn_schunck`] and [`tv_l1`] measure the flow, [`rof_denoise`] smooths an image by the total variation
//! that TV-L1 rests on. Images are planes of brightness of any scale (settings are for 1 to 256); flow
//! is in pixels, columns to the right and rows down.

mod field;
mod horn_schunck;
mod rof;
mod sweeping;
mod tv_l1;

pub use field::FlowField;
pub use horn_schunck::{
    HornSchunckConfig, HornSchunckSolver, horn_schunck, horn_schunck_energy, horn_schunck_of,
};
pub use rof::{RofConfig, rof_denoise, rof_energy};
pub use tv_l1::{TvL1Config, TvL1Flow, tv_l1};

pub use sphereflow_core::{Error, Result};
