//! The filter's state as ranges of the full image.

use super::doubt::Doubt;
use super::edges::Edges;
use super::lattice::Lattice;
use super::state::Node;
use rayon::prelude::*;
use sphereflow_core::Plane;
use sphereflow_sphere::Camera;

/// Rays of the full image, and where its pixels lie on the lattice.
#[derive(Clone, Debug)]
pub(super) struct Output {
    /// Length of the ray of gauge 1; NaN where there is none.
    length: Vec<f32>,
    width: usize,
    height: usize,
    binning: usize,
}

impl Output {
    pub fn new(camera: &Camera, binning: usize) -> Self {
        let (width, height) = (camera.width(), camera.height());
        let length = (0..width * height)
            .map(|i| Lattice::gauge_ray(camera, (i % width) as f64, (i / width) as f64).norm())
            .collect();
        Self {
            length,
            width,
            height,
            binning,
        }
    }

    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Range and its standard deviation, metres. zeta is read bilinearly, which is exact on planes of a
    /// pinhole; pixels outside the lattice's outermost centres extrapolate.
    pub fn fill(
        &self,
        lattice: &Lattice,
        (nodes, trust, doubt): (&[Node], &[f32], &Doubt),
        scale: StdScale,
        range: &mut Plane<f32>,
        std: &mut Plane<f32>,
    ) {
        let width = self.width;
        let (edges, doubts) = (Edges::new(lattice, nodes), doubt.of_pixels(nodes, trust));
        let columns: Vec<(usize, usize, f32)> = (0..width)
            .map(|x| place(x, self.binning, lattice.width, lattice.wraps))
            .collect();
        let rows = range.data_mut().par_chunks_mut(width);
        rows.zip(std.data_mut().par_chunks_mut(width))
            .enumerate()
            .for_each(|(y, (range, std))| {
                let (top, bottom, t) = place(y, self.binning, lattice.height, false);
                let row_cell = top;
                let (top, bottom) = (top * lattice.width, bottom * lattice.width);
                let length = &self.length[y * width..(y + 1) * width];
                for (x, (left, right, s)) in columns.iter().enumerate() {
                    let [a, b] = [top + left, top + right];
                    let [c, d] = [bottom + left, bottom + right];
                    let all = |k: usize| [nodes[a][k], nodes[b][k], nodes[c][k], nodes[d][k]];
                    // Variances are not extrapolated: two that differ would leave none beyond the smaller one.
                    let within = (s.clamp(0.0, 1.0), t.clamp(0.0, 1.0));
                    let (zeta, variance) = (mix(all(0), *s, t), mix(all(3), within.0, within.1));
                    // Extrapolation by a quarter of a pixel must not leave what is possible.
                    let corner = nodes[a][0];
                    let zeta = if zeta < 0.5 * corner {
                        0.5 * corner
                    } else {
                        zeta
                    };
                    let metres = length[x] / zeta;
                    let square = zeta * zeta;
                    let doubts = [doubts[a], doubts[b], doubts[c], doubts[d]];
                    let against = mix(doubts, within.0, within.1);
                    let other = edges.variance(zeta, *left, row_cell) + against * square;
                    let deviation = scale.of(doubt.of_noise(variance, square), other, zeta);
                    let known = metres > 0.0 && metres.is_finite();
                    range[x] = if known { metres } else { f32::NAN };
                    std[x] = if known { metres * deviation } else { f32::NAN };
                }
            });
    }
}

/// Bilinear mix of the upper and the lower two.
#[inline(always)]
fn mix([a, b, c, d]: [f32; 4], s: f32, t: f32) -> f32 {
    let (upper, lower) = (a + s * (b - a), c + s * (d - c));
    upper + t * (lower - upper)
}

/// From the variance the state carries to the error that is seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct StdScale {
    /// Factor on the standard deviation of zeta.
    pub factor: f32,
    /// Relative error that no measurement takes away.
    pub floor: f32,
    /// Relative variance of an error that all pixels share.
    pub common: f32,
    /// What all of it but the state's variance has grown by since anything was measured last.
    pub stale: f32,
}

impl StdScale {
    /// Relative standard deviation.
    #[inline(always)]
    pub fn of(&self, variance: f32, edge: f32, zeta: f32) -> f32 {
        let per_square = 1.0 / (zeta * zeta);
        let other = edge * per_square + self.floor * self.floor + self.common;
        (self.factor * self.factor * variance * per_square + self.stale * other).sqrt()
    }
}

/// The lattice's pixels between which a pixel lies, and the way between; beyond them it extrapolates.
fn place(i: usize, binning: usize, size: usize, wraps: bool) -> (usize, usize, f32) {
    let at = (i as f32 + 0.5) / binning as f32 - 0.5;
    if wraps {
        let low = at.floor();
        let wrapped = (low as i64).rem_euclid(size as i64) as usize;
        return (wrapped, (wrapped + 1) % size, at - low);
    }
    let low = (at.max(0.0) as usize).min(size - 2);
    (low, low + 1, at - low as f32)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to
mod tests {
    use super::*;

    const WIDTH: usize = 64;
    const HEIGHT: usize = 48;

    #[test]
    fn variances_are_not_extrapolated_to_nothing_at_the_border() {
        let camera = Camera::pinhole(60.0, 60.0, 31.5, 23.5, WIDTH, HEIGHT).unwrap();
        let lattice = Lattice::new(&camera.binned(2).unwrap()).unwrap();
        let pixels = lattice.width * lattice.height;
        // The outermost columns are known far better than those beside them.
        let (zeta, least, most) = (0.5_f32, 1e-8_f32, 1e-4_f32);
        let node = |i: usize| {
            let outer = [0, lattice.width - 1].contains(&(i % lattice.width));
            [zeta, 0.0, 1.0, if outer { least } else { most }]
        };
        let nodes: Vec<Node> = (0..pixels).map(node).collect();
        let scale = StdScale {
            factor: 1.0,
            floor: 0.0,
            common: 0.0,
            stale: 1.0,
        };
        let mut range = Plane::filled(WIDTH, HEIGHT, 0.0);
        let mut std = range.clone();
        let (trust, doubt) = (vec![1.0; pixels], Doubt::new(pixels));
        Output::new(&camera, 2).fill(
            &lattice,
            (&nodes, &trust, &doubt),
            scale,
            &mut range,
            &mut std,
        );
        let expected = least.sqrt() / zeta;
        for (range, std) in range.data().iter().zip(std.data()) {
            assert!(std / range >= 0.99 * expected, "{} {expected}", std / range);
        }
        let corner = std[(0, 0)] / range[(0, 0)];
        assert!((corner / expected - 1.0).abs() < 0.01, "{corner}");
    }
}
