//! The smooth window that makes a part of the sphere out of an image.
//!
//! Thesis: section 5.4.1: phi is 1 on K1, 0 outside K2, smooth between, with K2 inside the image.

use nalgebra::{Vector2, Vector3};
use sphereflow_core::Result;
use sphereflow_sphere::SphereGrid;

/// The window on a grid: its values, gradients, and its value anywhere in the image.
#[derive(Clone, Debug)]
pub struct Window {
    width: f64,
    height: f64,
    border: f64,
    whole: bool,
    values: Vec<f64>,
    gradient: Vec<Vector3<f64>>,
}

/// Outermost part of the image where the window is zero already (outside K2), of the border.
const ZERO: f64 = 0.1;

impl Window {
    /// For a grid; `border` is the part of width and height over which it falls. On the whole
    /// sphere, which has no border, it is 1.
    ///
    /// # Errors
    /// None for a grid of its own size.
    pub fn new(grid: &SphereGrid, border: f64) -> Result<Self> {
        let mut window = Self {
            width: grid.width() as f64,
            height: grid.height() as f64,
            border,
            whole: grid.wraps_around(),
            values: Vec::new(),
            gradient: Vec::new(),
        };
        let pixels = (0..grid.height()).flat_map(|y| (0..grid.width()).map(move |x| (x, y)));
        window.values = pixels
            .map(|(x, y)| window.at(&Vector2::new(x as f64, y as f64)))
            .collect();
        window.gradient = grid.gradient(&window.values)?;
        Ok(window)
    }

    /// phi at a pixel position.
    pub fn at(&self, pixel: &Vector2<f64>) -> f64 {
        if self.whole || self.border <= 0.0 {
            return 1.0;
        }
        let side = |position: f64, size: f64| {
            let inside = (position + 0.5).min(size - 0.5 - position) / (self.border * size);
            smooth((inside - ZERO) / (1.0 - ZERO))
        };
        side(pixel.x, self.width) * side(pixel.y, self.height)
    }

    /// phi of all pixels.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Its gradient on the sphere.
    pub fn gradient(&self) -> &[Vector3<f64>] {
        &self.gradient
    }
}

/// From 0 to 1 over [0, 1] with all derivatives zero at both ends.
fn smooth(t: f64) -> f64 {
    let bump = |t: f64| if t > 0.0 { (-1.0 / t).exp() } else { 0.0 };
    let (up, down) = (bump(t), bump(1.0 - t));
    up / (up + down)
}
