//! Intrinsics shared by views: a camera, and which of its parameters are estimated.

use super::device::{Device, ENTRIES, NAMES};
use crate::{Error, Result};
use nalgebra::{Vector2, Vector3};
use sphereflow_sphere::Camera;

/// More free parameters than any model has, and those of the device.
pub(crate) const MAX_FREE: usize = 12 + ENTRIES;
/// Step of the central differences by parameters without a closed form: pixels of 1e3 with 1e-13 of
/// rounding give 1e-8 px per unit, truncation is of the order of the square of the step.
const STEP: f64 = 1e-5;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// fx and fy together, their quotient kept.
    Focal,
    Fx,
    Fy,
    Cx,
    Cy,
    Skew,
    /// OpenCV's radial coefficients: power of s, and whether in the denominator.
    Radial {
        power: i32,
        below: bool,
    },
    P1,
    P2,
    /// By differences of the model.
    Other,
    /// An entry of the device, not of the lens.
    Device,
}

#[derive(Clone, Debug)]
struct Free {
    /// Of the lens's parameters, or of the device's entries.
    index: usize,
    kind: Kind,
    /// The camera with the parameter moved up and down (kind `Other` only).
    moved: Option<(Camera, Camera)>,
}

/// What is known of a parameter: a value, and 1 / sigma^2.
#[derive(Clone, Debug)]
struct Known {
    name: &'static str,
    value: f64,
    weight: f64,
}

/// A camera, what its images need besides the lens, and which of both is estimated.
#[derive(Clone, Debug)]
pub(crate) struct Intrinsics {
    pub camera: Camera,
    pub device: Device,
    known: Vec<Known>,
    names: Vec<&'static str>,
    values: Vec<f64>,
    free: Vec<Free>,
}

impl Intrinsics {
    pub fn fixed(camera: Camera) -> Self {
        let (names, values) = camera.named_parameters().into_iter().unzip();
        Self {
            camera,
            device: Device::default(),
            known: Vec::new(),
            names,
            values,
            free: Vec::new(),
        }
    }

    /// Estimate the parameters `names`, and no others.
    pub fn release(&mut self, names: &[&str]) -> Result<()> {
        let mut free: Vec<Free> = Vec::new();
        for &name in names {
            let column = if name == "focal" { "fx" } else { name };
            let (index, own) = self.find("free intrinsics", name)?;
            let same = |other: &Free| other.index == index && (other.kind == Kind::Device) != own;
            let clash = free
                .iter()
                .any(|other| same(other) || (other.kind == Kind::Focal && column == "fy"))
                || (name == "focal" && free.iter().any(|other| other.kind == Kind::Fy));
            if clash {
                return Err(Error::value("free intrinsics", "each parameter once", name));
            }
            let kind = if own {
                kind(self.camera.model_name(), name)
            } else {
                Kind::Device
            };
            free.push(Free {
                index,
                kind,
                moved: None,
            });
        }
        self.free = free;
        self.move_cameras()
    }

    /// Index of a parameter, and whether it is the lens's.
    fn find(&self, argument: &str, name: &str) -> Result<(usize, bool)> {
        let column = if name == "focal" { "fx" } else { name };
        let place = |names: &[&str]| names.iter().position(|known| *known == column);
        let found = place(&self.names).map(|index| (index, true));
        let found = found.or_else(|| place(&NAMES).map(|index| (index, false)));
        let all = || [&self.names[..], &NAMES].concat().join(", ");
        found.ok_or_else(|| Error::value(argument, format!("`focal` or one of {}", all()), name))
    }

    /// What is known of a parameter, with its standard deviation: it counts while it is estimated.
    pub fn know(&mut self, name: &str, value: f64, sigma: f64) -> Result<()> {
        let (index, own) = self.find("name", name)?;
        let name = if own { self.names[index] } else { NAMES[index] };
        self.known.push(Known {
            name,
            value,
            weight: sigma.powi(-2),
        });
        Ok(())
    }

    #[cfg(test)]
    pub fn forget(&mut self) {
        self.known.clear();
    }

    /// Of what is known of the free parameters: place among them, weight, what it has over that.
    pub fn gaps(&self) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        self.known.iter().filter_map(|known| {
            let named = |free: &Free| self.name(free) == known.name;
            let place = self.free.iter().position(named)?;
            let gap = self.value(&self.free[place]) - known.value;
            Some((place, known.weight, gap))
        })
    }

    /// Half the squared residuals of what is known.
    pub fn known_cost(&self) -> f64 {
        let squares = self.gaps().map(|(_, weight, gap)| weight * gap * gap);
        0.5 * squares.sum::<f64>()
    }

    fn name(&self, free: &Free) -> &'static str {
        match free.kind {
            Kind::Device => NAMES[free.index],
            _ => self.names[free.index],
        }
    }

    fn value(&self, free: &Free) -> f64 {
        match free.kind {
            Kind::Device => self.device.values[free.index],
            _ => self.values[free.index],
        }
    }

    /// The entry of the device that a free parameter is; `None` where it is the lens's.
    #[inline(always)]
    pub fn device_entry(&self, parameter: usize) -> Option<usize> {
        let free = &self.free[parameter];
        (free.kind == Kind::Device).then_some(free.index)
    }

    /// Number of parameters that are estimated.
    #[inline(always)]
    pub fn free(&self) -> usize {
        self.free.len()
    }

    /// Derivative of the pixel by a free parameter, at the point `x` of the camera frame, which
    /// projects to `pixel`.
    pub fn derivative(
        &self,
        parameter: usize,
        x: &Vector3<f64>,
        pixel: &Vector2<f64>,
    ) -> Vector2<f64> {
        let free = &self.free[parameter];
        let v = &self.values;
        let plane = || {
            let skew = if self.names[4..].first() == Some(&"skew") {
                v[4]
            } else {
                0.0
            };
            let b = (pixel.y - v[3]) / v[1];
            Vector2::new((pixel.x - v[2] - skew * b) / v[0], b)
        };
        let m = Vector2::new(x.x / x.z, x.y / x.z);
        let s = m.norm_squared();
        match free.kind {
            Kind::Focal => plane().component_mul(&Vector2::new(1.0, v[1] / v[0])),
            Kind::Fx => Vector2::new(plane().x, 0.0),
            Kind::Fy => Vector2::new(0.0, plane().y),
            Kind::Cx => Vector2::x(),
            Kind::Cy => Vector2::y(),
            Kind::Skew => Vector2::new(plane().y, 0.0),
            Kind::Radial { power, below } => {
                // names 4..12: k1 k2 p1 p2 k3 k4 k5 k6
                let above = 1.0 + s * (v[4] + s * (v[5] + s * v[8]));
                let under = 1.0 + s * (v[9] + s * (v[10] + s * v[11]));
                let factor = if below {
                    -above / (under * under)
                } else {
                    1.0 / under
                };
                self.pixels(&(m * (factor * s.powi(power))))
            }
            Kind::P1 => self.pixels(&(Vector2::new(0.0, s) + m * (2.0 * m.y))),
            Kind::P2 => self.pixels(&(Vector2::new(s, 0.0) + m * (2.0 * m.x))),
            Kind::Other => free
                .moved
                .as_ref()
                .and_then(|(up, down)| Some(up.project(x)? - down.project(x)?))
                .map_or(Vector2::zeros(), |d| d / (2.0 * STEP)),
            Kind::Device => Vector2::zeros(),
        }
    }

    fn pixels(&self, m: &Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.values[0] * m.x, self.values[1] * m.y)
    }

    /// Values of the free parameters.
    pub fn parameters(&self) -> impl Iterator<Item = f64> + '_ {
        self.free.iter().map(|free| self.value(free))
    }

    /// The intrinsics `step` further, into `next`; an error where no camera has such parameters.
    pub fn moved_by(&self, step: &[f64], next: &mut Self) -> Result<()> {
        next.values.copy_from_slice(&self.values);
        next.device = self.device;
        for (free, step) in self.free.iter().zip(step) {
            if free.kind == Kind::Device {
                next.device.values[free.index] += step;
                continue;
            }
            next.values[free.index] += step;
            if free.kind == Kind::Focal {
                next.values[1] = self.values[1] / self.values[0] * next.values[0];
            }
        }
        next.camera = next.camera.with_parameters(&next.values)?;
        next.move_cameras()
    }

    /// The same values as another with the same parameters free.
    pub fn copy_from(&mut self, other: &Self) {
        self.camera.clone_from(&other.camera);
        self.values.copy_from_slice(&other.values);
        self.device = other.device;
        for (free, other) in self.free.iter_mut().zip(&other.free) {
            free.moved.clone_from(&other.moved);
        }
    }

    /// Start from another camera of the same model.
    pub fn restart(&mut self, camera: &Camera) -> Result<()> {
        let (expected, found) = (self.camera.model_name(), camera.model_name());
        if expected != found {
            let expected = format!("a camera of the model {expected}");
            return Err(Error::value("camera", expected, found));
        }
        self.camera.clone_from(camera);
        let values = camera.named_parameters();
        for (value, (_, new)) in self.values.iter_mut().zip(values) {
            *value = new;
        }
        self.move_cameras()
    }

    fn move_cameras(&mut self) -> Result<()> {
        for i in 0..self.free.len() {
            if self.free[i].kind != Kind::Other {
                continue;
            }
            let index = self.free[i].index;
            let value = self.values[index];
            self.values[index] = value + STEP;
            let up = self.camera.with_parameters(&self.values);
            self.values[index] = value - STEP;
            let down = self.camera.with_parameters(&self.values);
            self.values[index] = value;
            self.free[i].moved = Some((up?, down?));
        }
        Ok(())
    }
}

fn kind(model: &str, name: &str) -> Kind {
    let radial = |power, below| Kind::Radial { power, below };
    match (model, name) {
        (_, "focal") => Kind::Focal,
        (_, "fx") => Kind::Fx,
        (_, "fy") => Kind::Fy,
        (_, "cx") => Kind::Cx,
        (_, "cy") => Kind::Cy,
        ("pinhole", "skew") => Kind::Skew,
        ("opencv", "k1") => radial(1, false),
        ("opencv", "k2") => radial(2, false),
        ("opencv", "k3") => radial(3, false),
        ("opencv", "k4") => radial(1, true),
        ("opencv", "k5") => radial(2, true),
        ("opencv", "k6") => radial(3, true),
        ("opencv", "p1") => Kind::P1,
        ("opencv", "p2") => Kind::P2,
        _ => Kind::Other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // the differences below are good to 1e-7 px relative to the derivative
    const RELATIVE: f64 = 1e-6;

    #[test]
    fn derivative_by_every_parameter_equals_differences() {
        let focal = [("fx", 400.0), ("fy", 410.0), ("cx", 320.0), ("cy", 240.0)];
        let models: [(&str, &[(&str, f64)]); 6] = [
            ("pinhole", &[("skew", 2.0)]),
            (
                "opencv",
                &[
                    ("k1", -0.1),
                    ("k2", 0.03),
                    ("p1", 0.001),
                    ("p2", -0.002),
                    ("k3", 0.01),
                    ("k4", 0.02),
                    ("k5", 0.01),
                    ("k6", 0.003),
                ],
            ),
            ("fov", &[("w", 0.9)]),
            (
                "kannala_brandt",
                &[("k1", 0.02), ("k2", 0.01), ("k3", 0.0), ("k4", 0.0)],
            ),
            ("unified", &[("alpha", 0.6)]),
            ("double_sphere", &[("xi", 0.1), ("alpha", 0.55)]),
        ];
        for (model, own) in models {
            let params: Vec<(&str, f64)> = focal.iter().chain(own).copied().collect();
            let camera = Camera::from_named(model, &params, 640, 480).unwrap();
            let fixed = Intrinsics::fixed(camera);
            for name in fixed.names.clone().into_iter().chain(["focal"]) {
                let mut here = fixed.clone();
                here.release(&[name]).unwrap();
                let x = Vector3::new(0.4, -0.3, 1.1);
                let pixel = here.camera.project(&x).unwrap();
                let analytic = here.derivative(0, &x, &pixel);
                let (mut up, mut down) = (here.clone(), here.clone());
                let h = 1e-4 * (1.0 + here.parameters().next().unwrap().abs() * 0.1);
                here.moved_by(&[h], &mut up).unwrap();
                here.moved_by(&[-h], &mut down).unwrap();
                let numeric =
                    (up.camera.project(&x).unwrap() - down.camera.project(&x).unwrap()) / (2.0 * h);
                let error = (numeric - analytic).norm();
                assert!(
                    error < RELATIVE * (1.0 + analytic.norm()),
                    "{model} {name} {error:e}"
                );
            }
        }
    }

    #[test]
    fn parameter_that_is_unknown_or_twice_is_an_error() {
        let camera = Camera::pinhole(500.0, 500.0, 320.0, 240.0, 640, 480).unwrap();
        let mut intrinsics = Intrinsics::fixed(camera);
        for names in [
            &["k1"][..],
            &["fx", "fx"],
            &["focal", "fy"],
            &["fy", "focal"],
        ] {
            assert!(intrinsics.release(names).is_err(), "{names:?}");
        }
    }
}
