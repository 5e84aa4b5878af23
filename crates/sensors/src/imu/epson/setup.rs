//! Automatic configuration: which bytes to send, which answers to await; no transport.

use super::registers::{DELIMITER, Register, read, select_window, write};
use super::{BurstFormat, Model, find_model};
use crate::{Error, Result};

/// Output rates, messages per second, with their codes.
const RATES: [(f64, u8); 10] = [
    (2000.0, 0),
    (1000.0, 1),
    (500.0, 2),
    (250.0, 3),
    (125.0, 4),
    (62.5, 5),
    (31.25, 6),
    (400.0, 8),
    (200.0, 9),
    (100.0, 10),
];

/// Bytes on the wire per second at 460 800 baud with 10 bits a byte; a stream of messages may use
/// nine tenths of them.
const WIRE_BYTES_PER_S: f64 = 46_080.0 * 0.9;

/// Answers to a question before it is given up.
const TRIES: u32 = 200;

/// What to do next.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Send these bytes, wait at least a millisecond; no answer comes.
    Send([u8; 3]),
    /// Send these bytes; hand the answer of four bytes to [`Setup::answer`].
    Ask([u8; 3]),
    /// Throw away what has come so far, for this many milliseconds.
    Discard(u64),
    /// The messages come.
    Done,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Window(u8, Next),
    Stop,
    Quiet,
    Asking(Next),
    Writing(usize),
    Start,
    Done,
}

/// What to do in a window once it is selected.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Next {
    Stop,
    Stopped,
    Id,
    Product(usize),
    Filter,
    Start,
}

/// The configuration of one device: ask [`Setup::next`] until it is [`Action::Done`].
#[derive(Clone, Debug)]
pub struct Setup {
    phase: Phase,
    format: BurstFormat,
    rate: (f64, u8),
    product: String,
    model: Option<&'static Model>,
    tries: u32,
}

/// The rates that can be asked for, messages per second.
pub fn output_rates() -> impl Iterator<Item = f64> {
    RATES.iter().map(|(rate, _)| *rate)
}

impl Setup {
    /// For messages of `format` at `rate_hz`.
    ///
    /// # Errors
    /// Where the device has no such rate, or the wire is too slow for it.
    pub fn new(format: BurstFormat, rate_hz: f64) -> Result<Self> {
        let refuse = |expected: String| {
            Error::Core(sphereflow_core::Error::value("rate_hz", expected, rate_hz))
        };
        let rate = RATES.iter().find(|(rate, _)| *rate == rate_hz).copied();
        let names = || {
            output_rates()
                .map(|r| r.to_string())
                .collect::<Vec<_>>()
                .join(", ")
        };
        let rate = rate.ok_or_else(|| refuse(format!("one of {}", names())))?;
        if rate_hz * format.length() as f64 > WIRE_BYTES_PER_S {
            let most = WIRE_BYTES_PER_S / format.length() as f64;
            return Err(refuse(format!("at most {most:.0} (460 800 baud)")));
        }
        let phase = Phase::Window(0, Next::Stop);
        Ok(Self {
            phase,
            format,
            rate,
            product: String::new(),
            model: None,
            tries: 0,
        })
    }

    /// The model, once it is known.
    pub fn model(&self) -> Option<&'static Model> {
        self.model
    }

    /// The product number as far as it is known.
    pub fn product(&self) -> &str {
        &self.product
    }

    fn writes(&self) -> [(u8, u8); 5] {
        let [fields_high, fields_low] = self.format.fields.to_be_bytes();
        [
            (Register::RATE.address + 1, self.rate.1),
            (Register::UART.address, 1),
            (Register::BURST_1.address, fields_low),
            (Register::BURST_1.address + 1, fields_high),
            (
                Register::BURST_2.address + 1,
                self.format.wide.to_be_bytes()[0],
            ),
        ]
    }

    /// What to do next.
    #[allow(clippy::should_implement_trait)] // no iterator: it awaits answers
    pub fn next(&mut self) -> Action {
        match self.phase {
            Phase::Window(window, next) => {
                self.phase = match next {
                    Next::Stop => Phase::Stop,
                    Next::Start => Phase::Start,
                    other => Phase::Asking(other),
                };
                Action::Send(select_window(window))
            }
            Phase::Stop => {
                self.phase = Phase::Quiet;
                Action::Send(write(Register::MODE.address + 1, 2))
            }
            Phase::Quiet => {
                self.phase = Phase::Window(0, Next::Stopped);
                Action::Discard(50) // the last messages at the lowest rate
            }
            Phase::Asking(next) => Action::Ask(read(address(next))),
            Phase::Writing(i) => {
                let (address, value) = self.writes()[i];
                let more = i + 1 < self.writes().len();
                self.phase = if more {
                    Phase::Writing(i + 1)
                } else {
                    Phase::Asking(Next::Filter)
                };
                Action::Send(write(address, value))
            }
            Phase::Start => {
                self.phase = Phase::Done;
                Action::Send(write(Register::MODE.address + 1, 1))
            }
            Phase::Done => Action::Done,
        }
    }

    /// The answer to the last [`Action::Ask`].
    ///
    /// # Errors
    /// Where it is no answer to that question, the device is none of Epson's, its model is unknown,
    /// or it never gets ready.
    pub fn answer(&mut self, bytes: &[u8]) -> Result<()> {
        let Phase::Asking(next) = self.phase else {
            return Ok(());
        };
        let asked = address(next);
        let value = match *bytes {
            [address, high, low, DELIMITER] if address == asked => u16::from_be_bytes([high, low]),
            _ => {
                let expected = format!("{asked:02x} .. .. 0d");
                return Err(refuse(
                    "answer of a register",
                    expected,
                    format!("{bytes:02x?}"),
                ));
            }
        };
        self.tries += 1;
        if self.tries > TRIES {
            return Err(refuse(
                "configuration",
                "a device that gets ready",
                "one that does not",
            ));
        }
        self.phase = match next {
            Next::Stopped if value & 0x0400 == 0 => self.phase,
            Next::Filter if value & 0x20 != 0 => self.phase,
            Next::Stopped => Phase::Asking(Next::Id),
            Next::Id if value != 0x5345 => {
                return Err(refuse("identity", "0x5345", format!("{value:#06x}")));
            }
            Next::Id => Phase::Window(1, Next::Product(0)),
            Next::Product(i) => self.letters(i, value)?,
            _ => Phase::Window(0, Next::Start),
        };
        Ok(())
    }

    fn letters(&mut self, i: usize, value: u16) -> Result<Phase> {
        let letters = value.to_le_bytes().map(char::from);
        self.product
            .extend(letters.iter().filter(|letter| letter.is_ascii_graphic()));
        if i < 3 {
            return Ok(Phase::Asking(Next::Product(i + 1)));
        }
        self.model = find_model(&self.product);
        if self.model.is_none() {
            let known: Vec<&str> = super::MODELS.iter().map(|model| model.product).collect();
            return Err(refuse("model", known.join(", "), &self.product));
        }
        Ok(Phase::Writing(0))
    }
}

fn address(next: Next) -> u8 {
    match next {
        Next::Id => Register::ID.address,
        Next::Product(i) => Register::PRODUCT.address + 2 * i as u8,
        Next::Filter => Register::FILTER.address,
        _ => Register::MODE.address,
    }
}

fn refuse(action: &str, expected: impl ToString, found: impl ToString) -> Error {
    Error::protocol("Epson IMU", action, expected, found)
}

#[cfg(test)]
#[path = "setup_tests.rs"]
mod tests;
