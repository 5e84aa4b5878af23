//! A simulated Epson unit behind a pseudo terminal, which opens like any serial port.

use super::{EpsonSimulator, Script};
use crate::{Error, Result};
use serialport::{SerialPort, TTYPort};
use std::io::{Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Between two looks at what the host sent.
const LOOK: Duration = Duration::from_millis(1);

/// The device and the thread that runs it; ends when it is dropped.
#[derive(Debug)]
pub struct PtyEpson {
    name: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl PtyEpson {
    /// A device that sends so many messages per second once it is configured.
    ///
    /// # Errors
    /// Where the rate is not positive, or the system has no pseudo terminals.
    pub fn start(rate_hz: f64, script: Script) -> Result<Self> {
        sphereflow_core::checks::positive("rate_hz", rate_hz)?;
        let (mut master, slave) = TTYPort::pair().map_err(|error| Error::System {
            device: "sim:epson".into(),
            action: "open a pseudo terminal".into(),
            reason: error.to_string(),
        })?;
        let name = slave.name().unwrap_or_default();
        drop(slave); // it is to be opened by its name
        let _ = master.set_timeout(LOOK);
        let stop = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&stop);
        let period = Duration::from_secs_f64(1.0 / rate_hz);
        let thread = std::thread::spawn(move || {
            run(&mut master, EpsonSimulator::new(script), period, &ended);
        });
        Ok(Self {
            name,
            stop,
            thread: Some(thread),
        })
    }

    /// Name of the port to open.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl Drop for PtyEpson {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(master: &mut TTYPort, mut device: EpsonSimulator, period: Duration, stop: &AtomicBool) {
    let mut due = None;
    while !stop.load(Ordering::Relaxed) && !device.is_unplugged() {
        let mut bytes = [0; 256];
        // while nobody has opened the other end, reading fails: that is no fault
        match master.read(&mut bytes) {
            Ok(count) if count > 0 => {
                let answers = device.receive(&bytes[..count]);
                let _ = master.write_all(&answers);
            }
            _ => std::thread::sleep(LOOK),
        }
        if !device.samples() {
            due = None;
            continue;
        }
        let first = *due.get_or_insert_with(|| (Instant::now(), device.count()));
        while !device.is_unplugged() && first.0.elapsed() >= period * (device.count() - first.1) {
            let _ = master.write_all(&device.next_message());
        }
    }
}
