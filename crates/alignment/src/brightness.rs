//! Brightness as a second conserved field: what makes planes and corridors observable.
//!
//! Thesis: eq. (1.16): the brightness of a ray changes only because the ray moves over the surface.
//! A point X of the first image's surface moves by `-(v + omega x X)` in the camera's frame, so that
//! after warping the second image by the motion found so far
//!
//! `y2(eta) - y1(eta) = g.(v + omega x X) = (X x g).omega + g.v`
//!
//! where g is the gradient of the brightness in space, `gamma` times that on the sphere.

use crate::binning::InverseDepth;
use crate::pyramid::Level;
use crate::row_motion::{Rigid, RowMotion};
use nalgebra::{Matrix6, Vector2, Vector3, Vector6};
use rayon::prelude::*;
use sphereflow_core::statistics::{mad_sigma_mut, median_mut};
use sphereflow_core::{Error, Plane};

/// Cauchy's constant in units of sigma: 95 % efficiency on normally distributed changes.
const CAUCHY: f64 = 2.385;
/// Smallest noise of a block's brightness, grey levels of 255: quantisation and motion blur.
const LEAST_NOISE: f64 = 1.0;
/// Rows of blocks summed together: fixed, so that the result does not depend on the threads.
const CHUNK_ROWS: usize = 8;

/// Mean brightness of the blocks of one image, 0 to 255, on the levels of a
/// [`crate::FramePyramid`]. Filled by [`crate::Aligner::average_brightness`]; the default is empty.
#[derive(Clone, Debug, Default)]
pub struct BrightnessPyramid {
    /// The finest first.
    pub(crate) levels: Vec<Vec<f32>>,
}

impl BrightnessPyramid {
    /// True where it is of the camera and the settings of these levels.
    pub(crate) fn fits(&self, levels: &[Level]) -> bool {
        let sizes = levels
            .iter()
            .map(|level| level.table.width * level.table.height);
        self.levels.iter().map(Vec::len).eq(sizes)
    }

    /// Averages an image over the blocks of all levels.
    ///
    /// # Errors
    /// A shape error where the image is not of the camera's size.
    pub(crate) fn fill(
        &mut self,
        image: &Plane<f32>,
        argument: &str,
        size: (usize, usize),
        finest_block: usize,
        levels: &[Level],
    ) -> crate::Result<()> {
        if image.size() != size {
            let expected = format!("{}x{} pixels as the camera", size.0, size.1);
            let found = format!("{}x{} pixels", image.width(), image.height());
            return Err(Error::shape(argument, expected, found));
        }
        self.levels.resize_with(levels.len(), Vec::new);
        for (k, (out, level)) in self.levels.iter_mut().zip(levels).enumerate() {
            let block = finest_block << k;
            let (columns, rows) = (level.table.width, level.table.height);
            out.resize(columns * rows, 0.0);
            out.par_chunks_mut(columns)
                .with_min_len(CHUNK_ROWS)
                .enumerate()
                .for_each(|(y, line)| mean_row(image, block, y, line));
        }
        Ok(())
    }
}

fn mean_row(image: &Plane<f32>, block: usize, y: usize, line: &mut [f32]) {
    let width = image.width();
    line.fill(0.0);
    for row in image.data()[y * block * width..].chunks(width).take(block) {
        for (value, pixels) in line.iter_mut().zip(row.chunks(block)) {
            *value += pixels.iter().sum::<f32>();
        }
    }
    let share = 1.0 / (block * block) as f32;
    line.iter_mut().for_each(|value| *value *= share);
}

/// What the brightness says of the motion that is left: `information x = gradient`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BrightnessTerm {
    pub(crate) information: Matrix6<f64>,
    pub(crate) gradient: Vector6<f64>,
}

/// One block's equation `change = coefficients . [omega, v]`.
struct Equation {
    change: f64,
    coefficients: Vector6<f64>,
}

/// Two images of one level.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Images<'a> {
    pub(crate) first_depth: &'a InverseDepth,
    /// Known where both depths are: what one image hides is left out.
    pub(crate) pair: &'a [f32],
    pub(crate) first: &'a [f32],
    pub(crate) second: &'a [f32],
    /// Motion to the rows of the second image.
    pub(crate) rows: &'a [RowMotion],
}

/// Working memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Brightness {
    warped: Vec<f32>,
    sorted: Vec<f64>,
    /// Of every [`CHUNK_ROWS`] rows.
    parts: Vec<BrightnessTerm>,
}

impl Brightness {
    /// The term of two images; `weight` stands for the correlation of neighbouring blocks.
    pub(crate) fn term(
        &mut self,
        level: &Level,
        images: &Images<'_>,
        weight: f64,
    ) -> BrightnessTerm {
        let (first_depth, first) = (images.first_depth, images.first);
        self.warp(level, images);
        let (offset, sigma) = self.offset_and_noise(first);
        if !sigma.is_finite() {
            return BrightnessTerm::default();
        }
        let (width, height) = (level.table.width, level.table.height);
        let mut parts = std::mem::take(&mut self.parts);
        (0..height.saturating_sub(2).div_ceil(CHUNK_ROWS))
            .into_par_iter()
            .map(|chunk| {
                let start = 1 + chunk * CHUNK_ROWS;
                let mut part = BrightnessTerm::default();
                for y in start..(start + CHUNK_ROWS).min(height - 1) {
                    for x in 1..width - 1 {
                        let i = y * width + x;
                        let Some(equation) = self.equation(level, first_depth, first, offset, i)
                        else {
                            continue;
                        };
                        let ratio = equation.change / (CAUCHY * sigma);
                        let w = weight / ((1.0 + ratio * ratio) * sigma * sigma);
                        part.add(&equation, w);
                    }
                }
                part
            })
            .collect_into_vec(&mut parts);
        let sum = parts
            .iter()
            .fold(BrightnessTerm::default(), |sum, part| BrightnessTerm {
                information: sum.information + part.information,
                gradient: sum.gradient + part.gradient,
            });
        self.parts = parts;
        sum
    }

    /// The second image's brightness on the rays of the first; NaN where not seen.
    fn warp(&mut self, level: &Level, images: &Images<'_>) {
        let Images {
            first_depth,
            pair,
            second,
            rows,
            ..
        } = *images;
        let (width, height) = (level.table.width, level.table.height);
        let rays = level.table.rays(first_depth.axis);
        self.warped.resize(width * height, f32::NAN);
        let lines = self.warped.par_chunks_mut(width).with_min_len(CHUNK_ROWS);
        lines.enumerate().for_each(|(y, line)| {
            let mut row = y.min(rows.len() - 1);
            for (x, value) in line.iter_mut().enumerate() {
                let i = y * width + x;
                *value = f32::NAN;
                if pair[i].is_nan() {
                    continue;
                }
                let range = f64::from(rays.length[i] / first_depth.values[i]);
                let ray = Vector3::from(rays.direction[i].map(f64::from));
                let point = moved(&rows[row].to, &(ray * range));
                if let Some(pixel) = level.camera.project(&point) {
                    row = (pixel.y.max(0.0) as usize).min(rows.len() - 1);
                    *value = bilinear(second, width, height, &pixel);
                }
            }
        });
    }

    /// Median change and its robust standard deviation; NaN where nothing is known.
    fn offset_and_noise(&mut self, first: &[f32]) -> (f64, f64) {
        self.sorted.clear();
        let changes = self.warped.iter().zip(first).map(|(b, a)| f64::from(b - a));
        self.sorted
            .extend(changes.filter(|change| change.is_finite()));
        if self.sorted.len() < 100 {
            return (f64::NAN, f64::NAN);
        }
        let offset = median_mut(&mut self.sorted).unwrap_or(f64::NAN);
        for value in &mut self.sorted {
            *value -= offset;
        }
        let sigma = mad_sigma_mut(&mut self.sorted).unwrap_or(f64::NAN);
        (offset, sigma.max(LEAST_NOISE))
    }

    /// The equation of block `i`, away from the border; `None` where a neighbour is unknown.
    fn equation(
        &self,
        level: &Level,
        first_depth: &InverseDepth,
        first: &[f32],
        offset: f64,
        i: usize,
    ) -> Option<Equation> {
        let width = level.table.width;
        let rays = level.table.rays(first_depth.axis);
        let change = f64::from(self.warped[i] - first[i]) - offset;
        // The mean of both images at the four neighbours: the gradient half-way.
        let mean = |k: usize| f64::from(self.warped[k] + first[k]) / 2.0;
        let across = mean(i + 1) - mean(i - 1);
        let down = mean(i + width) - mean(i - width);
        if !(change + across + down).is_finite() {
            return None;
        }
        let at = |k: usize| Vector3::from(rays.direction[k].map(f64::from));
        let (tu, tv) = (at(i + 1) - at(i - 1), at(i + width) - at(i - width));
        let on_sphere = gradient(&tu, &tv, across, down)?;
        let gamma = f64::from(first_depth.values[i] / rays.length[i]);
        let (g, x) = (on_sphere * gamma, at(i) / gamma);
        let turn = x.cross(&g);
        Some(Equation {
            change,
            coefficients: Vector6::new(turn.x, turn.y, turn.z, g.x, g.y, g.z),
        })
    }
}

impl BrightnessTerm {
    fn add(&mut self, equation: &Equation, weight: f64) {
        let c = &equation.coefficients;
        self.information += c * c.transpose() * weight;
        self.gradient += c * (weight * equation.change);
    }
}

/// The vector in the plane of `tu` and `tv` whose products with them are `u` and `v`.
fn gradient(tu: &Vector3<f64>, tv: &Vector3<f64>, u: f64, v: f64) -> Option<Vector3<f64>> {
    let (uu, uv, vv) = (tu.dot(tu), tu.dot(tv), tv.dot(tv));
    let determinant = uu * vv - uv * uv;
    let sound = determinant > 1e-6 * uu * vv; // not at a pole; false for NaN
    sound.then(|| (tu * (vv * u - uv * v) + tv * (uu * v - uv * u)) / determinant)
}

fn moved(motion: &Rigid, point: &Vector3<f64>) -> Vector3<f64> {
    let p = motion.turn([point.x as f32, point.y as f32, point.z as f32]);
    let t = motion.translation;
    Vector3::new(
        f64::from(p[0] + t[0]),
        f64::from(p[1] + t[1]),
        f64::from(p[2] + t[2]),
    )
}

fn bilinear(values: &[f32], width: usize, height: usize, pixel: &Vector2<f64>) -> f32 {
    let (u, v) = (pixel.x as f32, pixel.y as f32);
    if !(u >= 0.0 && v >= 0.0 && u < (width - 1) as f32 && v < (height - 1) as f32) {
        return f32::NAN;
    }
    let (x, y) = (u as usize, v as usize);
    let (u, v) = (u - x as f32, v - y as f32);
    let i = y * width + x;
    let top = values[i] + (values[i + 1] - values[i]) * u;
    let bottom = values[i + width] + (values[i + width + 1] - values[i + width]) * u;
    top + (bottom - top) * v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradient_has_the_given_products() {
        let (tu, tv) = (Vector3::new(0.1, 0.01, -0.02), Vector3::new(0.0, 0.2, 0.03));
        let g = gradient(&tu, &tv, 0.7, -0.3).unwrap();
        assert!((g.dot(&tu) - 0.7).abs() < 1e-12 && (g.dot(&tv) + 0.3).abs() < 1e-12);
        assert!(gradient(&tu, &(2.0 * tu), 1.0, 2.0).is_none());
    }
}
