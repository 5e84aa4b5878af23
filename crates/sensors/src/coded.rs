//! A number coded in a part of each image, by which frames and inertial samples are matched.
//!
//! Thesis: section 9.1.3. The inertial unit sends the depth camera a signal whose value changes from
//! frame to frame. Here it is a row of squares, dark for 0 and bright for 1: the bits of the number in
//! Gray code, the most significant first, then one bit that makes the number of ones even. Numbers
//! that follow each other differ in one bit, so that an image taken while it changes shows one of
//! the two or none, and no third one.

use sphereflow_core::checks::within;
use sphereflow_core::{Plane, Result};

/// Where the squares are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CodedSignal {
    /// Column of the first square's first pixel.
    pub x: usize,
    /// Row of the squares' first pixel.
    pub y: usize,
    /// Side of a square, pixels.
    pub side: usize,
    /// Bits of the number, without the parity: 1 to 16.
    pub bits: usize,
}

/// Why an image shows no number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoNumber {
    /// The squares do not lie in the image.
    Outside,
    /// A square is neither dark nor bright.
    Blurred,
    /// The parity is wrong.
    Parity,
}

/// Mean brightness (0 to 255) up to which a square is dark; the same distance from white is bright.
const DARK: f64 = 96.0;

impl CodedSignal {
    /// # Errors
    /// Where the number of bits or the side is out of range.
    pub fn check(&self) -> Result<()> {
        within("bits", self.bits, 1..=16)?;
        within("side", self.side, 1..=256)
    }

    /// The number that an image shows.
    ///
    /// # Errors
    /// [`NoNumber`] where it shows none: never a guess.
    pub fn decode(&self, grey: &Plane<f32>) -> std::result::Result<u32, NoNumber> {
        let (width, height) = grey.size();
        let end = self
            .x
            .saturating_add(self.side.saturating_mul(self.bits + 1));
        if self.side == 0 || end > width || self.y.saturating_add(self.side) > height {
            return Err(NoNumber::Outside);
        }
        let mut code = 0_u32;
        for square in 0..=self.bits {
            let mean = self.mean(grey, square);
            let bright = mean >= 255.0 - DARK;
            let dark = mean <= DARK;
            if !bright && !dark {
                return Err(NoNumber::Blurred);
            }
            code = code << 1 | u32::from(bright);
        }
        if !code.count_ones().is_multiple_of(2) {
            return Err(NoNumber::Parity);
        }
        Ok(from_gray(code >> 1))
    }

    /// Mean of a square's middle: its border may be smeared.
    fn mean(&self, grey: &Plane<f32>, square: usize) -> f64 {
        let border = self.side / 4;
        let first = self.x + square * self.side + border;
        let inside = self.side - 2 * border;
        let rows = self.y + border..self.y + border + inside;
        let sum: f64 = rows
            .flat_map(|y| grey.row(y)[first..first + inside].iter())
            .map(|value| f64::from(*value))
            .sum();
        sum / (inside * inside) as f64
    }

    /// Draws a number's lowest bits into an image; squares outside are left out.
    pub fn draw(&self, number: u32, image: &mut Plane<[u8; 3]>) {
        let gray = (number ^ number >> 1) & ((1_u32 << self.bits.min(16)) - 1);
        let gray = if self.bits == 0 { 0 } else { gray };
        let code = gray << 1 | (gray.count_ones() & 1);
        let width = image.width();
        for square in 0..=self.bits.min(16) {
            let bright = code >> (self.bits.min(16) - square) & 1 == 1;
            let first = self.x + square * self.side;
            for y in self.y..(self.y + self.side).min(image.height()) {
                for x in first..(first + self.side).min(width) {
                    image.data_mut()[y * width + x] = [if bright { 255 } else { 0 }; 3];
                }
            }
        }
    }
}

fn from_gray(gray: u32) -> u32 {
    (1..32).fold(gray, |number, shift| number ^ gray >> shift)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sphereflow_core::grey;

    const SIGNAL: CodedSignal = CodedSignal {
        x: 3,
        y: 2,
        side: 6,
        bits: 8,
    };

    fn image(number: u32) -> Plane<[u8; 3]> {
        let mut image = Plane::filled(64, 16, [130; 3]);
        SIGNAL.draw(number, &mut image);
        image
    }

    #[test]
    fn every_number_drawn_is_read() {
        assert!(SIGNAL.check().is_ok());
        for number in 0..256 {
            assert_eq!(SIGNAL.decode(&grey(&image(number))), Ok(number));
        }
    }

    #[test]
    fn a_single_flipped_square_is_never_read_as_a_number() {
        for square in 0..9 {
            let mut image = image(77);
            for y in 2..8 {
                for x in 3 + 6 * square..9 + 6 * square {
                    let pixel = &mut image.data_mut()[y * 64 + x];
                    *pixel = pixel.map(|v| 255 - v);
                }
            }
            assert_eq!(SIGNAL.decode(&grey(&image)), Err(NoNumber::Parity));
        }
    }

    #[test]
    fn half_an_exposure_of_two_numbers_shows_none() {
        // Thesis: section 9.1.3
        let (a, b) = (grey(&image(4)), grey(&image(5)));
        let mean = Plane::from_fn(64, 16, |x, y| (a[(x, y)] + b[(x, y)]) / 2.0);
        assert_eq!(SIGNAL.decode(&mean), Err(NoNumber::Blurred));
        let outside = CodedSignal { x: 20, ..SIGNAL };
        assert_eq!(outside.decode(&mean), Err(NoNumber::Outside));
    }
}
