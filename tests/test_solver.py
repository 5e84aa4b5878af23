"""The solver from Python and from the command line."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import sphereflow as sf
from sphereflow.cli.app import app
from sphereflow.solver import BundleProblem, PoseGraph
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


def test_pgo_command_solves_published_graph(tmp_path: Path) -> None:
    target = tmp_path / "optimised.g2o"
    source = ba_problems() / "parking-garage.g2o"
    done = CliRunner().invoke(app, ["pgo", str(source), "--json", "--out", str(target)])
    assert done.exit_code == 0, done.output
    # the optimum that GTSAM finds for the same residuals
    assert json.loads(done.stdout)["final_cost"] == pytest.approx(0.634192, rel=1e-5)
    assert target.exists()
