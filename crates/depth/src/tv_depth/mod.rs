//! Depth by total variation and an absolute data term on the sphere, with a duality gap.

mod gap;
mod solver;

use crate::{DataTerm, Error, PixelRays, Result, VariationalDepth};
use solver::{Problem, State};
use sphereflow_core::Plane;
use sphereflow_core::checks::{each, positive};
use sphereflow_raster::same_size;

/// Settings of [`TvDepth`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TvDepthConfig {
    /// Weight of the data, alpha^2 of (2.17): per metre and radian over a grey level per second.
    pub lambda: f64,
    /// The thesis's beta^2: 1/(2 beta^2) is the primal step. It changes the way, not the limit.
    pub beta2: f64,
    /// Relative duality gap at which to stop; 0 to use all iterations.
    pub gap: f64,
    /// Iterations at which to stop in any case.
    pub iterations: usize,
    /// Nearest surface, metres: 1/D stays between zero and its inverse.
    pub nearest_m: f64,
}

impl Default for TvDepthConfig {
    fn default() -> Self {
        Self {
            lambda: 0.5,
            beta2: 20.0,
            gap: 0.0,
            iterations: 50,
            nearest_m: 0.1,
        }
    }
}

/// Minimises int lambda |F + G Y| + |grad Y| dsigma over the inverse range Y, for any camera.
///
/// Thesis: eq. (2.17), (2.18), (2.19), (2.20), with the weights of the sphere's metric that the printed
/// algorithm drops, and the two printed steps that are wrong put right: step 3 starts from Lambda and
/// step 4 from the new Gamma. It then is the primal-dual iteration of Chambolle and Pock.
#[derive(Clone, Debug)]
pub struct TvDepth {
    rays: PixelRays,
    config: TvDepthConfig,
    problem: Problem,
    state: Option<State>,
}

impl TvDepth {
    /// For a camera.
    ///
    /// # Errors
    /// Value errors for settings out of their domain.
    pub fn new(rays: &PixelRays, config: TvDepthConfig) -> Result<Self> {
        let settings = [
            ("lambda", config.lambda),
            ("beta2", config.beta2),
            ("nearest_m", config.nearest_m),
        ];
        each(positive, &settings)?;
        if !(0.0..1.0).contains(&config.gap) {
            return Err(Error::value("gap", "0 to 1", config.gap));
        }
        Ok(Self {
            problem: Problem::new(rays, config.lambda as f32, (1.0 / config.nearest_m) as f32),
            rays: rays.clone(),
            config,
            state: None,
        })
    }

    /// The minimiser from `start` (1/D per metre) and the dual variables of the last call, or from
    /// zero. All NaN where no pixel says anything ([`DataTerm::is_silent`]).
    ///
    /// # Errors
    /// Shape errors naming the argument.
    pub fn solve(
        &mut self,
        data: &DataTerm,
        start: Option<&Plane<f32>>,
    ) -> Result<VariationalDepth> {
        /// Iterations between two looks at the gap, which cost about two of them.
        const BETWEEN_GAPS: usize = 25;
        same_size("data", self.rays.size(), data.f.size())?;
        if let Some(start) = start {
            same_size("start", self.rays.size(), start.size())?;
        }
        let (width, height) = self.rays.size();
        if data.is_silent() {
            return Ok(VariationalDepth::silent(self.rays.size()));
        }
        let mut state = match (self.state.take(), start) {
            (Some(state), Some(start)) => state.starting_from(start),
            (None, Some(start)) => State::new(width, height).starting_from(start),
            (_, None) => State::new(width, height),
        };
        let mut done = 0;
        let mut gap = f64::INFINITY;
        while done < self.config.iterations && gap > self.config.gap {
            let most = self.config.iterations - done;
            let count = if self.config.gap > 0.0 {
                most.min(BETWEEN_GAPS)
            } else {
                most
            };
            self.problem
                .iterate(data, &mut state, self.config.beta2, count);
            done += count;
            gap = self.problem.relative_gap(data, &state);
        }
        let energy = self.problem.energy(data, &state);
        let mut inv_range = state.value().clone();
        for (i, value) in inv_range.data_mut().iter_mut().enumerate() {
            if !self.rays.is_valid(i) {
                *value = f32::NAN;
            }
        }
        self.state = Some(state);
        Ok(VariationalDepth {
            inv_range,
            energy,
            residual: gap,
            iterations: done,
        })
    }
}
