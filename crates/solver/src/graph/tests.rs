//! Pose graphs: Jacobians, known optima, robust switches, bad input.

use super::solve::GraphState;
use super::*;
use crate::generate::{Graph, GraphKind, GraphSettings, graph as generate};
use crate::minimise::System;
use crate::{Damping, Loss, Options};
use nalgebra::{Matrix6, SMatrix, SVector, UnitQuaternion, Vector3, Vector6};
use sphereflow_core::Pose;

// central differences with a step of 1e-6 of a cost of size 100
const STEP: f64 = 1e-6;
const RELATIVE: f64 = 1e-6;

fn tight() -> Options {
    Options {
        max_iterations: 100,
        function_tolerance: 1e-12,
        parameter_tolerance: 1e-12,
        ..Options::default()
    }
}

fn rmse(graph: &PoseGraph<Pose, 6>, truth: &[Pose]) -> f64 {
    let squares = graph.nodes().iter().zip(truth);
    let sum: f64 = squares
        .map(|(a, b)| (a.translation - b.translation).norm_squared())
        .sum();
    (sum / truth.len() as f64).sqrt()
}

/// A ring of three with every prior, away from its minimum.
pub(super) fn sample<G: Group<D>, const D: usize>() -> PoseGraph<G, D> {
    let tangent = |k: f64| SVector::<f64, D>::from_fn(|r, _| 0.4 * (k + 1.7 * r as f64).sin());
    let information = |k: f64| {
        let a = SMatrix::<f64, D, D>::from_fn(|r, c| (k + r as f64 * 1.3 + c as f64).sin());
        a * a.transpose() + SMatrix::identity()
    };
    let mut graph = PoseGraph::new();
    for k in 0..3 {
        graph.add_node(G::exp(&tangent(f64::from(k)))).unwrap();
    }
    for (k, ends) in [(0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
        let k = k as f64;
        let measured = G::exp(&tangent(5.0 + k));
        graph
            .add_edge(ends, measured, &information(k), EdgeKind::Loop)
            .unwrap();
    }
    graph
        .add_prior(1, G::exp(&tangent(9.0)), &information(4.0))
        .unwrap();
    let (down, seen) = (Vector3::new(0.0, 9.81, 0.0), Vector3::new(0.2, 1.0, 0.3));
    graph.add_gravity(0, &down, &seen, 0.1).unwrap();
    let known = UnitQuaternion::from_euler_angles(0.3, 0.2, 0.1);
    graph.add_yaw(2, &down, &known, 0.2).unwrap();
    graph
}

fn check_gradient<G: Group<D>, const D: usize>(switch: LoopSwitch) {
    let mut system = GraphState::new(sample::<G, D>(), &[]);
    system.switch = switch;
    system.linearise(Damping::Identity, 0.0);
    let analytic = system.gradient().to_vec();
    let scale = analytic.iter().fold(1.0, |most: f64, g| most.max(g.abs()));
    for node in 0..3 {
        for axis in 0..D {
            let here = system.graph.nodes()[node];
            let mut cost = |h: f64| {
                let d = SVector::from_fn(|k, _| if k == axis { h } else { 0.0 });
                system.graph.nodes[node] = here.compose(&G::exp(&d));
                let cost = system.cost().unwrap();
                system.graph.nodes[node] = here;
                cost
            };
            let numeric = (cost(STEP) - cost(-STEP)) / (2.0 * STEP);
            let error = (numeric - analytic[D * node + axis]).abs();
            assert!(error < RELATIVE * scale, "{node} {axis} {error:e}");
        }
    }
}

#[test]
fn gradient_equals_differences_for_poses_and_similarities() {
    for switch in [LoopSwitch::Off, LoopSwitch::Scaled { phi: 0.5 }] {
        check_gradient::<Pose, 6>(switch);
        check_gradient::<Similarity, 7>(switch);
    }
}

#[test]
fn graph_without_noise_finds_the_truth() {
    for kind in [GraphKind::Sphere, GraphKind::Torus, GraphKind::Grid] {
        let settings = GraphSettings::new(kind, 8, 20, 3);
        let Graph {
            mut graph, truth, ..
        } = generate(&GraphSettings {
            rotation_sigma: 1e-6,
            translation_sigma: 1e-6,
            ..settings
        })
        .unwrap();
        let summary = graph.solve(LoopSwitch::Off, &tight()).unwrap();
        assert!(summary.issues.is_empty());
        assert!(rmse(&graph, &truth) < 1e-4, "{kind:?}");
    }
}

#[test]
fn loops_correct_the_drift_of_odometry() {
    for kind in [GraphKind::Sphere, GraphKind::Torus, GraphKind::Grid] {
        let settings = GraphSettings::new(kind, 20, 20, 4);
        let Graph {
            mut graph, truth, ..
        } = generate(&settings).unwrap();
        let before = rmse(&graph, &truth);
        let summary = graph.solve(LoopSwitch::Off, &tight()).unwrap();
        let after = rmse(&graph, &truth);
        // the cost is half a chi-squared variable of 6 (edges - nodes + 1) degrees of freedom
        let freedom = 6.0 * (graph.edges().count() - graph.nodes().len() + 1) as f64;
        let normal = 2.0 * summary.summary.final_cost / freedom;
        println!("{kind:?} {before:.3} -> {after:.3} m, {normal:.3}");
        assert!(after < 0.7 * before && (normal - 1.0).abs() < 0.15);
    }
}

#[test]
fn wrong_loops_are_switched_off() {
    for kind in [GraphKind::Sphere, GraphKind::Torus, GraphKind::Grid] {
        let clean = GraphSettings::new(kind, 15, 20, 5);
        let dirty = GraphSettings {
            wrong_loops: 0.1,
            ..clean.clone()
        };
        let Graph {
            graph: mut reference,
            truth,
            ..
        } = generate(&clean).unwrap();
        reference.solve(LoopSwitch::Off, &tight()).unwrap();
        let Graph {
            graph: start,
            wrong,
            ..
        } = generate(&dirty).unwrap();
        let mut graph = start.clone();
        let switch = LoopSwitch::Graduated { threshold: 16.8 };
        let summary = graph.solve(switch, &tight()).unwrap();
        let (good, found) = (rmse(&reference, &truth), rmse(&graph, &truth));
        let rejected = &summary.robust.rejected;
        println!(
            "{kind:?} {good:.4} {found:.4} m, {} of {}",
            rejected.len(),
            wrong.len()
        );
        assert!(found < 1.2 * good);
        assert!(wrong.iter().all(|edge| rejected.contains(edge)));
        let mut believed = start;
        believed.solve(LoopSwitch::Off, &tight()).unwrap();
        assert!(rmse(&believed, &truth) > 5.0 * good);
    }
}

#[test]
fn similarity_graph_corrects_the_drift_of_scale() {
    // a ring of eight whose scale grows by 2 % from pose to pose, and one edge that closes it
    let mut graph = PoseGraph::<Similarity, 7>::new();
    let step = SVector::<f64, 7>::from_column_slice(&[
        0.0,
        std::f64::consts::TAU / 8.0,
        0.0,
        0.3,
        0.0,
        1.0,
        0.0,
    ]);
    let (exact, mut drifting) = (Similarity::exp(&step), Similarity::identity());
    for _ in 0..8 {
        graph.add_node(drifting).unwrap();
        drifting = drifting * Similarity::new(exact.pose, 1.02);
    }
    graph.fix_node(0).unwrap();
    let information = SMatrix::identity();
    for k in 0..8 {
        let kind = if k < 7 {
            EdgeKind::Odometry
        } else {
            EdgeKind::Loop
        };
        graph
            .add_edge((k, (k + 1) % 8), exact, &information, kind)
            .unwrap();
    }
    let summary = graph.solve(LoopSwitch::Off, &tight()).unwrap();
    assert!(summary.summary.final_cost < 1e-15);
    assert!(
        graph
            .nodes()
            .iter()
            .all(|node| (node.scale - 1.0).abs() < 1e-7)
    );
}

#[test]
fn result_does_not_depend_on_the_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let settings = GraphSettings::new(GraphKind::Torus, 40, 40, 6);
        let Graph { mut graph, .. } = generate(&settings).unwrap();
        let options = Options {
            max_iterations: 3,
            ..tight()
        };
        pool.install(|| graph.solve(LoopSwitch::Off, &options).unwrap());
        graph.nodes().to_vec()
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn bad_edges_are_errors_by_name_and_loose_parts_are_issues() {
    let mut graph = PoseGraph::<Pose, 6>::new();
    for k in 0..4 {
        graph
            .add_node(Pose::new(Default::default(), Vector3::x() * f64::from(k)))
            .unwrap();
    }
    let (identity, one) = (Pose::identity(), Matrix6::identity());
    let mut lopsided = one;
    lopsided[(0, 1)] = 0.3;
    let nan = Pose::new(Default::default(), Vector3::repeat(f64::NAN));
    let negative = Matrix6::from_diagonal(&Vector6::new(1.0, 1.0, -1.0, 1.0, 1.0, 1.0));
    let odometry = EdgeKind::Odometry;
    for (name, error) in [
        (
            "information",
            graph.add_edge((0, 1), identity, &negative, odometry).err(),
        ),
        (
            "information",
            graph.add_edge((0, 1), identity, &lopsided, odometry).err(),
        ),
        (
            "information",
            graph
                .add_edge((0, 1), identity, &(one * f64::NAN), odometry)
                .err(),
        ),
        (
            "measured",
            graph.add_edge((0, 1), nan, &one, odometry).err(),
        ),
        ("to", graph.add_edge((0, 4), identity, &one, odometry).err()),
        ("to", graph.add_edge((1, 1), identity, &one, odometry).err()),
        ("world_from_body", graph.add_node(nan).err()),
        (
            "axis",
            graph
                .add_yaw(0, &Vector3::zeros(), &Default::default(), 0.1)
                .err(),
        ),
        (
            "sigma_rad",
            graph
                .add_gravity(0, &Vector3::y(), &Vector3::y(), 0.0)
                .err(),
        ),
    ] {
        let text = error.map(|e| e.to_string()).unwrap_or_default();
        assert!(text.starts_with(name), "{name}: {text}");
    }
    graph.add_edge((0, 1), identity, &one, odometry).unwrap();
    graph.add_edge((2, 3), identity, &one, odometry).unwrap();
    graph.fix_node(1).unwrap();
    let summary = graph.solve(LoopSwitch::Off, &tight()).unwrap();
    let expected = [
        GraphIssue::Disconnected { parts: 2 },
        GraphIssue::Held { node: 2 },
    ];
    assert_eq!(summary.issues, expected);
    let centres = graph.nodes().iter().map(|node| node.translation.x);
    assert!(
        centres
            .zip([1.0, 1.0, 2.0, 2.0])
            .all(|(a, b)| (a - b).abs() < 1e-9)
    );
}

// rounding of an adjoint applied twice
const SAME_SQUARE: f64 = 1e-10;
/// Metres: edges are measured to 1 cm and 10 mrad, the wrong one is 0.5 m off.
const PULLED: f64 = 0.03;

#[test]
fn alignment_has_its_residual_and_information_in_the_frame_of_the_first_pose() {
    let mut graph = PoseGraph::<Pose, 6>::new();
    let twist = |k: f64| Vector6::from_fn(|r, _| 0.5 * (k + 1.3 * r as f64).sin());
    let nodes = [Pose::exp(&twist(1.0)), Pose::exp(&twist(2.0))];
    for node in nodes {
        graph.add_node(node).unwrap();
    }
    let measured = Pose::exp(&twist(3.0));
    let a = Matrix6::from_fn(|r, c| (2.0 + r as f64 * 1.3 + c as f64).sin());
    let information = a * a.transpose() + Matrix6::identity();
    graph
        .add_alignment((0, 1), measured, &information, Loss::Cauchy(2.5))
        .unwrap();
    let error = Group::log(&(nodes[0].inverse() * nodes[1] * measured.inverse()));
    let expected = 0.5
        * Loss::Cauchy(2.5)
            .evaluate(error.dot(&(information * error)))
            .0;
    let cost = GraphState::new(graph, &[0]).cost().unwrap();
    assert!(
        (cost / expected - 1.0).abs() < SAME_SQUARE,
        "{cost} {expected}"
    );
}

#[test]
fn wrong_alignment_under_cauchy_is_rejected_and_does_not_pull() {
    let ring =
        |k: usize| Pose::exp(&(Vector6::new(0.0, 0.5, 0.0, 0.0, 0.0, 0.5) * (k % 12) as f64));
    let mut graph = PoseGraph::<Pose, 6>::new();
    for k in 0..12 {
        graph.add_node(ring(k)).unwrap();
    }
    graph.fix_node(0).unwrap();
    let information = Matrix6::identity() * 1e4;
    for k in 0..24 {
        let (a, b) = (k % 12, (k + 1 + k / 12) % 12);
        let noise = Vector6::from_fn(|r, _| 0.01 * (7.0 * k as f64 + 2.0 * r as f64).sin());
        let wrong = if k == 15 {
            Vector6::repeat(0.3)
        } else {
            Vector6::zeros()
        };
        let measured = Pose::exp(&(noise + wrong)) * (ring(a).inverse() * ring(b));
        graph
            .add_alignment((a, b), measured, &information, Loss::Cauchy(2.5))
            .unwrap();
    }
    let truth: Vec<Pose> = (0..12).map(ring).collect();
    let summary = graph.solve(LoopSwitch::Off, &tight()).unwrap();
    assert!(summary.summary.stop.converged());
    assert_eq!(summary.robust.rejected, [15]);
    let error = rmse(&graph, &truth);
    assert!(error < PULLED, "{error}");
}
