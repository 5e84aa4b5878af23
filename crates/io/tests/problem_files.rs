//! Bundle adjustment and pose graph files: read, solved, written, read again; and broken ones.
#![allow(clippy::unwrap_used)] // tests stop where a file is not as it should be

use sphereflow_io::problems::{BundleFormat, read_bundle, read_g2o};
use sphereflow_solver::bundle::adjust;
use sphereflow_solver::graph::LoopSwitch;
use sphereflow_solver::{LinearSolver, Options};
use std::path::{Path, PathBuf};

fn data(name: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("SPHEREFLOW_DATA") else {
        println!("skipped: SPHEREFLOW_DATA is not set");
        return None;
    };
    Some(Path::new(&folder).join("ba-problems").join(name))
}

fn write(text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("problem");
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

fn tight() -> Options {
    Options {
        max_iterations: 200,
        function_tolerance: 1e-10,
        ..Options::default()
    }
}

#[test]
fn published_bundle_problems_are_read_solved_and_written() {
    // pixels: root mean square of the starts, as the reprojection of the files' own cameras
    for (name, format, counts, start_px) in [
        (
            "gtsam_dubrovnik-3-7-pre.txt",
            BundleFormat::Bal,
            (3, 7, 19),
            20.0,
        ),
        (
            "gtsam_Balbianello.out",
            BundleFormat::Bundler,
            (5, 544, 1433),
            5.0,
        ),
        (
            "libmv_problem_02.bin",
            BundleFormat::Libmv,
            (440, 0, 0),
            5.0,
        ),
    ] {
        let Some(path) = data(name) else { return };
        let mut file = read_bundle(&path).unwrap();
        assert_eq!(file.format, format);
        let found = (
            file.problem.poses(),
            file.problem.points(),
            file.problem.observations(),
        );
        println!("{name} {found:?}");
        assert_eq!(found.0, counts.0);
        let summary = adjust(&mut file.problem, LinearSolver::Auto, &tight()).unwrap();
        let rms = |cost: f64| (2.0 * cost / found.2 as f64).sqrt();
        let (start, end) = (rms(summary.initial_cost), rms(summary.final_cost));
        println!(
            "{start:.4} -> {end:.4} px, {} {}",
            summary.iterations.len(),
            summary.stop
        );
        println!("{:?}", summary.issues.iter().take(3).collect::<Vec<_>>());
        assert!(start < start_px && end < 1.0 && end < start, "{name}");
        let folder = tempfile::tempdir().unwrap();
        let copy = folder.path().join("copy");
        file.write(&copy).unwrap();
        let mut again = read_bundle(&copy).unwrap();
        let options = Options {
            max_iterations: 0,
            ..tight()
        };
        let summary = adjust(&mut again.problem, LinearSolver::Auto, &options).unwrap();
        // libmv's numbers have 32 bits
        let tolerance = if format == BundleFormat::Libmv {
            1e-2
        } else {
            1e-6
        };
        // the smallest has more unknowns than pixels, and ends at 0
        let difference = (rms(summary.initial_cost) - end).abs();
        assert!(
            difference < tolerance * end.max(1e-2),
            "{name}: {difference:e}"
        );
    }
}

#[test]
fn published_pose_graph_is_read_solved_and_written() {
    let Some(path) = data("parking-garage.g2o") else {
        return;
    };
    let mut file = read_g2o(&path).unwrap();
    assert_eq!(
        (file.graph.nodes().len(), file.graph.edges().count()),
        (1661, 6275)
    );
    let summary = file.graph.solve(LoopSwitch::Off, &tight()).unwrap();
    println!(
        "{:?} {}",
        summary.summary.iterations.last(),
        summary.summary.stop
    );
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("copy.g2o");
    file.write(&copy).unwrap();
    let mut again = read_g2o(&copy).unwrap();
    let options = Options {
        max_iterations: 0,
        ..tight()
    };
    let repeated = again
        .graph
        .solve(LoopSwitch::Off, &options)
        .unwrap()
        .summary;
    assert!((repeated.initial_cost / summary.summary.final_cost - 1.0).abs() < 1e-9);
}

#[test]
fn broken_files_are_errors_that_name_the_line() {
    for (text, needles) in [
        ("1 1 1\n0 0 1.0 x\n", &[":2:", "a measurement", "x"][..]),
        ("1 1 1\n0 3 1.0 2.0\n", &[":2:", "a point below 1"]),
        (
            "1 1 1\n0 0 1.0 2.0\n0 0 0 0 0 0 500 0\n",
            &["a camera", "end of the file"],
        ),
        (
            "1 1 1\n0 0 1 2\n0 0 0 0 0 0 -500 0 0\n0 0 1\n",
            &["a camera", "fx"],
        ),
        ("# Bundle file v0.3\n1 1\nnan 0 0\n", &[":3:", "finite"]),
        ("vQ", &["`P`"]),
        ("vPxx", &["end of the file"]),
    ] {
        let (_folder, path) = write(text);
        let error = read_bundle(&path).unwrap_err().to_string();
        assert!(
            needles.iter().all(|needle| error.contains(needle)),
            "{text:?}: {error}"
        );
    }
    let vertex = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n";
    let edge = "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 -1 0 0 1 0 1\n";
    for (text, needles) in [
        (
            format!("{vertex}VERTEX_SE2 1 0 0 0\n"),
            &[":2:", "VERTEX_SE2"][..],
        ),
        (format!("{vertex}{vertex}"), &[":2:", "once"]),
        (format!("{vertex}{edge}"), &[":2:", "the id of a vertex"]),
        (
            format!("{vertex}{}{edge}", vertex.replace("QUAT 0", "QUAT 1")),
            &[":3:", "information", "positive definite"],
        ),
    ] {
        let (_folder, path) = write(&text);
        let error = read_g2o(&path).unwrap_err().to_string();
        assert!(
            needles.iter().all(|needle| error.contains(needle)),
            "{text:?}: {error}"
        );
    }
}
