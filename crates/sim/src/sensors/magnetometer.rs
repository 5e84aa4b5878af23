//! Magnetometer: the field where it is, through the iron it is mounted on, with noise.

use super::MagneticField;
use super::normals::normal3;
use crate::noise::checks;
use crate::noise::stream::{Purpose, Streams};
use nalgebra::{Matrix3, Vector3};
use rand_chacha::ChaCha8Rng;
use sphereflow_core::{Error, MagSample, Pose, Result, Stamp};

/// Parameters of [`Magnetometer`]; the default is a perfect sensor in the camera's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagnetometerParameters {
    /// Field of magnets that move with the sensor, sensor frame, uT.
    pub hard_iron_ut: Vector3<f64>,
    /// Gains and misalignment, sensor frame.
    pub soft_iron: Matrix3<f64>,
    /// Standard deviation of each component, uT.
    pub sigma_ut: f64,
    /// Where the sensor sits on the camera.
    pub camera_from_mag: Pose,
}

impl Default for MagnetometerParameters {
    fn default() -> Self {
        Self {
            hard_iron_ut: Vector3::zeros(),
            soft_iron: Matrix3::identity(),
            sigma_ut: 0.0,
            camera_from_mag: Pose::identity(),
        }
    }
}

/// A simulated magnetometer: `m = S R^T B(x) + h + noise`.
#[derive(Clone, Debug)]
pub struct Magnetometer {
    parameters: MagnetometerParameters,
    rng: ChaCha8Rng,
}

impl Magnetometer {
    /// # Errors
    /// [`Error::Value`] naming the parameter out of range.
    pub fn new(parameters: MagnetometerParameters, seed: u64) -> Result<Self> {
        checks::finite_all("hard_iron_ut", &parameters.hard_iron_ut)?;
        checks::finite_all("soft_iron", &parameters.soft_iron)?;
        checks::non_negative("sigma_ut", parameters.sigma_ut)?;
        checks::finite_all("camera_from_mag", &parameters.camera_from_mag.translation)?;
        if parameters.soft_iron.determinant() <= 0.0 {
            return Err(Error::value(
                "soft_iron",
                "a matrix of positive determinant",
                parameters.soft_iron,
            ));
        }
        Ok(Self {
            parameters,
            rng: Streams::new(seed, Purpose::Magnetometer, 0).chunk(0),
        })
    }

    /// The parameters.
    pub fn parameters(&self) -> &MagnetometerParameters {
        &self.parameters
    }

    /// The reading without noise, sensor frame, uT.
    pub fn ideal(&self, field: &MagneticField, world_from_camera: &Pose) -> Vector3<f64> {
        let p = &self.parameters;
        let world_from_mag = *world_from_camera * p.camera_from_mag;
        let in_sensor = world_from_mag
            .rotation
            .inverse_transform_vector(&field.at(&world_from_mag.translation));
        p.soft_iron * in_sensor + p.hard_iron_ut
    }

    /// The next reading.
    ///
    /// # Errors
    /// [`Error::Value`] for a pose that is not finite; the sensor is then unchanged.
    pub fn sample(
        &mut self,
        stamp: Stamp,
        field: &MagneticField,
        world_from_camera: &Pose,
    ) -> Result<MagSample> {
        let ideal = self.ideal(field, world_from_camera);
        if !ideal.iter().all(|v| v.is_finite()) {
            return Err(Error::value(
                "world_from_camera",
                "finite numbers",
                format!("{world_from_camera:?}"),
            ));
        }
        Ok(MagSample {
            stamp,
            mag_ut: ideal + normal3(&mut self.rng) * self.parameters.sigma_ut,
        })
    }
}
