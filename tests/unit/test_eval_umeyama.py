"""Alignment: what least squares must do, for any points and any motion."""

from __future__ import annotations

import numpy as np
import pytest
import sphereflow
from hypothesis import given, settings
from hypothesis import strategies as st
from sphereflow.eval import umeyama
from sphereflow.eval.rotations import angles_rad, matrices_from_quat_xyzw, quat_xyzw_from_matrix

# Positions of metres in double precision: rounding is 1e-15, ten thousand times that is allowed.
ROUNDING = 1e-11
# An angle from a matrix: the square root of rounding does not enter, atan2 is linear at both ends.
ANGLE_ROUNDING = 1e-12


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    quat = rng.normal(size=(1, 4))
    return matrices_from_quat_xyzw(quat / np.linalg.norm(quat))[0]


motions = st.tuples(
    st.integers(0, 2**32 - 1), st.integers(3, 60), st.floats(0.05, 20.0, allow_nan=False)
)


@given(motions)
def test_umeyama_of_moved_points_finds_the_motion(motion):
    seed, count, scale = motion
    rng = np.random.default_rng(seed)
    points, rotation, shift = rng.normal(size=(count, 3)), random_rotation(rng), rng.normal(size=3)
    found = umeyama(points, scale * points @ rotation.T + shift, with_scale=True)
    assert np.allclose(
        found.rotation, rotation, atol=1e-7
    )  # three random points can be nearly flat
    assert found.scale == pytest.approx(scale, rel=1e-9)
    assert np.allclose(found.points(points), scale * points @ rotation.T + shift, atol=1e-6)


@given(motions)
def test_umeyama_of_noisy_points_is_no_worse_than_any_motion_near_it(motion):
    seed, count, scale = motion
    rng = np.random.default_rng(seed)
    source, target = rng.normal(size=(count, 3)), scale * rng.normal(size=(count, 3))
    found = umeyama(source, target)
    best = np.square(found.points(source) - target).sum()
    for _ in range(5):
        rotation = random_rotation(rng) if rng.random() < 0.5 else _near(found.rotation, rng)
        shift = target.mean(axis=0) - rotation @ source.mean(axis=0)
        other = np.square(source @ rotation.T + shift - target).sum()
        assert best <= other * (1 + ROUNDING) + ROUNDING


@given(motions)
@settings(max_examples=50)
def test_umeyama_of_mirrored_points_is_a_rotation_never_a_mirror(motion):
    rng = np.random.default_rng(motion[0])
    points = rng.normal(size=(max(motion[1], 5), 3))
    found = umeyama(points, points * [1.0, 1.0, -1.0], with_scale=True)
    assert np.linalg.det(found.rotation) == pytest.approx(1.0, abs=ROUNDING)
    assert np.allclose(found.rotation @ found.rotation.T, np.eye(3), atol=ROUNDING)


def test_alignment_points_back_undoes_points():
    rng = np.random.default_rng(3)
    points = rng.normal(size=(9, 3))
    found = umeyama(points, 2.5 * points @ random_rotation(rng).T + 1.0, with_scale=True)
    assert np.allclose(found.points_back(found.points(points)), points, atol=ROUNDING)
    homogeneous = np.hstack([points, np.ones((9, 1))]) @ found.matrix.T
    assert np.allclose(homogeneous[:, :3], found.points(points), atol=ROUNDING)


@pytest.mark.parametrize(
    "points",
    [np.zeros((5, 3)), np.outer(np.arange(6.0), [1.0, 2.0, 3.0]), np.ones((4, 3)) * 7.0],
)
def test_umeyama_of_points_on_a_line_is_an_error(points):
    with pytest.raises(sphereflow.DataError, match="one line"):
        umeyama(points, points)


def test_umeyama_of_two_points_is_an_error():
    with pytest.raises(sphereflow.DataError, match="at least 3"):
        umeyama(np.eye(3)[:2], np.eye(3)[:2])


def test_umeyama_of_different_shapes_is_an_error_with_both():
    with pytest.raises(sphereflow.ShapeError, match=r"\(4, 3\) and \(5, 3\)"):
        umeyama(np.zeros((4, 3)), np.zeros((5, 3)))


@given(st.integers(0, 2**32 - 1))
def test_quaternion_of_matrix_of_quaternion_is_the_same_rotation(seed):
    rotation = random_rotation(np.random.default_rng(seed))
    quat = quat_xyzw_from_matrix(rotation)
    assert quat[3] >= 0.0
    assert np.allclose(matrices_from_quat_xyzw(quat[None])[0], rotation, atol=1e-12)


@given(st.floats(0.0, np.pi))
def test_angle_of_rotation_is_exact_from_no_turn_to_half_a_turn(angle):
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]])
    assert angles_rad(rotation)[0] == pytest.approx(angle, abs=ANGLE_ROUNDING)


def test_quaternion_of_quarter_turn_about_z_has_z_third():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    expected = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]
    assert np.allclose(quat_xyzw_from_matrix(turn), expected, atol=ROUNDING)


def _near(rotation: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    quat = np.append(1e-3 * rng.normal(size=3), 1.0)
    return rotation @ matrices_from_quat_xyzw((quat / np.linalg.norm(quat))[None])[0]
