//! One level of the pyramid: block means of both images and the equations of its blocks.

use super::RangeFlowConfig;
use super::equations::Row;
use crate::Result;
use nalgebra::{Matrix3, Vector3};
use sphereflow_alignment::binning::{BlockRule, InverseDepth};
use sphereflow_alignment::row_motion::RowMotion;
use sphereflow_alignment::sphere_table::SphereTable;
use sphereflow_alignment::warp::Warp;
use sphereflow_alignment::{Axis, DepthImage};
use sphereflow_core::Pose;
use sphereflow_sphere::{Camera, RollingShutter};

/// Blocks of one size, with working memory.
#[derive(Clone, Debug)]
pub(super) struct Level {
    block: usize,
    binned: Camera,
    table: SphereTable,
    /// Fits of the blocks, for images along `fits_of`.
    fits: Vec<PlaneFit>,
    fits_of: Option<Axis>,
    first: InverseDepth,
    second: InverseDepth,
    warped: InverseDepth,
    rows: Vec<RowMotion>,
    mean: Vec<f32>,
    change: Vec<f32>,
}

/// The plane through a block and its four neighbours. The block mean of the inverse depth of a
/// plane is `m . p`, with p the block's vector and m the plane's normal over its distance.
#[derive(Clone, Copy, Debug)]
struct PlaneFit {
    /// Turns differences to right and left, below and above, and the mean here into m.
    inverse: Matrix3<f32>,
    /// Mean squared angle between the neighbours on either side.
    span_squared: f32,
}

impl Level {
    pub(super) fn new(camera: &Camera, block: usize) -> Result<Self> {
        Ok(Self {
            block,
            binned: camera.binned(block)?,
            table: SphereTable::new(camera, block)?,
            fits: Vec::new(),
            fits_of: None,
            first: InverseDepth::default(),
            second: InverseDepth::default(),
            warped: InverseDepth::default(),
            rows: Vec::new(),
            mean: Vec::new(),
            change: Vec::new(),
        })
    }

    /// Takes the block means of both images, which are along the same axis.
    pub(super) fn take(
        &mut self,
        first: &DepthImage<'_>,
        second: &DepthImage<'_>,
        config: &RangeFlowConfig,
    ) {
        let rule = BlockRule {
            block: self.block,
            known_share: config.block_known_share as f32,
            max_spread: config.max_jump as f32,
        };
        self.first.average(first, None, rule);
        self.second.average(second, None, rule);
        let axis = first.axis();
        if self.fits_of != Some(axis) {
            self.fits = self.plane_fits(axis);
            self.fits_of = Some(axis);
        }
    }

    /// Compares the first image with the second one as seen from where the first was taken, were
    /// the motion `first_from_second`; without a motion, with the second one as it is.
    pub(super) fn compare(&mut self, motion: Option<Pose>, config: &RangeFlowConfig) {
        if let Some(motion) = motion {
            Warp {
                camera: &self.binned,
                plane: None,
                table: &self.table,
                second: &self.second,
                motion,
                shutter: RollingShutter::default(),
                max_jump: config.max_jump as f32,
                steps: 1,
            }
            .fill(&self.first, &mut self.rows, &mut self.warped);
        }
        let second = if motion.is_some() {
            &self.warped
        } else {
            &self.second
        };
        let pairs = || self.first.values.iter().zip(&second.values);
        self.mean.clear();
        self.mean.extend(pairs().map(|(a, b)| 0.5 * (a + b)));
        self.change.clear();
        self.change.extend(pairs().map(|(a, b)| b - a));
    }

    /// Share of blocks known in both images as compared.
    pub(super) fn known_share(&self) -> f64 {
        let known = self.mean.iter().filter(|v| v.is_finite()).count();
        known as f64 / self.mean.len().max(1) as f64
    }

    /// The equations of all blocks with four neighbours, without a jump between them.
    ///
    /// With gamma = 1/D, (1.17) at one ray is `gamma_t = (eta x m) . omega + gamma m . v`, where
    /// `m = grad gamma + gamma eta` is the normal of the surface over the distance of its tangent
    /// plane.
    ///
    /// Thesis: eq. (1.17), point by point; section 6.1 integrates it instead.
    pub(super) fn rows(&self, max_jump: f32, out: &mut Vec<Row>) {
        out.clear();
        let (width, height) = (self.table.width, self.table.height);
        let rays = self.table.rays(self.first.axis);
        let inner = if self.table.wraps {
            0..width
        } else {
            1..width - 1
        };
        for y in 1..height - 1 {
            for x in inner.clone() {
                let i = y * width + x;
                let (left, right) = (
                    y * width + (x + width - 1) % width,
                    y * width + (x + 1) % width,
                );
                let near = [left, right, i - width, i + width].map(|k| self.mean[k]);
                let (here, fit) = (self.mean[i], &self.fits[i]);
                let limit = max_jump * here;
                // A NaN fails the comparison.
                if !near.iter().all(|v| (v - here).abs() <= limit) {
                    continue;
                }
                let plane = fit.inverse * Vector3::new(near[1] - near[0], near[3] - near[2], here);
                let ray = Vector3::from(rays.direction[i]);
                let gamma = here / rays.length[i];
                let row = Row::new(
                    &ray,
                    &plane,
                    gamma,
                    self.change[i] / rays.length[i],
                    1.0 / (fit.span_squared * rays.length[i] * rays.length[i]),
                );
                out.extend(row);
            }
        }
    }

    fn plane_fits(&self, axis: Axis) -> Vec<PlaneFit> {
        let (width, height) = (self.table.width, self.table.height);
        let rays = self.table.rays(axis);
        let vector = |x: usize, y: usize| {
            let i = y * width + x;
            Vector3::from(rays.direction[i].map(f64::from)) * f64::from(rays.length[i])
        };
        let fit = |x: usize, y: usize| {
            let (left, right) = if self.table.wraps {
                ((x + width - 1) % width, (x + 1) % width)
            } else {
                (x.saturating_sub(1), (x + 1).min(width - 1))
            };
            let across = vector(right, y) - vector(left, y);
            let down = vector(x, (y + 1).min(height - 1)) - vector(x, y.saturating_sub(1));
            let here = vector(x, y);
            let system =
                Matrix3::from_rows(&[across.transpose(), down.transpose(), here.transpose()]);
            let inverse = system.try_inverse().unwrap_or(Matrix3::repeat(f64::NAN));
            let span = 0.5 * (across.norm_squared() + down.norm_squared());
            PlaneFit {
                inverse: inverse.cast(),
                span_squared: (span / here.norm_squared()) as f32,
            }
        };
        (0..width * height)
            .map(|i| fit(i % width, i / width))
            .collect()
    }
}
