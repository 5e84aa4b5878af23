//! Which of the two tables a camera has, from pixels.

use super::edge::{EdgeElement, Side};
use super::{fov, pinhole};
use crate::Result;
use nalgebra::Vector2;
use sphereflow_core::Error;
use sphereflow_sphere::Camera;
use sphereflow_sphere::camera::{Bend, Model};

/// The edge table of a camera, in pixels: section 6.2 for a pinhole, section 6.3 for a FOV
/// fish-eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeTable {
    /// Pixels per unit of image plane.
    focal: Vector2<f64>,
    centre: Vector2<f64>,
    /// Field of view of the fish-eye; a pinhole has none.
    w: Option<f64>,
}

impl EdgeTable {
    /// The table of `camera`.
    ///
    /// # Errors
    /// A core value error where the thesis has no table for it: any other model, a skewed pinhole,
    /// a fish-eye whose distortion centre is not its principal point.
    pub fn new(camera: &Camera) -> Result<Self> {
        let refuse = |found: String| {
            let expected = "a pinhole without skew (section 6.2) or a FOV fish-eye with its \
                distortion centre at the principal point (section 6.3): the thesis's method has \
                no table for others; the methods 'single' and 'pyramid' take any camera";
            Err(Error::value("camera", expected, found))
        };
        match camera.model() {
            Model::Pinhole(p) if p.skew == 0.0 => Ok(Self {
                focal: Vector2::new(p.fx, p.fy),
                centre: Vector2::new(p.cx, p.cy),
                w: None,
            }),
            Model::Pinhole(p) => refuse(format!("a pinhole with a skew of {} px", p.skew)),
            Model::Fov(lens) => {
                let moved = lens.bend.named().iter().skip(1).any(|(_, v)| *v != 0.0);
                if moved {
                    return refuse("a FOV fish-eye with a distortion centre of its own".into());
                }
                Ok(Self {
                    focal: Vector2::new(lens.focal.fx, lens.focal.fy),
                    centre: Vector2::new(lens.focal.cx, lens.focal.cy),
                    w: Some(lens.bend.w()),
                })
            }
            other => refuse(format!("a camera of model '{}'", other.name())),
        }
    }

    /// Image plane coordinates of a pixel.
    pub fn plane(&self, x: f64, y: f64) -> Vector2<f64> {
        (Vector2::new(x, y) - self.centre).component_div(&self.focal)
    }

    /// Solid angle of the pixel about `(x, y)`, steradian, as the tables have it: the density at
    /// the centre times the area.
    pub fn pixel_area(&self, x: f64, y: f64) -> f64 {
        let z = self.plane(x, y);
        let density = match self.w {
            None => pinhole::area(z.x, z.y),
            Some(w) => fov::area(w, z.x, z.y),
        };
        density / (self.focal.x * self.focal.y)
    }

    /// The row of `side` for one pixel's length of edge whose middle is at `(x, y)`.
    pub fn pixel_edge(&self, side: Side, x: f64, y: f64) -> EdgeElement {
        let z = self.plane(x, y);
        let length = if side.is_level() {
            1.0 / self.focal.x
        } else {
            1.0 / self.focal.y
        };
        let element = match self.w {
            None => pinhole::edge(side, z.x, z.y),
            Some(w) => fov::edge(w, side, z.x, z.y),
        };
        element.times(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_refuses_cameras_that_the_thesis_does_not_cover_and_says_what_to_use() {
        let cameras = [
            Camera::equirectangular(64, 32).unwrap(),
            Camera::pinhole_with_skew(50.0, 50.0, 32.0, 24.0, 0.5, 64, 48).unwrap(),
            Camera::fov(50.0, 50.0, 32.0, 24.0, 0.9, 64, 48)
                .unwrap()
                .with_distortion_centre(0.01, 0.0)
                .unwrap(),
        ];
        for camera in cameras {
            let error = EdgeTable::new(&camera).unwrap_err().to_string();
            assert!(error.starts_with("camera: expected a pinhole"), "{error}");
            assert!(error.contains("'single'"), "{error}");
        }
    }

    /// Thesis: section 6.2, section 6.3: per pixel, the tables are mid-point rules.
    #[test]
    fn pixel_edge_is_the_sphere_grids_to_the_square_of_a_pixel() {
        let cameras = [
            Camera::pinhole(290.0, 280.0, 159.5, 119.5, 320, 240).unwrap(),
            Camera::fov(160.0, 150.0, 159.5, 119.5, 0.9, 320, 240).unwrap(),
        ];
        for camera in cameras {
            let table = EdgeTable::new(&camera).unwrap();
            let grid = sphereflow_sphere::SphereGrid::new(&camera).unwrap();
            for (x, y) in [(0, 0), (159, 119), (300, 20)] {
                let (xf, yf) = (x as f64, y as f64);
                let right = table.pixel_edge(Side::HighZ1, xf + 0.5, yf);
                let theirs = grid.edge_x(x + 1, y);
                // a pixel is 1/160 of the image plane
                let close = 3e-5 * theirs.tangent_length.norm();
                assert!((right.tangent - theirs.tangent_length).norm() < close);
                assert!((right.normal - theirs.normal_length).norm() < close);
                let below = table.pixel_edge(Side::HighZ2, xf, yf + 0.5);
                let theirs = grid.edge_y(x, y + 1);
                assert!((below.tangent - theirs.tangent_length).norm() < close);
                assert!((below.normal - theirs.normal_length).norm() < close);
                let area = grid.solid_angle()[y * 320 + x];
                assert!((table.pixel_area(xf, yf) / area - 1.0).abs() < 3e-5);
            }
        }
    }
}
