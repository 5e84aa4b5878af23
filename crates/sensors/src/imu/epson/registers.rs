//! Registers: how they are read and written. A register is two bytes in one of some windows.

/// A register: its window and its even address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// Window that must be selected.
    pub window: u8,
    /// Address.
    pub address: u8,
}

impl Register {
    const fn new(window: u8, address: u8) -> Self {
        Self { window, address }
    }

    /// Mode: high byte 1 starts sampling, 2 stops it; bit 10 tells that it is stopped.
    pub const MODE: Self = Self::new(0, 0x02);
    /// 0x5345 in every device.
    pub const ID: Self = Self::new(0, 0x4c);
    /// Output rate in the high byte, filter in the low one.
    pub const RATE: Self = Self::new(1, 0x04);
    /// Bit 5 of the filter: still being set.
    pub const FILTER: Self = Self::new(1, 0x06);
    /// Bit 0: messages come unasked.
    pub const UART: Self = Self::new(1, 0x08);
    /// Bit 7 resets; bit 10 tells that the device is not ready.
    pub const COMMAND: Self = Self::new(1, 0x0a);
    /// Fields of a burst message.
    pub const BURST_1: Self = Self::new(1, 0x0c);
    /// Which of them have 32 bits.
    pub const BURST_2: Self = Self::new(1, 0x0e);
    /// First of the four that hold the product number, two letters each, the first in the low byte.
    pub const PRODUCT: Self = Self::new(1, 0x6a);
}

/// Last byte of every message in either direction.
pub const DELIMITER: u8 = 0x0d;

/// Asks for a register of the selected window: the answer is address, high byte, low byte, 0x0d.
pub fn read(address: u8) -> [u8; 3] {
    [address & 0x7f, 0, DELIMITER]
}

/// Writes one byte of the selected window: no answer.
pub fn write(address: u8, value: u8) -> [u8; 3] {
    [address | 0x80, value, DELIMITER]
}

/// Selects a window: no answer.
pub fn select_window(window: u8) -> [u8; 3] {
    [0xfe, window, DELIMITER]
}
