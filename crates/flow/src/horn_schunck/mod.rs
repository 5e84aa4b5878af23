//! Horn and Schunck's optical flow: least squares with a Sobolev prior.

mod relax;
mod system;

use crate::{Error, FlowField, Result};
use sphereflow_core::Plane;
use sphereflow_core::checks::positive;
use sphereflow_raster::{Derivatives, Padded, PairRows, is_blank, same_size};
use system::System;

/// How the linear system (2.5) is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HornSchunckSolver {
    /// So many sweeps of Jacobi's iteration, as the thesis prints it.
    Jacobi {
        /// Sweeps over the image.
        sweeps: usize,
    },
    /// Successive over-relaxation until no displacement changes by more than the tolerance, which is looked
    /// at after every tenth sweep.
    Sor {
        /// Largest change of a displacement in a sweep at which to stop, pixels.
        tolerance_px: f32,
        /// Sweeps at which to stop in any case.
        sweeps: usize,
    },
}

/// Settings of [`horn_schunck`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HornSchunckConfig {
    /// Weight of smoothness: grey levels per pixel of flow against flow change per pixel.
    pub alpha: f32,
    /// Height over width of a pixel, radians or anything else (1 for square pixels).
    pub aspect: f32,
    /// The solver.
    pub solver: HornSchunckSolver,
}

impl Default for HornSchunckConfig {
    fn default() -> Self {
        Self {
            alpha: 10.0,
            aspect: 1.0,
            solver: HornSchunckSolver::Jacobi { sweeps: 50 },
        }
    }
}

/// Flow from `image0` to `image1` in pixels, of images of any size and any brightness scale.
///
/// Thesis: eq. (2.2), (2.5), (2.6), (2.7). The prior is on the angle moved, so that pixels that are not
/// square weigh right. Flow larger than about a pixel needs a start nearby: `start`, else zero.
/// Unknown pixels (NaN) say nothing: the flow there is the prior's. Where one of the images is blank, the
/// flow is NaN everywhere.
///
/// # Errors
/// Shape errors naming the image or `start`; value errors for settings out of their domain.
pub fn horn_schunck(
    image0: &Plane<f32>,
    image1: &Plane<f32>,
    config: &HornSchunckConfig,
    start: Option<&FlowField>,
) -> Result<FlowField> {
    let mut rows = PairRows::new(image0, image1)?;
    let size = image0.size();
    check(config, size, start)?;
    if is_blank(image0) || is_blank(image1) {
        return Ok(FlowField::unknown(size.0, size.1));
    }
    let write = |y: usize, out: [&mut [f32]; 3]| rows.write(y, out);
    solve(size, config, write, start)
}

/// [`horn_schunck`] of derivatives that are known already.
///
/// # Errors
/// As [`horn_schunck`].
pub fn horn_schunck_of(
    derivatives: &Derivatives,
    config: &HornSchunckConfig,
    start: Option<&FlowField>,
) -> Result<FlowField> {
    let size = derivatives.x.size();
    same_size("derivatives.y", size, derivatives.y.size())?;
    same_size("derivatives.t", size, derivatives.t.size())?;
    check(config, size, start)?;
    let planes = [&derivatives.x, &derivatives.y, &derivatives.t];
    let write = |y: usize, out: [&mut [f32]; 3]| {
        for (plane, out) in planes.into_iter().zip(out) {
            out.copy_from_slice(plane.row(y));
        }
    };
    solve(size, config, write, start)
}

fn check(
    config: &HornSchunckConfig,
    size: (usize, usize),
    start: Option<&FlowField>,
) -> Result<()> {
    positive("alpha", f64::from(config.alpha))?;
    positive("aspect", f64::from(config.aspect))?;
    if size.0 < 2 || size.1 < 2 {
        let found = format!("{}x{}", size.0, size.1);
        return Err(Error::value("image size", "at least 2x2 pixels", found));
    }
    match start {
        Some(start) => same_size("start", size, start.size()),
        None => Ok(()),
    }
}

/// The flow of derivatives whose rows `write` gives.
fn solve(
    size: (usize, usize),
    config: &HornSchunckConfig,
    write: impl FnMut(usize, [&mut [f32]; 3]),
    start: Option<&FlowField>,
) -> Result<FlowField> {
    const PLANES: usize = 7;
    let mut block = vec![0.0; PLANES * Padded::len(size)];
    let [a, b, c, u, v, other_u, other_v] = Padded::split::<PLANES>(&mut block, size)?;
    let system = System::new([a, b, c], config, write);
    let mut flow = [u, v];
    if let Some(start) = start {
        for (padded, plane) in flow.iter_mut().zip([&start.u, &start.v]) {
            padded.load_known(plane);
        }
    }
    match config.solver {
        HornSchunckSolver::Jacobi { sweeps } => {
            flow = system.jacobi(flow, [other_u, other_v], sweeps);
        }
        HornSchunckSolver::Sor {
            tolerance_px,
            sweeps,
        } => system.relax(&mut flow, tolerance_px, sweeps),
    }
    let [u, v] = flow.map(|plane| plane.to_plane());
    Ok(FlowField { u, v })
}

/// The cost I of a flow, grey levels squared.
///
/// Thesis: eq. (2.2), with forward differences in the prior.
pub fn horn_schunck_energy(
    derivatives: &Derivatives,
    flow: &FlowField,
    config: &HornSchunckConfig,
) -> f64 {
    let (width, height) = flow.size();
    let Weights { u, v } = Weights::new(config.aspect);
    let alpha2 = config.alpha * config.alpha;
    let mut sum = 0.0;
    for y in 0..height {
        for x in 0..width {
            let at = (x, y);
            let residual =
                derivatives.t[at] + derivatives.x[at] * flow.u[at] + derivatives.y[at] * flow.v[at];
            let mut rough = 0.0;
            for (field, [along, down]) in [(&flow.u, u), (&flow.v, v)] {
                let right = field[((x + 1).min(width - 1), y)] - field[at];
                let below = field[(x, (y + 1).min(height - 1))] - field[at];
                rough += along * right * right + down * below * below;
            }
            sum += f64::from(residual * residual + alpha2 * rough);
        }
    }
    sum
}

/// Weights of squared differences along and down, of both components: the prior is on
/// (d1 u, d2 v) over (d1 x, d2 y), divided by the common d1^2/d1^2.
struct Weights {
    u: [f32; 2],
    v: [f32; 2],
}

impl Weights {
    fn new(aspect: f32) -> Self {
        let square = aspect * aspect;
        Self {
            u: [1.0, 1.0 / square],
            v: [square, 1.0],
        }
    }
}
