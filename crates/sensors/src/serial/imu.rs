//! An IMU on a serial port: configured, decoded, its readings on the host's clock.

use super::SerialLink;
use crate::clock::{ClockFit, ClockState};
use crate::imu::epson::{Action, Burst, BurstFormat, Counter, Setup, burst_decoder};
use crate::imu::text::{Lines, line_decoder};
use crate::imu::vectornav::{Binary, binary_decoder};
use crate::imu::xsens::{MtData2, TO_MEASUREMENT, mtdata2_decoder};
use crate::imu::{Decoder, Reading};
use crate::{Error, MessageFaults, Result};
use sphereflow_core::{ImuSample, MagSample, Stamp};
use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// How long an answer during configuration is awaited.
const ANSWER: Duration = Duration::from_millis(500);
/// Between two commands, which the device takes up to 350 microseconds for.
const BETWEEN: Duration = Duration::from_millis(1);

/// Which protocol a port speaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImuKind {
    /// Epson M-G3xx: found out and configured.
    Epson {
        /// What messages hold.
        format: BurstFormat,
        /// Messages per second, one of [`crate::imu::epson::output_rates`].
        rate_hz: f64,
    },
    /// Xsens MTi, sending MTData2 as it was configured.
    Xsens,
    /// VectorNav, sending binary messages as it was configured.
    VectorNav,
    /// A board that sends the lines of [`crate::imu::text`].
    Text,
}

/// A sample on the host's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SerialSample {
    /// Gyro and accelerometer.
    Imu(ImuSample),
    /// Magnetometer.
    Mag(MagSample),
}

#[derive(Debug)]
enum AnyDecoder {
    Epson(Decoder<Burst>),
    Xsens(Decoder<MtData2>),
    VectorNav(Decoder<Binary>),
    Text(Decoder<Lines>),
}

/// An open IMU.
#[derive(Debug)]
pub struct SerialImu {
    link: SerialLink,
    decoder: AnyDecoder,
    clock: ClockFit,
    product: Option<String>,
    waiting: VecDeque<SerialSample>,
}

impl SerialImu {
    /// Opens a port and brings the device on it to send.
    ///
    /// # Errors
    /// Those of [`SerialLink::open`]; [`Error::Timeout`] and [`Error::Protocol`] where an Epson unit
    /// does not answer as one.
    pub fn open(port: &str, baud: u32, kind: ImuKind) -> Result<Self> {
        let mut link = SerialLink::open(port, baud)?;
        let mut product = None;
        let decoder = match kind {
            ImuKind::Epson { format, rate_hz } => {
                let mut setup = Setup::new(format, rate_hz)?;
                configure(&mut link, &mut setup)?;
                product = Some(setup.product().to_owned());
                let model = setup.model().ok_or_else(|| {
                    Error::protocol(port, "configuration", "a known model", "none")
                })?;
                let period_ns = (1e9 / rate_hz).round() as i64;
                AnyDecoder::Epson(burst_decoder(
                    *model,
                    format,
                    Counter::Messages { period_ns },
                ))
            }
            ImuKind::Xsens => {
                link.write(&TO_MEASUREMENT)?;
                AnyDecoder::Xsens(mtdata2_decoder())
            }
            ImuKind::VectorNav => AnyDecoder::VectorNav(binary_decoder()),
            ImuKind::Text => AnyDecoder::Text(line_decoder()),
        };
        Ok(Self {
            link,
            decoder,
            clock: ClockFit::new(),
            product,
            waiting: VecDeque::new(),
        })
    }

    /// Product number of an Epson unit.
    pub fn product(&self) -> Option<&str> {
        self.product.as_deref()
    }

    /// What went wrong so far.
    pub fn faults(&self) -> MessageFaults {
        match &self.decoder {
            AnyDecoder::Epson(decoder) => decoder.faults(),
            AnyDecoder::Xsens(decoder) => decoder.faults(),
            AnyDecoder::VectorNav(decoder) => decoder.faults(),
            AnyDecoder::Text(decoder) => decoder.faults(),
        }
    }

    /// Drift and jitter of the device's clock.
    pub fn clock(&self) -> ClockState {
        self.clock.state()
    }

    /// The next sample; `None` where none came within `timeout`.
    ///
    /// # Errors
    /// [`Error::Unplugged`] where the port is gone, within 100 ms.
    pub fn next_sample(&mut self, timeout: Duration) -> Result<Option<SerialSample>> {
        let begin = Instant::now();
        loop {
            if let Some(sample) = self.waiting.pop_front() {
                return Ok(Some(sample));
            }
            if begin.elapsed() > timeout {
                return Ok(None);
            }
            let mut bytes = [0; 1024];
            let count = self.link.read(&mut bytes)?;
            self.take(&bytes[..count], now());
        }
    }

    fn take(&mut self, bytes: &[u8], arrived: Stamp) {
        let (clock, waiting) = (&mut self.clock, &mut self.waiting);
        let push = |reading: Reading| {
            let stamp = reading
                .device_ns
                .map_or(arrived, |ns| clock.stamp(ns, arrived));
            waiting.extend(reading.imu(stamp).map(SerialSample::Imu));
            waiting.extend(reading.mag(stamp).map(SerialSample::Mag));
        };
        match &mut self.decoder {
            AnyDecoder::Epson(decoder) => decoder.push(bytes, push),
            AnyDecoder::Xsens(decoder) => decoder.push(bytes, push),
            AnyDecoder::VectorNav(decoder) => decoder.push(bytes, push),
            AnyDecoder::Text(decoder) => decoder.push(bytes, push),
        }
    }
}

/// The host's time since 1970.
fn now() -> Stamp {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    Stamp::from_ns(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

fn configure(link: &mut SerialLink, setup: &mut Setup) -> Result<()> {
    loop {
        match setup.next() {
            Action::Done => return Ok(()),
            Action::Send(bytes) => {
                link.write(&bytes)?;
                std::thread::sleep(BETWEEN);
            }
            Action::Discard(ms) => {
                let begin = Instant::now();
                while begin.elapsed() < Duration::from_millis(ms) {
                    link.read(&mut [0; 1024])?;
                }
            }
            Action::Ask(bytes) => {
                link.write(&bytes)?;
                let answer = answer(link, bytes[0])?;
                setup.answer(&answer)?;
                std::thread::sleep(BETWEEN);
            }
        }
    }
}

/// The four bytes that answer a question about `address`.
fn answer(link: &mut SerialLink, address: u8) -> Result<[u8; 4]> {
    let begin = Instant::now();
    let (mut answer, mut got) = ([0; 4], 0);
    while got < answer.len() {
        if begin.elapsed() > ANSWER {
            return Err(Error::Timeout {
                device: link.name().into(),
                action: format!("a question about register {address:#04x}"),
                seconds: ANSWER.as_secs_f64(),
            });
        }
        got += link.read(&mut answer[got..])?;
    }
    Ok(answer)
}
