//! The thesis's observer of velocity biases on images, discretised so that it is stable.
//!
//! Thesis: eq. (5.16) on the whole sphere, Thesis: eq. (5.33) on the window of an image, with the source
//! `phi eta` in the linear bias (the print has `eta`), Thesis: eq. (5.34) without linear velocity.
//! Explicit Euler steps with Sobel gradients, as the thesis takes them, blow up (Courant numbers of 4
//! to 16). Here the fields are transported back along the flow to the mid-point's foot, the window's
//! change along the way is exact, and the corrections are implicit.

use super::debiased::Sums;
use super::images::Images;
use super::window::Window;
use crate::Result;
use nalgebra::{Matrix6, Vector3, Vector6};
use rayon::prelude::*;
use sphereflow_core::Plane;
use sphereflow_sphere::SphereGrid;

/// How the biases follow the integrals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gains {
    /// `b' = -k int`, in the thesis's units: angular, linear.
    Fixed(f64, f64),
    /// `b' = -rate k_field Gram^-1 int`: every observable direction falls at this rate, 1/s.
    Normalised(f64),
}

/// Measured velocities of a step; without a linear one the camera is taken to rotate only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageVelocity {
    /// rad/s.
    pub angular_rad_s: Vector3<f64>,
    /// m/s.
    pub linear_m_s: Option<Vector3<f64>>,
}

mod flow;
#[cfg(test)]
mod ledger;

use flow::{Flow, mean};

/// The observer's state.
#[derive(Clone, Debug)]
pub struct FieldObserver {
    grid: SphereGrid,
    window: Window,
    gains: Gains,
    k_field: f64,
    lambda: [f64; 2],
    /// Estimates of X = phi y and Lambda = phi D, and the images before.
    fields: Option<([Plane<f32>; 2], Images)>,
    /// [angular, linear].
    bias: Vector6<f64>,
    field_energy: f64,
    /// Independent slopes of the last second or so: what is no noise.
    sums: Sums,
    mean_range: f64,
}

impl FieldObserver {
    /// At zero bias. `lambda` are the weights of brightness and range.
    pub fn new(
        grid: SphereGrid,
        window: Window,
        gains: Gains,
        k_field: f64,
        lambda: [f64; 2],
    ) -> Self {
        Self {
            grid,
            window,
            gains,
            k_field,
            lambda,
            fields: None,
            bias: Vector6::zeros(),
            field_energy: 0.0,
            sums: Sums::zeros(),
            mean_range: 1.0,
        }
    }

    /// The biases, [angular rad/s, linear m/s].
    pub fn bias(&self) -> Vector6<f64> {
        self.bias
    }

    /// Gram matrix of the sensitivities of the images to the biases, [angular, linear], without what
    /// noise adds to it.
    pub fn seen(&self, mean_range: f64) -> Matrix6<f64> {
        let spectrum = self.sums.gathered(mean_range);
        spectrum.map_or_else(Matrix6::zeros, |s| s.information())
    }

    /// The part of the Lyapunov function that needs no truth: `int lambda_X X~^2 + lambda_L L~^2`
    /// over two. Thesis: eq. (5.17).
    pub fn field_energy(&self) -> f64 {
        self.field_energy
    }

    /// The Lyapunov function. Thesis: eq. (5.17), with fixed gains; `None` with normalised ones.
    pub fn lyapunov(&self, true_bias: &Vector6<f64>) -> Option<f64> {
        let Gains::Fixed(k_omega, k_v) = self.gains else {
            return None;
        };
        let error = self.bias - true_bias;
        let (omega, v) = (error.fixed_rows::<3>(0), error.fixed_rows::<3>(3));
        Some(
            self.field_energy
                + omega.norm_squared() / (2.0 * k_omega)
                + v.norm_squared() / (2.0 * k_v),
        )
    }

    /// The images of an instant and the velocities measured over the `dt_s` before it.
    ///
    /// # Errors
    /// A shape error where the images are not of the grid's size.
    pub fn step(
        &mut self,
        images: Images,
        velocity: &ImageVelocity,
        mean_range: f64,
        dt_s: f64,
    ) -> Result<()> {
        self.mean_range = mean_range;
        let measured = self.windowed(&images);
        let Some((fields, before)) = self.fields.take() else {
            self.fields = Some((measured, images));
            return Ok(());
        };
        let flow = self.flow(&before, &images, velocity, dt_s);
        let sources = [mean(&before.grey, &images.grey), flow.range.clone()];
        let share = self.k_field * dt_s;
        let mut corrected =
            [0, 1].map(|i| flow.transport(&fields[i], &sources[i], i == 1, &measured[i], share));
        let linear = velocity.linear_m_s.is_some();
        self.follow(&mut corrected, &measured, [&before, &images], linear, dt_s)?;
        self.fields = Some((corrected, images));
        Ok(())
    }

    /// The flow between two images, as the de-biased velocities make it.
    fn flow(
        &self,
        before: &Images,
        images: &Images,
        velocity: &ImageVelocity,
        dt_s: f64,
    ) -> Flow<'_> {
        Flow {
            grid: &self.grid,
            window: &self.window,
            range: mean(&before.range, &images.range),
            omega: velocity.angular_rad_s - self.bias.fixed_rows::<3>(0),
            v: velocity
                .linear_m_s
                .map_or_else(Vector3::zeros, |v| v - self.bias.fixed_rows::<3>(3)),
            dt_s,
        }
    }

    /// The images are the first ones once more; the biases stay.
    pub fn restart(&mut self, images: Images) {
        self.fields = Some((self.windowed(&images), images));
    }

    /// X = phi y and Lambda = phi D. Thesis: section 5.4.1.
    fn windowed(&self, images: &Images) -> [Plane<f32>; 2] {
        let phi = self.window.values();
        [&images.grey, &images.range].map(|image| {
            let width = image.width();
            Plane::from_fn(width, image.height(), |x, y| {
                image[(x, y)] * phi[y * width + x] as f32
            })
        })
    }

    /// The integrals of (5.33) and the step of the biases, which is implicit: the fields go along with
    /// the biases' change, as if they had been transported by the new ones. An explicit step of
    /// `b' = -K g` adds `dt^2 g . K g / 2` to the Lyapunov function, which on the whole sphere is more
    /// than the correction takes away; the implicit one takes as much away.
    fn follow(
        &mut self,
        fields: &mut [Plane<f32>; 2],
        measured: &[Plane<f32>; 2],
        [before, images]: [&Images; 2],
        linear: bool,
        dt_s: f64,
    ) -> Result<()> {
        let own = self.slopes(fields, images, linear)?;
        // Slopes of two frames: their noise has nothing to do with each other, and unlike those of the
        // estimate they are where they belong while the biases are not found yet.
        let now = self.slopes(measured, images, linear)?;
        let then = self.slopes(&self.windowed(before), before, linear)?;
        let (mut integral, mut gram) = (Vector6::zeros(), Matrix6::zeros());
        let mut sums = Sums::zeros();
        for i in 0..2 {
            let pair = [&now[i], &then[i]];
            let parts = self.integrals(&fields[i], &measured[i], &own[i], pair);
            integral += parts.integral * self.lambda[i];
            gram += parts.gram * self.lambda[i];
            sums.add(&parts.sums, self.lambda[i]);
        }
        self.sums.follow(&sums, dt_s);
        let carried = dt_s / (1.0 + self.k_field * dt_s);
        let step = self.bias_step(&integral, &gram, carried, dt_s);
        self.bias += step;
        self.field_energy = 0.0;
        for i in 0..2 {
            self.carry(&mut fields[i], &own[i], &(step * carried));
            let energy = self.energy(&fields[i], &measured[i]);
            self.field_energy += 0.5 * self.lambda[i] * energy;
        }
        Ok(())
    }

    /// Slopes of both fields, whose sources are `images`.
    fn slopes<'a>(
        &self,
        fields: &[Plane<f32>; 2],
        images: &'a Images,
        linear: bool,
    ) -> Result<[Slopes<'a>; 2]> {
        let of = |i: usize| -> Result<Slopes<'a>> {
            let values: Vec<f64> = fields[i].data().iter().map(|v| f64::from(*v)).collect();
            Ok(Slopes {
                gradient: self.grid.gradient(&values)?,
                source: [&images.grey, &images.range][i].data(),
                range: images.range.data(),
                is_range: i == 1,
                linear,
            })
        };
        Ok([of(0)?, of(1)?])
    }

    /// `-dt (K^-1 + dt^2 Gram / (1 + k dt))^-1 int`.
    fn bias_step(
        &self,
        integral: &Vector6<f64>,
        gram: &Matrix6<f64>,
        carried: f64,
        dt_s: f64,
    ) -> Vector6<f64> {
        match self.gains {
            Gains::Fixed(k_omega, k_v) => {
                let k = Vector6::new(k_omega, k_omega, k_omega, k_v, k_v, k_v);
                let whole = Matrix6::from_diagonal(&k.map(|k| 1.0 / k)) + gram * (dt_s * carried);
                let solved = whole.cholesky().map(|factor| factor.solve(integral));
                solved.unwrap_or_else(|| integral.component_mul(&k)) * -dt_s
            }
            Gains::Normalised(rate) => {
                let gain = rate * self.k_field;
                let spectrum = self.sums.gathered(self.mean_range);
                spectrum.map_or_else(Vector6::zeros, |s| s.solved(gram, integral))
                    * (-dt_s * gain / (1.0 + gain * dt_s * carried))
            }
        }
    }

    /// What a pixel says of the biases, [angular, linear].
    #[inline]
    fn sensitivity(&self, i: usize, slopes: &Slopes<'_>) -> Vector6<f64> {
        let eta = self.grid.rays()[i];
        let slope = slopes.gradient[i] - self.window.gradient()[i] * f64::from(slopes.source[i]);
        let omega = slope.cross(&eta);
        let mut v = Vector3::zeros();
        if slopes.linear {
            v = eta.cross(&omega) * (-1.0 / f64::from(slopes.range[i]));
            if slopes.is_range {
                v += eta * self.window.values()[i];
            }
        }
        Vector6::new(omega.x, omega.y, omega.z, v.x, v.y, v.z)
    }

    /// The integrals of a field, in fixed chunks: row after row.
    fn integrals(
        &self,
        field: &Plane<f32>,
        measured: &Plane<f32>,
        slopes: &Slopes<'_>,
        pair: [&Slopes<'_>; 2],
    ) -> Integrals {
        let width = self.grid.width();
        let row = |y: usize| {
            let mut out = Integrals::zeros();
            for i in y * width..(y + 1) * width {
                let area = self.grid.solid_angle()[i];
                let error = f64::from(field.data()[i]) - f64::from(measured.data()[i]);
                let s = self.sensitivity(i, slopes);
                if (area * (error + s.sum())).is_finite() {
                    out.integral += s * (area * error);
                    out.gram += s * s.transpose() * area;
                    let [a, b] = pair.map(|slopes| self.sensitivity(i, slopes));
                    if (a + b).sum().is_finite() {
                        out.sums.push(&a, &b, area);
                    }
                }
            }
            out
        };
        let rows: Vec<_> = (0..self.grid.height()).into_par_iter().map(row).collect();
        rows.into_iter().fold(Integrals::zeros(), |mut all, row| {
            all.integral += row.integral;
            all.gram += row.gram;
            all.sums.add(&row.sums, 1.0);
            all
        })
    }

    /// The field changes by what its sensitivities make of a step of the biases.
    fn carry(&self, field: &mut Plane<f32>, slopes: &Slopes<'_>, step: &Vector6<f64>) {
        let width = self.grid.width();
        let rows = field.data_mut().par_chunks_mut(width).enumerate();
        rows.for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                let change = self.sensitivity(y * width + x, slopes).dot(step);
                if change.is_finite() {
                    *value += change as f32;
                }
            }
        });
    }

    /// `int e^2`.
    fn energy(&self, field: &Plane<f32>, measured: &Plane<f32>) -> f64 {
        let pixels = field.data().iter().zip(measured.data());
        pixels
            .zip(self.grid.solid_angle())
            .map(|((a, b), area)| (f64::from(*a) - f64::from(*b)).powi(2) * area)
            .filter(|part| part.is_finite())
            .sum()
    }
}

/// Integrals of a field over the images.
struct Integrals {
    /// `int e s`.
    integral: Vector6<f64>,
    /// `int s s'`.
    gram: Matrix6<f64>,
    sums: Sums,
}

impl Integrals {
    fn zeros() -> Self {
        Self {
            integral: Vector6::zeros(),
            gram: Matrix6::zeros(),
            sums: Sums::zeros(),
        }
    }
}

/// What the sensitivities of a field are made of.
struct Slopes<'a> {
    gradient: Vec<Vector3<f64>>,
    source: &'a [f32],
    range: &'a [f32],
    is_range: bool,
    linear: bool,
}
