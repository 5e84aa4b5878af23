"""What can be wrong with a problem: an error that names it, or a line in the result, never NaN."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import sphereflow as sf
from sphereflow.solver import BundleProblem, PoseGraph, SimilarityGraph, SolverResult

CENTRE = np.array([160.0, 120.0])


def scene(*, fixed: int = 2) -> BundleProblem:
    """Three poses and thirty points, slightly off."""
    rng = np.random.default_rng(1)
    problem = BundleProblem()
    problem.add_camera(sf.Camera.pinhole(300, 300, 160, 120, 320, 240))
    points = rng.uniform([-1, -1, 3], [1, 1, 5], (30, 3))
    problem.add_points(points + rng.normal(0, 0.02, points.shape))
    for k in range(3):
        pose = np.eye(4)
        pose[0, 3] = 0.3 * k
        problem.add_pose(pose, fixed=k < fixed)
        seen = points - pose[:3, 3]
        pixel = 300 * seen[:, :2] / seen[:, 2:] + CENTRE
        problem.add_pixels(np.full(30, k), np.arange(30), pixel)
    return problem


def solved(problem: BundleProblem) -> SolverResult:
    result = problem.solve(max_iterations=30)
    assert np.isfinite(problem.poses).all()
    assert np.isfinite(problem.points_m).all()
    assert result.final_cost <= result.initial_cost
    return result


def test_point_behind_a_camera_is_named_and_stays() -> None:
    problem = scene()
    point = problem.add_points([[0, 0, -2]])
    problem.add_pixels([0, 1], [point, point], [CENTRE, CENTRE])
    issues = solved(problem).issues
    assert f"observation 90 left out: pose 0 does not see point {point} at the start" in issues
    assert f"point {point} left alone: 0 views do not determine it" in issues
    assert problem.points_m[point].tolist() == [0, 0, -2]


def test_point_seen_once_is_named_and_stays() -> None:
    problem = scene()
    point = problem.add_points([[0.1, 0, 2]])
    problem.add_pixels([2], [point], [CENTRE])
    assert solved(problem).issues == [f"point {point} left alone: 1 views do not determine it"]
    assert problem.points_m[point].tolist() == [0.1, 0, 2]


def test_cameras_that_share_no_point_are_named() -> None:
    problem = scene()
    rng = np.random.default_rng(2)
    points = rng.uniform([-1, -1, 3], [1, 1, 5], (20, 3))
    first = problem.add_points(points)
    for k in range(2):
        pose = np.eye(4)
        pose[1, 3] = 0.2 * k
        index = problem.add_pose(pose)
        seen = points - pose[:3, 3]
        pixel = 300 * seen[:, :2] / seen[:, 2:] + CENTRE
        problem.add_pixels(np.full(20, index), first + np.arange(20), pixel)
    assert solved(problem).issues == [
        "the poses fall into 2 groups that share no point",
        "the group of pose 3 can move as a whole in 7 directions",
    ]


@pytest.mark.parametrize(("fixed", "directions"), [(0, 7), (1, 1)])
def test_free_gauge_is_named(fixed: int, directions: int) -> None:
    problem = scene(fixed=fixed)
    issues = solved(problem).issues
    assert issues == [f"the group of pose 0 can move as a whole in {directions} directions"]
    with pytest.raises(sf.DataError, match="move as a whole"):
        problem.covariance([2])


def test_pose_that_nothing_measures_is_named_and_stays() -> None:
    problem = scene()
    pose = problem.add_pose(np.eye(4))
    assert solved(problem).issues == [f"pose {pose} left alone: nothing measures it"]
    assert np.array_equal(problem.poses[pose], np.eye(4))


def test_numbers_that_are_none_and_matrices_that_are_no_covariance_are_refused_by_name() -> None:
    problem = scene()
    lopsided = np.eye(6)
    lopsided[0, 1] = 0.5
    refused: list[tuple[str, Callable[[], object]]] = [
        ("pixel", lambda: problem.add_pixels([0], [0], [[np.nan, 1]])),
        ("covariance", lambda: problem.add_pixels([0], [0], [CENTRE], sigma_px=0)),
        ("covariance", lambda: problem.add_pixels([0], [0], [CENTRE], sigma_px=np.nan)),
        ("position", lambda: problem.add_points([[np.inf, 0, 0]])),
        ("world_from_camera", lambda: problem.add_pose(np.full((4, 4), np.nan))),
        ("inv_range", lambda: problem.add_inverse_ranges([0], [0], [np.nan], sigma=1)),
        ("sigma", lambda: problem.add_inverse_ranges([0], [0], [1], sigma=0)),
        (
            "point_in_camera",
            lambda: problem.add_point_measurements([0], [0], [[0, np.nan, 1]], sigma_m=1),
        ),
        ("covariance", lambda: problem.add_pose_prior(0, np.eye(4), -np.eye(6))),
        ("covariance", lambda: problem.add_pose_prior(0, np.eye(4), lopsided)),
        ("covariance", lambda: problem.add_attitude_prior(0, np.eye(4), np.zeros((3, 3)))),
    ]
    before = problem.measurements
    for name, call in refused:
        with pytest.raises(sf.ValueRangeError, match=name):
            call()
    assert problem.measurements == before
    assert solved(problem).converged


@pytest.mark.parametrize(("made", "size"), [(PoseGraph, 6), (SimilarityGraph, 7)])
def test_graph_with_bad_edges_names_them(
    made: type[PoseGraph] | type[SimilarityGraph], size: int
) -> None:
    graph, one = made(), np.eye(size)
    for k in range(4):
        node = np.eye(4)
        node[0, 3] = k
        graph.add_node(node, fixed=k == 0)
    nan, negative = np.full((4, 4), np.nan), np.diag([1.0, 1, -1, 1, 1, 1, 1][:size])
    refused: list[tuple[str, Callable[[], object]]] = [
        ("information", lambda: graph.add_edge(0, 1, np.eye(4), negative)),
        ("information", lambda: graph.add_edge(0, 1, np.eye(4), one * np.nan)),
        ("first_from_second", lambda: graph.add_edge(0, 1, nan, one)),
        ("to", lambda: graph.add_edge(0, 9, np.eye(4), one)),
        ("to", lambda: graph.add_edge(1, 1, np.eye(4), one)),
        ("world_from_body", lambda: graph.add_node(nan)),
        ("information", lambda: graph.add_prior(0, np.eye(4), one * 0)),
        ("sigma_rad", lambda: graph.add_gravity(0, [0, 1, 0], [0, 1, 0], sigma_rad=-1)),
        ("nodes", lambda: graph.set_nodes([np.eye(4)])),
    ]
    for name, call in refused:
        with pytest.raises(sf.ValueRangeError, match=name):
            call()
    graph.add_edge(0, 1, np.eye(4), one)
    graph.add_edge(2, 3, np.eye(4), one)
    result = graph.solve(function_tolerance=1e-12)
    assert result.issues == [
        "the graph falls into 2 parts that no edge ties",
        "nothing fixes the part of node 2: that node was held",
    ]
    assert np.allclose(graph.nodes[:, 0, 3], [0, 0, 2, 2], atol=1e-9)


def test_graph_keeps_its_layout_and_starts_again_from_other_nodes() -> None:
    graph = PoseGraph.generate("torus", 20, 20, seed=3)
    start = graph.nodes
    first = graph.solve(function_tolerance=1e-12)
    graph.set_nodes(start)
    again = graph.solve(function_tolerance=1e-12)
    # a matrix is made orthogonal again where it comes in: rounding
    assert again.initial_cost == pytest.approx(first.initial_cost, rel=1e-12)
    assert again.final_cost == pytest.approx(first.final_cost, rel=1e-12)
    # something new is laid out again
    graph.add_edge(0, 399, np.linalg.inv(graph.nodes[0]) @ graph.nodes[399], np.eye(6))
    assert graph.solve(function_tolerance=1e-12).converged
