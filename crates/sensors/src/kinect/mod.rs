//! The Kinect v1 (Xbox 360): its packets, its control messages and its factory parameters.
//!
//! Model 1414 is the one whose protocol is public in full. Models 1473 and "for Windows" share
//! the image streams; they were not tried on hardware.

mod camera;
mod command;
mod frames;
mod halves;
mod mode;
mod motor;
mod parameters;
pub(crate) mod registers;

pub use camera::{Camera, CameraFrame, Content};
pub use command::{CameraCommand, REPLY_BYTES, Reply, parse_reply};
pub use frames::{FrameAssembler, RawFrame};
pub use mode::{DEPTH_STREAM, Mode, PixelFormat, VIDEO_STREAM};
pub use motor::{Led, MotorState, MotorStatus, led_request, parse_motor_state, tilt_request};
pub use parameters::{parse_fixed_parameters, parse_padding, parse_registration, parse_shift};
pub use registers::{Step, start_colour, start_depth, start_infrared, stop_depth, stop_video};

/// Ticks of the device clock per second: it wraps after 71.58 s.
pub const TICKS_PER_SECOND: f64 = 60e6;

/// Value of a depth pixel without a reading, with 11 bits.
pub const NO_READING: u16 = 2047;
