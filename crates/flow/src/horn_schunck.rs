//! Horn and Schunck's optical flow: least squares with a Sobolev prior.

use crate::derivatives::Derivatives;
use crate::error::{Error, positive, same_size};
use crate::{FlowField, Result};
use sphereflow_core::Plane;

/// How the linear system (2.5) is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HornSchunckSolver {
    /// So many sweeps of Jacobi's iteration, as the thesis prints it.
    Jacobi {
        /// Sweeps over the image.
        sweeps: usize,
    },
    /// Successive over-relaxation until no displacement changes by more than the tolerance.
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
///
/// # Errors
/// Shape errors naming the image or `start`; value errors for settings out of their domain.
pub fn horn_schunck(
    image0: &Plane<f32>,
    image1: &Plane<f32>,
    config: &HornSchunckConfig,
    start: Option<&FlowField>,
) -> Result<FlowField> {
    let derivatives = Derivatives::of_pair(image0, image1)?;
    horn_schunck_of(&derivatives, config, start)
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
    positive("alpha", f64::from(config.alpha))?;
    positive("aspect", f64::from(config.aspect))?;
    let (width, height) = derivatives.x.size();
    if width < 2 || height < 2 {
        return Err(Error::value(
            "image size",
            "at least 2x2 pixels",
            format!("{width}x{height}"),
        ));
    }
    let mut flow = match start {
        Some(start) => {
            same_size("start", (width, height), start.size())?;
            start.clone()
        }
        None => FlowField::zero(width, height),
    };
    let system = System::new(derivatives, config);
    match config.solver {
        HornSchunckSolver::Jacobi { sweeps } => system.jacobi(&mut flow, sweeps),
        HornSchunckSolver::Sor {
            tolerance_px,
            sweeps,
        } => system.relax(&mut flow, tolerance_px, sweeps),
    }
    Ok(flow)
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

/// The linear system, ready for sweeps: `u = mean(u) - cx r`, `r = yx mean(u) + yy mean(v) + yt`.
struct System<'a> {
    d: &'a Derivatives,
    cx: Vec<f32>,
    cy: Vec<f32>,
    /// Share of the horizontal neighbours in the means of u and v.
    along: [f32; 2],
}

impl<'a> System<'a> {
    fn new(d: &'a Derivatives, config: &HornSchunckConfig) -> Self {
        let Weights { u, v } = Weights::new(config.aspect);
        let alpha2 = config.alpha * config.alpha;
        // n alpha^2 of (2.6), for each component: weights of the two neighbours each way.
        let (nu, nv) = (2.0 * (u[0] + u[1]) * alpha2, 2.0 * (v[0] + v[1]) * alpha2);
        let slopes = d.x.data().iter().zip(d.y.data());
        let (cx, cy) = slopes
            .map(|(yx, yy)| {
                let scale = 1.0 / (1.0 + yx * yx / nu + yy * yy / nv);
                (yx / nu * scale, yy / nv * scale)
            })
            .unzip();
        Self {
            d,
            cx,
            cy,
            along: [u[0] / (u[0] + u[1]), v[0] / (v[0] + v[1])],
        }
    }

    /// Thesis: eq. (2.7). All sweeps run through the image together, each two rows behind the one before, so
    /// that the rows they share stay in the cache; the result is that of sweep after sweep.
    fn jacobi(&self, flow: &mut FlowField, sweeps: usize) {
        let height = flow.size().1;
        let mut other = flow.clone();
        /// Sweeps that run together: their rows fit into the cache.
        const TOGETHER: usize = 10;
        let mut done = 0;
        while done < sweeps {
            let together = TOGETHER.min(sweeps - done);
            for front in 0..height + 2 * (together - 1) {
                for sweep in 0..together {
                    let Some(row) = front.checked_sub(2 * sweep).filter(|row| *row < height) else {
                        continue;
                    };
                    match (done + sweep) % 2 {
                        0 => self.jacobi_row(row, flow, &mut other),
                        _ => self.jacobi_row(row, &other, flow),
                    }
                }
            }
            done += together;
        }
        if sweeps % 2 == 1 {
            std::mem::swap(flow, &mut other);
        }
    }

    fn jacobi_row(&self, y: usize, from: &FlowField, to: &mut FlowField) {
        let (width, height) = from.size();
        let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
        let range = y * width..(y + 1) * width;
        let (yx, yy, yt) = (self.d.x.row(y), self.d.y.row(y), self.d.t.row(y));
        let (cx, cy) = (&self.cx[range.clone()], &self.cy[range.clone()]);
        let (u, v) = (
            [from.u.row(above), from.u.row(y), from.u.row(below)],
            [from.v.row(above), from.v.row(y), from.v.row(below)],
        );
        let (out_u, out_v) = (
            &mut to.u.data_mut()[range.clone()],
            &mut to.v.data_mut()[range],
        );
        let mut pixel = |x: usize, left: usize, right: usize| {
            let mean = |f: &[&[f32]; 3], share: f32| {
                0.5 * (share * (f[1][left] + f[1][right]) + (1.0 - share) * (f[0][x] + f[2][x]))
            };
            let (mu, mv) = (mean(&u, self.along[0]), mean(&v, self.along[1]));
            let r = yx[x] * mu + yy[x] * mv + yt[x];
            out_u[x] = mu - cx[x] * r;
            out_v[x] = mv - cy[x] * r;
        };
        pixel(0, 0, 1);
        for x in 1..width - 1 {
            pixel(x, x - 1, x + 1);
        }
        pixel(width - 1, width - 2, width - 1);
    }

    /// Gauss and Seidel's sweeps in place, over-relaxed.
    fn relax(&self, flow: &mut FlowField, tolerance_px: f32, sweeps: usize) {
        /// Between 1 (Gauss-Seidel) and 2 (divergence): near the best for means over a few hundred pixels.
        const OVER: f32 = 1.9;
        let (width, height) = flow.size();
        for _ in 0..sweeps {
            let mut largest = 0.0_f32;
            for y in 0..height {
                let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
                for x in 0..width {
                    let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
                    let mean = |f: &Plane<f32>, share: f32| {
                        0.5 * (share * (f[(left, y)] + f[(right, y)])
                            + (1.0 - share) * (f[(x, above)] + f[(x, below)]))
                    };
                    let (mu, mv) = (mean(&flow.u, self.along[0]), mean(&flow.v, self.along[1]));
                    let r = self.d.x[(x, y)] * mu + self.d.y[(x, y)] * mv + self.d.t[(x, y)];
                    let i = y * width + x;
                    let du = OVER * (mu - self.cx[i] * r - flow.u[(x, y)]);
                    let dv = OVER * (mv - self.cy[i] * r - flow.v[(x, y)]);
                    flow.u[(x, y)] += du;
                    flow.v[(x, y)] += dv;
                    largest = largest.max(du.abs()).max(dv.abs());
                }
            }
            if largest <= tolerance_px {
                break;
            }
        }
    }
}
