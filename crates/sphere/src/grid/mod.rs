//! A camera sampled on its pixels: rays, solid angles, edges, and the calculus of the sphere.
//!
//! Pixel corners (at half-integers) are unprojected to unit rays; a pixel is the spherical polygon
//! whose edges are arcs of great circles between its corners. Solid angles, edge normals and the
//! theorem of Gauss are then exact for every camera: straight lines of a pinhole image are great
//! circles, and the pixels of a 360-degree image tile the whole sphere. All operators are of second
//! order in every pixel, up to image borders and poles (only the Laplacian on the ragged rim of a
//! fish-eye is of first).

mod border;
mod build;
mod discrepancy;
mod divergence;
mod edges;
mod geometry;
mod gradient;
mod laplacian;
mod lattice;
mod whole_sphere;

pub use border::Border;
pub use discrepancy::laplacian_discrepancy;
pub use geometry::Edge;

use crate::camera::Camera;
use edges::EdgeTable;
use gradient::DualBasis;
use lattice::{Axis, Lattice};
use nalgebra::Vector3;
use whole_sphere::WholeSphere;

/// A camera sampled on its pixels. Pixel `(x, y)` has index `y * width + x` in every slice.
///
/// A pixel whose centre or one of whose corners has no ray (outside the image circle of a
/// fish-eye) is invalid: its ray, its solid angle and every result there are NaN, and the edges
/// against it are borders like those of the image.
#[derive(Clone, Debug)]
pub struct SphereGrid {
    camera: Camera,
    rays: Vec<Vector3<f64>>,
    solid_angle: Vec<f64>,
    lattice: Lattice,
    dual: Vec<DualBasis>,
    /// `(width + 1) * height` edges, normals to +x.
    edges_x: EdgeTable,
    /// `width * (height + 1)` edges, normals to +y.
    edges_y: EdgeTable,
    /// Of a complete 360-degree image.
    whole: Option<WholeSphere>,
}

impl SphereGrid {
    /// The camera that is sampled.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Pixels per row.
    pub fn width(&self) -> usize {
        self.camera.width()
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.camera.height()
    }

    /// True where the first and the last column are neighbours (360-degree images).
    pub fn wraps_around(&self) -> bool {
        self.camera.wraps_around()
    }

    /// Unit ray of the centre of pixel `(x, y)`, camera frame; NaN where the pixel is invalid.
    ///
    /// # Panics
    /// Outside the image, as slices do.
    pub fn ray(&self, x: usize, y: usize) -> Vector3<f64> {
        self.rays[y * self.width() + x]
    }

    /// Unit rays of all pixels, row after row; NaN where invalid.
    pub fn rays(&self) -> &[Vector3<f64>] {
        &self.rays
    }

    /// Solid angles of all pixels in steradians, row after row; NaN where invalid.
    pub fn solid_angle(&self) -> &[f64] {
        &self.solid_angle
    }

    /// False where the camera has no ray for the centre or a corner of the pixel.
    ///
    /// # Panics
    /// Outside the image, as slices do.
    pub fn is_valid(&self, x: usize, y: usize) -> bool {
        self.solid_angle[y * self.width() + x].is_finite()
    }

    /// The edge between pixels `(x - 1, y)` and `(x, y)`, `x` from 0 to the width, normal to +x.
    /// Where the grid wraps around, edges 0 and width are the same. NaN where a corner has no ray.
    ///
    /// # Panics
    /// Outside the image, as slices do.
    pub fn edge_x(&self, x: usize, y: usize) -> &Edge {
        self.edges_x.edge(x, y)
    }

    /// The edge between pixels `(x, y - 1)` and `(x, y)`, `y` from 0 to the height, normal to +y.
    /// At a pole it has no length. NaN where a corner has no ray.
    ///
    /// # Panics
    /// Outside the image, as slices do.
    pub fn edge_y(&self, x: usize, y: usize) -> &Edge {
        self.edges_y.edge(x, y)
    }

    fn table(&self, axis: Axis) -> &EdgeTable {
        match axis {
            Axis::X => &self.edges_x,
            Axis::Y => &self.edges_y,
        }
    }
}

#[cfg(test)]
mod tests;
