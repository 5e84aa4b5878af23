//! Rows of a pair of images: every pixel's brightness and range against those of a reference image,
//! seen from where the de-biased velocities say the camera was.
//!
//! Thesis: eq. (5.3), integrated over time: with `X1 = R X2 + p`, (R, p) the motion between,
//! `y2 = y1(X1)` and `|X1| = D1(X1)`. Slopes are those of the second image at its pixel centres, by
//! differences that leave the pixel itself out: so the noise of slopes and residuals is not
//! correlated, and however noisy the images are the estimate settles on the truth.

use super::images::Images;
use super::information::PoseInformation;
use super::references::Reference;
use super::row_motion::RowMotion;
use crate::Result;
use nalgebra::{Matrix6, Vector2, Vector3, Vector6};
use rayon::prelude::*;
use sphereflow_core::statistics::{SIGMA_PER_MAD, median_mut};
use sphereflow_core::{Plane, Pose};
use sphereflow_sphere::{Sampler, SphereGrid};

/// Images with the slopes that alignment needs.
#[derive(Clone, Debug)]
pub struct Sloped {
    /// As measured.
    pub images: Images,
    grey_slope: Vec<Vector3<f64>>,
    range_slope: Vec<Vector3<f64>>,
    smooth_range: Plane<f32>,
}

/// Passes of the 1-2-1 filter before slopes are taken, brightness and range.
const SMOOTHING: [usize; 2] = [1, 4];
/// Cauchy's constant in robust standard deviations.
const CAUCHY: f64 = 2.385;
/// A range that differs by more than this, relative, is another surface.
const OTHER_SURFACE: f64 = 0.2;
/// Rows of neighbouring pixels share part of their errors: information is divided by this.
const OVERCONFIDENCE: f64 = 1.5;

impl Sloped {
    /// Slopes of both images on the sphere.
    ///
    /// # Errors
    /// A shape error where the images are not of the grid's size.
    pub fn new(grid: &SphereGrid, images: Images) -> Result<Self> {
        let smooth = |image: &Plane<f32>, passes: usize| {
            (0..passes).fold(image.clone(), |image, _| smoothed(&image))
        };
        let slope = |image: &Plane<f32>| {
            let values: Vec<f64> = image.data().iter().map(|v| f64::from(*v)).collect();
            grid.gradient(&values)
        };
        let smooth_range = smooth(&images.range, SMOOTHING[1]);
        Ok(Self {
            grey_slope: slope(&smooth(&images.grey, SMOOTHING[0]))?,
            range_slope: slope(&smooth_range)?,
            smooth_range,
            images,
        })
    }
}

/// Residuals and sensitivities of one pixel.
#[derive(Clone, Copy)]
struct Row {
    residual: [f64; 2],
    sensitivity: [Vector6<f64>; 2],
}

const NO_ROW: Row = Row {
    residual: [f64::NAN; 2],
    sensitivity: [Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0); 2],
};

/// A pair to align.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// Geometry of both images.
    pub grid: &'a SphereGrid,
    /// The image before, and how its rows moved.
    pub reference: &'a Reference,
    /// The image now.
    pub image: &'a Sloped,
    /// How its rows moved.
    pub rows: RowMotion,
}

/// The normal equations of a pair at the motion `reference_from_image`, and the share of pixels with
/// a row.
pub fn align(pair: &Pair<'_>, motion: &Pose) -> (PoseInformation, f64) {
    let (grid, first) = (pair.grid, &pair.reference.images);
    let width = grid.width();
    let mut rows = vec![NO_ROW; grid.rays().len()];
    rows.par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, line)| {
            let (grey, range) = (sampler(grid, &first.grey), sampler(grid, &first.range));
            for (x, row) in line.iter_mut().enumerate() {
                if let Some(found) = pixel(pair, motion, (x, y), [&grey, &range]) {
                    *row = found;
                }
            }
        });
    let count = rows
        .iter()
        .filter(|row| row.residual[1].is_finite())
        .count();
    let mut found = PoseInformation {
        information: Matrix6::zeros(),
        gradient: Vector6::zeros(),
    };
    for kind in 0..2 {
        add(&mut found, &rows, kind, width);
    }
    (found, count as f64 / rows.len().max(1) as f64)
}

fn sampler<'a>(grid: &SphereGrid, image: &'a Plane<f32>) -> Sampler<'a> {
    if grid.wraps_around() {
        Sampler::wrapping(image)
    } else {
        Sampler::new(image)
    }
}

/// Where a point of the reference's stamp is seen in its rows: pixel and position then.
fn seen_in_rows(pair: &Pair<'_>, point: Vector3<f64>) -> Option<(Vector2<f64>, Vector3<f64>)> {
    let camera = pair.grid.camera();
    let mut at = camera.project(&point)?;
    let rows = &pair.reference.rows;
    if rows.is_still() {
        return Some((at, point));
    }
    let mut then = point;
    for _ in 0..2 {
        then = rows.to_row(&point, at.y);
        at = camera.project(&then)?;
    }
    Some((at, then))
}

fn pixel(
    pair: &Pair<'_>,
    motion: &Pose,
    (x, y): (usize, usize),
    [grey, range]: [&Sampler<'_>; 2],
) -> Option<Row> {
    let (grid, second) = (pair.grid, pair.image);
    let i = y * grid.width() + x;
    let own_range = f64::from(second.images.range.data()[i]);
    if !own_range.is_finite() {
        return None;
    }
    let ray = grid.ray(x, y);
    let there = pair.rows.to_stamp(&(ray * own_range), y as f64);
    let (at, here) = seen_in_rows(pair, motion.rotation * there + motion.translation)?;
    let distance = here.norm();
    let seen_range = f64::from(range.bicubic(&at));
    let residual_range = distance - seen_range;
    if residual_range.is_nan() || residual_range.abs() >= OTHER_SURFACE * seen_range {
        return None;
    }
    let residual_grey = f64::from(second.images.grey.data()[i]) - f64::from(grey.bicubic(&at));
    // Sensitivities take the smooth range: the pixel's own noise in them would be correlated with
    // the residual, and a thousandth of a metre over one frame is centimetres per second.
    let smooth = f64::from(second.smooth_range.data()[i]);
    let arm = ray * smooth;
    let eta = motion.rotation.inverse() * (here / distance);
    // dr = g . (xi_omega x X + xi_v), all in the second frame
    let row = |slope: &Vector3<f64>, along: f64| {
        let g = eta * along - (slope - eta * eta.dot(slope)) / smooth;
        let by_omega = arm.cross(&g);
        Vector6::new(by_omega.x, by_omega.y, by_omega.z, g.x, g.y, g.z)
    };
    Some(Row {
        residual: [residual_grey, residual_range],
        sensitivity: [
            row(&second.grey_slope[i], 0.0),
            row(&second.range_slope[i], 1.0),
        ],
    })
}

/// Add the rows of brightness (0) or range (1), weighted by their own robust scale. A brightness
/// that all pixels share belongs to the exposure and is taken off.
fn add(found: &mut PoseInformation, rows: &[Row], kind: usize, width: usize) {
    let usable =
        |row: &&Row| row.residual[kind].is_finite() && row.sensitivity[kind].sum().is_finite();
    let mut residuals: Vec<f64> = rows
        .iter()
        .filter(usable)
        .map(|row| row.residual[kind])
        .collect();
    if residuals.len() < 50 {
        return;
    }
    let offset = if kind == 0 {
        median_mut(&mut residuals).unwrap_or(0.0)
    } else {
        0.0
    };
    residuals.iter_mut().for_each(|r| *r = (*r - offset).abs());
    let scale = (SIGMA_PER_MAD * median_mut(&mut residuals).unwrap_or(0.0)).max(1e-9);
    let chunk = |rows: &[Row]| {
        let (mut information, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
        for row in rows.iter().filter(usable) {
            let (s, r) = (&row.sensitivity[kind], row.residual[kind] - offset);
            let ratio = r / (CAUCHY * scale);
            let weight = 1.0 / (scale * scale * (1.0 + ratio * ratio) * OVERCONFIDENCE);
            information += s * s.transpose() * weight;
            gradient += s * (weight * r);
        }
        (information, gradient)
    };
    let parts: Vec<_> = rows.par_chunks(width).map(chunk).collect();
    for (information, gradient) in parts {
        found.information += information;
        found.gradient -= gradient;
    }
}

/// One pass of 1-2-1 along rows and columns; unknown pixels stay unknown and give no weight.
fn smoothed(image: &Plane<f32>) -> Plane<f32> {
    let (width, height) = image.size();
    let pass = |image: &Plane<f32>, dx: usize, dy: usize| {
        Plane::from_fn(width, height, |x, y| {
            let own = image[(x, y)];
            if own.is_nan() {
                return own;
            }
            let (mut sum, mut weight) = (2.0 * own, 2.0);
            let before = (x >= dx && y >= dy).then(|| image[(x - dx, y - dy)]);
            for value in before.into_iter().chain(image.get(x + dx, y + dy).copied()) {
                if !value.is_nan() {
                    (sum, weight) = (sum + value, weight + 1.0);
                }
            }
            sum / weight
        })
    };
    pass(&pass(image, 1, 0), 0, 1)
}
