//! The transport equations of the sphere, on exact simulated fields.
#![allow(clippy::unwrap_used)] // helpers of tests fail as tests do

use nalgebra::{Vector2, Vector3};
use sphereflow_sim::{Motion, Scene};

/// Step in time (s) and in direction (rad, or units of z): with sixth-order differences the
/// truncation of fields that vary over 0.05 rad and the rounding 1e-15 / h are both below 1e-9.
const STEP: f64 = 1e-3;
/// Largest residual over the largest derivative: the acceptance figure of the exact fields.
const TOLERANCE: f64 = 1e-7;
/// What a wrong equation must exceed.
const CLEARLY_WRONG: f64 = 1e-2;
/// Half of the field of view of section 4.1.1: 50 x 40 degrees.
const HALF_VIEW: [f64; 2] = [25.0, 20.0];
const INSTANTS: [f64; 4] = [0.31, 1.27, 2.05, 3.6];

/// Brightness and range of a direction of the camera frame at a time.
struct World {
    scene: Scene,
    motion: Motion,
}

/// A field value with its face, so that stencils across creases are recognised.
struct Seen {
    y: f64,
    range: f64,
    face: (usize, usize),
}

impl World {
    fn new(scene: Scene) -> Self {
        let motion = Motion::sinusoids_411();
        Self { scene, motion }
    }

    fn see(&self, t: f64, direction: &Vector3<f64>) -> Seen {
        let pose = self.motion.pose(t);
        let ray = pose.rotation * direction;
        let hit = self.scene.intersect(&pose.translation, &ray).unwrap();
        Seen {
            y: hit.grey,
            range: hit.range_m,
            face: (hit.primitive, hit.face),
        }
    }

    /// Sixth-order central difference of `[y, D]` along `path` at 0; `None` where a crease lies
    /// within the stencil.
    fn derivative(&self, path: impl Fn(f64) -> (f64, Vector3<f64>)) -> Option<Vector2<f64>> {
        let at = |k: f64| {
            let (t, direction) = path(k * STEP);
            self.see(t, &direction)
        };
        let face = at(0.0).face;
        let mut sum = Vector2::zeros();
        for (k, weight) in [(1.0, 45.0), (2.0, -9.0), (3.0, 1.0)] {
            let (after, before) = (at(k), at(-k));
            if after.face != face || before.face != face {
                return None;
            }
            sum += weight * Vector2::new(after.y - before.y, after.range - before.range);
        }
        Some(sum / (60.0 * STEP))
    }
}

/// Largest residual and largest derivative of y and of D.
#[derive(Default)]
struct Worst {
    residual: [f64; 2],
    derivative: [f64; 2],
    points: usize,
}

impl Worst {
    fn add(&mut self, found: Vector2<f64>, expected: Vector2<f64>) {
        self.points += 1;
        for i in 0..2 {
            self.residual[i] = self.residual[i].max((found[i] - expected[i]).abs());
            self.derivative[i] = self.derivative[i].max(found[i].abs());
        }
    }

    fn relative(&self) -> [f64; 2] {
        [0, 1].map(|i| self.residual[i] / self.derivative[i])
    }
}

fn scenes() -> [(&'static str, World); 2] {
    [
        ("room", World::new(Scene::thesis_room())),
        ("ellipsoid", World::new(Scene::thesis_ellipsoid())),
    ]
}

/// Directions spread evenly over the whole sphere (golden-angle spiral).
fn whole_sphere(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let flat = (1.0 - z * z).sqrt();
        Vector3::new(flat * cos, flat * sin, z)
    })
}

/// Residuals of (1.16) and (1.17) over the whole sphere; `turn` scales omega, -1 for the wrong
/// sign; `in_world` takes v in the world frame, which is wrong too.
fn sphere_residuals(world: &World, turn: f64, in_world: bool) -> Worst {
    let mut worst = Worst::default();
    for t in INSTANTS {
        let state = world.motion.state(t);
        let omega = turn * state.twist.angular_rad_s;
        let mut v = state.twist.linear_m_s;
        if in_world {
            v = state.world_from_camera.rotation * v;
        }
        for eta in whole_sphere(2000) {
            let u = eta.cross(&Vector3::new(0.3, 1.0, 0.2)).normalize();
            let w = eta.cross(&u);
            let along =
                |d: Vector3<f64>| world.derivative(move |s| (t, eta * s.cos() + d * s.sin()));
            let in_time = world.derivative(|s| (t + s, eta));
            let (Some(du), Some(dw), Some(dt)) = (along(u), along(w), in_time) else {
                continue;
            };
            let range = world.see(t, &eta).range;
            // Thesis: eq. (1.16), eq. (1.17).
            let flow = eta.cross(&(omega + eta.cross(&v) / range));
            let transport = -(du * u.dot(&flow) + dw * w.dot(&flow));
            worst.add(dt, transport - Vector2::new(0.0, v.dot(&eta)));
        }
    }
    worst
}

#[test]
fn transport_on_the_sphere_holds_for_exact_fields() {
    // Thesis: eq. (1.16), eq. (1.17).
    for (name, world) in scenes() {
        let worst = sphere_residuals(&world, 1.0, false);
        println!(
            "{name}: {} points, residuals of y, D {:?}",
            worst.points,
            worst.relative()
        );
        assert!(worst.points > 6000, "{name}: {}", worst.points);
        assert!(
            worst.relative().iter().all(|r| *r < TOLERANCE),
            "{name}: {:?}",
            worst.relative()
        );
    }
}

#[test]
fn transport_with_wrong_sign_or_frame_of_velocity_fails() {
    // Thesis: eq. (1.16), eq. (1.17): omega and v are those of the camera, in its own frame.
    for (name, world) in scenes() {
        for (turn, in_world) in [(-1.0, false), (1.0, true)] {
            let relative = sphere_residuals(&world, turn, in_world).relative();
            println!("{name}: omega times {turn}, v in the world {in_world}: {relative:?}");
            assert!(
                relative.iter().all(|r| *r > CLEARLY_WRONG),
                "{name}: {relative:?}"
            );
        }
    }
}

/// Residuals of (1.22) and (1.23) over the field of view; `printed` leaves out the division of the
/// last term by n.
fn pinhole_residuals(world: &World, printed: bool) -> Worst {
    let mut worst = Worst::default();
    let limits = HALF_VIEW.map(|degrees| degrees.to_radians().tan());
    for t in INSTANTS {
        let twist = world.motion.state(t).twist;
        let (o, v) = (twist.angular_rad_s, twist.linear_m_s);
        for k in 0..4096 {
            let share = |i: i32| (f64::from(i) + 0.37) / 32.0 - 1.0;
            let (z1, z2) = (share(k % 64) * limits[0], share(k / 64) * limits[1]);
            let ray = |a: f64, b: f64| Vector3::new(z1 + a, z2 + b, 1.0);
            let d1 = world.derivative(|s| (t, ray(s, 0.0)));
            let d2 = world.derivative(|s| (t, ray(0.0, s)));
            let dt = world.derivative(|s| (t + s, ray(0.0, 0.0)));
            let (Some(d1), Some(d2), Some(dt)) = (d1, d2, dt) else {
                continue;
            };
            let range = world.see(t, &ray(0.0, 0.0)).range;
            // Thesis: eq. (1.22), eq. (1.23), the latter corrected: v.eta has eta of unit norm, so
            // the last term is divided by n.
            let n = (1.0 + z1 * z1 + z2 * z2).sqrt();
            let flow1 =
                z1 * z2 * o.x - (1.0 + z1 * z1) * o.y + z2 * o.z + n / range * (-v.x + z1 * v.z);
            let flow2 =
                (1.0 + z2 * z2) * o.x - z1 * z2 * o.y - z1 * o.z + n / range * (-v.y + z2 * v.z);
            let approach = (z1 * v.x + z2 * v.y + v.z) / if printed { 1.0 } else { n };
            worst.add(dt, -(d1 * flow1 + d2 * flow2) - Vector2::new(0.0, approach));
        }
    }
    worst
}

#[test]
fn transport_in_pinhole_coordinates_holds_with_the_corrected_last_term() {
    // Thesis: eq. (1.22), eq. (1.23) corrected.
    for (name, world) in scenes() {
        let worst = pinhole_residuals(&world, false);
        println!(
            "{name}: {} points, residuals of y, D {:?}",
            worst.points,
            worst.relative()
        );
        assert!(worst.points > 12_000, "{name}: {}", worst.points);
        assert!(
            worst.relative().iter().all(|r| *r < TOLERANCE),
            "{name}: {:?}",
            worst.relative()
        );
    }
}

#[test]
fn transport_in_pinhole_coordinates_as_printed_fails_for_range() {
    // Thesis: eq. (1.23) as printed lacks the division by n; (1.22) is right as printed.
    for (name, world) in scenes() {
        let [y, range] = pinhole_residuals(&world, true).relative();
        println!("{name}: as printed, residuals of y, D {y:.1e} {range:.1e}");
        assert!(y < TOLERANCE, "{name}: {y}");
        assert!(range > CLEARLY_WRONG, "{name}: {range}");
    }
}
