//! Conjugate gradients, preconditioned by a multigrid cycle.

use super::{Cells, Stencil};

/// Sweeps on the coarsest lattice, each way: it has at most a few pixels to a side.
const COARSEST_SWEEPS: usize = 20;

/// A lattice no wider or higher than this is not halved further.
const COARSEST: usize = 6;

/// The lattices from full size to a few pixels.
#[derive(Debug)]
pub(crate) struct Multigrid {
    levels: Vec<Level>,
}

#[derive(Debug)]
struct Level {
    stencil: Stencil,
    value: Vec<f64>,
    right_side: Vec<f64>,
    residual: Vec<f64>,
}

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Solved {
    /// Norm of the residual over that of the right side.
    pub residual: f64,
    pub iterations: usize,
}

impl Multigrid {
    /// Of `scale` times the diffusion plus `mass` on the diagonal.
    pub fn new(cells: &Cells, scale: f64, mass: &[f64]) -> Self {
        let mut levels = vec![Level::new(Stencil::new(cells, scale, mass))];
        let (mut cells, mut mass) = (cells.clone(), mass.to_vec());
        while cells.width.min(cells.height) > COARSEST {
            mass = restricted(&mass, cells.width, cells.height);
            // Sums of four pixels: the mass as it is, the diffusion of the wider lattice likewise.
            cells = cells.halved();
            levels.push(Level::new(Stencil::new(&cells, scale, &mass)));
        }
        Self { levels }
    }

    /// Solves in place from the value that is there.
    pub fn solve(
        &mut self,
        value: &mut [f64],
        right_side: &[f64],
        tolerance: f64,
        most: usize,
    ) -> Solved {
        let count = value.len();
        let target = tolerance * dot(right_side, right_side).sqrt();
        let scale = dot(right_side, right_side).sqrt().max(f64::MIN_POSITIVE);
        let mut residual = vec![0.0; count];
        self.levels[0].stencil.apply(value, &mut residual);
        for (r, b) in residual.iter_mut().zip(right_side) {
            *r = b - *r;
        }
        let (mut direction, mut product) = (vec![0.0; count], vec![0.0; count]);
        let mut before = 0.0;
        for iteration in 0..most {
            let size = dot(&residual, &residual).sqrt();
            if size <= target {
                return Solved {
                    residual: size / scale,
                    iterations: iteration,
                };
            }
            let better = self.cycle_from(&residual);
            let now = dot(better, &residual);
            let beta = if iteration == 0 { 0.0 } else { now / before };
            for (d, z) in direction.iter_mut().zip(better) {
                *d = z + beta * *d;
            }
            before = now;
            self.levels[0].stencil.apply(&direction, &mut product);
            let step = now / dot(&direction, &product);
            if !step.is_finite() {
                break;
            }
            let moves = direction.iter().zip(&product);
            for ((v, r), (d, p)) in value.iter_mut().zip(&mut residual).zip(moves) {
                *v += step * d;
                *r -= step * p;
            }
        }
        let size = dot(&residual, &residual).sqrt();
        Solved {
            residual: size / scale,
            iterations: most,
        }
    }

    /// The diffusion's part of the quadratic form, `scale int |grad u|^2`.
    pub fn form(&mut self, value: &[f64], mass: &[f64]) -> f64 {
        let fine = &mut self.levels[0];
        fine.stencil.apply(value, &mut fine.residual);
        let data: f64 = value.iter().zip(mass).map(|(v, m)| m * v * v).sum();
        dot(value, &fine.residual) - data
    }

    /// One symmetric V-cycle from zero.
    fn cycle_from(&mut self, right_side: &[f64]) -> &[f64] {
        self.levels[0].right_side.copy_from_slice(right_side);
        let last = self.levels.len() - 1;
        for level in 0..last {
            let (fine, coarse) = self.levels.split_at_mut(level + 1);
            let (fine, coarse) = (&mut fine[level], &mut coarse[0]);
            fine.value.fill(0.0);
            fine.stencil.relax(&mut fine.value, &fine.right_side, false);
            fine.stencil.apply(&fine.value, &mut fine.residual);
            for (r, b) in fine.residual.iter_mut().zip(&fine.right_side) {
                *r = b - *r;
            }
            fine.restrict_into(coarse);
        }
        let coarsest = &mut self.levels[last];
        coarsest.value.fill(0.0);
        for backwards in [false, true] {
            for _ in 0..COARSEST_SWEEPS {
                coarsest
                    .stencil
                    .relax(&mut coarsest.value, &coarsest.right_side, backwards);
            }
        }
        for level in (0..last).rev() {
            let (fine, coarse) = self.levels.split_at_mut(level + 1);
            let (fine, coarse) = (&mut fine[level], &coarse[0]);
            fine.add_interpolated(coarse);
            fine.stencil.relax(&mut fine.value, &fine.right_side, true);
        }
        &self.levels[0].value
    }
}

impl Level {
    fn new(stencil: Stencil) -> Self {
        let zero = vec![0.0; stencil.diagonal.len()];
        Self {
            stencil,
            value: zero.clone(),
            right_side: zero.clone(),
            residual: zero,
        }
    }

    fn size(&self) -> (usize, usize) {
        (self.stencil.width, self.stencil.height)
    }

    /// Adds the bilinear interpolation of the coarser value: weights 9, 3, 3, 1 of 16.
    fn add_interpolated(&mut self, coarse: &Self) {
        let ((width, height), size) = (self.size(), coarse.size());
        for y in 0..height {
            for x in 0..width {
                if self.stencil.diagonal[y * width + x] > 0.0 {
                    let mut sum = 0.0;
                    parents((x, y), size, |parent, weight| {
                        sum += weight * coarse.value[parent]
                    });
                    self.value[y * width + x] += sum;
                }
            }
        }
    }

    /// The transpose of the interpolation, so that the cycle is symmetric.
    fn restrict_into(&self, coarse: &mut Self) {
        let ((width, height), size) = (self.size(), coarse.size());
        coarse.right_side.fill(0.0);
        for y in 0..height {
            for x in 0..width {
                let value = self.residual[y * width + x];
                if self.stencil.diagonal[y * width + x] > 0.0 {
                    parents((x, y), size, |parent, weight| {
                        coarse.right_side[parent] += weight * value;
                    });
                }
            }
        }
    }
}

/// The four coarse pixels around a fine one, with their weights.
#[inline]
fn parents((x, y): (usize, usize), (width, height): (usize, usize), mut f: impl FnMut(usize, f64)) {
    let near = |i: usize, size: usize| {
        let own = (i / 2).min(size - 1);
        let other = if i.is_multiple_of(2) {
            own.saturating_sub(1)
        } else {
            (own + 1).min(size - 1)
        };
        (own, other)
    };
    let ((x0, x1), (y0, y1)) = (near(x, width), near(y, height));
    f(y0 * width + x0, 0.5625);
    f(y0 * width + x1, 0.1875);
    f(y1 * width + x0, 0.1875);
    f(y1 * width + x1, 0.0625);
}

/// Sums of two by two pixels.
fn restricted(mass: &[f64], width: usize, height: usize) -> Vec<f64> {
    let (half, rows) = (width.div_ceil(2), height.div_ceil(2));
    let mut out = vec![0.0; half * rows];
    for (i, value) in mass.iter().enumerate() {
        out[(i / width / 2) * half + (i % width) / 2] += value;
    }
    out
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PixelRays;
    use sphereflow_sphere::{Border, Camera, SphereGrid};

    fn cameras() -> [Camera; 3] {
        [
            Camera::pinhole(60.0, 70.0, 40.0, 25.0, 77, 58).unwrap(),
            Camera::equirectangular(96, 48).unwrap(),
            Camera::kannala_brandt(30.0, 30.0, 31.5, 31.5, [0.01, 0.0, 0.0, 0.0], 64, 64).unwrap(),
        ]
    }

    #[test]
    fn diffusion_of_a_smooth_field_is_the_laplacian_on_every_camera() {
        // Thesis: eq. (2.13), (2.14), (2.16): the matrix over the solid angle is the Laplacian.
        for camera in cameras() {
            let rays = PixelRays::new(&camera).unwrap();
            let cells = Cells::new(&rays);
            let stencil = Stencil::new(&cells, 1.0, &vec![0.0; rays.len()]);
            let field: Vec<f64> = rays
                .rays()
                .iter()
                .map(|eta| f64::from(eta.x * eta.y + 0.5 * eta.z))
                .collect();
            let mut out = vec![0.0; field.len()];
            stencil.apply(&field, &mut out);
            let grid = SphereGrid::new(&camera).unwrap();
            let mut expected = field.clone();
            grid.laplacian_into(&field, Border::Extrapolate, &mut expected)
                .unwrap();
            let (mut worst, mut seen) = (0.0_f64, 0);
            let (width, height) = rays.size();
            for y in height / 4..3 * height / 4 {
                for x in width / 4..3 * width / 4 {
                    let i = y * width + x;
                    worst = worst.max((-out[i] / grid.solid_angle()[i] - expected[i]).abs());
                    seen += 1;
                }
            }
            // Second order in pixels of 0.015 to 0.07 rad on a field of curvature near 6.
            assert!(
                seen > 500 && worst < 0.05,
                "{}: {worst}",
                camera.model().name()
            );
        }
    }

    #[test]
    fn multigrid_solves_to_rounding_in_few_iterations_on_every_camera() {
        for camera in cameras() {
            let rays = PixelRays::new(&camera).unwrap();
            let cells = Cells::new(&rays);
            // Data in a few pixels only: the field must travel across the whole image.
            let mass: Vec<f64> = (0..rays.len())
                .map(|i| {
                    if i % 97 == 3 && rays.is_valid(i) {
                        0.01
                    } else {
                        0.0
                    }
                })
                .collect();
            let truth: Vec<f64> = (0..rays.len()).map(|i| (i as f64 * 0.01).sin()).collect();
            let mut right_side = vec![0.0; truth.len()];
            let mut multigrid = Multigrid::new(&cells, 1.0, &mass);
            multigrid.levels[0].stencil.apply(&truth, &mut right_side);
            let mut value = vec![0.0; truth.len()];
            let solved = multigrid.solve(&mut value, &right_side, 1e-10, 200);
            // Near the poles of the whole sphere pixels are slivers: point relaxation is slower there.
            let most = if camera.wraps_around() { 120 } else { 60 };
            assert!(
                solved.iterations < most,
                "{}: {solved:?}",
                camera.model().name()
            );
            for i in (0..rays.len()).filter(|i| rays.is_valid(*i)) {
                if multigrid.levels[0].stencil.diagonal[i] > 0.0 {
                    assert!(
                        (value[i] - truth[i]).abs() < 1e-5,
                        "{}",
                        camera.model().name()
                    );
                }
            }
        }
    }
}
