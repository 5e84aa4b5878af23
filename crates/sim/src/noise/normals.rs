//! Normal random numbers from a table: for noise that is rounded or smoothed afterwards.
//!
//! The normal law is cut into 4096 pieces of equal probability, each replaced by its mean, and the
//! values scaled to unit variance. One lookup of 12 random bits then draws a number, five of them
//! from 64 bits. Against the law itself the largest magnitude is 3.8 (one true draw in 7000 is
//! larger) and the values lie up to 0.3 apart out there, 0.0006 in the middle: rounding to grey
//! levels or a filter over some pixels hides both.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use std::sync::LazyLock;

const BITS: u32 = 12;
const PIECES: usize = 1 << BITS;
const PER_DRAW: usize = (u64::BITS / BITS) as usize;

static TABLE: LazyLock<[f32; PIECES]> = LazyLock::new(table);

/// Step of the integration of the density: its error is far below a rounding of `f32`.
const STEP: f64 = 1e-4;

/// Means of the pieces, ascending, of unit variance.
fn table() -> [f32; PIECES] {
    let density = |x: f64| (-0.5 * x * x).exp() / TAU.sqrt();
    // Borders of the pieces above zero by integration from the middle; beyond the last, nothing.
    let (mut x, mut mass, mut below) = (0.0, 0.0, density(0.0));
    let mut upper = [0.0_f64; PIECES / 2];
    for (index, mean) in upper.iter_mut().enumerate() {
        let border = (index + 1) as f64 / PIECES as f64;
        let mut at_border = 0.0;
        if index + 1 < PIECES / 2 {
            loop {
                let piece = STEP * density(x + 0.5 * STEP);
                if mass + piece >= border {
                    at_border = density(x + STEP * (border - mass) / piece);
                    break;
                }
                (x, mass) = (x + STEP, mass + piece);
            }
        }
        // The mean over a piece from a to b is the density's fall from a to b over its probability.
        *mean = (below - at_border) * PIECES as f64;
        below = at_border;
    }
    let variance = upper.iter().map(|v| v * v).sum::<f64>() / upper.len() as f64;
    let scale = 1.0 / variance.sqrt();
    std::array::from_fn(|index| match index.checked_sub(PIECES / 2) {
        Some(above) => (upper[above] * scale) as f32,
        None => (-upper[PIECES / 2 - 1 - index] * scale) as f32,
    })
}

/// Lets `put` place one normal number on each value.
#[inline]
pub(crate) fn for_each(
    values: &mut [f32],
    rng: &mut ChaCha8Rng,
    mut put: impl FnMut(&mut f32, f32),
) {
    let table = &*TABLE;
    let mut groups = values.chunks_exact_mut(PER_DRAW);
    let mut place = |bits: u64, value: &mut f32| {
        put(value, table[bits as usize & (PIECES - 1)]);
        bits >> BITS
    };
    for group in &mut groups {
        group.iter_mut().fold(rng.next_u64(), &mut place);
    }
    let rest = groups.into_remainder();
    if !rest.is_empty() {
        rest.iter_mut().fold(rng.next_u64(), place);
    }
}

#[cfg(test)]
mod tests {
    use super::super::stream::{Purpose, Streams};
    use super::*;

    #[test]
    fn normals_table_has_the_moments_and_quantiles_of_the_normal_law() {
        let values = TABLE.map(f64::from);
        let moment = |k: i32| values.iter().map(|v| v.powi(k)).sum::<f64>() / PIECES as f64;
        assert!(moment(1).abs() < 1e-7 && moment(3).abs() < 1e-6);
        // Rounding of 4096 f32.
        assert!((moment(2) - 1.0).abs() < 1e-6, "{}", moment(2));
        // What is cut off beyond 3.8 sigma.
        assert!((moment(4) - 3.0).abs() < 0.03, "{}", moment(4));
        assert!(values.windows(2).all(|pair| pair[0] < pair[1]));
        // Quantiles at -3, -1 and 2 sigma, from any table of the normal law.
        for (sigma, below) in [(-3.0, 0.001_349_90), (-1.0, 0.158_655), (2.0, 0.977_250)] {
            let share = values.iter().filter(|v| **v < sigma).count() as f64 / PIECES as f64;
            assert!(
                (share - below).abs() < 1.5 / PIECES as f64,
                "{sigma}: {share}"
            );
        }
    }

    #[test]
    fn normals_reach_every_value_once_and_are_independent_of_their_neighbours() {
        let mut rng = Streams::new(1, Purpose::Image, 0).chunk(0);
        let count = 200_003;
        let mut values = vec![0.0; count];
        for_each(&mut values, &mut rng, |value, normal| {
            *value += 1.0 + normal
        });
        let centred: Vec<f64> = values.iter().map(|v| f64::from(*v) - 1.0).collect();
        for lag in 1..8 {
            let products = centred.iter().zip(&centred[lag..]).map(|(a, b)| a * b);
            let correlation = products.sum::<f64>() / count as f64;
            // Four standard errors.
            assert!(correlation.abs() < 0.009, "{lag}: {correlation}");
        }
        let variance = centred.iter().map(|v| v * v).sum::<f64>() / count as f64;
        assert!((variance - 1.0).abs() < 0.013, "{variance}");
    }
}
