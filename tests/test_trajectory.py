"""Trajectories from Python: construction, association, exact files."""

from pathlib import Path

import numpy as np
import pytest
import sphereflow as sf


def sample(n: int = 50, seed: int = 3) -> sf.Trajectory:
    rng = np.random.default_rng(seed)
    quat = rng.normal(size=(n, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    stamps = 1_305_031_229_528_748_001 + np.cumsum(rng.integers(1, 10**8, n))
    return sf.Trajectory(stamps, rng.normal(size=(n, 3)), quat)


@pytest.mark.parametrize("form", ["tum", "euroc"])
def test_trajectory_file_round_trip_is_exact(tmp_path: Path, form: str) -> None:
    trajectory = sample()
    path = tmp_path / ("t.csv" if form == "euroc" else "t.txt")
    trajectory.write(path, format=form)
    again = sf.Trajectory.read(path, format=form)
    np.testing.assert_array_equal(again.stamp_ns, trajectory.stamp_ns)
    np.testing.assert_array_equal(again.position_m, trajectory.position_m)
    np.testing.assert_array_equal(again.quat_xyzw, trajectory.quat_xyzw)


def test_trajectory_kitti_round_trip_writes_the_same_bytes(tmp_path: Path) -> None:
    first, second = tmp_path / "a.txt", tmp_path / "b.txt"
    sample().write(first, format="kitti")
    sf.Trajectory.read(first, format="kitti").write(second, format="kitti")
    a, b = np.loadtxt(first), np.loadtxt(second)
    np.testing.assert_allclose(a, b, rtol=0, atol=1e-15)


def test_trajectory_float_stamps_are_refused() -> None:
    with pytest.raises(sf.DtypeError, match="stamp_ns"):
        sf.Trajectory(np.array([1.5e9]), np.zeros((1, 3)), np.array([[0, 0, 0, 1.0]]))


def test_trajectory_repeated_stamp_is_an_error() -> None:
    with pytest.raises(sf.TimeOrderError, match="index 1"):
        sf.Trajectory([5, 5], np.zeros((2, 3)), [[0, 0, 0, 1.0]] * 2)


def test_trajectory_with_seven_columns_names_path_and_line(tmp_path: Path) -> None:
    path = tmp_path / "short.txt"
    path.write_text("# header\n1.0 0 0 0 0 0 0 1\n2.0 0 0 0 0 0 0\n")
    with pytest.raises(sf.DataError, match=r"short\.txt.*3"):
        sf.Trajectory.read(path)


def test_trajectory_interpolates_between_poses() -> None:
    trajectory = sf.Trajectory([0, 10**9], [[0, 0, 0], [2, 0, 0]], [[0, 0, 0, 1.0]] * 2)
    middle = trajectory.interpolate(5 * 10**8, max_gap_s=1.0)
    assert middle is not None
    np.testing.assert_allclose(middle[:3, 3], [1, 0, 0])
    assert trajectory.interpolate(5 * 10**8, max_gap_s=0.5) is None


def test_associate_pairs_nearest_within_the_limit() -> None:
    pairs = sf.associate([0, 10, 20, 30], [1, 22, 90], 5e-9)
    np.testing.assert_array_equal(pairs, [[0, 0], [2, 1]])
    with pytest.raises(sf.ValueRangeError, match="max_difference_s"):
        sf.associate([0], [0], -1.0)
