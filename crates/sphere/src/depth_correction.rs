//! The smooth error of a depth camera and how to undo it: two low-order fields over the image.

use crate::Camera;
use nalgebra::Vector2;
use rayon::prelude::*;
use sphereflow_core::{DepthMap, Error, Result};

/// Number of terms of each field.
pub const TERM_COUNT: usize = 9;

/// Names of the terms of each field, monomials in `z1 = x/z` and `z2 = y/z` of the pixel's ray:
/// 1, z1, z2, z1^2, z1 z2, z2^2, r^2 z1, r^2 z2, r^4, with `r^2 = z1^2 + z2^2`.
pub const TERM_NAMES: [&str; TERM_COUNT] = [
    "one", "z1", "z2", "z1_z1", "z1_z2", "z2_z2", "r2_z1", "r2_z2", "r4",
];

/// What makes true depth of measured depth:
///
/// `1/Z_true = (1 + m(z1, z2)) / Z_measured + a(z1, z2)`
///
/// with `m` (no unit) and `a` (1/m) sums of the terms of [`TERM_NAMES`] and `(z1, z2) = (x/z, y/z)`
/// of the pixel's ray in the camera it is applied with. Structured light measures a disparity,
/// which is linear in 1/Z: baseline, focal length and zero of the disparity that are wrong by
/// amounts that vary slowly over the image give such fields. `m`'s constant is the unit of length:
/// no motion of the camera shows it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthCorrection {
    relative: [f64; TERM_COUNT],
    additive: [f64; TERM_COUNT],
}

impl DepthCorrection {
    /// From the coefficients of `m` and `a` in the order of [`TERM_NAMES`].
    ///
    /// # Errors
    /// [`Error::Value`] naming the coefficient that is not finite.
    pub fn new(relative: [f64; TERM_COUNT], additive: [f64; TERM_COUNT]) -> Result<Self> {
        for (field, values) in [("relative", &relative), ("additive", &additive)] {
            for (name, value) in TERM_NAMES.iter().zip(values) {
                if !value.is_finite() {
                    let argument = format!("{field}.{name}");
                    return Err(Error::value(argument, "a finite number", value));
                }
            }
        }
        Ok(Self { relative, additive })
    }

    /// From coefficients by name; what is not named is zero.
    ///
    /// # Errors
    /// [`Error::Value`] naming a coefficient that is unknown, repeated or not finite.
    pub fn from_named<S: AsRef<str>>(relative: &[(S, f64)], additive: &[(S, f64)]) -> Result<Self> {
        Self::new(
            ordered("relative", relative)?,
            ordered("additive", additive)?,
        )
    }

    /// Coefficients of `m`, in the order of [`TERM_NAMES`].
    pub fn relative(&self) -> &[f64; TERM_COUNT] {
        &self.relative
    }

    /// Coefficients of `a`, 1/m, in the order of [`TERM_NAMES`].
    pub fn additive(&self) -> &[f64; TERM_COUNT] {
        &self.additive
    }

    /// True where it changes nothing.
    pub fn is_identity(&self) -> bool {
        *self == Self::default()
    }

    /// `1 + m` and `a` (1/m) at a place of the image plane.
    pub fn factor_and_offset(&self, z1: f64, z2: f64) -> (f64, f64) {
        let terms = correction_terms(z1, z2);
        let sum = |c: &[f64; TERM_COUNT]| c.iter().zip(terms).map(|(c, t)| c * t).sum::<f64>();
        (1.0 + sum(&self.relative), sum(&self.additive))
    }
}

/// The terms of [`TERM_NAMES`] at a place of the image plane.
pub fn correction_terms(z1: f64, z2: f64) -> [f64; TERM_COUNT] {
    let r2 = z1 * z1 + z2 * z2;
    let square = [z1 * z1, z1 * z2, z2 * z2];
    let [a, b, c] = square;
    [1.0, z1, z2, a, b, c, r2 * z1, r2 * z2, r2 * r2]
}

fn ordered<S: AsRef<str>>(field: &str, named: &[(S, f64)]) -> Result<[f64; TERM_COUNT]> {
    let mut values = [None; TERM_COUNT];
    for (name, value) in named {
        let name = name.as_ref();
        let slot = TERM_NAMES.iter().position(|known| *known == name);
        let slot = slot.and_then(|i| values.get_mut(i)).filter(|v| v.is_none());
        let Some(slot) = slot else {
            let expected = format!("each of {} at most once", TERM_NAMES.join(", "));
            return Err(Error::value(format!("{field}.{name}"), expected, name));
        };
        *slot = Some(*value);
    }
    Ok(values.map(|value| value.unwrap_or(0.0)))
}

/// A [`DepthCorrection`] made ready for one camera: both fields at every pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthCorrector {
    size: (usize, usize),
    correction: DepthCorrection,
    /// `1 + m`; NaN where the camera looks nowhere or sideways.
    factor: Vec<f32>,
    /// `a`, 1/m.
    offset: Vec<f32>,
}

impl DepthCorrector {
    /// The fields of `correction` over the image of `camera`.
    ///
    /// # Errors
    /// [`Error::Value`] for a 360-degree camera, whose distances are ranges: they have no such
    /// correction.
    pub fn new(camera: &Camera, correction: &DepthCorrection) -> Result<Self> {
        if camera.wraps_around() {
            let expected = "a camera with an optical axis: ranges of a 360-degree one have none";
            return Err(Error::value(
                "depth_correction",
                expected,
                camera.model_name(),
            ));
        }
        let (width, height) = (camera.width(), camera.height());
        let field = |i: usize| {
            let pixel = Vector2::new((i % width) as f64, (i / width) as f64);
            match camera.unproject(&pixel) {
                Some(ray) if ray.z > 0.0 => {
                    let (factor, offset) =
                        correction.factor_and_offset(ray.x / ray.z, ray.y / ray.z);
                    (factor as f32, offset as f32)
                }
                _ => (f32::NAN, f32::NAN),
            }
        };
        let (factor, offset) = (0..width * height).into_par_iter().map(field).unzip();
        Ok(Self {
            size: (width, height),
            correction: *correction,
            factor,
            offset,
        })
    }

    /// The correction.
    pub fn correction(&self) -> &DepthCorrection {
        &self.correction
    }

    /// Corrected depth, in the memory of the depth given. Unknown stays unknown, and what would
    /// come to lie at or behind the camera becomes unknown.
    ///
    /// # Errors
    /// [`Error::Shape`] where the map has not the size of the camera's image.
    pub fn apply(&self, depth: DepthMap) -> Result<DepthMap> {
        let text = |(width, height): (usize, usize)| format!("{width}x{height}");
        if depth.size() != self.size {
            let expected = format!("{} as the camera's image", text(self.size));
            return Err(Error::shape("depth", expected, text(depth.size())));
        }
        let width = self.size.0;
        let mut metres = depth.into_plane();
        let fields = (self.factor.par_chunks(width)).zip(self.offset.par_chunks(width));
        let rows = metres.data_mut().par_chunks_mut(width).zip(fields);
        rows.with_min_len(16).for_each(|(row, (factor, offset))| {
            for ((z, factor), offset) in row.iter_mut().zip(factor).zip(offset) {
                // 1 / (factor / z + offset), with one division; not positive becomes NaN below
                *z /= factor + offset * *z;
            }
        });
        Ok(DepthMap::new(metres))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sphereflow_core::Plane;

    /// Some roundings of f32.
    const ROUNDING: f32 = 5e-7;

    fn camera() -> Camera {
        let lens = [0.2, -0.3, 1e-3, -2e-3, 0.1, 0.0, 0.0, 0.0];
        Camera::opencv(50.0, 51.0, 31.0, 24.5, lens, 64, 48).unwrap()
    }

    fn depth() -> DepthMap {
        let metres = |x, y| {
            if (x + y) % 7 == 0 {
                0.0
            } else {
                0.5 + 0.05 * (x + y) as f32
            }
        };
        DepthMap::new(Plane::from_fn(64, 48, metres))
    }

    fn same(a: &DepthMap, b: &DepthMap) -> bool {
        let close = |a: f32, b: f32| (a.is_nan() && b.is_nan()) || (a - b).abs() <= ROUNDING * a;
        let pairs = a.metres().data().iter().zip(b.metres().data());
        pairs.into_iter().all(|(&a, &b)| close(a, b))
    }

    #[test]
    fn correction_without_coefficients_changes_nothing() {
        let identity = DepthCorrection::default();
        let corrector = DepthCorrector::new(&camera(), &identity).unwrap();
        assert!(identity.is_identity());
        assert!(same(&corrector.apply(depth()).unwrap(), &depth()));
    }

    #[test]
    fn correction_multiplies_and_adds_in_inverse_depth_at_the_pixels_ray() {
        let named = [("z1", -0.02), ("r4", -0.05)];
        let correction = DepthCorrection::from_named(&named, &[("one", 0.01), ("z2", 0.03)]);
        let corrector = DepthCorrector::new(&camera(), &correction.unwrap()).unwrap();
        let found = corrector.apply(depth()).unwrap();
        for (x, y) in [(0, 3), (63, 47), (12, 40), (31, 24)] {
            let ray = camera()
                .unproject(&Vector2::new(x as f64, y as f64))
                .unwrap();
            let (z1, z2) = (ray.x / ray.z, ray.y / ray.z);
            let r2 = z1 * z1 + z2 * z2;
            let measured = f64::from(depth().metres()[(x, y)]);
            let inverse = (1.0 - 0.02 * z1 - 0.05 * r2 * r2) / measured + 0.01 + 0.03 * z2;
            let expected = (1.0 / inverse) as f32;
            let found = found.metres()[(x, y)];
            assert!(
                (found - expected).abs() <= ROUNDING * expected,
                "{found} {expected}"
            );
        }
    }

    #[test]
    fn correction_and_its_opposite_give_back_the_depth() {
        // 1/Z' = 1/Z + a and back; 1/Z' = (1 + c) / Z and back by 1 / (1 + c) - 1
        let mut forth = [0.0; TERM_COUNT];
        (forth[1], forth[8]) = (0.05, -0.1);
        let zero = [0.0; TERM_COUNT];
        let mut constant = zero;
        constant[0] = 0.25;
        let mut inverse = zero;
        inverse[0] = -0.2;
        let pairs = [
            ((zero, forth), (zero, forth.map(|c| -c))),
            ((constant, zero), (inverse, zero)),
        ];
        for (there, back) in pairs {
            let apply = |(relative, additive), depth| {
                let correction = DepthCorrection::new(relative, additive).unwrap();
                let corrector = DepthCorrector::new(&camera(), &correction).unwrap();
                corrector.apply(depth).unwrap()
            };
            let there = apply(there, depth());
            assert!(!same(&there, &depth()));
            assert!(same(&apply(back, there), &depth()));
        }
    }

    #[test]
    fn correction_never_gives_depth_that_is_not_positive() {
        let correction = DepthCorrection::from_named(&[], &[("one", -0.4)]).unwrap();
        let corrector = DepthCorrector::new(&camera(), &correction).unwrap();
        let found = corrector.apply(depth()).unwrap();
        let pairs = || {
            depth()
                .into_plane()
                .into_vec()
                .into_iter()
                .zip(found.metres().data())
        };
        assert!(pairs().all(|(z, found)| found.is_nan() || (z < 2.5 && *found > 0.0)));
        assert!(pairs().any(|(z, found)| z > 2.5 && found.is_nan()));
    }

    #[test]
    fn correction_of_wrong_names_sizes_and_cameras_is_an_error() {
        let text = |e: Error| e.to_string();
        let unknown = DepthCorrection::from_named(&[("z3", 1.0)], &[]).unwrap_err();
        assert!(text(unknown).starts_with("relative.z3"));
        let twice = DepthCorrection::from_named(&[], &[("z1", 1.0), ("z1", 2.0)]).unwrap_err();
        assert!(text(twice).starts_with("additive.z1"));
        let endless = DepthCorrection::from_named(&[], &[("r4", f64::NAN)]).unwrap_err();
        assert!(text(endless).starts_with("additive.r4"));
        let identity = DepthCorrection::default();
        let all_around = Camera::equirectangular(64, 32).unwrap();
        let refused = DepthCorrector::new(&all_around, &identity).unwrap_err();
        assert!(text(refused).contains("equirectangular"));
        let corrector = DepthCorrector::new(&camera(), &identity).unwrap();
        let small = DepthMap::new(Plane::filled(8, 8, 1.0));
        assert!(text(corrector.apply(small).unwrap_err()).contains("64x48"));
    }
}
