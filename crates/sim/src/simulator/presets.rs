//! Simulations that have a name.

use super::{DepthNoiseParameters, SimConfig};
use crate::noise::{ImageNoiseParameters, KinectParameters};
use crate::sensors::{ImuBias, ImuParameters};
use crate::{Motion, Result, Scene};
use nalgebra::Vector3;
use sphereflow_sphere::Camera;

impl SimConfig {
    /// The demonstration: a furnished room, once around its table and back (25 s, 30 Hz), a Kinect
    /// of 640x480 with its noise, grey-level noise, and the inertial sensor of a good telephone.
    ///
    /// # Errors
    /// None in practice: the camera's constructor can fail.
    pub fn demo(seed: u64) -> Result<Self> {
        let camera = Camera::pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)?;
        let scene = Scene::furnished_room(seed);
        Ok(Self {
            seed,
            depth_noise: DepthNoiseParameters::Kinect(KinectParameters::default()),
            image_noise: ImageNoiseParameters {
                sigma_grey: 2.0,
                ..ImageNoiseParameters::default()
            },
            imu: Some(ImuParameters {
                gyroscope_noise_density: 1.7e-4,
                gyroscope_random_walk: 2.0e-5,
                accelerometer_noise_density: 2.0e-3,
                accelerometer_random_walk: 3.0e-3,
                initial_bias: ImuBias {
                    gyro_rad_s: Vector3::new(0.010, -0.008, 0.012),
                    accel_m_s2: Vector3::new(0.072, -0.023, -0.12),
                },
                ..ImuParameters::default()
            }),
            ..Self::perfect(scene, camera, Motion::room_tour(seed))
        })
    }

    /// Thesis: section 4.1.1. The painted room, 640x480 pixels of 50 x 40 degrees (not quite
    /// square: 1.457e-3 by 1.517e-3), 4 s at 60 Hz; no noise.
    ///
    /// # Errors
    /// None in practice: the camera's constructor can fail.
    pub fn thesis_411() -> Result<Self> {
        let (scene, motion) = (Scene::thesis_room(), Motion::sinusoids_411());
        Ok(Self {
            rate_hz: 60.0,
            ..Self::perfect(scene, Self::thesis_camera(640, 480)?, motion)
        })
    }

    /// Thesis: section 4.1.1. A pinhole camera of 50 x 40 degrees, border to border.
    ///
    /// # Errors
    /// A value error for an empty image.
    pub fn thesis_camera(width: usize, height: usize) -> Result<Camera> {
        let focal =
            |size: usize, degrees: f64| 0.5 * size as f64 / (0.5 * degrees).to_radians().tan();
        let middle = |size: usize| 0.5 * size as f64 - 0.5;
        Ok(Camera::pinhole(
            focal(width, 50.0),
            focal(height, 40.0),
            middle(width),
            middle(height),
            width,
            height,
        )?)
    }
}
