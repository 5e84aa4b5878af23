//! Objects that move on their own: rejected and reported, or a status, never a wrong answer that is
//! claimed to be right.
#![allow(clippy::unwrap_used, clippy::panic)] // a test may

#[path = "../../alignment/tests/scene/mod.rs"]
mod scene;

use nalgebra::{Vector2, Vector3};
use scene::{DT_S, Scene, pinhole, twist};
use sphereflow_alignment::{Config, VelocityEstimate, estimate_velocity, pose_from_twist};
use sphereflow_core::{DepthMap, Plane, Pose, Reason, Stamp, TrackStatus, Twist};
use sphereflow_odometry::{DepthOdometry, OdometryConfig};

/// What is called right, m/s and rad/s: exact depth, but the domains on the object's border.
const RIGHT_M_S: f64 = 0.03;
const RIGHT_RAD_S: f64 = 0.02;

/// A corner of a room with its floor and ceiling: all of the motion shows in it. (Before a single wall
/// nothing but the person would tell how the camera moves along it.)
fn corner() -> Scene {
    let walls = [
        ([0.6, 0.1, 0.8], 2.2),
        ([-0.7, 0.05, 0.75], 2.4),
        ([0.1, 1.0, 0.3], 1.2),
        ([0.0, -1.0, 0.3], 1.3),
    ];
    let wall = |(n, d): ([f64; 3], f64)| (Vector3::from(n).normalize(), d);
    Scene::Room(walls.map(wall).to_vec())
}

/// A person: an upright cylinder without end, before the first camera.
struct Person {
    /// In the frame of the first camera, metres.
    centre: Vector3<f64>,
    radius_m: f64,
    velocity_m_s: Vector3<f64>,
}

impl Person {
    /// One that covers about this share of the view.
    fn covering(share: f64, velocity_m_s: Vector3<f64>) -> Self {
        let distance = 1.2;
        // half the covered angle, off the middle so that nothing is symmetric
        let half = (share * 160.0 / 290.0_f64).atan();
        Self {
            centre: Vector3::new(0.1 - 0.25 * (0.5 - share), 0.0, distance),
            radius_m: distance * half.sin(),
            velocity_m_s,
        }
    }

    /// Depth along `ray` from `origin`, both in the frame of the first camera; NaN where missed.
    fn range(&self, origin: &Vector3<f64>, ray: &Vector3<f64>, time_s: f64) -> f64 {
        let o = origin - self.centre - self.velocity_m_s * time_s;
        let (a, b) = (ray.x * ray.x + ray.z * ray.z, ray.x * o.x + ray.z * o.z);
        let c = o.x * o.x + o.z * o.z - self.radius_m.powi(2);
        let t = (-b - (b * b - a * c).sqrt()) / a;
        if t > 0.0 { t } else { f64::NAN }
    }

    /// The room with the person, from `pose` in the frame of the first camera.
    fn view(&self, pose: &Pose, time_s: f64) -> (DepthMap, f64) {
        let (camera, room) = (pinhole(), corner());
        let mut covered = 0.0;
        let plane = Plane::from_fn(camera.width(), camera.height(), |x, y| {
            let ray = camera.unproject(&Vector2::new(x as f64, y as f64)).unwrap();
            let turned = pose.rotation * ray;
            let wall = room.range(&pose.translation, &turned);
            let person = self.range(&pose.translation, &turned, time_s);
            covered += f64::from(person < wall);
            (person.min(wall) * ray.z) as f32
        });
        (DepthMap::new(plane), covered / 76_800.0)
    }
}

fn measure(person: &Person, motion: &Twist) -> (VelocityEstimate, f64) {
    let (a, share) = person.view(&Pose::identity(), 0.0);
    let (b, _) = person.view(&pose_from_twist(motion, DT_S), DT_S);
    let found = estimate_velocity(&pinhole(), &a, &b, DT_S, &Config::default()).unwrap();
    (found, share)
}

fn is_right(found: &VelocityEstimate, truth: &Twist) -> bool {
    found.twist.is_some_and(|twist| {
        (twist.linear_m_s - truth.linear_m_s).norm() < RIGHT_M_S
            && (twist.angular_rad_s - truth.angular_rad_s).norm() < RIGHT_RAD_S
    })
}

fn camera_motions() -> [Twist; 3] {
    [
        twist([0.0; 6]),
        twist([0.3, -0.4, 0.2, 0.25, -0.1, 0.3]),
        twist([0.0, 0.6, 0.0, -0.3, 0.0, 0.0]),
    ]
}

fn walks() -> [Vector3<f64>; 4] {
    [
        Vector3::new(0.8, 0.0, 0.0),
        Vector3::new(-0.6, 0.0, 0.4),
        Vector3::new(0.0, 0.0, -0.7),
        Vector3::new(0.3, 0.0, 0.9),
    ]
}

#[test]
fn estimate_with_a_person_in_a_part_of_the_view_is_right_and_reports_the_share() {
    let mut wrong = Vec::new();
    for share in [0.2, 0.25, 0.3] {
        for (k, walk) in walks().into_iter().enumerate() {
            for (m, motion) in camera_motions().into_iter().enumerate() {
                let (found, covered) = measure(&Person::covering(share, walk), &motion);
                let missed = found.twist.map(|t| (t.vector() - motion.vector()).norm());
                println!(
                    "{covered:.2} of the view, walk {k}, motion {m}: {}, off by {missed:.4?}, rejected {:.2}, \
                     divided {:.2}",
                    found.status, found.rejected_share, found.divided_share
                );
                // Not all of the person is at odds with the room in every walk: what moves along
                // itself is not. A domain on the border counts whole.
                let near = (covered - 0.15)..(covered + 0.15);
                // Weak is allowed: what the person hides may be the only thing that shows a direction.
                if !found.status.has_pose()
                    || !is_right(&found, &motion)
                    || !near.contains(&found.rejected_share)
                {
                    wrong.push((share, k, m));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Two images alone do not say which of two motions is the camera's: the estimate must say that it
/// does not know, and its covariance must reach to the truth.
#[test]
fn estimate_with_a_person_in_half_of_the_view_is_right_or_says_why_not() {
    /// Squared error over covariance, six degrees of freedom: one in a thousand.
    const FAR: f64 = 22.5;
    let (mut right, mut divided, mut all) = (0, 0, 0);
    let mut wrong = Vec::new();
    for share in [0.4, 0.45, 0.5, 0.55, 0.6] {
        for (k, walk) in walks().into_iter().enumerate() {
            for (m, motion) in camera_motions().into_iter().enumerate() {
                let (found, covered) = measure(&Person::covering(share, walk), &motion);
                let good = is_right(&found, &motion);
                let far = found
                    .twist
                    .zip(found.covariance)
                    .map(|(twist, covariance)| {
                        let error = twist.vector() - motion.vector();
                        error.dot(&(covariance.try_inverse().unwrap() * error))
                    });
                println!(
                    "{covered:.2} of the view, walk {k}, motion {m}: {}, right {good}, divided {:.2}, \
                     squared error over covariance {far:.1?}",
                    found.status, found.divided_share
                );
                right += usize::from(good);
                divided += usize::from(matches!(
                    found.status,
                    TrackStatus::Weak(Reason::Divided { .. })
                ));
                all += 1;
                if !good && (found.status == TrackStatus::Tracked || far.is_some_and(|f| f > FAR)) {
                    wrong.push((share, k, m));
                }
            }
        }
    }
    println!("{right} of {all} right, {divided} called divided");
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// The same, frame after frame: poses that are claimed are right.
#[test]
fn odometry_with_a_person_walking_through_is_right_or_says_why_not() {
    const FRAME_NS: i64 = 33_333_333;
    let motion = twist([0.1, -0.2, 0.1, 0.1, -0.05, 0.1]);
    for share in [0.15, 0.2, 0.3, 0.4, 0.5] {
        let mut person = Person::covering(share, Vector3::new(0.9, 0.0, 0.0));
        person.centre.x -= 0.8; // walks in from the left
        let mut odometry = DepthOdometry::new(&pinhole(), OdometryConfig::default()).unwrap();
        for i in 0..40 {
            let time_s = (i * FRAME_NS) as f64 * 1e-9;
            let pose = pose_from_twist(&motion, time_s);
            let (depth, covered) = person.view(&pose, time_s);
            let found = odometry.push(&depth, Stamp::from_ns(i * FRAME_NS)).unwrap();
            let (d, a) = found.world_from_camera.distance_and_angle(&pose);
            println!("{i}: {covered:.2}, {}, {d:.4} m {a:.4} rad", found.status);
            let claimed = matches!(found.status, TrackStatus::Tracked);
            assert!(!claimed || (d < 0.01 && a < 0.01), "{i}: {d} m {a} rad");
            assert!(found.status.has_pose(), "{i}: {}", found.status);
        }
    }
}

#[test]
fn odometry_before_a_wall_that_fills_the_view_is_weak() {
    let wall = Scene::wall(Vector3::new(0.1, 0.05, 1.0), 0.6);
    let mut odometry = DepthOdometry::new(&pinhole(), OdometryConfig::default()).unwrap();
    for i in 0..5 {
        let pose = pose_from_twist(&twist([0.1, 0.0, 0.0, 0.1, 0.0, 0.05]), f64::from(i) * DT_S);
        let stamp = Stamp::from_ns(i64::from(i) * 33_333_333);
        let found = odometry
            .push(&wall.depths(&pinhole(), &pose), stamp)
            .unwrap();
        assert!(
            i == 0 || matches!(found.status, TrackStatus::Weak(_)),
            "{}",
            found.status
        );
    }
}
