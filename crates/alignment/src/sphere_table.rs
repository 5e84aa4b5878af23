//! The blocks of the image as polygons on the unit sphere: rays, solid angles and edge integrals.

use crate::Result;
use crate::depth_image::Axis;
use nalgebra::{Vector2, Vector3};
use sphereflow_sphere::{Camera, SphereGrid};

/// What a domain's contour integrals need of one edge, oriented towards +x or +y.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Edge {
    /// Integral of `eta x n` along the edge: factor of gamma in the coefficients of omega.
    pub tangent: [f32; 3],
    /// Integral of `n` along the edge: factor of gamma^2 / 2 in the coefficients of v.
    pub normal: [f32; 3],
}

/// The sampled sphere of a camera, single precision, row after row.
#[derive(Clone, Debug)]
pub struct SphereTable {
    /// Blocks a row.
    pub width: usize,
    /// Rows of blocks.
    pub height: usize,
    /// Left and right border are the same.
    pub wraps: bool,
    /// Rays for depths along the optical axis.
    optical: BlockRays,
    /// Rays for ranges along the ray.
    along_ray: BlockRays,
    /// `(x/z, y/z)` of the rays for depths along the optical axis.
    pub plane: Vec<[f32; 2]>,
    /// Solid angle of each block, steradian; NaN where the camera does not see all of it.
    pub area: Vec<f32>,
    /// Solid angle times the ray of the block's inverse range, component by component.
    pub area_ray: [Vec<f32>; 3],
    /// Edge to the left of block `(x, y)` at `y * (width + 1) + x`.
    pub left: Vec<Edge>,
    /// Edge above block `(x, y)` at `y * width + x`, with one more row at the bottom.
    pub top: Vec<Edge>,
}

/// Where the mean of a block belongs. On a plane the inverse depth is linear in `eta / eta_z`, the
/// inverse range in eta, so that the mean over the pixels of a block is the plane's value at the
/// mean of these vectors, whatever the camera's distortion. NaN where a pixel has no such vector.
#[derive(Clone, Debug)]
pub struct BlockRays {
    /// Mean vector's direction.
    pub direction: Vec<[f32; 3]>,
    /// Mean vector's length: inverse range times it is the block's value.
    pub length: Vec<f32>,
}

impl SphereTable {
    /// Samples the `block` x `block` pixels of `camera`. With great circles as edges the integrals are exact: `n` is
    /// constant along an edge, and `eta x n` is the unit tangent, so that it integrates to the
    /// chord. Summed over a closed polygon the chords vanish exactly.
    ///
    /// Thesis: section 6.2, the table of `(eta x n) dl` and `n dl` (there for a pinhole only), and
    /// section 6.3 (for one distortion); here for any camera.
    pub fn new(camera: &Camera, block: usize) -> Result<Self> {
        let grid = SphereGrid::new(&camera.binned(block)?)?;
        let size = (grid.width(), grid.height());
        let (width, height) = (grid.width(), grid.height());
        let mut table = Self {
            width,
            height,
            wraps: grid.wraps_around(),
            optical: BlockRays::new(camera, block, size, |ray| {
                // NaN beyond 90 degrees: there is no depth along the axis
                if ray.z > 0.0 {
                    ray / ray.z
                } else {
                    ray * f64::NAN
                }
            }),
            along_ray: BlockRays::new(camera, block, size, |ray| ray),
            plane: Vec::new(),
            area: grid.solid_angle().iter().map(|&a| a as f32).collect(),
            area_ray: Default::default(),
            left: Vec::with_capacity((width + 1) * height),
            top: Vec::with_capacity(width * (height + 1)),
        };
        let optical = table.optical.direction.iter().zip(&table.optical.length);
        table.plane = optical
            .map(|(ray, length)| [ray[0] * length, ray[1] * length])
            .collect();
        let rays = table.along_ray.direction.iter().zip(&table.area);
        table.area_ray = [0, 1, 2].map(|k| rays.clone().map(|(ray, area)| ray[k] * area).collect());
        for y in 0..=height {
            if y < height {
                table
                    .left
                    .extend((0..=width).map(|x| Edge::new(grid.edge_x(x, y))));
            }
            table
                .top
                .extend((0..width).map(|x| Edge::new(grid.edge_y(x, y))));
        }
        Ok(table)
    }

    /// The rays that go with values along `axis`.
    pub fn rays(&self, axis: Axis) -> &BlockRays {
        match axis {
            Axis::Optical => &self.optical,
            Axis::Ray => &self.along_ray,
        }
    }
}

impl BlockRays {
    fn new(
        camera: &Camera,
        block: usize,
        (width, height): (usize, usize),
        vector: impl Fn(Vector3<f64>) -> Vector3<f64>,
    ) -> Self {
        let pixel = |x: usize, y: usize| match camera.unproject(&Vector2::new(x as f64, y as f64)) {
            Some(ray) => vector(ray),
            None => Vector3::repeat(f64::NAN),
        };
        let mut rays = Self {
            direction: Vec::with_capacity(width * height),
            length: Vec::with_capacity(width * height),
        };
        for i in 0..width * height {
            let (x0, y0) = (i % width * block, i / width * block);
            let pixels = (0..block * block).map(|k| pixel(x0 + k % block, y0 + k / block));
            let mean = pixels.sum::<Vector3<f64>>() / (block * block) as f64;
            rays.direction.push(single(&mean.normalize()));
            rays.length.push(mean.norm() as f32);
        }
        rays
    }
}

impl Edge {
    fn new(edge: &sphereflow_sphere::Edge) -> Self {
        Self {
            tangent: single(&edge.tangent_length),
            normal: single(&edge.normal_length),
        }
    }
}

fn single(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Single precision of the table.
    const ROUNDING: f64 = 2e-7;

    #[test]
    fn table_edges_of_a_pinhole_match_the_printed_integrands() {
        let camera = Camera::pinhole(500.0, 480.0, 319.5, 239.5, 640, 480).unwrap();
        let table = SphereTable::new(&camera, 1).unwrap();
        for (x, y) in [(0, 0), (320, 100), (600, 479), (17, 333)] {
            let (z1, dz1) = ((x as f64 - 319.5) / 500.0, 1.0 / 500.0);
            let (z2, dz2) = ((y as f64 - 239.5) / 480.0, 1.0 / 480.0);
            let top = table.top[y * 640 + x];
            let t = (y as f64 - 0.5 - 239.5) / 480.0;
            let q = 1.0 + z1 * z1 + t * t;
            // Thesis: section 6.2, first row of the table: the outward normal of the upper edge
            // points upwards, ours downwards.
            let tangent = Vector3::new(1.0 + t * t, -z1 * t, -z1) * (dz1 / q.powf(1.5));
            let normal = Vector3::new(0.0, -1.0, t) * (dz1 / q);
            assert_close(top.tangent, -tangent, "top tangent");
            assert_close(top.normal, -normal, "top normal");
            // Second row: the right edge, outward normal towards +x as ours.
            let right = table.left[y * 641 + x + 1];
            let r = (x as f64 + 0.5 - 319.5) / 500.0;
            let q = 1.0 + r * r + z2 * z2;
            let tangent = Vector3::new(-r * z2, 1.0 + r * r, -z2) * (dz2 / q.powf(1.5));
            let normal = Vector3::new(1.0, 0.0, -r) * (dz2 / q);
            assert_close(right.tangent, tangent, "right tangent");
            assert_close(right.normal, normal, "right normal");
            let area = dz1 * dz2 / (1.0 + z1 * z1 + z2 * z2).powf(1.5);
            assert!((f64::from(table.area[y * 640 + x]) / area - 1.0).abs() < 1e-5);
        }
    }

    fn assert_close(found: [f32; 3], expected: Vector3<f64>, what: &str) {
        let found = Vector3::from(found.map(f64::from));
        // The printed rows are mid-point rules: good to the square of the pixel's angle.
        let error = (found - expected).norm() / expected.norm();
        assert!(error < 3e-6, "{what}: {found} {expected}");
    }

    #[test]
    fn table_of_the_whole_sphere_has_area_four_pi_and_closed_contours() {
        let table = SphereTable::new(&Camera::equirectangular(64, 32).unwrap(), 1).unwrap();
        let area: f64 = table.area.iter().map(|&a| f64::from(a)).sum();
        assert!((area - 4.0 * PI).abs() < 1e-4, "{area}");
        for y in 0..32 {
            for x in 0..64 {
                let sides = [
                    (table.left[y * 65 + x + 1], 1.0),
                    (table.left[y * 65 + x], -1.0),
                    (table.top[(y + 1) * 64 + x], 1.0),
                    (table.top[y * 64 + x], -1.0),
                ];
                for k in 0..3 {
                    let chords: f64 = sides.iter().map(|(e, s)| s * f64::from(e.tangent[k])).sum();
                    assert!(chords.abs() < 4.0 * ROUNDING, "{x} {y}: {chords}");
                }
            }
        }
    }
}
