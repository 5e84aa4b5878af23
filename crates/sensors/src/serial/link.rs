//! A serial port: bytes in and out, and a clear end when it is unplugged.

use crate::{Error, Result};
use serialport::SerialPort;
use std::io::{ErrorKind, Read, Write};
use std::time::Duration;

/// A read gives up after this long without a byte: short enough for an unplugged port to be told
/// within a second, long enough to sleep between messages.
const READ_TIMEOUT: Duration = Duration::from_millis(100);

/// An open port with 8 data bits, no parity, one stop bit.
pub struct SerialLink {
    port: Box<dyn SerialPort>,
    name: String,
}

impl std::fmt::Debug for SerialLink {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SerialLink")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

impl SerialLink {
    /// Opens a port, as `/dev/ttyUSB0` or `COM3`, for this process alone.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where it is not there, [`Error::System`] where the system refuses.
    pub fn open(name: &str, baud: u32) -> Result<Self> {
        let port = serialport::new(name, baud).timeout(READ_TIMEOUT).open();
        let port = port.map_err(|error| match error.kind() {
            serialport::ErrorKind::NoDevice | serialport::ErrorKind::Io(ErrorKind::NotFound) => {
                Error::NoDevice {
                    wanted: name.into(),
                    found: ports(),
                }
            }
            serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => Error::System {
                device: name.into(),
                action: "open".into(),
                reason: format!("{error}; on Linux the user must be in the group dialout"),
            },
            _ => Error::System {
                device: name.into(),
                action: "open".into(),
                reason: error.to_string(),
            },
        })?;
        Ok(Self {
            port,
            name: name.into(),
        })
    }

    /// The port's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Bytes that have come, at least one unless none came for 100 ms; their number.
    ///
    /// # Errors
    /// [`Error::Unplugged`] where the port is gone.
    pub fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        match self.port.read(bytes) {
            Ok(0) => Err(self.unplugged()),
            Ok(count) => Ok(count),
            Err(error) => match error.kind() {
                ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted => Ok(0),
                _ => Err(self.unplugged()),
            },
        }
    }

    /// Sends bytes.
    ///
    /// # Errors
    /// [`Error::Unplugged`] where the port is gone.
    pub fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let sent = self.port.write_all(bytes).and_then(|()| self.port.flush());
        sent.map_err(|_| self.unplugged())
    }

    fn unplugged(&self) -> Error {
        Error::Unplugged {
            device: self.name.clone(),
        }
    }
}

/// Names of the ports that the system knows.
fn ports() -> String {
    let ports = serialport::available_ports().unwrap_or_default();
    let names: Vec<String> = ports.into_iter().map(|port| port.port_name).collect();
    if names.is_empty() {
        "no serial port".into()
    } else {
        names.join(", ")
    }
}
