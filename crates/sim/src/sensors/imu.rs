//! Gyro and accelerometer: ideal readings of a moving body, with bias that wanders and white noise.

use super::normals::normal3;
use crate::noise::checks;
use crate::noise::stream::{Purpose, Streams};
use nalgebra::{UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;
use sphereflow_core::{Error, ImuSample, Pose, Result, Stamp};

/// Gravity of the simulated world (x right, y down, z forward), m/s^2.
pub const GRAVITY_M_S2: Vector3<f64> = Vector3::new(0.0, 9.81, 0.0);

/// Parameters of [`Imu`], named as in a Kalibr calibration file. The default is a perfect sensor at
/// 200 Hz in the camera's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuParameters {
    /// Readings per second: sets the noise of one reading, `density * sqrt(rate)`.
    pub rate_hz: f64,
    /// rad/s/sqrt(Hz).
    pub gyroscope_noise_density: f64,
    /// rad/s^2/sqrt(Hz).
    pub gyroscope_random_walk: f64,
    /// m/s^2/sqrt(Hz).
    pub accelerometer_noise_density: f64,
    /// m/s^3/sqrt(Hz).
    pub accelerometer_random_walk: f64,
    /// Bias at the first reading.
    pub initial_bias: ImuBias,
    /// Gravity itself in the world, m/s^2.
    pub gravity_m_s2: Vector3<f64>,
    /// Where the sensor sits on the camera.
    pub camera_from_imu: Pose,
}

impl Default for ImuParameters {
    fn default() -> Self {
        Self {
            rate_hz: 200.0,
            gyroscope_noise_density: 0.0,
            gyroscope_random_walk: 0.0,
            accelerometer_noise_density: 0.0,
            accelerometer_random_walk: 0.0,
            initial_bias: ImuBias::default(),
            gravity_m_s2: GRAVITY_M_S2,
            camera_from_imu: Pose::identity(),
        }
    }
}

/// What is to be subtracted from a reading, in the sensor's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuBias {
    /// rad/s.
    pub gyro_rad_s: Vector3<f64>,
    /// m/s^2.
    pub accel_m_s2: Vector3<f64>,
}

/// How the camera moves at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyMotion {
    /// Attitude of the camera.
    pub world_from_camera: UnitQuaternion<f64>,
    /// Angular velocity, camera frame, rad/s.
    pub omega_body: Vector3<f64>,
    /// Derivative of `omega_body`, camera frame, rad/s^2; only the lever arm needs it.
    pub alpha_body: Vector3<f64>,
    /// Second derivative of the camera's position, world frame, m/s^2.
    pub accel_world: Vector3<f64>,
}

impl BodyMotion {
    /// At rest in the world.
    pub fn at_rest(world_from_camera: UnitQuaternion<f64>) -> Self {
        Self {
            world_from_camera,
            omega_body: Vector3::zeros(),
            alpha_body: Vector3::zeros(),
            accel_world: Vector3::zeros(),
        }
    }
}

/// A reading and the bias that is in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuReading {
    /// What the sensor says.
    pub sample: ImuSample,
    /// The truth that an estimator looks for.
    pub bias: ImuBias,
}

/// A simulated IMU. Its bias and its noise advance with each reading.
#[derive(Clone, Debug)]
pub struct Imu {
    parameters: ImuParameters,
    bias: ImuBias,
    last: Option<Stamp>,
    rng: ChaCha8Rng,
}

impl Imu {
    /// # Errors
    /// [`Error::Value`] naming the parameter out of range.
    pub fn new(parameters: ImuParameters, seed: u64) -> Result<Self> {
        let p = &parameters;
        checks::positive("rate_hz", p.rate_hz)?;
        for (name, value) in [
            ("gyroscope_noise_density", p.gyroscope_noise_density),
            ("gyroscope_random_walk", p.gyroscope_random_walk),
            ("accelerometer_noise_density", p.accelerometer_noise_density),
            ("accelerometer_random_walk", p.accelerometer_random_walk),
        ] {
            checks::non_negative(name, value)?;
        }
        checks::finite_all("initial_bias.gyro_rad_s", &p.initial_bias.gyro_rad_s)?;
        checks::finite_all("initial_bias.accel_m_s2", &p.initial_bias.accel_m_s2)?;
        checks::finite_all("gravity_m_s2", &p.gravity_m_s2)?;
        checks::finite_all("camera_from_imu", &p.camera_from_imu.translation)?;
        Ok(Self {
            parameters,
            bias: parameters.initial_bias,
            last: None,
            rng: Streams::new(seed, Purpose::Imu, 0).chunk(0),
        })
    }

    /// The parameters.
    pub fn parameters(&self) -> &ImuParameters {
        &self.parameters
    }

    /// Seconds between readings.
    pub fn period_s(&self) -> f64 {
        1.0 / self.parameters.rate_hz
    }

    /// The perfect reading. With `l` the lever arm in the camera, R = `world_from_camera`:
    /// `a = R^T (C'' - g) + alpha x l + omega x (omega x l)`, both turned into the sensor's frame.
    pub fn ideal(&self, stamp: Stamp, motion: &BodyMotion) -> ImuSample {
        let p = &self.parameters;
        let lever = p.camera_from_imu.translation;
        let omega = motion.omega_body;
        let specific_force = motion
            .world_from_camera
            .inverse_transform_vector(&(motion.accel_world - p.gravity_m_s2))
            + motion.alpha_body.cross(&lever)
            + omega.cross(&omega.cross(&lever));
        let imu_from_camera = p.camera_from_imu.rotation.inverse();
        ImuSample {
            stamp,
            gyro_rad_s: imu_from_camera * omega,
            accel_m_s2: imu_from_camera * specific_force,
        }
    }

    /// The next reading. The bias walks by `random_walk * sqrt(dt)` from the reading before.
    ///
    /// # Errors
    /// [`Error::TimeOrder`] where `stamp` does not come after the reading before, [`Error::Value`]
    /// for a motion that is not finite. The sensor is then unchanged.
    pub fn sample(&mut self, stamp: Stamp, motion: &BodyMotion) -> Result<ImuReading> {
        let mut sample = self.ideal(stamp, motion);
        let finite = |v: &Vector3<f64>| v.iter().all(|v| v.is_finite());
        if !(finite(&sample.gyro_rad_s) && finite(&sample.accel_m_s2)) {
            return Err(Error::value(
                "motion",
                "finite numbers",
                format!("{motion:?}"),
            ));
        }
        let dt_s = match self.last {
            Some(earlier) if stamp <= earlier => {
                return Err(Error::TimeOrder {
                    argument: "stamp".into(),
                    earlier,
                    later: stamp,
                    index: 0,
                });
            }
            Some(earlier) => stamp.seconds_since(earlier),
            None => 0.0,
        };
        self.last = Some(stamp);
        let p = &self.parameters;
        let (walk, white) = (dt_s.sqrt(), p.rate_hz.sqrt());
        self.bias.gyro_rad_s += normal3(&mut self.rng) * (p.gyroscope_random_walk * walk);
        self.bias.accel_m_s2 += normal3(&mut self.rng) * (p.accelerometer_random_walk * walk);
        sample.gyro_rad_s +=
            self.bias.gyro_rad_s + normal3(&mut self.rng) * (p.gyroscope_noise_density * white);
        sample.accel_m_s2 +=
            self.bias.accel_m_s2 + normal3(&mut self.rng) * (p.accelerometer_noise_density * white);
        Ok(ImuReading {
            sample,
            bias: self.bias,
        })
    }
}
