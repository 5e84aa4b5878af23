//! Depth by least squares with a Sobolev prior on the sphere.

use crate::elliptic::{Cells, Multigrid};
use crate::{DataTerm, PixelRays, Result, VariationalDepth};
use sphereflow_core::Plane;
use sphereflow_core::checks::positive;
use sphereflow_raster::same_size;

/// Settings of [`SobolevDepth`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SobolevConfig {
    /// Weight of smoothness alpha, metres per second in the thesis's units (brightness 1 to 256).
    pub alpha_m_s: f64,
    /// Norm of the residual over that of the right side at which to stop.
    pub tolerance: f64,
    /// Iterations at which to stop in any case.
    pub iterations: usize,
}

impl Default for SobolevConfig {
    fn default() -> Self {
        Self {
            alpha_m_s: 300.0,
            tolerance: 1e-4,
            iterations: 60,
        }
    }
}

/// Minimises int (F + G Y)^2 + alpha^2 |grad Y|^2 dsigma over the inverse range Y, for any camera.
#[derive(Debug)]
pub struct SobolevDepth {
    rays: PixelRays,
    cells: Cells,
    config: SobolevConfig,
}

impl SobolevDepth {
    /// For a camera.
    ///
    /// # Errors
    /// Value errors for settings out of their domain.
    pub fn new(rays: &PixelRays, config: SobolevConfig) -> Result<Self> {
        positive("alpha_m_s", config.alpha_m_s)?;
        positive("tolerance", config.tolerance)?;
        Ok(Self {
            cells: Cells::new(rays),
            rays: rays.clone(),
            config,
        })
    }

    /// The minimiser, from `start` (1/D per metre) or zero. All NaN where no pixel says anything
    /// ([`DataTerm::is_silent`]).
    ///
    /// Thesis: eq. (2.12), (2.13), (2.14), (2.16).
    ///
    /// # Errors
    /// Shape errors naming the argument.
    pub fn solve(&self, data: &DataTerm, start: Option<&Plane<f32>>) -> Result<VariationalDepth> {
        same_size("data", self.rays.size(), data.f.size())?;
        if let Some(start) = start {
            same_size("start", self.rays.size(), start.size())?;
        }
        let (width, height) = self.rays.size();
        if data.is_silent() {
            return Ok(VariationalDepth::silent(self.rays.size()));
        }
        let weight = |i: usize| {
            if self.rays.is_valid(i) {
                f64::from(self.rays.solid_angle(i))
            } else {
                0.0
            }
        };
        let terms = data.f.data().iter().zip(data.g.data()).enumerate();
        let (mass, right_side): (Vec<f64>, Vec<f64>) = terms
            .map(|(i, (f, g))| {
                let (f, g) = (f64::from(*f), f64::from(*g));
                (weight(i) * g * g, -weight(i) * f * g)
            })
            .unzip();
        let alpha2 = self.config.alpha_m_s * self.config.alpha_m_s;
        let mut value: Vec<f64> = match start {
            Some(start) => start.data().iter().map(|v| finite_or_zero(*v)).collect(),
            None => vec![0.0; mass.len()],
        };
        let mut solver = Multigrid::new(&self.cells, alpha2, &mass);
        let (tolerance, most) = (self.config.tolerance, self.config.iterations);
        let solved = solver.solve(&mut value, &right_side, tolerance, most);
        let mut inv_range = Plane::filled(width, height, f32::NAN);
        for (i, out) in inv_range.data_mut().iter_mut().enumerate() {
            if self.rays.is_valid(i) {
                *out = value[i] as f32;
            }
        }
        Ok(VariationalDepth {
            energy: self.energy(data, &value, solver.form(&value, &mass)),
            inv_range,
            residual: solved.residual,
            iterations: solved.iterations,
        })
    }

    /// The functional: the data's part summed here, the prior's given.
    fn energy(&self, data: &DataTerm, value: &[f64], prior: f64) -> f64 {
        let terms = data.f.data().iter().zip(data.g.data()).zip(value);
        let misfit: f64 = terms
            .enumerate()
            .filter(|(i, _)| self.rays.is_valid(*i))
            .map(|(i, ((f, g), y))| {
                let r = f64::from(*f) + f64::from(*g) * y;
                f64::from(self.rays.solid_angle(i)) * r * r
            })
            .sum();
        misfit + prior
    }
}

fn finite_or_zero(value: f32) -> f64 {
    if value.is_finite() {
        f64::from(value)
    } else {
        0.0
    }
}
