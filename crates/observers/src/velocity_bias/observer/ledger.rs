//! The books of the Lyapunov function: what a discrete step adds to it and takes away.
//!
//! Let `e = X^ - X` be the error of the fields, `T` the transport along the estimated flow, and `r`
//! what the transport of the true field misses the next one by. A step is
//! `(1 + s) e+ = T e + r + dt S . db` with `s = k dt`, and the biases go by `db = -dt K g` with
//! `g = int e+ S`. Hence, with nothing left out,
//!
//! `V+ - V = (|T e|^2 - |e|^2) / 2 - s |e+|^2 - |T e - e+|^2 / 2
//!          + (<e+, r> - dt g . b~) - db . K^-1 db / 2`
//!
//! The first term is the flow's divergence (Proposition 1's L/2) and what comes in over the border, the
//! next two are the correction, the last the implicit step of the biases; these never add. The fourth
//! vanishes for exact sensitivities, for which `r = dt S . b~`: what is left of it is the defect of
//! transport and gradients between pixels. In a smooth scene it is small, and V falls on every step;
//! where walls meet it does not vanish at any step, but with the size of the pixels.

use super::*;
use crate::velocity_bias::config::FixedGains;
use crate::velocity_bias::tests::{Simulation, true_bias};
use sphereflow_sim::Scene;
use sphereflow_sim::scene::{Ellipsoid, Primitive, Texture};
use sphereflow_sphere::Camera;

/// The terms of a step, and the function after it.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    value: f64,
    change: f64,
    transport: f64,
    correction: f64,
    defect: f64,
    biases: f64,
}

impl Entry {
    fn sum(&self) -> f64 {
        self.transport + self.correction + self.defect + self.biases
    }
}

/// Inner product over the image.
fn dot(grid: &SphereGrid, a: &Plane<f32>, b: &Plane<f32>) -> f64 {
    let products = a.data().iter().zip(b.data());
    products
        .zip(grid.solid_angle())
        .map(|((a, b), area)| f64::from(*a) * f64::from(*b) * area)
        .filter(|p| p.is_finite())
        .sum()
}

fn difference(a: &Plane<f32>, b: &Plane<f32>) -> Plane<f32> {
    Plane::from_fn(a.width(), a.height(), |x, y| a[(x, y)] - b[(x, y)])
}

/// One step of the observer with its books.
fn entry(
    observer: &mut FieldObserver,
    images: Images,
    velocity: &ImageVelocity,
    dt_s: f64,
    truth: &Vector6<f64>,
) -> Option<Entry> {
    let measured = observer.windowed(&images);
    let Some((fields, before)) = observer.fields.clone() else {
        observer.step(images, velocity, 3.0, dt_s).unwrap();
        return None;
    };
    let (was, bias) = (observer.lyapunov(truth).unwrap(), observer.bias);
    let truth_before = observer.windowed(&before);
    let flow = observer.flow(&before, &images, velocity, dt_s);
    let sources = [mean(&before.grey, &images.grey), flow.range.clone()];
    let carried = |field: &Plane<f32>, i: usize| {
        flow.transport(field, &sources[i], i == 1, &measured[i], 0.0)
    };
    let parts: Vec<[Plane<f32>; 3]> = (0..2)
        .map(|i| {
            let exact = carried(&truth_before[i], i);
            [
                difference(&fields[i], &truth_before[i]),
                difference(&carried(&fields[i], i), &exact),
                difference(&exact, &measured[i]),
            ]
        })
        .collect();
    observer.step(images, velocity, 3.0, dt_s).unwrap();
    let (grid, s) = (&observer.grid, observer.k_field * dt_s);
    let after = &observer.fields.as_ref()?.0;
    let mut entry = Entry {
        value: observer.lyapunov(truth).unwrap(),
        ..Entry::default()
    };
    entry.change = entry.value - was;
    for (i, [error, moved, missed]) in parts.iter().enumerate() {
        let lambda = observer.lambda[i];
        let now = difference(&after[i], &measured[i]);
        let square = |p: &Plane<f32>| dot(grid, p, p);
        entry.transport += 0.5 * lambda * (square(moved) - square(error));
        entry.correction -= lambda * (s * square(&now) + 0.5 * square(&difference(moved, &now)));
        entry.defect += lambda * dot(grid, &now, missed);
    }
    let Gains::Fixed(k_omega, k_v) = observer.gains else {
        return None;
    };
    let k = Vector6::new(k_omega, k_omega, k_omega, k_v, k_v, k_v);
    let step = observer.bias - bias;
    let scaled = step.component_div(&k);
    entry.defect += scaled.dot(&(bias - truth));
    entry.biases = -0.5 * scaled.dot(&step);
    Some(entry)
}

/// A run without noise.
struct Run {
    camera: Camera,
    scene: Scene,
    gains: FixedGains,
    rate_hz: f64,
    seconds: f64,
    turns_only: bool,
}

impl Run {
    /// The books of all its steps but the first.
    fn books(&self) -> Vec<Entry> {
        let mut simulation = Simulation::exact(&self.camera, &self.scene, self.rate_hz);
        let mut truth = true_bias();
        if self.turns_only {
            simulation.turn_only();
            truth.fixed_rows_mut::<3>(3).fill(0.0);
        }
        let grid = SphereGrid::new(&self.camera).unwrap();
        let window = Window::new(&grid, 0.15).unwrap();
        let g = &self.gains;
        let (fixed, lambda) = (Gains::Fixed(g.k_omega, g.k_v), [g.lambda_y, g.lambda_d]);
        let mut observer = FieldObserver::new(grid, window, fixed, g.k_field, lambda);
        let step = |_| {
            let (grey, range, mut velocity, dt_s) = simulation.next();
            if self.turns_only {
                velocity.linear_m_s = None;
            }
            let range = range.into_plane();
            let images = Images { grey, range };
            entry(&mut observer, images, &velocity, dt_s, &truth)
        };
        let frames = (self.seconds * self.rate_hz) as usize;
        (0..frames).filter_map(step).skip(1).collect()
    }
}

fn smooth() -> Scene {
    let semi_axes_m = Vector3::new(1.5, 2.25, 2.0);
    let shape = Ellipsoid {
        centre: Vector3::zeros(),
        semi_axes_m,
    };
    let texture = Texture::SolidSinusoid { period_m: 2.0 };
    Scene::new(vec![Primitive::new(shape, texture)]).unwrap()
}

fn room() -> Scene {
    Scene::thesis_room_with(2.0).unwrap()
}

/// 50 x 40 degrees, 40 x 30 pixels `n` times.
fn pinhole(n: usize) -> Camera {
    crate::velocity_bias::tests::camera(40 * n, 30 * n)
}

fn whole(n: usize) -> Camera {
    Camera::equirectangular(32 * n, 16 * n).unwrap()
}

/// The three observers on cameras of two sizes: name, with linear velocity or not, cameras.
fn observers(sizes: [usize; 2], whole_sizes: [usize; 2]) -> [(&'static str, bool, [Camera; 2]); 3] {
    [
        ("(5.33)", false, sizes.map(pinhole)),
        ("(5.34)", true, sizes.map(pinhole)),
        ("(5.16)", false, whole_sizes.map(whole)),
    ]
}

fn run(camera: Camera, scene: Scene, turns_only: bool, seconds: f64) -> Run {
    // On a camera that only turns the printed k_omega takes minutes.
    let k_omega = if turns_only { 1e-4 } else { 1e-5 };
    let gains = FixedGains {
        k_omega,
        ..FixedGains::default()
    };
    let rate_hz = 42.0;
    Run {
        camera,
        scene,
        gains,
        rate_hz,
        seconds,
        turns_only,
    }
}

#[test]
fn lyapunov_function_in_a_smooth_scene_falls_on_every_step() {
    // Thesis: eq. (5.16). Thesis: eq. (5.17). Thesis: eq. (5.33). Thesis: eq. (5.34).
    // Thesis: Proposition 1.
    for (name, turns_only, [_, camera]) in observers([2, 4], [4, 8]) {
        let books = run(camera, smooth(), turns_only, 4.0).books();
        let (first, last) = (books[0].value, books[books.len() - 1].value);
        let rises = books.iter().filter(|e| e.change >= 0.0).count();
        println!(
            "{name}, smooth scene: V {first:.3} -> {last:.3}, {rises} of {} steps rose",
            books.len()
        );
        assert_eq!(rises, 0, "{name}");
        assert!(last < 0.5 * first, "{name}: {first} -> {last}");
    }
}

#[test]
fn lyapunov_function_where_walls_meet_rises_by_the_defect_alone_which_shrinks_with_the_pixels() {
    // Thesis: eq. (5.16). Thesis: eq. (5.17). Thesis: eq. (5.33). Thesis: eq. (5.34).
    for (name, turns_only, cameras) in observers([2, 4], [2, 4]) {
        let risen = cameras.map(|camera| {
            let books = run(camera, room(), turns_only, 4.0).books();
            for entry in &books {
                // Fields are of single precision.
                let off = (entry.change - entry.sum()).abs();
                assert!(off < 1e-6 * books[0].value, "{name}: {entry:?}");
                assert!(entry.sum() < entry.defect, "{name}: {entry:?}");
            }
            let up = |e: &Entry| e.change.max(0.0);
            println!(
                "{name}, room: {} of {} steps rose, by {:.3} in all, all of it defect",
                books.iter().filter(|e| e.change > 0.0).count(),
                books.len(),
                books.iter().map(up).sum::<f64>()
            );
            books.iter().map(up).sum::<f64>()
        });
        // Of second order, but for where a wall's edge lies between the pixels.
        assert!(risen[1] < 0.5 * risen[0], "{name}: {risen:?}");
    }
}
