//! An Epson M-G366 as far as its registers and messages: bytes in, bytes out.

use crate::imu::epson::{BurstFormat, Register};

/// Product number, two letters in each register.
const PRODUCT: [u16; 4] = [0x3347, 0x3636, 0x4450, 0x3047];
/// Counts of the accelerometer that are 1 g: 0.25 thousandths each.
const ONE_G: f64 = 4000.0;

/// What goes wrong, by message numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Script {
    /// Every so many messages one is lost; 0 for none.
    pub lose_every: u32,
    /// Every so many messages garbage stands before one; 0 for none.
    pub garbage_every: u32,
    /// After so many messages the device is unplugged; 0 for never.
    pub unplug_after: u32,
}

/// The device: registers in two windows, and messages while it samples.
#[derive(Clone, Debug)]
pub struct EpsonSimulator {
    windows: [[u16; 64]; 2],
    window: usize,
    received: Vec<u8>,
    script: Script,
    count: u32,
}

impl EpsonSimulator {
    /// A device that has been switched on, with what goes wrong.
    pub fn new(script: Script) -> Self {
        let mut device = Self {
            windows: [[0; 64]; 2],
            window: 0,
            received: Vec::new(),
            script,
            count: 0,
        };
        device.windows[0][usize::from(Register::MODE.address / 2)] = 0x0400;
        device.windows[0][usize::from(Register::ID.address / 2)] = 0x5345;
        let first = usize::from(Register::PRODUCT.address / 2);
        device.windows[1][first..first + 4].copy_from_slice(&PRODUCT);
        device
    }

    /// Bytes from the host; the answers to them.
    pub fn receive(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut answers = Vec::new();
        self.received.extend_from_slice(bytes);
        while let Some(end) = self.received.get(2).copied() {
            if end != 0x0d {
                self.received.remove(0); // no command: one byte on
                continue;
            }
            let (head, value) = (self.received[0], self.received[1]);
            self.received.drain(..3);
            answers.extend(self.command(head, value));
        }
        answers
    }

    fn command(&mut self, head: u8, value: u8) -> Vec<u8> {
        let address = head & 0x7f;
        let register = usize::from(address / 2);
        if head & 0x80 == 0 {
            let [high, low] = self.windows[self.window][register].to_be_bytes();
            return vec![address, high, low, 0x0d];
        }
        if head == 0xfe {
            self.window = usize::from(value & 1);
            return Vec::new();
        }
        let old = self.windows[self.window][register].to_be_bytes();
        let new = if address % 2 == 1 {
            [value, old[1]]
        } else {
            [old[0], value]
        };
        self.windows[self.window][register] = u16::from_be_bytes(new);
        if self.window == 0 && address == Register::MODE.address + 1 {
            self.windows[0][register] = if value == 1 { 0 } else { 0x0400 };
        }
        Vec::new()
    }

    /// Whether messages are due.
    pub fn samples(&self) -> bool {
        self.windows[0][usize::from(Register::MODE.address / 2)] & 0x0400 == 0
            && self.windows[1][usize::from(Register::UART.address / 2)] & 1 == 1
    }

    /// Whether the script has come to the unplugging.
    pub fn is_unplugged(&self) -> bool {
        self.script.unplug_after > 0 && self.count >= self.script.unplug_after
    }

    /// Messages sent or lost so far.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The bytes of the next message, with what the script puts before it or instead of it: at rest,
    /// level, its gyro's z reads the message's number in counts up to 100.
    pub fn next_message(&mut self) -> Vec<u8> {
        let register = |register: Register| self.windows[1][usize::from(register.address / 2)];
        let format = BurstFormat {
            fields: register(Register::BURST_1),
            wide: register(Register::BURST_2),
        };
        self.count += 1;
        let due = |every: u32| every > 0 && self.count.is_multiple_of(every);
        let gyro = [0.0, 0.0, f64::from(self.count % 100)];
        let message = format.encode(0.0, gyro, [0.0, 0.0, ONE_G], self.count as u16);
        let mut bytes = Vec::new();
        if due(self.script.garbage_every) {
            bytes.extend([0x80, 0x00, 0x0d, 0x80, 0x80, 0xfe, 0x0d].repeat(3));
        }
        if !due(self.script.lose_every) {
            bytes.extend(message);
        }
        bytes
    }
}
