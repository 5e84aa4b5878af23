//! What a moving camera sees flow, and how far away it therefore is (Chapters 2 to 4).
//!
//! [`horn_schunck`] and [`tv_l1`] measure the optical flow between two images, [`rof_denoise`]
//! smooths one. Images are planes of brightness of any scale; flow is in pixels.

mod derivatives;
mod error;
mod field;
mod gaussian;
mod horn_schunck;
mod rof;
#[allow(dead_code)]
mod sampling;
mod tv_l1;

pub use derivatives::{Derivatives, sobel};
pub use error::Error;
pub use field::FlowField;
pub use horn_schunck::{
    HornSchunckConfig, HornSchunckSolver, horn_schunck, horn_schunck_energy, horn_schunck_of,
};
pub use rof::{RofConfig, rof_denoise, rof_energy};
pub use tv_l1::{TvL1Config, TvL1Flow, tv_l1};

/// Result of the crate's fallible calls.
pub type Result<T> = std::result::Result<T, Error>;
