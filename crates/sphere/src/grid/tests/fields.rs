//! Fields on the sphere whose derivatives are known in closed form.

use nalgebra::Vector3;

/// A scalar field with its gradient and Laplacian, and a vector field with its divergence.
pub(super) trait Exact {
    fn value(&self, eta: &Vector3<f64>) -> f64;
    fn gradient(&self, eta: &Vector3<f64>) -> Vector3<f64>;
    fn laplacian(&self, eta: &Vector3<f64>) -> f64;
    fn vector(&self, eta: &Vector3<f64>) -> Vector3<f64>;
    fn divergence(&self, eta: &Vector3<f64>) -> f64;
}

/// `eta.P`, and `eta x (eta x P)`.
///
/// Thesis: eq. (A.1), the gradient -eta x (eta x P). Thesis: eq. (A.4), the Laplacian -2 eta.P.
/// Thesis: section 6.1 prints div(eta x (eta x P)) = -2 eta.P; the sign is +, since
/// eta x (eta x P) is minus the gradient of eta.P.
pub(super) struct Linear(pub Vector3<f64>);

impl Exact for Linear {
    fn value(&self, eta: &Vector3<f64>) -> f64 {
        eta.dot(&self.0)
    }
    fn gradient(&self, eta: &Vector3<f64>) -> Vector3<f64> {
        -eta.cross(&eta.cross(&self.0))
    }
    fn laplacian(&self, eta: &Vector3<f64>) -> f64 {
        -2.0 * eta.dot(&self.0)
    }
    fn vector(&self, eta: &Vector3<f64>) -> Vector3<f64> {
        eta.cross(&eta.cross(&self.0))
    }
    fn divergence(&self, eta: &Vector3<f64>) -> f64 {
        2.0 * eta.dot(&self.0)
    }
}

/// `exp(eta.P)`, with every harmonic in it, and `exp(eta.P) (eta x Q)`.
pub(super) struct Exponential(pub Vector3<f64>, pub Vector3<f64>);

impl Exact for Exponential {
    fn value(&self, eta: &Vector3<f64>) -> f64 {
        eta.dot(&self.0).exp()
    }
    fn gradient(&self, eta: &Vector3<f64>) -> Vector3<f64> {
        (self.0 - eta * eta.dot(&self.0)) * self.value(eta)
    }
    fn laplacian(&self, eta: &Vector3<f64>) -> f64 {
        let radial = eta.dot(&self.0);
        self.value(eta) * (self.0.norm_squared() - radial * radial - 2.0 * radial)
    }
    fn vector(&self, eta: &Vector3<f64>) -> Vector3<f64> {
        eta.cross(&self.1) * self.value(eta)
    }
    fn divergence(&self, eta: &Vector3<f64>) -> f64 {
        // div(eta x Q) = 0, so only the gradient of the factor counts.
        self.gradient(eta).dot(&eta.cross(&self.1))
    }
}

/// The zonal harmonic of degree 3 about a tilted unit axis, `(5 t^3 - 3 t) / 2` with `t = eta.P`
/// (seen from a pole of the grid it has every order from 0 to 3), and it times the tangential part
/// of Q.
pub(super) struct Harmonic(pub Vector3<f64>, pub Vector3<f64>);

impl Exact for Harmonic {
    fn value(&self, eta: &Vector3<f64>) -> f64 {
        let t = eta.dot(&self.0);
        0.5 * t * (5.0 * t * t - 3.0)
    }
    fn gradient(&self, eta: &Vector3<f64>) -> Vector3<f64> {
        let t = eta.dot(&self.0);
        (self.0 - eta * t) * (7.5 * t * t - 1.5)
    }
    fn laplacian(&self, eta: &Vector3<f64>) -> f64 {
        // -l (l + 1) with l = 3.
        -12.0 * self.value(eta)
    }
    fn vector(&self, eta: &Vector3<f64>) -> Vector3<f64> {
        (self.1 - eta * eta.dot(&self.1)) * self.value(eta)
    }
    fn divergence(&self, eta: &Vector3<f64>) -> f64 {
        self.gradient(eta).dot(&self.1) - 2.0 * eta.dot(&self.1) * self.value(eta)
    }
}

pub(super) fn all() -> Vec<(&'static str, Box<dyn Exact>)> {
    let p = Vector3::new(0.7, -0.9, 0.5);
    let q = Vector3::new(-0.4, 0.6, 1.1);
    vec![
        ("linear", Box::new(Linear(p))),
        ("exponential", Box::new(Exponential(p, q))),
        ("harmonic", Box::new(Harmonic(p.normalize(), q))),
    ]
}
