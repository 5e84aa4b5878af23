//! The observers of Chapter 3: their theorems on exact inputs, and the sequence of Chapter 4.

#![allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to

mod scene;

use nalgebra::Vector3;
use scene::{Sequence, error_percent, quantile};
use sphereflow_core::{Plane, Twist};
use sphereflow_depth::{
    DepthObserver, DepthReason, DepthStatus, FlowObserver, ObserverConfig, PixelRays,
};
use sphereflow_flow::FlowField;
use sphereflow_sim::{Motion, Scene, SimConfig};
use sphereflow_sphere::Camera;

/// The exact inverse range at the middle of a step.
fn exact_inverse(sequence: &Sequence, step: usize) -> Plane<f32> {
    let pose = sequence.motion.pose((step as f64 + 0.5) * sequence.dt_s());
    sequence
        .renderer
        .render(&pose)
        .range
        .metres()
        .map(|d| 1.0 / d)
}

/// The exact flow at the middle of a step, pixels in a step.
fn exact_flow(sequence: &Sequence, rays: &PixelRays, step: usize) -> (FlowField, Twist) {
    let twist = sequence.twist(step as f64 + 0.5);
    let inverse = exact_inverse(sequence, step);
    let (omega, v) = (twist.angular_rad_s.cast(), twist.linear_m_s.cast());
    let (width, height) = rays.size();
    let dt = sequence.dt_s() as f32;
    let part = |k: usize| {
        Plane::from_fn(width, height, |x, y| {
            let i = y * width + x;
            let motion = rays.motion(i, &omega, &v);
            dt * (motion.rotation[k] + inverse.data()[i] * motion.translation[k])
        })
    };
    (
        FlowField {
            u: part(0),
            v: part(1),
        },
        twist,
    )
}

/// Which observer, and its gain.
#[derive(Clone, Copy)]
enum Kind {
    Flow(f64),
    Depth(f64),
}

/// |measured / predicted - 1| of the error's decay over 40 steps in the pixels that stay in view, and
/// the largest errors at the start and after each step.
fn decay(sequence: &Sequence, kind: Kind) -> (Vec<f64>, Vec<f64>) {
    const STEPS: usize = 40;
    let camera = sequence.camera().clone();
    let rays = PixelRays::new(&camera).unwrap();
    let config = |gain| ObserverConfig {
        gain,
        ..ObserverConfig::flow()
    };
    let gain = match kind {
        Kind::Flow(gain) | Kind::Depth(gain) => gain,
    };
    let mut flow_observer = FlowObserver::new(&rays, config(gain)).unwrap();
    let mut depth_observer = DepthObserver::new(&rays, config(gain)).unwrap();
    let start = sequence.frame(0);
    let mut largest = Vec::new();
    for step in 0..STEPS {
        let (flow, twist) = exact_flow(sequence, &rays, step);
        let range = match kind {
            Kind::Flow(_) => {
                flow_observer.step(&flow, &twist, sequence.dt_s()).unwrap();
                flow_observer.range()
            }
            Kind::Depth(_) => {
                let inverse = exact_inverse(sequence, step);
                depth_observer
                    .step(&inverse, &twist, sequence.dt_s())
                    .unwrap();
                depth_observer.range()
            }
        };
        let truth = sequence.frame(step + 1).range;
        let errors = range.data().iter().zip(truth.data());
        largest.push(
            errors
                .map(|(a, b)| f64::from((a - b).abs()))
                .fold(0.0, f64::max),
        );
    }
    let range = match kind {
        Kind::Flow(_) => flow_observer.range(),
        Kind::Depth(_) => depth_observer.range(),
    };
    let end = sequence.frame(STEPS);
    let (width, height) = rays.size();
    let mut ratios = Vec::new();
    for y in (2..height - 2).step_by(3) {
        for x in (2..width - 2).step_by(3) {
            let point = end.pose.transform(
                &(rays.rays()[y * width + x].cast::<f64>() * f64::from(end.range[(x, y)])),
            );
            let Some(exponent) = exponent(sequence, &camera, &point, kind, STEPS) else {
                continue;
            };
            let back = start.pose.inverse().transform(&point);
            let error0 = config(gain).initial_range_m - back.norm();
            let error1 = f64::from(range[(x, y)] - end.range[(x, y)]);
            ratios.push((error1 / (error0 * (-exponent).exp()) - 1.0).abs());
        }
    }
    (ratios, largest)
}

/// Integral of the decay rate along the way of a point of the world; `None` where it leaves the view.
fn exponent(
    sequence: &Sequence,
    camera: &Camera,
    point: &Vector3<f64>,
    kind: Kind,
    steps: usize,
) -> Option<f64> {
    let mut sum = 0.0;
    for step in 0..steps {
        let state = sequence.motion.state((step as f64 + 0.5) * sequence.dt_s());
        let own = state.world_from_camera.inverse().transform(point);
        if !camera.contains(&camera.project(&own)?) {
            return None;
        }
        let (range, v) = (own.norm(), state.twist.linear_m_s);
        let g2 = v.norm_squared() - (v.dot(&own) / range).powi(2);
        sum += sequence.dt_s()
            * match kind {
                Kind::Flow(gain) => gain * g2 / range,
                Kind::Depth(gain) => gain / range,
            };
    }
    Some(sum)
}

/// Largest allowed growth of the largest error in a step: bilinear reading across the room's edges, metres.
const ROUNDING_M: f64 = 2e-3;

fn check(name: &str, (ratios, largest): (Vec<f64>, Vec<f64>)) {
    let (median, p95) = (quantile(&ratios, 0.5), quantile(&ratios, 0.95));
    println!(
        "{name}: median {:.2} %, p95 {:.2} %, {} points",
        100.0 * median,
        100.0 * p95,
        ratios.len()
    );
    assert!(ratios.len() > 1000);
    assert!(median < 0.01 && p95 < 0.03, "{name}: {median} {p95}");
    for pair in largest.windows(2) {
        assert!(
            pair[1] <= pair[0] + ROUNDING_M,
            "{name}: the largest error grows: {pair:?}"
        );
    }
}

#[test]
fn flow_observer_on_exact_flow_decays_at_the_rate_of_theorem_1() {
    // Thesis: Theorem 1, eq. (3.3), (3.4), (3.5), (3.6).
    check(
        "flow",
        decay(&Sequence::room(320, 240, 0.0), Kind::Flow(20.0)),
    );
}

#[test]
fn depth_observer_on_exact_depth_decays_at_the_rate_of_theorem_2() {
    // Thesis: Theorem 2, eq. (3.7), (3.8).
    check(
        "depth",
        decay(&Sequence::room(320, 240, 0.0), Kind::Depth(2.0)),
    );
}

#[test]
fn flow_observer_with_exact_flow_and_the_gain_of_the_thesis_settles_and_stays() {
    // Thesis: section 4.1.2, eq. (4.1): k = 500 s/m, from D = 1 m; below 0.3 % after 2 s.
    let sequence = Sequence::room(160, 120, 0.0);
    let rays = PixelRays::new(sequence.camera()).unwrap();
    let mut observer = FlowObserver::new(&rays, ObserverConfig::flow()).unwrap();
    let mut worst = 0.0_f64;
    for step in 0..180 {
        let (flow, twist) = exact_flow(&sequence, &rays, step);
        observer.step(&flow, &twist, sequence.dt_s()).unwrap();
        if step >= 120 && step % 10 == 0 {
            let truth = sequence.frame(step + 1).range;
            worst = worst.max(error_percent(observer.range(), &truth, sequence.camera()));
        }
    }
    println!("worst after 2 s: {worst:.3} %");
    assert!(worst < 0.6, "{worst}"); // twice the figure of 640x480: the corner is a quarter as sharp
}

#[test]
fn observers_on_the_whole_sphere_settle_on_a_closed_smooth_surface() {
    // Thesis: Theorem 1, Theorem 2 with its H1: closed, smooth, seen all around.
    let camera = Camera::equirectangular(192, 96).unwrap();
    let scene = Scene::ellipsoid(1.5, 2.25, 2.0).unwrap();
    let sequence = Sequence::new(scene, &camera, Motion::sinusoids_411(), 0.0);
    let rays = PixelRays::new(&camera).unwrap();
    let mut by_flow = FlowObserver::new(&rays, ObserverConfig::flow()).unwrap();
    let mut by_depth = DepthObserver::new(&rays, ObserverConfig::depth()).unwrap();
    for step in 0..60 {
        let (flow, twist) = exact_flow(&sequence, &rays, step);
        by_flow.step(&flow, &twist, sequence.dt_s()).unwrap();
        by_depth
            .step(&exact_inverse(&sequence, step), &twist, sequence.dt_s())
            .unwrap();
    }
    let truth = sequence.frame(60).range;
    let flow = error_percent(by_flow.range(), &truth, &camera);
    let depth = error_percent(by_depth.range(), &truth, &camera);
    println!("whole sphere: flow {flow:.3} %, depth {depth:.3} %");
    assert!(flow < 1.5 && depth < 0.5, "{flow} {depth}");
}

#[test]
fn observers_without_motion_keep_their_state_and_say_so() {
    // Thesis: Remark 1: without excitation nothing converges.
    let rays = PixelRays::new(&SimConfig::thesis_camera(32, 24).unwrap()).unwrap();
    let mut observer = FlowObserver::new(&rays, ObserverConfig::flow()).unwrap();
    let still = observer
        .step(&FlowField::zero(32, 24), &Twist::default(), 0.02)
        .unwrap();
    assert!(matches!(
        still,
        DepthStatus::Unobservable(DepthReason::NoMotion { .. })
    ));
    let turning = Twist {
        angular_rad_s: [0.0, 0.3, 0.0].into(),
        ..Twist::default()
    };
    let turned = observer
        .step(&FlowField::zero(32, 24), &turning, 0.02)
        .unwrap();
    assert!(matches!(
        turned,
        DepthStatus::Unobservable(DepthReason::PureRotation { .. })
    ));
    assert!(observer.range().data().iter().all(|d| *d == 1.0));
}

#[test]
fn observer_of_flow_with_the_wrong_sign_refuses_it_and_stays_positive() {
    let rays = PixelRays::new(&SimConfig::thesis_camera(32, 24).unwrap()).unwrap();
    let mut observer = FlowObserver::new(&rays, ObserverConfig::flow()).unwrap();
    let twist = Twist {
        linear_m_s: [0.5, 0.0, 0.0].into(),
        ..Twist::default()
    };
    // Moving right, the image moves left; here it moves right, and is unknown in one pixel.
    let mut flow = FlowField::zero(32, 24);
    flow.u = Plane::filled(32, 24, 0.3);
    flow.u[(5, 5)] = f32::NAN;
    for _ in 0..50 {
        observer.step(&flow, &twist, 0.02).unwrap();
    }
    assert!(
        observer
            .range()
            .data()
            .iter()
            .all(|d| d.is_finite() && *d > 0.0)
    );
}

#[test]
fn observer_of_bad_input_names_the_argument_and_keeps_its_state() {
    let rays = PixelRays::new(&SimConfig::thesis_camera(32, 24).unwrap()).unwrap();
    let mut observer = FlowObserver::new(&rays, ObserverConfig::flow()).unwrap();
    let (flow, twist) = (FlowField::zero(32, 24), Twist::default());
    let nan = Twist {
        linear_m_s: [f64::NAN; 3].into(),
        ..twist
    };
    for (error, name) in [
        (observer.step(&FlowField::zero(31, 24), &twist, 0.1), "flow"),
        (observer.step(&flow, &nan, 0.1), "twist"),
        (observer.step(&flow, &twist, 0.0), "dt_s"),
    ] {
        assert!(error.unwrap_err().to_string().contains(name));
    }
    let bad = ObserverConfig {
        gain: -1.0,
        ..ObserverConfig::flow()
    };
    assert!(
        FlowObserver::new(&rays, bad)
            .unwrap_err()
            .to_string()
            .contains("gain")
    );
    assert!(observer.set_range(&Plane::filled(32, 24, -1.0)).is_err());
    assert!(observer.range().data().iter().all(|d| *d == 1.0));
}
