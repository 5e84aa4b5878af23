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


def test_trajectory_of_its_own_matrices_is_the_same() -> None:
    trajectory = sample()
    matrices = trajectory.world_from_camera
    assert matrices.shape == (50, 4, 4)
    again = sf.Trajectory.from_matrices(trajectory.stamp_ns, matrices)
    # 1e-12: a rotation goes through a matrix and back
    np.testing.assert_allclose(again.world_from_camera, matrices, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(matrices[:, :3, 3], trajectory.position_m)


def test_trajectory_of_a_matrix_that_is_no_pose_names_its_index() -> None:
    matrices = np.tile(np.eye(4), (3, 1, 1))
    matrices[2, 0, 0] = 5.0
    with pytest.raises(sf.ValueRangeError, match=r"world_from_camera\[2\]"):
        sf.Trajectory.from_matrices([0, 1, 2], matrices)
    with pytest.raises(sf.ShapeError, match="world_from_camera"):
        sf.Trajectory.from_matrices([0, 1], matrices)


def test_trajectory_indices_slices_and_masks_select() -> None:
    trajectory = sample(10)
    stamp_ns, pose = trajectory[-1]
    assert stamp_ns == trajectory.stamp_ns[-1]
    np.testing.assert_array_equal(pose, trajectory.world_from_camera[-1])
    assert trajectory[2:8:3] == sf.Trajectory(
        trajectory.stamp_ns[2:8:3], trajectory.position_m[2:8:3], trajectory.quat_xyzw[2:8:3]
    )
    mask = np.arange(10) % 2 == 0
    np.testing.assert_array_equal(trajectory[mask].stamp_ns, trajectory.stamp_ns[mask])
    np.testing.assert_array_equal(trajectory[[0, 3]].stamp_ns, trajectory.stamp_ns[[0, 3]])
    assert [stamp for stamp, _ in trajectory] == trajectory.stamp_ns.tolist()


@pytest.mark.parametrize(
    ("key", "error"),
    [
        (10, IndexError),
        (slice(None, None, -1), sf.TimeOrderError),
        ([3, 0], sf.TimeOrderError),
        (np.ones(9, bool), sf.ShapeError),
        ("first", sf.DtypeError),
        (0.5, sf.DtypeError),
    ],
)
def test_trajectory_key_that_selects_nothing_sensible_raises(
    key: object, error: type[Exception]
) -> None:
    with pytest.raises(error):
        sample(10)[key]


def test_trajectory_parts_put_together_are_the_whole() -> None:
    trajectory = sample()
    assert trajectory[:20] + trajectory[20:] == trajectory
    assert trajectory[:20].concatenated(trajectory[20:]) == trajectory
    assert trajectory[:20] != trajectory[:21]
    with pytest.raises(sf.TimeOrderError):
        trajectory[20:] + trajectory[:20]
    with pytest.raises(TypeError):
        trajectory + 1


def test_trajectory_length_is_the_way_and_not_the_distance() -> None:
    there_and_back = sf.Trajectory(
        [0, 1, 2], [[0, 0, 0], [3, 4, 0], [0, 0, 0]], [[0, 0, 0, 1.0]] * 3
    )
    assert there_and_back.length_m == 10.0
    assert there_and_back[:0].length_m == 0.0


def test_trajectory_transformed_multiplies_on_both_sides() -> None:
    trajectory = sample(5)
    left, right = sample(2, seed=8).world_from_camera
    moved = trajectory.transformed(left, camera_from_body=right)
    expected = left @ trajectory.world_from_camera @ right
    # 1e-12: quaternions instead of matrices
    np.testing.assert_allclose(moved.world_from_camera, expected, rtol=0, atol=1e-12)
    assert trajectory.transformed() == trajectory
