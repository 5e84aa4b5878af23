"""Absolute and relative error on trajectories whose error is known by construction."""

from __future__ import annotations

import fakes
import numpy as np
import pytest
import sphereflow
from sphereflow.eval import ape, rpe
from sphereflow.eval.association import one_to_one
from sphereflow.eval.rotations import quat_xyzw_from_matrix

EXACT = 1e-9
"""Errors of a copy: rounding of metres, with room."""


def moved(trajectory, rotation, shift, scale=1.0):
    from sphereflow.eval.rotations import matrices_from_quat_xyzw

    turned = rotation @ matrices_from_quat_xyzw(np.asarray(trajectory.quat_xyzw))
    quats = np.array([quat_xyzw_from_matrix(one) for one in turned])
    position = scale * np.asarray(trajectory.position_m) @ rotation.T + shift
    return sphereflow.Trajectory(trajectory.stamp_ns, position, quats)


@pytest.mark.parametrize(("align", "scale"), [("se3", 1.0), ("sim3", 0.4), ("origin", 1.0)])
@pytest.mark.parametrize("relation", ["translation", "rotation_deg", "full"])
def test_ape_of_a_copy_in_another_world_is_zero(align, scale, relation):
    truth = fakes.trajectory(50)
    copy = moved(truth, fakes.turn_about_y(1.1), [3.0, -2.0, 5.0], scale)
    result = ape(truth, copy, align=align, relation=relation)
    assert result.statistics.max < EXACT
    assert result.scale == pytest.approx(1.0 / scale)
    assert np.allclose(result.estimate_position_m, truth.position_m, atol=EXACT)


def test_ape_without_alignment_is_the_offset():
    truth = fakes.trajectory(20)
    shifted = moved(truth, np.eye(3), [0.0, 0.3, 0.4])
    result = ape(truth, shifted, align="none")
    assert np.allclose(result.error, 0.5)
    assert result.statistics.sse == pytest.approx(20 * 0.25)
    assert result.unit == "m"


def test_ape_rotation_of_turned_cameras_is_the_angle():
    truth = fakes.trajectory(20)
    turned = moved(truth, fakes.turn_about_y(np.deg2rad(10.0)), np.zeros(3))
    result = ape(truth, turned, align="none", relation="rotation_deg")
    assert np.allclose(result.error, 10.0)


def test_rpe_does_not_depend_on_the_world():
    truth = fakes.trajectory(60)
    other = moved(truth, fakes.turn_about_y(0.7), [1.0, 2.0, 3.0])
    assert rpe(truth, other, delta=5).statistics.max < EXACT


def test_rpe_of_a_scaled_copy_is_the_lost_share_of_each_step():
    truth = fakes.trajectory(60)
    result = rpe(truth, moved(truth, np.eye(3), np.zeros(3), 0.9), relation="distance_percent")
    assert np.allclose(result.error, 10.0)
    assert result.unit == "%"


def test_rpe_pairs_in_frames_share_ends_or_overlap():
    truth = fakes.trajectory(10)
    spans = rpe(truth, truth, delta=3).spans
    assert spans.tolist() == [[0, 3], [3, 6], [6, 9]]
    assert len(rpe(truth, truth, delta=3, all_pairs=True).spans) == 7


def test_rpe_pairs_in_seconds_are_exact_in_nanoseconds():
    truth = fakes.trajectory(61)
    # 30 steps of 33 333 333 ns are 10 ns short of a second: the 31st frame is the first past it.
    assert rpe(truth, truth, delta=1.0, delta_unit="s").spans.tolist() == [[0, 31]]
    result = rpe(truth, truth, delta=1.0, delta_unit="s", all_pairs=True, delta_tolerance=0.01)
    assert set(np.diff(result.spans, axis=1).ravel()) == {30}


def test_rpe_pairs_in_metres_and_angle_reach_the_step():
    truth = fakes.trajectory(100)
    steps = np.linalg.norm(np.diff(truth.position_m, axis=0), axis=1)
    for first, last in rpe(truth, truth, delta=0.5, delta_unit="m").spans:
        assert steps[first:last].sum() >= 0.5 > steps[first : last - 1].sum()
    spans = rpe(truth, truth, delta=0.3, delta_unit="rad", all_pairs=True, delta_tolerance=0.01)
    assert set(np.diff(spans.spans, axis=1).ravel()) == {15}


def test_rpe_in_degrees_takes_the_same_pairs_as_in_radians():
    truth = fakes.trajectory(80)
    degrees = rpe(truth, truth, delta=np.rad2deg(0.31), delta_unit="deg")
    radians = rpe(truth, truth, delta=0.31, delta_unit="rad")
    assert np.array_equal(degrees.spans, radians.spans)


def test_one_to_one_prefers_the_closest_and_uses_none_twice():
    first, second = np.array([0, 10, 20]), np.array([9, 11, 12])
    # 9 and 11 are equally close to 10: the later of equals is taken, always the same one.
    assert one_to_one(first, second, 9).tolist() == [[0, 0], [1, 1], [2, 2]]
    assert one_to_one(first, second, 5).tolist() == [[1, 1]]
    assert one_to_one(first, second + 1000, 5).shape == (0, 2)


def test_offset_is_added_to_the_estimate():
    truth = fakes.trajectory(30)
    late = sphereflow.Trajectory(truth.stamp_ns + 2_000_000_000, truth.position_m, truth.quat_xyzw)
    assert ape(truth, late, offset_s=-2.0).statistics.max < EXACT


def test_ape_without_overlap_tells_both_spans():
    truth = fakes.trajectory(30)
    other = sphereflow.Trajectory(
        truth.stamp_ns - 1_600_000_000_000_000_000, truth.position_m, truth.quat_xyzw
    )
    with pytest.raises(sphereflow.DataError) as raised:
        ape(truth, other)
    assert "100000000.123456789 to 100000001.090123446 s" in str(raised.value)
    assert "1700000000.123456789 to 1700000001.090123446 s" in str(raised.value)


def test_ape_of_two_poses_says_how_many_are_needed():
    with pytest.raises(sphereflow.DataError, match="2 matched positions, at least 3"):
        ape(fakes.trajectory(2), fakes.trajectory(2))


class Arrays:
    def __init__(self, stamp_ns, position_m, quat_xyzw):
        self.stamp_ns, self.position_m, self.quat_xyzw = stamp_ns, position_m, quat_xyzw


def test_any_object_with_the_arrays_is_a_trajectory():
    truth = fakes.trajectory(9)
    copy = Arrays(truth.stamp_ns, truth.position_m, truth.quat_xyzw)
    assert ape(copy, copy).statistics.max < EXACT


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        ({"position_m": np.zeros((9, 2))}, sphereflow.ShapeError, "estimate: expected"),
        ({"stamp_ns": np.arange(9.0)}, sphereflow.ShapeError, "integer nanoseconds"),
        ({"stamp_ns": np.arange(9)[::-1]}, sphereflow.DataError, "times must increase"),
        ({"position_m": np.full((9, 3), np.nan)}, sphereflow.DataError, "pose 0 .*not finite"),
        ({"quat_xyzw": np.zeros((9, 4))}, sphereflow.DataError, "length 0"),
    ],
)
def test_bad_arrays_are_errors_that_name_the_argument(change, error, text):
    truth = fakes.trajectory(9)
    arrays = {name: getattr(truth, name) for name in ("stamp_ns", "position_m", "quat_xyzw")}
    with pytest.raises(error, match=text):
        ape(truth, Arrays(**{**arrays, **change}))


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"align": "umeyama"}, "align must be one of se3"),
        ({"relation": "distance_percent"}, "relation must be one of"),
        ({"max_difference_s": -1.0}, "at least 0 seconds"),
        ({"association": "closest"}, "association must be one of"),
    ],
)
def test_ape_with_an_unknown_option_is_an_error_that_lists_the_known(options, text):
    with pytest.raises(sphereflow.ValueRangeError, match=text):
        ape(fakes.trajectory(9), fakes.trajectory(9), **options)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"delta": 0}, "above 0"),
        ({"delta": 1.5}, "whole number"),
        ({"delta_unit": "km"}, "delta_unit must be"),
        ({"delta": 181, "delta_unit": "deg"}, "half a turn"),
        ({"pairs_from": "both"}, "pairs_from must be"),
        ({"delta": 1, "delta_tolerance": -0.1}, "delta_tolerance"),
    ],
)
def test_rpe_with_an_impossible_option_is_an_error(options, text):
    with pytest.raises(sphereflow.ValueRangeError, match=text):
        rpe(fakes.trajectory(9), fakes.trajectory(9), **options)


def test_rpe_over_a_step_longer_than_the_path_is_an_error():
    with pytest.raises(sphereflow.DataError, match="no two of the 9 matched poses are 500 m"):
        rpe(fakes.trajectory(9), fakes.trajectory(9), delta=500, delta_unit="m")
