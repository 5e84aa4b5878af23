//! The filter's state as ranges of the full image.

use super::doubt::Doubt;
use super::edges::{EdgeRow, Edges};
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
        let columns: Vec<Place> = (0..width)
            .map(|x| Place::new(x, self.binning, lattice.width, lattice.wraps))
            .collect();
        let arch = pulp::Arch::new();
        let rows = range.data_mut().par_chunks_mut(width);
        rows.zip(std.data_mut().par_chunks_mut(width))
            .enumerate()
            .for_each_init(
                || Mixes::new(lattice.width, width),
                |mixes, (y, (range, std))| {
                    let place = Place::new(y, self.binning, lattice.height, false);
                    let Place { low, high, .. } = place;
                    let rows =
                        [low, high].map(|row| row * lattice.width..(row + 1) * lattice.width);
                    arch.dispatch(Row {
                        nodes: rows.each_ref().map(|row| &nodes[row.clone()]),
                        doubts: rows.map(|row| &doubts[row]),
                        place,
                        columns: &columns,
                        length: &self.length[y * width..][..width],
                        edges: edges.row(low),
                        doubt,
                        scale,
                        mixes,
                        out: [range, std],
                    });
                },
            );
    }
}

/// The lattice's pixels between which a pixel lies, and the way from the lower one; beyond them it extrapolates.
#[derive(Clone, Copy, Debug)]
struct Place {
    low: usize,
    high: usize,
    way: f32,
}

impl Place {
    fn new(i: usize, binning: usize, size: usize, wraps: bool) -> Self {
        let at = (i as f32 + 0.5) / binning as f32 - 0.5;
        if wraps {
            let before = at.floor();
            let low = (before as i64).rem_euclid(size as i64) as usize;
            return Self {
                low,
                high: (low + 1) % size,
                way: at - before,
            };
        }
        let low = (at.max(0.0) as usize).min(size - 2);
        Self {
            low,
            high: low + 1,
            way: at - low as f32,
        }
    }
}

/// One row of the output, compiled for wide vectors.
struct Row<'a> {
    /// Of the lattice's rows above and below.
    nodes: [&'a [Node]; 2],
    doubts: [&'a [f32]; 2],
    /// Between those rows.
    place: Place,
    columns: &'a [Place],
    length: &'a [f32],
    edges: EdgeRow<'a>,
    doubt: &'a Doubt,
    scale: StdScale,
    mixes: &'a mut Mixes,
    out: [&'a mut [f32]; 2],
}

/// What is mixed for a row: zeta, its variance, the doubts' relative variance.
const MIXED: usize = 3;

/// Room for a row of the lattice, mixed of two, and for what its pixels take from there.
struct Mixes {
    lattice: [Vec<f32>; MIXED],
    pixels: [Vec<f32>; MIXED],
    /// Zeta above and left of a pixel.
    corner: Vec<f32>,
    /// As of [`EdgeRow::at`].
    edge: [Vec<f32>; 3],
}

impl Mixes {
    fn new(lattice: usize, width: usize) -> Self {
        Self {
            lattice: [(); MIXED].map(|()| vec![0.0; lattice]),
            pixels: [(); MIXED].map(|()| vec![0.0; width]),
            corner: vec![0.0; width],
            edge: [(); 3].map(|()| vec![0.0; width]),
        }
    }
}

impl pulp::WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { mixes, edges, .. } = self;
        mixes.down(self.nodes, self.doubts, self.place.way);
        mixes.across(self.columns, self.nodes[0], edges);
        let count = self.length.len();
        let [zeta, variance, against] = mixes.pixels.each_ref().map(|row| &row[..count]);
        let [least, most, bent] = mixes.edge.each_ref().map(|row| &row[..count]);
        let (corner, length) = (&mixes.corner[..count], &self.length[..count]);
        let [range, std] = self.out.map(|row| &mut row[..count]);
        for x in 0..count {
            // Extrapolation by a quarter of a pixel must not leave what is possible.
            let (zeta, nearest) = (zeta[x], 0.5 * corner[x]);
            let zeta = if zeta < nearest { nearest } else { zeta };
            let metres = length[x] / zeta;
            let square = zeta * zeta;
            let edge = edges.variance(zeta, [least[x], most[x], bent[x]]);
            let other = edge + against[x] * square;
            let deviation = self
                .scale
                .of(self.doubt.of_noise(variance[x], square), other, zeta);
            // False for NaN, too.
            let known = metres > 0.0 && metres < f32::INFINITY;
            range[x] = if known { metres } else { f32::NAN };
            std[x] = if known { metres * deviation } else { f32::NAN };
        }
    }
}

impl Mixes {
    /// A row between two of the lattice. Variances are not extrapolated: two that differ would leave none beyond the
    /// smaller one.
    #[inline(always)]
    fn down(&mut self, [above, below]: [&[Node]; 2], doubts: [&[f32]; 2], way: f32) {
        let within = way.clamp(0.0, 1.0);
        let [zeta, variance, against] = &mut self.lattice;
        let nodes = above.iter().zip(below);
        let out = zeta.iter_mut().zip(variance);
        for ((zeta, variance), (above, below)) in out.zip(nodes) {
            *zeta = mix(above[0], below[0], way);
            *variance = mix(above[3], below[3], within);
        }
        for ((out, above), below) in against.iter_mut().zip(doubts[0]).zip(doubts[1]) {
            *out = mix(*above, *below, within);
        }
    }

    /// The pixels of that row.
    #[inline(always)]
    fn across(&mut self, columns: &[Place], above: &[Node], edges: EdgeRow<'_>) {
        let Self {
            lattice,
            pixels: [zeta, variance, against],
            corner,
            edge: [least, most, bent],
        } = self;
        for (x, Place { low, high, way }) in columns.iter().enumerate() {
            let within = way.clamp(0.0, 1.0);
            zeta[x] = mix(lattice[0][*low], lattice[0][*high], *way);
            variance[x] = mix(lattice[1][*low], lattice[1][*high], within);
            against[x] = mix(lattice[2][*low], lattice[2][*high], within);
            corner[x] = above[*low][0];
            [least[x], most[x], bent[x]] = edges.at(*low);
        }
    }
}

#[inline(always)]
fn mix(a: f32, b: f32, way: f32) -> f32 {
    a + way * (b - a)
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
