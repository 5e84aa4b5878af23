//! What is estimated: each parameter with its name, its prior and the step of its differences.

use super::SelfCalibrationConfig;
use crate::Result;
use nalgebra::{DVector, Vector2};
use sphereflow_sphere::depth_correction::{TERM_COUNT, TERM_NAMES, correction_terms};
use sphereflow_sphere::{Camera, DepthCorrection};

/// Where a parameter goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// A named parameter of the camera.
    Camera(&'static str),
    /// A term of the factor of 1/Z.
    Relative(usize),
    /// A term of what is added to 1/Z.
    Additive(usize),
    /// The read-out time.
    Readout,
}

/// One number to be estimated; its value counts from what the camera has now.
#[derive(Clone, Debug)]
pub(super) struct Unknown {
    pub(super) name: String,
    place: Place,
    /// Standard deviation before anything was measured.
    pub(super) prior_std: f64,
    /// Value before anything was measured.
    pub(super) prior: f64,
}

/// Differences are taken over this share of the prior: far above the rounding of f32, far below
/// what bends the residuals.
const STEP_SHARE: f64 = 0.1;

/// Terms of the factor of 1/Z. Its constant is the unit of length, which no motion shows; of the
/// terms of third order a camera's optics has none that are not in what is added.
const RELATIVE: [usize; 6] = [1, 2, 3, 4, 5, 8];

/// Distortion that is estimated where the model has it.
const LENS: [&str; 4] = ["k1", "k2", "p1", "p2"];

/// All unknowns of a camera, in order: lens, field, read-out.
#[derive(Clone, Debug)]
pub(super) struct Unknowns {
    camera: Camera,
    pub(super) all: Vec<Unknown>,
}

/// What a vector of values means.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Calibrated {
    pub(super) camera: Camera,
    pub(super) correction: DepthCorrection,
    pub(super) readout_s: f64,
}

impl Unknowns {
    pub(super) fn new(camera: &Camera, config: &SelfCalibrationConfig) -> Self {
        let mut unknowns = Self {
            camera: with_distortion(camera),
            all: Vec::new(),
        };
        let border = Border::of(camera);
        if config.lens {
            unknowns.add_lens(&border, config);
        }
        if config.field {
            for (place, terms) in [
                (Place::Relative as fn(usize) -> Place, RELATIVE.as_slice()),
                (Place::Additive as fn(usize) -> Place, &ALL_TERMS),
            ] {
                for &term in terms {
                    let std = config.field_std / border.largest_term[term];
                    unknowns.add(place(term), 0.0, std);
                }
            }
        }
        if config.readout {
            unknowns.add(Place::Readout, config.readout_s, config.readout_std_s);
        }
        unknowns
    }

    fn add_lens(&mut self, border: &Border, config: &SelfCalibrationConfig) {
        for (name, value) in self.camera.named_parameters() {
            let r = border.radius;
            let std = match name {
                "fx" | "fy" => config.focal_std * value,
                "cx" => config.focal_std * border.focal.0,
                "cy" => config.focal_std * border.focal.1,
                "k1" => config.lens_std / r.powi(3),
                "k2" => config.lens_std / r.powi(5),
                "p1" | "p2" => config.lens_std / (3.0 * r * r),
                _ => continue,
            };
            let bends = LENS.contains(&name);
            if !bends || matches!(self.camera.model_name(), "opencv" | "kannala_brandt") {
                self.add(Place::Camera(name), 0.0, std);
            }
        }
    }

    fn add(&mut self, place: Place, prior: f64, prior_std: f64) {
        let name = match place {
            Place::Camera(name) => name.to_string(),
            Place::Relative(term) => format!("relative.{}", TERM_NAMES[term]),
            Place::Additive(term) => format!("additive.{}", TERM_NAMES[term]),
            Place::Readout => "readout_s".to_string(),
        };
        self.all.push(Unknown {
            name,
            place,
            prior_std,
            prior,
        });
    }

    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    pub(super) fn prior(&self) -> DVector<f64> {
        DVector::from_iterator(self.len(), self.all.iter().map(|u| u.prior))
    }

    pub(super) fn prior_std(&self) -> DVector<f64> {
        DVector::from_iterator(self.len(), self.all.iter().map(|u| u.prior_std))
    }

    /// Step of the differences by unknown `i`.
    pub(super) fn step(&self, i: usize) -> f64 {
        STEP_SHARE * self.all[i].prior_std
    }

    /// True where unknown `i` changes the rays, and with them the tables.
    pub(super) fn changes_rays(&self, i: usize) -> bool {
        matches!(self.all[i].place, Place::Camera(_))
    }

    /// Camera, field and read-out of `values`; `readout_s` where that is not estimated.
    pub(super) fn calibrated(&self, values: &DVector<f64>, readout_s: f64) -> Result<Calibrated> {
        let mut named = self.camera.named_parameters();
        let mut relative = [0.0; TERM_COUNT];
        let mut additive = [0.0; TERM_COUNT];
        let mut readout_s = readout_s;
        for (unknown, &value) in self.all.iter().zip(values.iter()) {
            match unknown.place {
                Place::Camera(name) => {
                    for (_, old) in named.iter_mut().filter(|(known, _)| *known == name) {
                        *old += value;
                    }
                }
                Place::Relative(term) => relative[term] = value,
                Place::Additive(term) => additive[term] = value,
                Place::Readout => readout_s = value,
            }
        }
        let (width, height) = (self.camera.width(), self.camera.height());
        Ok(Calibrated {
            camera: Camera::from_named(self.camera.model_name(), &named, width, height)?,
            correction: DepthCorrection::new(relative, additive)?,
            readout_s,
        })
    }
}

const ALL_TERMS: [usize; TERM_COUNT] = [0, 1, 2, 3, 4, 5, 6, 7, 8];

/// How far the image reaches.
struct Border {
    radius: f64,
    focal: (f64, f64),
    largest_term: [f64; TERM_COUNT],
}

impl Border {
    /// From pixels along the border and within; a fish-eye counts up to 60 degrees from its axis,
    /// beyond which polynomials of the tangent are no description of anything.
    fn of(camera: &Camera) -> Self {
        const STEPS: usize = 16;
        const WIDEST: f64 = 1.75;
        let mut border = Self {
            radius: 0.1,
            focal: (1.0, 1.0),
            largest_term: [1e-3; TERM_COUNT],
        };
        for (name, value) in camera.named_parameters() {
            match name {
                "fx" => border.focal.0 = value,
                "fy" => border.focal.1 = value,
                _ => {}
            }
        }
        for i in 0..=STEPS * STEPS + 2 * STEPS {
            let (x, y) = (i % (STEPS + 1), i / (STEPS + 1));
            let at = |k: usize, n: usize| (k * (n - 1)) as f64 / STEPS as f64;
            let pixel = Vector2::new(at(x, camera.width()), at(y, camera.height()));
            let Some(ray) = camera.unproject(&pixel).filter(|ray| ray.z > 0.0) else {
                continue;
            };
            let (z1, z2) = (ray.x / ray.z, ray.y / ray.z);
            if z1.hypot(z2) > WIDEST {
                continue;
            }
            border.radius = border.radius.max(z1.hypot(z2));
            for (largest, term) in border.largest_term.iter_mut().zip(correction_terms(z1, z2)) {
                *largest = largest.max(term.abs());
            }
        }
        border
    }
}

/// A pinhole without skew as the lens model it is a case of, so that it can get a distortion.
fn with_distortion(camera: &Camera) -> Camera {
    let named = camera.named_parameters();
    let value = |name: &str| named.iter().find(|(n, _)| *n == name).map_or(0.0, |p| p.1);
    if camera.model_name() != "pinhole" || value("skew") != 0.0 {
        return camera.clone();
    }
    let [fx, fy, cx, cy] = ["fx", "fy", "cx", "cy"].map(value);
    let (width, height) = (camera.width(), camera.height());
    Camera::opencv(fx, fy, cx, cy, [0.0; 8], width, height).unwrap_or_else(|_| camera.clone())
}
