//! Denoising that keeps edges: total variation with a quadratic data term (Rudin, Osher, Fatemi).

use crate::{Error, Result};
use sphereflow_core::Plane;
use sphereflow_core::checks::positive;

/// Settings of [`rof_denoise`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RofConfig {
    /// Weight of the data, per grey level: large keeps the image, small smooths it.
    pub beta2: f32,
    /// Time step of the dual iteration, at most 1/4.
    pub tau: f32,
    /// Iterations.
    pub iterations: usize,
}

impl Default for RofConfig {
    fn default() -> Self {
        Self {
            beta2: 0.05,
            tau: 0.25,
            iterations: 100,
        }
    }
}

/// The image y that minimises the sum of |grad y| + beta^2 (y - image)^2, in grey levels and pixels.
///
/// Thesis: eq. (2.8), with Chambolle's dual iteration of section 2.1.4.
///
/// # Errors
/// A value error where a setting is out of its domain.
pub fn rof_denoise(image: &Plane<f32>, config: &RofConfig) -> Result<Plane<f32>> {
    positive("beta2", f64::from(config.beta2))?;
    positive("tau", f64::from(config.tau))?;
    if config.tau > 0.25 {
        return Err(Error::value("tau", "at most 1/4", config.tau));
    }
    let (width, height) = image.size();
    let mut p = [
        Plane::filled(width, height, 0.0_f32),
        Plane::filled(width, height, 0.0_f32),
    ];
    let mut y = image.clone();
    let step = 2.0 * config.beta2 * config.tau;
    for _ in 0..config.iterations {
        for j in 0..height {
            for i in 0..width {
                let here = y[(i, j)];
                let px = p[0][(i, j)] + step * (y[((i + 1).min(width - 1), j)] - here);
                let py = p[1][(i, j)] + step * (y[(i, (j + 1).min(height - 1))] - here);
                let scale = 1.0 / px.hypot(py).max(1.0);
                (p[0][(i, j)], p[1][(i, j)]) = (px * scale, py * scale);
            }
        }
        primal(image, &p, config.beta2, &mut y);
    }
    Ok(y)
}

/// The functional that [`rof_denoise`] minimises.
pub fn rof_energy(candidate: &Plane<f32>, image: &Plane<f32>, beta2: f32) -> f64 {
    let (width, height) = image.size();
    let mut sum = 0.0;
    for j in 0..height {
        for i in 0..width {
            let here = candidate[(i, j)];
            let dx = candidate[((i + 1).min(width - 1), j)] - here;
            let dy = candidate[(i, (j + 1).min(height - 1))] - here;
            let misfit = here - image[(i, j)];
            sum += f64::from(dx.hypot(dy) + beta2 * misfit * misfit);
        }
    }
    sum
}

/// Thesis: eq. (2.8). y = y_d + div p / (2 beta^2).
fn primal(image: &Plane<f32>, p: &[Plane<f32>; 2], beta2: f32, y: &mut Plane<f32>) {
    let (width, height) = image.size();
    let scale = 0.5 / beta2;
    for j in 0..height {
        for i in 0..width {
            // The negative adjoint of forward differences that vanish beyond the border.
            let ahead = |value: f32, inside: bool| if inside { value } else { 0.0 };
            let mut div = ahead(p[0][(i, j)], i + 1 < width) + ahead(p[1][(i, j)], j + 1 < height);
            if i > 0 {
                div -= p[0][(i - 1, j)];
            }
            if j > 0 {
                div -= p[1][(i, j - 1)];
            }
            y[(i, j)] = image[(i, j)] + scale * div;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step with noise that repeats the same way everywhere.
    fn noisy_step() -> Plane<f32> {
        Plane::from_fn(40, 30, |x, y| {
            let noise = ((x * 7 + y * 13) % 11) as f32 - 5.0;
            if x < 20 { 50.0 + noise } else { 150.0 + noise }
        })
    }

    #[test]
    fn denoising_of_a_two_pixel_step_is_the_closed_form() {
        // Thesis: eq. (2.8). |b - a| + beta^2 ((a - 0)^2 + (b - 10)^2): each end moves by 1/(2 beta^2).
        let image = Plane::from_vec(2, 1, vec![0.0, 10.0]).unwrap();
        let config = RofConfig {
            beta2: 0.25,
            ..RofConfig::default()
        };
        let y = rof_denoise(&image, &config).unwrap();
        assert!((y[(0, 0)] - 2.0).abs() < 1e-4 && (y[(1, 0)] - 8.0).abs() < 1e-4);
    }

    #[test]
    fn denoising_keeps_the_edge_the_mean_and_lowers_the_energy() {
        // Thesis: eq. (2.8).
        let image = noisy_step();
        let y = rof_denoise(&image, &RofConfig::default()).unwrap();
        let mean = |plane: &Plane<f32>| plane.data().iter().sum::<f32>() / 1200.0;
        assert!((mean(&y) - mean(&image)).abs() < 1e-2);
        assert!(
            y[(22, 15)] - y[(17, 15)] > 80.0,
            "the edge was smoothed away"
        );
        let spread = |plane: &Plane<f32>| {
            let inner = (3..15).map(|x| (plane[(x, 15)] - 50.0).abs());
            inner.sum::<f32>() / 12.0
        };
        assert!(spread(&y) < 0.3 * spread(&image));
        assert!(rof_energy(&y, &image, 0.05) < 0.7 * rof_energy(&image, &image, 0.05));
    }

    #[test]
    fn denoising_with_too_long_a_step_is_refused() {
        let config = RofConfig {
            tau: 0.3,
            ..RofConfig::default()
        };
        let error = rof_denoise(&noisy_step(), &config).unwrap_err().to_string();
        assert!(error.contains("tau") && error.contains("1/4"), "{error}");
    }
}
