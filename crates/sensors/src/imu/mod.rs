//! Serial IMUs: bytes to readings.

pub mod epson;
mod framing;
mod reading;
pub mod text;
pub mod vectornav;
pub mod xsens;

pub use framing::{Decoder, Step};
pub use reading::{Reading, unwrap_counter};
