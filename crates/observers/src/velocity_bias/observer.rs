//! The thesis's observer of velocity biases on images, discretised so that it is stable.
//!
//! Thesis: eq. (5.16) on the whole sphere, Thesis: eq. (5.33) on the window of an image, with the source
//! `phi eta` in the linear bias (the print has `eta`), Thesis: eq. (5.34) without linear velocity.
//! Explicit Euler steps with Sobel gradients, as the thesis takes them, blow up (Courant numbers of 4
//! to 16). Here the fields are transported back along the flow to the mid-point's foot, the window's
//! change along the way is exact, and the corrections are implicit.

use super::images::Images;
use super::window::Window;
use crate::Result;
use nalgebra::{Matrix6, Vector2, Vector3, Vector6};
use rayon::prelude::*;
use sphereflow_core::Plane;
use sphereflow_sphere::{Sampler, SphereGrid};

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
    gram: Matrix6<f64>,
}

/// Eigenvalues of the Gram matrix below this part of the largest are not divided by.
const RANK: f64 = 1e-5;

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
            gram: Matrix6::zeros(),
        }
    }

    /// The biases, [angular rad/s, linear m/s].
    pub fn bias(&self) -> Vector6<f64> {
        self.bias
    }

    /// Gram matrix of the sensitivities of the images to the biases, [angular, linear].
    pub fn gram(&self) -> &Matrix6<f64> {
        &self.gram
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
    pub fn step(&mut self, images: Images, velocity: &ImageVelocity, dt_s: f64) -> Result<()> {
        let measured = self.windowed(&images);
        let Some((fields, before)) = self.fields.take() else {
            self.fields = Some((measured, images));
            return Ok(());
        };
        let omega = velocity.angular_rad_s - self.bias.fixed_rows::<3>(0);
        let v = velocity
            .linear_m_s
            .map_or_else(Vector3::zeros, |v| v - self.bias.fixed_rows::<3>(3));
        let flow = Flow {
            grid: &self.grid,
            window: &self.window,
            range: mean(&before.range, &images.range),
            omega,
            v,
            dt_s,
        };
        let sources = [mean(&before.grey, &images.grey), flow.range.clone()];
        let share = self.k_field * dt_s;
        let corrected: Vec<Plane<f32>> = (0..2)
            .map(|i| flow.transport(&fields[i], &sources[i], i == 1, &measured[i], share))
            .collect();
        self.follow(
            &corrected,
            &measured,
            &images,
            velocity.linear_m_s.is_some(),
            dt_s,
        )?;
        if let Ok(fields) = <[Plane<f32>; 2]>::try_from(corrected) {
            self.fields = Some((fields, images));
        }
        Ok(())
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

    /// The integrals of (5.33) and the step of the biases.
    fn follow(
        &mut self,
        fields: &[Plane<f32>],
        measured: &[Plane<f32>; 2],
        images: &Images,
        linear: bool,
        dt_s: f64,
    ) -> Result<()> {
        let (mut integral, mut gram, mut energy) = (Vector6::zeros(), Matrix6::zeros(), 0.0);
        for i in 0..2 {
            let source = [&images.grey, &images.range][i];
            let values: Vec<f64> = fields[i].data().iter().map(|v| f64::from(*v)).collect();
            let gradient = self.grid.gradient(&values)?;
            let parts = self.integrals(
                &values,
                measured[i].data(),
                source.data(),
                images.range.data(),
                &gradient,
                i == 1,
                linear,
            );
            integral += parts.0 * self.lambda[i];
            gram += parts.1 * self.lambda[i];
            energy += 0.5 * parts.2 * self.lambda[i];
        }
        (self.gram, self.field_energy) = (gram, energy);
        let step = match self.gains {
            Gains::Fixed(k_omega, k_v) => {
                let k = Vector6::new(k_omega, k_omega, k_omega, k_v, k_v, k_v);
                integral.component_mul(&k)
            }
            Gains::Normalised(rate) => divided(&gram, &integral) * (rate * self.k_field),
        };
        self.bias -= step * dt_s;
        Ok(())
    }

    /// `int e s`, `int s s'`, `int e^2` of a field, in fixed chunks: row after row.
    #[allow(clippy::too_many_arguments)]
    fn integrals(
        &self,
        values: &[f64],
        measured: &[f32],
        source: &[f32],
        range: &[f32],
        gradient: &[Vector3<f64>],
        is_range: bool,
        linear: bool,
    ) -> (Vector6<f64>, Matrix6<f64>, f64) {
        let width = self.grid.width();
        let row = |y: usize| {
            let (mut integral, mut gram, mut energy) = (Vector6::zeros(), Matrix6::zeros(), 0.0);
            for i in y * width..(y + 1) * width {
                let (eta, area) = (self.grid.rays()[i], self.grid.solid_angle()[i]);
                let error = values[i] - f64::from(measured[i]);
                let slope = gradient[i] - self.window.gradient()[i] * f64::from(source[i]);
                let omega = slope.cross(&eta);
                let mut v = eta.cross(&omega) * (-1.0 / f64::from(range[i]));
                if is_range {
                    v += eta * self.window.values()[i];
                }
                if !linear {
                    v = Vector3::zeros();
                }
                let s = Vector6::new(omega.x, omega.y, omega.z, v.x, v.y, v.z);
                let weight = area * (error + s.sum());
                if weight.is_finite() {
                    integral += s * (area * error);
                    gram += s * s.transpose() * area;
                    energy += area * error * error;
                }
            }
            (integral, gram, energy)
        };
        let rows: Vec<_> = (0..self.grid.height()).into_par_iter().map(row).collect();
        rows.into_iter()
            .fold((Vector6::zeros(), Matrix6::zeros(), 0.0), |a, b| {
                (a.0 + b.0, a.1 + b.1, a.2 + b.2)
            })
    }
}

/// The flow of a step.
struct Flow<'a> {
    grid: &'a SphereGrid,
    window: &'a Window,
    range: Plane<f32>,
    omega: Vector3<f64>,
    v: Vector3<f64>,
    dt_s: f64,
}

impl Flow<'_> {
    /// `W = eta x (omega + eta x v / D)`.
    fn velocity(&self, eta: &Vector3<f64>, range: f64) -> Vector3<f64> {
        eta.cross(&(self.omega + eta.cross(&self.v) / range))
    }

    /// A field carried along, its sources added, and corrected by what is measured. Where the
    /// estimate is unknown the measurement takes its place, and the other way round.
    fn transport(
        &self,
        field: &Plane<f32>,
        source: &Plane<f32>,
        is_range: bool,
        measured: &Plane<f32>,
        share: f64,
    ) -> Plane<f32> {
        let (width, height) = field.size();
        let mut out = Plane::filled(width, height, f32::NAN);
        let (sampler, ranges) = if self.grid.wraps_around() {
            (Sampler::wrapping(field), Sampler::wrapping(&self.range))
        } else {
            (Sampler::new(field), Sampler::new(&self.range))
        };
        out.data_mut()
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, row)| {
                for (x, out) in row.iter_mut().enumerate() {
                    let i = y * width + x;
                    let seen = f64::from(measured.data()[i]);
                    let carried = self.carried(
                        x,
                        y,
                        &sampler,
                        &ranges,
                        f64::from(source.data()[i]),
                        is_range,
                    );
                    *out = match (carried.is_finite(), seen.is_finite()) {
                        (true, true) => (carried + share * seen) / (1.0 + share),
                        (true, false) => carried,
                        _ => seen,
                    } as f32;
                }
            });
        out
    }

    /// The value that arrives at a pixel, with the window's change and the range's source on the way.
    fn carried(
        &self,
        x: usize,
        y: usize,
        field: &Sampler<'_>,
        ranges: &Sampler<'_>,
        source: f64,
        is_range: bool,
    ) -> f64 {
        let eta = self.grid.ray(x, y);
        let range = f64::from(self.range[(x, y)]);
        if !(range.is_finite() && eta.x.is_finite()) {
            return f64::NAN;
        }
        let middle = (eta - self.velocity(&eta, range) * (0.5 * self.dt_s)).normalize();
        let there = self.pixel(&middle).map_or(range, |p| {
            let sampled = f64::from(ranges.bilinear(&p));
            if sampled.is_finite() { sampled } else { range }
        });
        let foot = (eta - self.velocity(&middle, there) * self.dt_s).normalize();
        let Some(pixel) = self.pixel(&foot) else {
            return f64::NAN;
        };
        let phi = self.window.values()[y * self.grid.width() + x];
        let phi_foot = self.window.at(&pixel);
        let mut value = f64::from(field.bicubic(&pixel)) + source * (phi - phi_foot);
        if is_range {
            value -= 0.5 * (phi + phi_foot) * self.v.dot(&middle) * self.dt_s;
        }
        value
    }

    /// Where the ray is in the image; beyond its border the nearest pixel: the field goes on without
    /// slope where the flow comes in.
    fn pixel(&self, ray: &Vector3<f64>) -> Option<Vector2<f64>> {
        let camera = self.grid.camera();
        let pixel = camera.project(ray)?;
        if self.grid.wraps_around() {
            return Some(pixel);
        }
        let (w, h) = (camera.width() as f64 - 1.0, camera.height() as f64 - 1.0);
        Some(Vector2::new(pixel.x.clamp(0.0, w), pixel.y.clamp(0.0, h)))
    }
}

/// Mean of two images; where one is unknown, the other.
fn mean(a: &Plane<f32>, b: &Plane<f32>) -> Plane<f32> {
    Plane::from_fn(a.width(), a.height(), |x, y| {
        let (a, b) = (a[(x, y)], b[(x, y)]);
        if a.is_nan() {
            b
        } else if b.is_nan() {
            a
        } else {
            0.5 * (a + b)
        }
    })
}

/// `Gram^-1 integral` over the directions that the images show.
fn divided(gram: &Matrix6<f64>, integral: &Vector6<f64>) -> Vector6<f64> {
    let eigen = gram.symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let mut out = Vector6::zeros();
    for i in 0..6 {
        if eigen.eigenvalues[i] > RANK * largest && largest > 0.0 {
            let direction = eigen.eigenvectors.column(i);
            out += direction * (direction.dot(integral) / eigen.eigenvalues[i]);
        }
    }
    out
}
