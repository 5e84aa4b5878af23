"""The solver from Python and from the command line."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import sphereflow as sf
from sphereflow.cli.app import app
from sphereflow.solver import BundleProblem, PoseGraph, SimilarityGraph
from typer.testing import CliRunner

BAL = """2 4 8
0 0 10 20
1 0 -10 21
0 1 -30 20
1 1 -52 19
0 2 12 -40
1 2 -9 -41
0 3 55 33
1 3 33 31
0
0
0
0
0
0
500
0
0
0
0
0
-0.2
0
0
500
0
0
0.1 0.2 -5
-0.3 0.2 -5.2
0.1 -0.4 -4.8
0.5 0.3 -5
"""


def ba_problems() -> Path:
    folder = os.environ.get("SPHEREFLOW_DATA")
    if folder is None:
        pytest.skip("SPHEREFLOW_DATA is not set")
    return Path(folder) / "ba-problems"


def test_problem_from_arrays_finds_truth() -> None:
    camera = sf.Camera.pinhole(300, 300, 160, 120, 320, 240)
    problem = BundleProblem()
    problem.add_camera(camera)
    poses = [np.eye(4) for _ in range(3)]
    for k, pose in enumerate(poses):
        pose[0, 3] = 0.3 * k
    rng = np.random.default_rng(1)
    points = rng.uniform([-1, -1, 3], [1, 1, 5], (30, 3))
    for k, pose in enumerate(poses):
        start = pose.copy()
        start[1, 3] += 0.02 if k == 2 else 0.0
        problem.add_pose(start, fixed=k < 2)
        seen = points - pose[:3, 3]
        pixel = 300 * seen[:, :2] / seen[:, 2:] + [160, 120]
        if k == 0:
            assert problem.add_points(points + rng.normal(0, 0.02, points.shape)) == 0
        problem.add_pixels(np.full(30, k), np.arange(30), pixel, sigma_px=0.5)
    result = problem.solve(max_iterations=30, function_tolerance=1e-12)
    assert result.converged, result
    assert result.final_cost < 1e-9
    assert np.allclose(problem.poses, poses, atol=1e-6)
    assert np.allclose(problem.points_m, points, atol=1e-5)
    covariance = problem.covariance([2])
    assert covariance.shape == (6, 6)
    assert np.all(np.linalg.eigvalsh(covariance) > 0)


def test_problem_with_bad_arguments_names_them() -> None:
    problem = BundleProblem()
    with pytest.raises(sf.ValueRangeError, match="camera"):
        problem.add_pose(np.eye(4))
    problem.add_camera(sf.Camera.pinhole(300, 300, 160, 120, 320, 240))
    problem.add_pose(np.eye(4))
    problem.add_points([[0, 0, 1]])
    with pytest.raises(sf.ValueRangeError, match="pixel"):
        problem.add_pixels([0], [0], [[np.nan, 1]])
    with pytest.raises(sf.ShapeError, match="pose, point"):
        problem.add_pixels([0], [0, 0], [[1, 1]])
    with pytest.raises(sf.ValueRangeError, match="pose"):
        problem.add_pixels([-1], [0], [[1, 1]])
    with pytest.raises(sf.ValueRangeError, match="loss"):
        problem.set_loss("huber", -1.0)


def test_inverse_ranges_and_attitude_prior_take_part() -> None:
    camera = sf.Camera.pinhole(300, 300, 160, 120, 320, 240)
    problem = BundleProblem()
    problem.add_camera(camera)
    rng = np.random.default_rng(2)
    points = rng.uniform([-1, -1, 3], [1, 1, 5], (40, 3))
    problem.add_points(points * 1.1)
    for k in range(2):
        pose = np.eye(4)
        pose[0, 3] = 0.3 * k
        problem.add_pose(pose * 1.0 if k == 0 else pose, fixed=k == 0)
        seen = points - pose[:3, 3]
        pixel = 300 * seen[:, :2] / seen[:, 2:] + [160, 120]
        index = np.arange(40)
        problem.add_pixels(np.full(40, k), index, pixel)
        ranges = np.linalg.norm(seen, axis=1)
        problem.add_inverse_ranges(np.full(40, k), index, 1 / ranges, sigma=0.01)
    problem.add_attitude_prior(1, np.eye(4), np.eye(3) * 1e-4)
    result = problem.solve(max_iterations=50, function_tolerance=1e-12)
    assert result.converged
    assert result.issues == []
    assert np.allclose(problem.points_m, points, atol=1e-5)
    with pytest.raises(sf.ValueRangeError, match="inv_range"):
        problem.add_inverse_ranges([0], [0], [-1.0], sigma=0.1)
    with pytest.raises(sf.ValueRangeError, match="covariance"):
        problem.add_attitude_prior(0, np.eye(4), np.zeros((3, 3)))


def turned(roll: float, yaw: float) -> np.ndarray:
    c, s = np.cos(roll), np.sin(roll)
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    c, s = np.cos(yaw), np.sin(yaw)
    about_y = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    pose = np.eye(4)
    pose[:3, :3] = about_y @ about_z
    return pose


def test_gravity_and_yaw_turn_a_graph_upright() -> None:
    graph = PoseGraph()
    truth, wrong = turned(0.0, 0.0), turned(0.2, -0.3)
    graph.add_node(wrong)
    graph.add_node(wrong)
    graph.add_edge(0, 1, np.eye(4), np.eye(6))
    graph.add_prior(0, wrong, np.diag([1e-6] * 3 + [1.0] * 3))
    down = [0, 9.81, 0]
    graph.add_gravity(0, down, truth[:3, :3].T @ down, sigma_rad=0.01)
    graph.add_yaw(1, down, truth, sigma_rad=0.01)
    assert graph.solve(function_tolerance=1e-12).converged
    assert np.allclose(graph.nodes[:, :3, :3], np.eye(3), atol=1e-4)
    with pytest.raises(sf.ValueRangeError, match="sigma_rad"):
        graph.add_gravity(0, down, down, sigma_rad=0.0)
    with pytest.raises(sf.ValueRangeError, match="axis"):
        graph.add_yaw(0, [0, 0, 0], truth, sigma_rad=1.0)


def test_similarity_graph_spreads_the_drift_of_scale() -> None:
    graph, count, grow = SimilarityGraph(), 8, 1.05
    step = turned(0.0, 2 * np.pi / count)
    step[0, 3] = 1.0
    drifting = step.copy()
    drifting[:3, :3] *= grow
    node = np.eye(4)
    for k in range(count):
        graph.add_node(node, fixed=k == 0)
        node = node @ drifting
    for k in range(count - 1):
        graph.add_edge(k, k + 1, drifting, np.eye(7))
    graph.add_edge(count - 1, 0, step, np.eye(7) * 1e6, loop_closure=True)
    result = graph.solve(function_tolerance=1e-12)
    assert result.converged
    scale = np.cbrt(np.linalg.det(graph.nodes[:, :3, :3]))
    # what drifted by 5 % from step to step is the size of the first node again at the end
    assert scale[-1] == pytest.approx(1.0, abs=1e-3)
    with pytest.raises(sf.ValueRangeError, match="scale"):
        graph.add_node(-np.eye(4))


def test_graph_with_wrong_loops_is_switched() -> None:
    graph = PoseGraph.generate("torus", 12, 20, wrong_loops=0.1, seed=2)
    result = graph.solve(switch="gnc", function_tolerance=1e-9)
    errors = np.linalg.norm(graph.nodes[:, :3, 3] - graph.truth[:, :3, 3], axis=1)
    assert len(result.rejected) >= 15
    assert np.sqrt(np.mean(errors**2)) < 0.1


def test_ba_command_prints_costs_and_writes_result(tmp_path: Path) -> None:
    source, target = tmp_path / "problem.txt", tmp_path / "adjusted.txt"
    source.write_text(BAL)
    done = CliRunner().invoke(app, ["ba", str(source), "--out", str(target)])
    assert done.exit_code in (0, 1), done.output
    assert "cost" in done.output
    assert target.exists()
    again = CliRunner().invoke(app, ["ba", str(target), "--json", "--max-iterations", "0"])
    first = CliRunner().invoke(app, ["ba", str(source), "--json", "--max-iterations", "0"])
    costs = [json.loads(run.stdout)["initial_cost"] for run in (first, again)]
    assert costs[1] < costs[0]


def test_ba_command_of_broken_file_names_line(tmp_path: Path) -> None:
    source = tmp_path / "problem.txt"
    source.write_text("1 1 1\n0 0 a 3\n")
    done = CliRunner().invoke(app, ["ba", str(source)])
    assert done.exit_code == 1
    assert "problem.txt:2" in done.stderr


def test_ba_command_without_the_folder_of_its_result_does_not_begin(tmp_path: Path) -> None:
    source, target = tmp_path / "problem.txt", tmp_path / "none" / "adjusted.txt"
    source.write_text(BAL)
    done = CliRunner().invoke(app, ["ba", str(source), "--out", str(target)])
    assert done.exit_code == 2
    assert "no such folder" in done.stderr
    assert not target.parent.exists()


def test_pgo_command_solves_published_graph(tmp_path: Path) -> None:
    target = tmp_path / "optimised.g2o"
    source = ba_problems() / "parking-garage.g2o"
    done = CliRunner().invoke(app, ["pgo", str(source), "--json", "--out", str(target)])
    assert done.exit_code == 0, done.output
    # the optimum that GTSAM finds for the same residuals
    assert json.loads(done.stdout)["final_cost"] == pytest.approx(0.634192, rel=1e-5)
    assert target.exists()
