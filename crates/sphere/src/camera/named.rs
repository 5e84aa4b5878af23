//! Cameras from named parameters, as in calibration files and keyword arguments.

use super::{
    Camera, DoubleSphere, Equirectangular, Focal, Fov, InversePolynomial, KannalaBrandt, Lens,
    Model, Opencv, Pinhole, Projection, Unified, double_sphere, fov, inverse_polynomial,
    kannala_brandt, opencv,
};
use sphereflow_core::{Error, Result};

const FOCAL: [&str; 4] = ["fx", "fy", "cx", "cy"];

/// Names of the models.
pub const MODEL_NAMES: [&str; 8] = [
    "pinhole",
    "opencv",
    "inverse_polynomial",
    "fov",
    "kannala_brandt",
    "unified",
    "double_sphere",
    "equirectangular",
];

/// What may be left out, and is then zero: skew, the higher orders and the distortion centre.
fn is_optional(model: &str, name: &str) -> bool {
    match model {
        "pinhole" => name == "skew",
        "opencv" => matches!(name, "k3" | "k4" | "k5" | "k6"),
        "inverse_polynomial" => matches!(name, "k2" | "k3" | "k4" | "dx" | "dy"),
        "fov" => matches!(name, "dx" | "dy"),
        _ => false,
    }
}

/// The names of a model's own parameters, after fx, fy, cx, cy.
fn own_names(model: &str) -> Result<&'static [&'static str]> {
    Ok(match model {
        "pinhole" => &["skew"],
        "opencv" => &opencv::NAMES,
        "inverse_polynomial" => &inverse_polynomial::NAMES,
        "fov" => &fov::NAMES,
        "kannala_brandt" => &kannala_brandt::NAMES,
        "unified" => &["alpha"],
        "double_sphere" => &double_sphere::NAMES,
        "equirectangular" => &[],
        other => {
            let expected = format!("one of {}", MODEL_NAMES.join(", "));
            return Err(Error::value("camera model", expected, other));
        }
    })
}

/// The values of `names`, in that order, from `params`.
fn ordered<S: AsRef<str>>(model: &str, names: &[&str], params: &[(S, f64)]) -> Result<Vec<f64>> {
    for (i, (name, _)) in params.iter().enumerate() {
        let name = name.as_ref();
        let twice = params[..i].iter().any(|(other, _)| other.as_ref() == name);
        if twice || !names.contains(&name) {
            let expected = match names {
                [] => "no parameters".to_string(),
                _ => format!("each of {} at most once", names.join(", ")),
            };
            let problem = if twice { "a second" } else { "an unknown" };
            return Err(Error::value(
                format!("parameters of camera model {model}"),
                expected,
                format!("{problem} `{name}`"),
            ));
        }
    }
    let find = |name: &str| params.iter().find(|(other, _)| other.as_ref() == name);
    names
        .iter()
        .map(|name| match find(name) {
            Some((_, value)) => Ok(*value),
            None if is_optional(model, name) => Ok(0.0),
            None => Err(Error::value(
                format!("parameters of camera model {model}"),
                format!("`{name}`"),
                "no such parameter",
            )),
        })
        .collect()
}

/// `N` of the values, from `start` on.
fn part<const N: usize>(values: &[f64], start: usize) -> [f64; N] {
    std::array::from_fn(|i| values[start + i])
}

impl Camera {
    /// From the name of a model ([`MODEL_NAMES`]) and its parameters by name, in any order. `fx`,
    /// `fy`, `cx`, `cy` in pixels belong to every model but `equirectangular`, which has none.
    /// Optional, and zero where absent: `skew`; `k3`..`k6` of `opencv`; `k2`..`k4` of
    /// `inverse_polynomial`; `dx`, `dy`.
    ///
    /// # Errors
    /// [`Error::Value`] naming an unknown model, an unknown, repeated or missing parameter, or one
    /// outside its domain.
    pub fn from_named<S: AsRef<str>>(
        model: &str,
        params: &[(S, f64)],
        width: usize,
        height: usize,
    ) -> Result<Self> {
        let own = own_names(model)?;
        if model == "equirectangular" {
            ordered(model, own, params)?;
            return Self::from_values(model, &[], width, height);
        }
        let names: Vec<&str> = FOCAL.iter().chain(own).copied().collect();
        Self::from_values(model, &ordered(model, &names, params)?, width, height)
    }

    /// From the values of all parameters of a model that there is, in the order of their names.
    fn from_values(model: &str, values: &[f64], width: usize, height: usize) -> Result<Self> {
        if model == "equirectangular" {
            let sphere = Equirectangular::new(width, height)?;
            return Self::new(Model::Equirectangular(sphere), width, height);
        }
        let [fx, fy, cx, cy] = part(values, 0);
        let focal = Focal::new(fx, fy, cx, cy)?;
        let model = match model {
            "pinhole" => Model::Pinhole(Pinhole::new(fx, fy, cx, cy, values[4])?),
            "opencv" => Model::Opencv(Lens::new(focal, Opencv::new(part(values, 4))?)),
            "inverse_polynomial" => {
                let bend = InversePolynomial::new(part(values, 4), part(values, 8))?;
                Model::InversePolynomial(Lens::new(focal, bend))
            }
            "fov" => Model::Fov(Lens::new(focal, Fov::new(values[4], part(values, 5))?)),
            "kannala_brandt" => {
                Model::KannalaBrandt(Lens::new(focal, KannalaBrandt::new(part(values, 4))?))
            }
            "unified" => Model::Unified(Lens::new(focal, Unified::new(values[4])?)),
            _ => {
                let bend = DoubleSphere::new(values[4], values[5])?;
                Model::DoubleSphere(Lens::new(focal, bend))
            }
        };
        Self::new(model, width, height)
    }

    /// The same model with other values of its parameters, in the order of
    /// [`Camera::named_parameters`]. It asks for no memory, unlike [`Camera::from_named`].
    ///
    /// # Errors
    /// [`Error::Value`] where their number is wrong, or one is outside its domain.
    pub fn with_parameters(&self, values: &[f64]) -> Result<Self> {
        let own = own_names(self.model_name())?;
        let expected = match own {
            [] => 0,
            own => FOCAL.len() + own.len(),
        };
        if values.len() != expected {
            return Err(Error::value("parameters", expected, values.len()));
        }
        Self::from_values(self.model_name(), values, self.width(), self.height())
    }

    /// The name of the model, as [`Camera::from_named`] reads it.
    pub fn model_name(&self) -> &'static str {
        self.model().name()
    }

    /// Names and values of all parameters, as [`Camera::from_named`] reads them.
    pub fn named_parameters(&self) -> Vec<(&'static str, f64)> {
        self.model().named()
    }
}
