//! The magnetic field inside a building: the earth's, bent by a few magnetic dipoles.

use super::normals::normal3;
use crate::noise::checks;
use crate::noise::stream::{Purpose, Streams};
use nalgebra::Vector3;
use rand::RngExt;
use sphereflow_core::{Error, Result};

/// Field of a unit dipole at a unit distance: mu_0 / (4 pi) in uT m^3 / (A m^2).
const UT_PER_DIPOLE: f64 = 0.1;

/// Parameters of [`MagneticField`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagneticFieldParameters {
    /// Horizontal part of the uniform field, uT.
    pub horizontal_ut: f64,
    /// Angle of the uniform field below the horizon, radians; positive on the northern hemisphere.
    pub dip_rad: f64,
    /// Direction of north: angle from the world's z axis towards its x axis, radians.
    pub north_heading_rad: f64,
    /// Dipoles (iron furniture, motors, loudspeakers) at random places.
    pub dipole_count: usize,
    /// Standard deviation of each component of a dipole's moment, A m^2.
    pub dipole_moment_a_m2: f64,
    /// Radius of a dipole, metres: within it the field no longer grows.
    pub dipole_radius_m: f64,
    /// Corner of the box that holds the dipoles with the smallest coordinates, world, metres.
    pub box_min_m: Vector3<f64>,
    /// Corner with the largest coordinates.
    pub box_max_m: Vector3<f64>,
}

impl Default for MagneticFieldParameters {
    /// Central Europe, six pieces of iron in a room of 6 x 3 x 6 m.
    fn default() -> Self {
        Self {
            horizontal_ut: 20.0,
            dip_rad: 1.13,
            north_heading_rad: 0.0,
            dipole_count: 6,
            dipole_moment_a_m2: 10.0,
            dipole_radius_m: 0.3,
            box_min_m: Vector3::new(-3.0, -1.5, -3.0),
            box_max_m: Vector3::new(3.0, 1.5, 3.0),
        }
    }
}

/// A magnet: where it is and how strong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dipole {
    /// World, metres.
    pub position_m: Vector3<f64>,
    /// Moment, world, A m^2.
    pub moment_a_m2: Vector3<f64>,
}

/// A field that does not change in time.
#[derive(Clone, Debug, PartialEq)]
pub struct MagneticField {
    uniform_ut: Vector3<f64>,
    radius_m: f64,
    dipoles: Vec<Dipole>,
}

impl MagneticField {
    /// # Errors
    /// [`Error::Value`] naming the parameter out of range.
    pub fn new(parameters: &MagneticFieldParameters, seed: u64) -> Result<Self> {
        let p = parameters;
        checks::positive("horizontal_ut", p.horizontal_ut)?;
        checks::finite("north_heading_rad", p.north_heading_rad)?;
        checks::non_negative("dipole_moment_a_m2", p.dipole_moment_a_m2)?;
        checks::positive("dipole_radius_m", p.dipole_radius_m)?;
        checks::finite_all("box_min_m", &p.box_min_m)?;
        checks::finite_all("box_max_m", &p.box_max_m)?;
        if p.dip_rad.is_nan() || p.dip_rad.abs() >= std::f64::consts::FRAC_PI_2 {
            return Err(Error::value(
                "dip_rad",
                "an angle within +-pi/2, or no field is horizontal",
                p.dip_rad,
            ));
        }
        if p.box_min_m.iter().zip(&p.box_max_m).any(|(a, b)| a > b) {
            return Err(Error::value(
                "box_max_m",
                format!("no coordinate below box_min_m = {:?}", p.box_min_m),
                format!("{:?}", p.box_max_m),
            ));
        }
        let (sin, cos) = p.north_heading_rad.sin_cos();
        let mut rng = Streams::new(seed, Purpose::MagneticField, 0).chunk(0);
        let dipoles = (0..p.dipole_count)
            .map(|_| {
                let share = Vector3::from_fn(|_, _| rng.random::<f64>());
                Dipole {
                    position_m: p.box_min_m + (p.box_max_m - p.box_min_m).component_mul(&share),
                    moment_a_m2: normal3(&mut rng) * p.dipole_moment_a_m2,
                }
            })
            .collect();
        Ok(Self {
            uniform_ut: Vector3::new(sin, p.dip_rad.tan(), cos) * p.horizontal_ut,
            radius_m: p.dipole_radius_m,
            dipoles,
        })
    }

    /// The field far from all dipoles, world, uT.
    pub fn uniform_ut(&self) -> Vector3<f64> {
        self.uniform_ut
    }

    /// The dipoles.
    pub fn dipoles(&self) -> &[Dipole] {
        &self.dipoles
    }

    /// The field at a point of the world, uT, world axes.
    pub fn at(&self, position_m: &Vector3<f64>) -> Vector3<f64> {
        let mut field = self.uniform_ut;
        for dipole in &self.dipoles {
            let offset = position_m - dipole.position_m;
            let distance = offset.norm();
            if distance == 0.0 {
                continue; // the middle of a magnet has no direction
            }
            let (axis, moment) = (offset / distance, dipole.moment_a_m2);
            let reach = distance.max(self.radius_m).powi(3);
            field += (axis * (3.0 * moment.dot(&axis)) - moment) * (UT_PER_DIPOLE / reach);
        }
        field
    }
}
