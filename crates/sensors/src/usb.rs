//! What a driver asks of a USB device: control transfers, and packets of its endpoints.
//!
//! Drivers are written against this; a simulated device in the same process answers it, and a library
//! that reaches real devices does so too.

use crate::Result;
use sphereflow_core::Stamp;
use std::time::Duration;

/// Request type, request and value of a control transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Direction, kind and recipient.
    pub kind: u8,
    /// Number of the request.
    pub request: u8,
    /// Its value.
    pub value: u16,
}

/// An open USB device.
pub trait UsbLink: Send {
    /// What the device is called in errors.
    fn name(&self) -> String;

    /// A control transfer to the device.
    ///
    /// # Errors
    /// Where the device refuses or is gone.
    fn control_out(&mut self, request: Request, data: &[u8]) -> Result<()>;

    /// A control transfer from the device, of at most `length` bytes.
    ///
    /// # Errors
    /// Where the device refuses or is gone.
    fn control_in(&mut self, request: Request, length: usize) -> Result<Vec<u8>>;

    /// Begins to fetch packets of an endpoint.
    ///
    /// # Errors
    /// Where the system refuses.
    fn submit(&mut self, endpoint: u8) -> Result<()>;

    /// Ends it and awaits what is under way.
    ///
    /// # Errors
    /// Where the device is gone.
    fn drain(&mut self, endpoint: u8) -> Result<()>;

    /// Calls `packet` with packets that have come (endpoint, bytes, when), in their order; their number,
    /// 0 where none came within `timeout`.
    ///
    /// # Errors
    /// [`crate::Error::Unplugged`] where the device is gone.
    fn packets(
        &mut self,
        timeout: Duration,
        packet: &mut dyn FnMut(u8, &[u8], Stamp),
    ) -> Result<usize>;
}
