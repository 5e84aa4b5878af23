//! TV-L1 optical flow: total variation prior, absolute data term, warps on a pyramid.

mod bicubic;
mod config;
mod median;
mod solver;
mod warping;

use crate::{Error, FlowField, Result};
use config::Settings;
pub use config::TvL1Config;
use solver::{Weight, Workspace};
use sphereflow_core::Plane;
use sphereflow_raster::{is_blank, measured_noise, same_size, sobel_into};
use warping::{halved, linearise_at, smoothed};

/// Flow from `image0` to `image1` in pixels, of images of any size and any brightness scale.
///
/// Thesis: section 2.1.4, eq. (2.9). With a `split` of zero beta is a mere step of the primal-dual
/// iteration, whose limit does not depend on it; with the default the data and the smooth flow stay
/// apart by beta, as in the printed functional. Unknown pixels (NaN) say nothing: the flow there is the
/// prior's. Where one of the images is blank, the flow is NaN everywhere.
///
/// # Errors
/// Shape errors naming the image or `start`; value errors for settings out of their domain.
pub fn tv_l1(
    image0: &Plane<f32>,
    image1: &Plane<f32>,
    config: &TvL1Config,
    start: Option<&FlowField>,
) -> Result<FlowField> {
    TvL1Flow::new(*config)?.flow(image0, image1, start)
}

/// [`tv_l1`] for one pair after the other: keeps its buffers and its dual variables.
#[derive(Clone, Debug)]
pub struct TvL1Flow {
    config: TvL1Config,
    levels: Vec<Workspace>,
}

impl TvL1Flow {
    /// With settings.
    ///
    /// # Errors
    /// Value errors for settings out of their domain.
    pub fn new(config: TvL1Config) -> Result<Self> {
        config.check()?;
        Ok(Self {
            config,
            levels: Vec::new(),
        })
    }

    /// As [`tv_l1`]. With a start of the same size as the call before, the dual variables of that
    /// call are used again (warm start).
    ///
    /// # Errors
    /// As [`tv_l1`].
    pub fn flow(
        &mut self,
        image0: &Plane<f32>,
        image1: &Plane<f32>,
        start: Option<&FlowField>,
    ) -> Result<FlowField> {
        same_size("image1", image0.size(), image1.size())?;
        let (width, height) = image0.size();
        if width < 4 || height < 4 {
            let found = format!("{width}x{height}");
            return Err(Error::value("image size", "at least 4x4 pixels", found));
        }
        if let Some(start) = start {
            same_size("start", (width, height), start.size())?;
        }
        if is_blank(image0) || is_blank(image1) {
            return Ok(FlowField::unknown(width, height));
        }
        let squares = [image0, image1].map(|image| measured_noise(image).powi(2));
        let settings = self
            .config
            .settings((0.5 * (squares[0] + squares[1])).sqrt());
        let pyramid = self.pyramid(image0, image1, settings);
        self.fit_workspaces(&pyramid, start.is_some());
        let coarsest = pyramid[pyramid.len() - 1].0.size();
        let mut flow = match start {
            Some(start) if coarsest == (width, height) => start.as_start(),
            Some(start) => start.as_start().resized(coarsest.0, coarsest.1),
            None => FlowField::zero(coarsest.0, coarsest.1),
        };
        let weight = Weight::new(settings.lambda, settings.split);
        for ((from, to), work) in pyramid.iter().zip(&mut self.levels).rev() {
            if flow.size() != from.size() {
                flow = flow.resized(from.width(), from.height());
            }
            let [slope_x, slope_y] = &mut work.slopes;
            sobel_into(from, slope_x, slope_y);
            for _ in 0..self.config.warps {
                linearise_at(work, from, to, &flow, weight);
                let (iterations, radius) = (self.config.iterations, self.config.median_radius);
                work.solve(&mut flow, weight, iterations, radius);
            }
        }
        Ok(flow)
    }

    fn pyramid(
        &self,
        image0: &Plane<f32>,
        image1: &Plane<f32>,
        settings: Settings,
    ) -> Vec<(Plane<f32>, Plane<f32>)> {
        /// Below this size a level has no content left.
        const LEAST: usize = 16;
        let sigma = settings.presmooth_px;
        let mut levels = vec![(smoothed(image0, sigma), smoothed(image1, sigma))];
        while levels.len() < self.config.levels {
            let (a, b) = &levels[levels.len() - 1];
            if a.width().min(a.height()) / 2 < LEAST {
                break;
            }
            levels.push((halved(a), halved(b)));
        }
        levels
    }

    fn fit_workspaces(&mut self, pyramid: &[(Plane<f32>, Plane<f32>)], warm: bool) {
        let fits = self.levels.len() == pyramid.len()
            && self
                .levels
                .iter()
                .zip(pyramid)
                .all(|(w, p)| w.size() == p.0.size());
        if !(fits && warm) {
            let new = |(image, _): &(Plane<f32>, Plane<f32>)| Workspace::new(image.size());
            self.levels = pyramid.iter().map(new).collect();
        }
    }
}
