//! From a camera to its grid: corners, rays, solid angles and edges.

use super::SphereGrid;
use super::edges::EdgeTable;
use super::geometry::{Edge, triangle_solid_angle};
use super::gradient::DualBasis;
use super::lattice::{Axis, Lattice};
use super::whole_sphere::WholeSphere;
use crate::camera::Camera;
use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use sphereflow_core::{Error, Result};

/// In smaller 360-degree images than this an edge would be a half circle or longer, of which the two
/// ends do not say where it runs.
const LEAST_WRAPPING_SIZE: (usize, usize) = (4, 2);

impl SphereGrid {
    /// Samples `camera` on its pixels.
    ///
    /// # Errors
    /// [`Error::Value`] where no pixel has a ray, or a 360-degree image is smaller than 4x2.
    pub fn new(camera: &Camera) -> Result<Self> {
        Self::with_rays(camera, |pixel| camera.unproject(pixel))
    }

    /// The grid of the pixels of `camera` with the rays that `unproject` gives.
    pub(super) fn with_rays(
        camera: &Camera,
        unproject: impl Fn(&Vector2<f64>) -> Option<Vector3<f64>> + Sync,
    ) -> Result<Self> {
        let (width, height) = (camera.width(), camera.height());
        let (least_width, least_height) = LEAST_WRAPPING_SIZE;
        if camera.wraps_around() && (width < least_width || height < least_height) {
            return Err(Error::value(
                "camera size",
                format!("at least {least_width}x{least_height} pixels on the whole sphere"),
                format!("{width}x{height}"),
            ));
        }
        let ray_at = |x: f64, y: f64| {
            unproject(&Vector2::new(x, y)).unwrap_or_else(|| Vector3::repeat(f64::NAN))
        };
        let corners = Corners::new(camera, ray_at);
        let pixels = (0..width * height).into_par_iter();
        let (rays, solid_angle): (Vec<_>, Vec<_>) = pixels
            .map(|index| {
                let (x, y) = (index % width, index / width);
                corners.pixel(x, y, ray_at(x as f64, y as f64))
            })
            .unzip();
        if solid_angle.iter().all(|angle| angle.is_nan()) {
            return Err(Error::value(
                "camera",
                "rays for at least one pixel and its corners",
                format!("none in {width}x{height} pixels"),
            ));
        }
        let complete = solid_angle.iter().all(|angle| angle.is_finite());
        let valid = solid_angle.iter().map(|angle| angle.is_finite()).collect();
        let lattice = Lattice::new(width, height, camera.wraps_around(), valid);
        let dual = (0..width * height)
            .into_par_iter()
            .map(|index| DualBasis::new(&lattice, &rays, index % width, index / width));
        let edges_y = EdgeTable::new(&lattice, &rays, Axis::Y, corners.edges_y());
        let whole =
            (camera.wraps_around() && complete).then(|| WholeSphere::new(width, height, &edges_y));
        Ok(Self {
            camera: camera.clone(),
            dual: dual.collect(),
            edges_x: EdgeTable::new(&lattice, &rays, Axis::X, corners.edges_x()),
            edges_y,
            whole,
            rays,
            solid_angle,
            lattice,
        })
    }
}

/// Rays of the pixel corners: corner `(x, y)` is the upper left one of pixel `(x, y)`.
struct Corners {
    width: usize,
    height: usize,
    rays: Vec<Vector3<f64>>,
}

impl Corners {
    fn new(camera: &Camera, ray_at: impl Fn(f64, f64) -> Vector3<f64>) -> Self {
        let (width, height) = (camera.width(), camera.height());
        let mut rays = Vec::with_capacity((width + 1) * (height + 1));
        for y in 0..=height {
            // At a pole, and on the meridian where the image closes, several corners are one
            // point: they get one ray, to the last bit, so that the pixels leave no gap.
            let pole = camera.wraps_around() && (y == 0 || y == height);
            for x in 0..=width {
                let column = match () {
                    () if pole => 0,
                    () if camera.wraps_around() => x % width,
                    () => x,
                };
                rays.push(ray_at(column as f64 - 0.5, y as f64 - 0.5));
            }
        }
        Self {
            width,
            height,
            rays,
        }
    }

    fn at(&self, x: usize, y: usize) -> &Vector3<f64> {
        &self.rays[y * (self.width + 1) + x]
    }

    /// Ray and solid angle of a pixel; NaN for both where one of its five rays is missing.
    fn pixel(&self, x: usize, y: usize, ray: Vector3<f64>) -> (Vector3<f64>, f64) {
        let (a, b) = (self.at(x, y), self.at(x + 1, y));
        let (c, d) = (self.at(x + 1, y + 1), self.at(x, y + 1));
        let angle = triangle_solid_angle(a, b, c) + triangle_solid_angle(a, c, d);
        if angle > 0.0 && ray.iter().all(|v| v.is_finite()) {
            (ray, angle)
        } else {
            (Vector3::repeat(f64::NAN), f64::NAN)
        }
    }

    fn edges_x(&self) -> Vec<Edge> {
        let stride = self.width + 1;
        let edges = (0..stride * self.height).into_par_iter();
        let edges = edges.map(|index| (index % stride, index / stride));
        edges
            .map(|(x, y)| Edge::from_arc(self.at(x, y), self.at(x, y + 1)))
            .collect()
    }

    fn edges_y(&self) -> Vec<Edge> {
        let edges = (0..self.width * (self.height + 1)).into_par_iter();
        let edges = edges.map(|index| (index % self.width, index / self.width));
        edges
            .map(|(x, y)| Edge::from_arc(self.at(x + 1, y), self.at(x, y)))
            .collect()
    }
}
