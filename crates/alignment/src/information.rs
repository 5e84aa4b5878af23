//! What one range image lets see of the camera's motion, before any second image is taken.
//!
//! The rate of the range at a fixed ray is linear in the twist: `dD/dt = s(eta) . [omega, v]`. The
//! Gram matrix of these sensitivities over the seen solid angle says which motions change the
//! image and which slide the surface on itself.

use crate::Result;
use crate::depth_image::{Axis, DepthImage};
use crate::direction_name::simplest_basis;
use nalgebra::{Matrix6, SymmetricEigen, Vector3, Vector6};
use sphereflow_core::Error;
use sphereflow_sphere::{Camera, SphereGrid};

/// Blocks across the image, at least: more show only more of the noise.
const BLOCKS_ACROSS: usize = 160;
/// Blocks on each side of a domain.
const SIDE: usize = 8;
/// Relative difference of neighbouring inverse ranges that is a jump from one surface to another.
const MAX_JUMP: f64 = 0.12;
/// A block needs this share of known pixels.
const KNOWN_SHARE: f64 = 0.8;

/// The information of one image. Directions are `[omega, v]` in the camera's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Information {
    /// Mean over the seen solid angle of `s s^T`, `s` the derivative of the range's rate by
    /// `[omega, v]`: m^2 for omega, 1 for v. Zero where nothing was seen.
    pub matrix: Matrix6<f64>,
    /// Mean range, metres; NaN where nothing was seen.
    pub mean_range_m: f64,
    /// Eigenvalues of the matrix with omega in units of 1 / mean range, increasing.
    pub eigenvalues: [f64; 6],
    /// Their directions, unit vectors `[mean_range omega, v]`.
    pub directions: [Vector6<f64>; 6],
    /// Square root of the smallest over the largest eigenvalue: 0 (some motion changes nothing)
    /// to 1.
    pub score: f64,
    /// Domains that took part.
    pub domains: usize,
}

/// The information of one image of `camera`: depth along the axis or range along the ray.
///
/// The sensitivities are means over domains of about 1/20 of the image's width, from contour
/// integrals and not from derivatives, so that noise hardly adds to them: that of a Kinect makes
/// what is unseen of a wall at 2.5 m score some 0.006. Domains with holes or jumps of depth are left
/// out: what a jump's motion tells is not what a surface tells.
///
/// Thesis: Theorem 3: what has no rotation axis has a regular matrix. Thesis: eq. (1.17), in the
/// weak form of eq. (6.3) for 1/D.
///
/// # Errors
/// A core shape error where the image is not of the camera's size.
pub fn information<'a>(camera: &Camera, depth: impl Into<DepthImage<'a>>) -> Result<Information> {
    let image = depth.into();
    let (width, height) = (camera.width(), camera.height());
    if image.size() != (width, height) {
        let (w, h) = image.size();
        let expected = format!("{width}x{height} pixels as the camera");
        return Err(Error::shape("depth", expected, format!("{w}x{h} pixels")));
    }
    let block = block_size(camera);
    let grid = SphereGrid::new(&camera.binned(block)?)?;
    let blocks = Blocks {
        gamma: inverse_ranges(&grid, block, width, &image),
        grid: &grid,
    };
    let mut matrix = Matrix6::zeros();
    let (mut area, mut range, mut domains) = (0.0, 0.0, 0);
    for y in 0..grid.height() / SIDE {
        for x in 0..grid.width() / SIDE {
            if let Some(domain) = blocks.domain(x * SIDE, y * SIDE) {
                matrix += domain.row * domain.row.transpose() * domain.area;
                area += domain.area;
                range += domain.range * domain.area;
                domains += 1;
            }
        }
    }
    if domains == 0 {
        return Ok(Information::nothing());
    }
    Ok(Information::new(matrix / area, range / area, domains))
}

impl Information {
    fn new(matrix: Matrix6<f64>, mean_range_m: f64, domains: usize) -> Self {
        let unscale = scaling(1.0 / mean_range_m);
        let eigen = SymmetricEigen::new(unscale * matrix * unscale);
        let mut order = [0, 1, 2, 3, 4, 5];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let eigenvalues = order.map(|i| eigen.eigenvalues[i].max(0.0));
        let score = if eigenvalues[5] > 0.0 {
            (eigenvalues[0] / eigenvalues[5]).sqrt()
        } else {
            0.0
        };
        Self {
            matrix,
            mean_range_m,
            eigenvalues,
            directions: order.map(|i| eigen.eigenvectors.column(i).into_owned()),
            score,
            domains,
        }
    }

    fn nothing() -> Self {
        Self {
            matrix: Matrix6::zeros(),
            mean_range_m: f64::NAN,
            eigenvalues: [0.0; 6],
            directions: [0, 1, 2, 3, 4, 5].map(|i| Matrix6::identity().column(i).into_owned()),
            score: 0.0,
            domains: 0,
        }
    }

    /// Motions that change the image less than `limit` (0 to 1) times what the best seen one does:
    /// a basis `[omega, v]` of them, each of unit length once omega is multiplied by the mean
    /// range. Among all bases the one with the most translations, so that they can be named.
    ///
    /// Thesis: Theorem 3
    pub fn unseen(&self, limit: f64) -> Vec<Vector6<f64>> {
        let largest = self.eigenvalues[5];
        let is_unseen = |value: f64| largest <= 0.0 || (value / largest).sqrt() < limit;
        let count = self.eigenvalues.iter().take_while(|v| is_unseen(**v));
        let basis = simplest_basis(&self.directions[..count.count()]);
        let range = if self.domains > 0 {
            self.mean_range_m
        } else {
            1.0
        };
        let unscale = scaling(1.0 / range);
        basis.iter().map(|direction| unscale * direction).collect()
    }
}

/// The mean sensitivity of a domain.
struct Domain {
    /// Of the range's rate to `[omega, v]`.
    row: Vector6<f64>,
    area: f64,
    range: f64,
}

/// Inverse ranges on blocks of pixels, 1/m; NaN where unknown.
struct Blocks<'a> {
    gamma: Vec<f64>,
    grid: &'a SphereGrid,
}

impl Blocks<'_> {
    /// The block at `(x, y)`, around the seam of a whole sphere; NaN beyond the image.
    fn at(&self, x: isize, y: isize) -> f64 {
        let (width, height) = (self.grid.width() as isize, self.grid.height() as isize);
        let x = if self.grid.wraps_around() {
            x.rem_euclid(width)
        } else {
            x
        };
        if (0..width).contains(&x) && (0..height).contains(&y) {
            self.gamma[(y * width + x) as usize]
        } else {
            f64::NAN
        }
    }

    /// The domain whose first block is `(x0, y0)`; `None` where it has a hole or a jump.
    ///
    /// Thesis: eq. (6.3), for 1/D: `d/dt int g = oint g (eta x n).omega + oint g^2/2 n.v +
    /// int 2 g^2 eta.v`, and the range changes by `-1/g^2` of that.
    fn domain(&self, x0: usize, y0: usize) -> Option<Domain> {
        let mut row = Vector6::zeros();
        let (mut area, mut sum) = (0.0, 0.0);
        for y in y0..y0 + SIDE {
            for x in x0..x0 + SIDE {
                let (xi, yi) = (x as isize, y as isize);
                let gamma = self.at(xi, yi);
                let right = x + 1 < x0 + SIDE && jumps(gamma, self.at(xi + 1, yi));
                let below = y + 1 < y0 + SIDE && jumps(gamma, self.at(xi, yi + 1));
                if gamma.is_nan() || right || below {
                    return None;
                }
                let solid = self.grid.solid_angle()[y * self.grid.width() + x];
                let source = self.grid.ray(x, y) * (2.0 * gamma * gamma * solid);
                (0..3).for_each(|k| row[3 + k] += source[k]);
                area += solid;
                sum += gamma * solid;
            }
        }
        for i in 0..SIDE {
            let (x, y) = (x0 + i, y0 + i);
            let (last_x, last_y) = (x0 + SIDE - 1, y0 + SIDE - 1);
            self.add_edge(&mut row, self.grid.edge_x(x0, y), (x0, y), (-1, 0));
            self.add_edge(
                &mut row,
                self.grid.edge_x(last_x + 1, y),
                (last_x, y),
                (1, 0),
            );
            self.add_edge(&mut row, self.grid.edge_y(x, y0), (x, y0), (0, -1));
            self.add_edge(
                &mut row,
                self.grid.edge_y(x, last_y + 1),
                (x, last_y),
                (0, 1),
            );
        }
        let mean = sum / area;
        let row = row * (-1.0 / (area * mean * mean));
        row.iter().all(|v| v.is_finite()).then_some(Domain {
            row,
            area,
            range: 1.0 / mean,
        })
    }

    /// Adds the contour's part at the side of block `(x, y)` towards `(dx, dy)`: the value there is
    /// the mean of both sides, or the continued line where the other side is another surface.
    fn add_edge(
        &self,
        row: &mut Vector6<f64>,
        edge: &sphereflow_sphere::Edge,
        (x, y): (usize, usize),
        (dx, dy): (isize, isize),
    ) {
        let (x, y) = (x as isize, y as isize);
        let inside = self.at(x, y);
        let beyond = self.at(x + dx, y + dy);
        let gamma = if jumps(inside, beyond) {
            1.5 * inside - 0.5 * self.at(x - dx, y - dy)
        } else {
            0.5 * (inside + beyond)
        };
        let outward = (dx + dy) as f64;
        for k in 0..3 {
            row[k] += outward * gamma * edge.tangent_length[k];
            row[3 + k] += outward * 0.5 * gamma * gamma * edge.normal_length[k];
        }
    }
}

/// True also where either is unknown.
fn jumps(a: f64, b: f64) -> bool {
    let smooth = (a - b).abs() <= MAX_JUMP * a.min(b); // false for NaN
    !smooth
}

/// Pixels on each side of a block: one that divides the image of a whole sphere.
fn block_size(camera: &Camera) -> usize {
    let most = (camera.width() / BLOCKS_ACROSS).max(1);
    let fits = |block: usize| {
        let divides = |size: usize| size.is_multiple_of(block);
        !camera.wraps_around() || (divides(camera.width()) && divides(camera.height()))
    };
    (1..=most).rev().find(|&block| fits(block)).unwrap_or(1)
}

/// Means over blocks of the inverse range; NaN with too few known pixels or a jump.
fn inverse_ranges(
    grid: &SphereGrid,
    block: usize,
    width: usize,
    image: &DepthImage<'_>,
) -> Vec<f64> {
    let metres = image.metres();
    let mean = |x: usize, y: usize| {
        let (mut sum, mut known) = (0.0, 0.0);
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for k in 0..block * block {
            let i = (y * block + k / block) * width + x * block + k % block;
            let inverse = 1.0 / f64::from(metres[i]);
            if inverse.is_finite() && inverse > 0.0 {
                sum += inverse;
                known += 1.0;
                (low, high) = (low.min(inverse), high.max(inverse));
            }
        }
        let enough = known >= KNOWN_SHARE * (block * block) as f64;
        if enough && high - low <= MAX_JUMP * low {
            sum / known
        } else {
            f64::NAN
        }
    };
    let per_range = |ray: &Vector3<f64>| match image.axis() {
        Axis::Ray => 1.0,
        Axis::Optical if ray.z > 0.0 => ray.z,
        Axis::Optical => f64::NAN,
    };
    (0..grid.width() * grid.height())
        .map(|i| (i % grid.width(), i / grid.width()))
        .map(|(x, y)| mean(x, y) * per_range(&grid.ray(x, y)))
        .collect()
}

/// `[omega, v] -> [s omega, v]`
fn scaling(s: f64) -> Matrix6<f64> {
    Matrix6::from_diagonal(&Vector6::new(s, s, s, 1.0, 1.0, 1.0))
}
