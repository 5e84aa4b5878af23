//! Holes: round blobs of unknown depth scattered over the image.

use super::stream::Streams;
use rand::RngExt;
use std::f64::consts::PI;

/// Radii of the blobs, pixels, uniform between the two.
const RADIUS_PX: (f64, f64) = (1.5, 6.0);

/// Makes about `share` of `metres` NaN in discs at random places. Discs overlap, hence the logarithm:
/// a pixel survives `n` discs of mean area `A` in an image of area `S` with probability `exp(-n A / S)`.
pub(crate) fn punch(metres: &mut [f32], width: usize, share: f64, streams: &Streams) {
    let (lo, hi) = RADIUS_PX;
    let height = metres.len() / width;
    let mean_area = PI * (hi.powi(3) - lo.powi(3)) / (3.0 * (hi - lo));
    // Centres may lie outside, so that the border has as many holes as the middle.
    let (span_x, span_y) = (width as f64 + 2.0 * hi, height as f64 + 2.0 * hi);
    let expected = -(1.0 - share).ln() * span_x * span_y / mean_area;
    let mut rng = streams.chunk(0);
    let count = expected.floor() as usize + usize::from(rng.random::<f64>() < expected.fract());
    for _ in 0..count {
        let x = rng.random::<f64>() * span_x - hi - 0.5;
        let y = rng.random::<f64>() * span_y - hi - 0.5;
        let radius = lo + (hi - lo) * rng.random::<f64>();
        disc(metres, width, (x, y), radius);
    }
}

/// Makes the pixels within `radius` of `centre` unknown.
fn disc(metres: &mut [f32], width: usize, centre: (f64, f64), radius: f64) {
    let rows = metres.chunks_exact_mut(width).enumerate();
    let first = (centre.1 - radius).ceil().max(0.0) as usize;
    let count = (2.0 * radius) as usize + 2;
    for (y, row) in rows.skip(first).take(count) {
        let dy = y as f64 - centre.1;
        let half = radius * radius - dy * dy;
        if half < 0.0 {
            continue;
        }
        let half = half.sqrt();
        let from = (centre.0 - half).ceil().max(0.0) as usize;
        let to = ((centre.0 + half).floor() + 1.0).clamp(0.0, width as f64) as usize;
        if from < to {
            row[from..to].fill(f32::NAN);
        }
    }
}
