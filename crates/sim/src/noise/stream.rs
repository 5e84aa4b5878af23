//! Random streams: one key for a seed, a purpose and a frame; one ChaCha stream for each chunk.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What the numbers are for, so that two uses of one seed never share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub(crate) enum Purpose {
    CorrelatedDepth = 1,
    Holes = 2,
    IndependentDepth = 3,
    Image = 4,
    Imu = 5,
    MagneticField = 6,
    Magnetometer = 7,
    Velocity = 8,
}

/// The random streams of one frame (or of one sensor, frame 0).
#[derive(Clone, Debug)]
pub(crate) struct Streams {
    base: ChaCha8Rng,
}

impl Streams {
    pub(crate) fn new(seed: u64, purpose: Purpose, frame_index: u64) -> Self {
        let mut key = [0_u8; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&(purpose as u64).to_le_bytes());
        key[16..24].copy_from_slice(&frame_index.to_le_bytes());
        Self {
            base: ChaCha8Rng::from_seed(key),
        }
    }

    /// The stream of chunk `index` (an image row, say), from its beginning.
    pub(crate) fn chunk(&self, index: u64) -> ChaCha8Rng {
        let mut rng = self.base.clone();
        rng.set_stream(index);
        rng
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn streams_of_other_seed_purpose_frame_or_chunk_differ() {
        let first = |seed, purpose, frame, chunk| {
            Streams::new(seed, purpose, frame).chunk(chunk).next_u64()
        };
        let reference = first(1, Purpose::Image, 0, 0);
        assert_eq!(reference, first(1, Purpose::Image, 0, 0));
        for other in [
            first(2, Purpose::Image, 0, 0),
            first(1, Purpose::Holes, 0, 0),
            first(1, Purpose::Image, 1, 0),
            first(1, Purpose::Image, 0, 1),
        ] {
            assert_ne!(reference, other);
        }
    }
}
