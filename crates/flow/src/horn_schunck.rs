//! Horn and Schunck's optical flow: least squares with a Sobolev prior.

use crate::blank::is_blank;
use crate::derivatives::Derivatives;
use crate::error::{Error, positive, same_size};
use crate::sweeping::{Sweep, sweep_together};
use crate::{FlowField, Result};
use sphereflow_core::Plane;
use std::ops::Range;

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
    let derivatives = Derivatives::of_pair(image0, image1)?.silent_where_unknown();
    let flow = horn_schunck_of(&derivatives, config, start)?;
    if is_blank(image0) || is_blank(image1) {
        let (width, height) = image0.size();
        return Ok(FlowField::unknown(width, height));
    }
    Ok(flow)
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
            start.as_start()
        }
        None => FlowField::zero(width, height),
    };
    let system = System::new(derivatives, config);
    match config.solver {
        HornSchunckSolver::Jacobi { sweeps } => {
            let sweeps = Sweeps {
                system: &system,
                flow: &mut flow,
                sweeps,
            };
            pulp::Arch::new().dispatch(sweeps);
        }
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

/// The linear system, ready for sweeps: `u = mean(u) - yx r`, `v = mean(v) - yy r n_u/n_v`, where
/// `r = gain (yx mean(u) + yy mean(v) + yt)`, with n alpha^2 of (2.6) for each component n_u and n_v.
struct System<'a> {
    d: &'a Derivatives,
    /// 1 / (n_u + yx^2 + yy^2 n_u/n_v).
    gain: Vec<f32>,
    /// n_u/n_v.
    ratio: f32,
    /// Share of each horizontal neighbour in the means of u and v.
    share: [f32; 2],
}

impl<'a> System<'a> {
    fn new(d: &'a Derivatives, config: &HornSchunckConfig) -> Self {
        let Weights { u, v } = Weights::new(config.aspect);
        let alpha2 = config.alpha * config.alpha;
        // Weights of the two neighbours each way.
        let [nu, nv] = [u, v].map(|[x, y]| 2.0 * (x + y) * alpha2);
        let ratio = nu / nv;
        let slopes = d.x.data().iter().zip(d.y.data());
        let gain = slopes.map(|(yx, yy)| 1.0 / (nu + yx * yx + yy * yy * ratio));
        Self {
            d,
            gain: gain.collect(),
            ratio,
            share: [u, v].map(|[x, y]| 0.5 * x / (x + y)),
        }
    }

    /// Thesis: eq. (2.7).
    #[inline(always)]
    fn jacobi<const SQUARE: bool>(&self, flow: &mut FlowField, sweeps: usize) {
        let mut pass = Jacobi::<'_, SQUARE> {
            system: self,
            other: flow.clone(),
            flow,
        };
        sweep_together(pass.other.size(), sweeps, &mut pass);
        if sweeps % 2 == 1 {
            std::mem::swap(pass.flow, &mut pass.other);
        }
    }

    #[inline(always)]
    fn jacobi_row<const SQUARE: bool>(
        &self,
        y: usize,
        columns: Range<usize>,
        from: &FlowField,
        to: &mut FlowField,
    ) {
        let (width, height) = from.size();
        let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
        let range = y * width..(y + 1) * width;
        let coefficients = [
            self.d.x.row(y),
            self.d.y.row(y),
            self.d.t.row(y),
            &self.gain[range.clone()],
        ];
        let u = [from.u.row(above), from.u.row(y), from.u.row(below)];
        let v = [from.v.row(above), from.v.row(y), from.v.row(below)];
        let out_u = &mut to.u.data_mut()[range.clone()];
        let out_v = &mut to.v.data_mut()[range];
        let last = width - 1;
        for (x, left, right) in [(0, 0, 1), (last, last - 1, last)] {
            if !columns.contains(&x) {
                continue;
            }
            let near = |f: [&[f32]; 3]| [f[1][left], f[1][right], f[0][x], f[2][x]];
            let new = self.pixel::<SQUARE>(coefficients.map(|c| c[x]), near(u), near(v));
            (out_u[x], out_v[x]) = (new[0], new[1]);
        }
        // Slices of one length have no bounds to check, so that the loop runs on vectors.
        let first = columns.start.max(1);
        let count = columns.end.min(last).saturating_sub(first);
        let [yx, yy, yt, gain] = coefficients.map(|row| &row[first..][..count]);
        let [ul, ur, ua, ub] = neighbours(u, first, count);
        let [vl, vr, va, vb] = neighbours(v, first, count);
        let (out_u, out_v) = (&mut out_u[first..][..count], &mut out_v[first..][..count]);
        for i in 0..count {
            let new = self.pixel::<SQUARE>(
                [yx[i], yy[i], yt[i], gain[i]],
                [ul[i], ur[i], ua[i], ub[i]],
                [vl[i], vr[i], va[i], vb[i]],
            );
            (out_u[i], out_v[i]) = (new[0], new[1]);
        }
    }

    /// Flow of a pixel from that of its left, right, upper and lower neighbours; shorter for square pixels.
    #[inline(always)]
    fn pixel<const SQUARE: bool>(
        &self,
        [yx, yy, yt, gain]: [f32; 4],
        u: [f32; 4],
        v: [f32; 4],
    ) -> [f32; 2] {
        let mean = |n: [f32; 4], share: f32| {
            if SQUARE {
                0.25 * ((n[0] + n[1]) + (n[2] + n[3]))
            } else {
                share * (n[0] + n[1]) + (0.5 - share) * (n[2] + n[3])
            }
        };
        let (mu, mv) = (mean(u, self.share[0]), mean(v, self.share[1]));
        let r = gain * (yx * mu + yy * mv + yt);
        let rv = if SQUARE { r } else { r * self.ratio };
        [mu - yx * r, mv - yy * rv]
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
                    let near = |f: &Plane<f32>| {
                        [f[(left, y)], f[(right, y)], f[(x, above)], f[(x, below)]]
                    };
                    let at = (x, y);
                    let [yx, yy, yt] = [self.d.x[at], self.d.y[at], self.d.t[at]];
                    let coefficients = [yx, yy, yt, self.gain[y * width + x]];
                    let [u, v] = self.pixel::<false>(coefficients, near(&flow.u), near(&flow.v));
                    let (du, dv) = (OVER * (u - flow.u[at]), OVER * (v - flow.v[at]));
                    flow.u[at] += du;
                    flow.v[at] += dv;
                    largest = largest.max(du.abs()).max(dv.abs());
                }
            }
            if largest <= tolerance_px {
                break;
            }
        }
    }
}

/// Sweeps from one flow to the other in turn.
struct Jacobi<'a, const SQUARE: bool> {
    system: &'a System<'a>,
    flow: &'a mut FlowField,
    other: FlowField,
}

impl<const SQUARE: bool> Sweep for Jacobi<'_, SQUARE> {
    #[inline(always)]
    fn visit(&mut self, sweep: usize, row: usize, columns: Range<usize>) {
        let (from, to) = match sweep % 2 {
            0 => (&*self.flow, &mut self.other),
            _ => (&self.other, &mut *self.flow),
        };
        self.system.jacobi_row::<SQUARE>(row, columns, from, to);
    }
}

/// Jacobi's sweeps, compiled for wide vectors.
struct Sweeps<'a> {
    system: &'a System<'a>,
    flow: &'a mut FlowField,
    sweeps: usize,
}

impl pulp::WithSimd for Sweeps<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        if self.system.ratio == 1.0 && self.system.share == [0.25; 2] {
            self.system.jacobi::<true>(self.flow, self.sweeps);
        } else {
            self.system.jacobi::<false>(self.flow, self.sweeps);
        }
    }
}

/// Left, right, upper and lower neighbours of a row's pixels.
#[inline(always)]
fn neighbours([above, own, below]: [&[f32]; 3], first: usize, count: usize) -> [&[f32]; 4] {
    [
        &own[first - 1..][..count],
        &own[first + 1..][..count],
        &above[first..][..count],
        &below[first..][..count],
    ]
}
