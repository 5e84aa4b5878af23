//! Exact ranges in simple scenes: what the tests measure motion in.
#![allow(dead_code)] // each test program uses its part

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use sphereflow_alignment::{Config, VelocityEstimate, estimate_velocity, pose_from_twist};
use sphereflow_core::{DepthMap, Plane, Pose, RangeMap, Twist};
use sphereflow_sphere::Camera;

/// Time between two images, seconds.
pub const DT_S: f64 = 1.0 / 30.0;

/// Scenes seen from inside or in front.
pub enum Scene {
    /// Six walls of a box without right angles to the axes: normals and distances, all seen from
    /// inside (convex: hypothesis H1 holds).
    Room(Vec<(Vector3<f64>, f64)>),
    /// Sphere about a centre.
    Sphere(Vector3<f64>, f64),
    /// Ellipsoid about the origin with these half axes.
    Ellipsoid(Vector3<f64>),
}

impl Scene {
    /// A convex room of six slanted walls and two more, 2 to 4 metres away.
    pub fn room() -> Self {
        let walls = [
            ([1.0, 0.1, 0.05], 2.0),
            ([-1.0, 0.15, 0.1], 2.2),
            ([0.1, 1.0, 0.2], 1.5),
            ([-0.05, -1.0, 0.1], 1.4),
            ([0.1, -0.1, 1.0], 3.0),
            ([0.2, 0.1, -1.0], 3.2),
            ([0.7, 0.3, 1.0], 3.1),
            ([-0.6, -0.5, 1.0], 3.0),
        ];
        Self::Room(
            walls
                .iter()
                .map(|(n, d)| (Vector3::from(*n).normalize(), *d))
                .collect(),
        )
    }

    /// One wall across the view.
    pub fn wall(normal: Vector3<f64>, distance: f64) -> Self {
        Self::Room(vec![(normal.normalize(), distance)])
    }

    /// Range from `origin` along a unit `ray`, metres; NaN where nothing is hit.
    pub fn range(&self, origin: &Vector3<f64>, ray: &Vector3<f64>) -> f64 {
        match self {
            Self::Room(walls) => walls
                .iter()
                .map(|(normal, distance)| (distance - normal.dot(origin)) / normal.dot(ray))
                .filter(|t| *t > 0.0)
                .fold(f64::NAN, f64::min),
            Self::Sphere(centre, radius) => {
                quadric(&(origin - centre), ray, &Vector3::repeat(1.0 / radius))
            }
            Self::Ellipsoid(axes) => quadric(origin, ray, &axes.map(|a| 1.0 / a)),
        }
    }

    /// Range image from a pose.
    pub fn ranges(&self, camera: &Camera, pose: &Pose) -> RangeMap {
        RangeMap::new(self.image(camera, pose, |_| 1.0))
    }

    /// Depth image from a pose.
    pub fn depths(&self, camera: &Camera, pose: &Pose) -> DepthMap {
        DepthMap::new(self.image(camera, pose, |ray| ray.z))
    }

    fn image(
        &self,
        camera: &Camera,
        pose: &Pose,
        along: impl Fn(&Vector3<f64>) -> f64,
    ) -> Plane<f32> {
        Plane::from_fn(camera.width(), camera.height(), |x, y| {
            let pixel = Vector2::new(x as f64, y as f64);
            let Some(ray) = camera.unproject(&pixel) else {
                return f32::NAN;
            };
            let range = self.range(&pose.translation, &(pose.rotation * ray));
            (range * along(&ray)) as f32
        })
    }
}

fn quadric(origin: &Vector3<f64>, ray: &Vector3<f64>, inverse_axes: &Vector3<f64>) -> f64 {
    let (o, r) = (
        origin.component_mul(inverse_axes),
        ray.component_mul(inverse_axes),
    );
    let (a, b, c) = (r.dot(&r), r.dot(&o), o.dot(&o) - 1.0);
    (-b + (b * b - a * c).sqrt()) / a
}

/// The usual test camera: 320x240, 58x45 degrees.
pub fn pinhole() -> Camera {
    Camera::pinhole(290.0, 290.0, 159.5, 119.5, 320, 240).unwrap()
}

/// A twist from `[omega, v]`.
pub fn twist(values: [f64; 6]) -> Twist {
    Twist::from_vector(&values.into())
}

/// Two poses `dt_s` apart under a constant twist, the first being `start`.
pub fn two_poses(start: &Pose, twist: &Twist, dt_s: f64) -> (Pose, Pose) {
    (*start, *start * pose_from_twist(twist, dt_s))
}

/// A pose off the centre of the scenes, with no axis along theirs.
pub fn somewhere() -> Pose {
    let rotation = UnitQuaternion::from_euler_angles(0.1, -0.2, 0.3);
    Pose::new(rotation, Vector3::new(0.2, -0.1, 0.3))
}

/// The estimate from two exact images: ranges where the camera sees beyond 90 degrees.
pub fn measure(
    scene: &Scene,
    camera: &Camera,
    motion: &Twist,
    config: &Config,
) -> VelocityEstimate {
    let (a, b) = two_poses(&somewhere(), motion, DT_S);
    let corner = camera.unproject(&Vector2::new(0.0, 0.0));
    if corner.is_some_and(|ray| ray.z > 0.0) {
        let (a, b) = (scene.depths(camera, &a), scene.depths(camera, &b));
        estimate_velocity(camera, &a, &b, DT_S, config).unwrap()
    } else {
        let (a, b) = (scene.ranges(camera, &a), scene.ranges(camera, &b));
        estimate_velocity(camera, &a, &b, DT_S, config).unwrap()
    }
}
