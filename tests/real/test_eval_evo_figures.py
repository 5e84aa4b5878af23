"""Published trajectory pairs: the figures that evo prints for them, to every printed digit."""

from __future__ import annotations

from pathlib import Path

import pytest
from sphereflow.cli.files import read_trajectory
from sphereflow.eval import ape, rpe

ASSOCIATION_S = 0.02


def pair(recordings: Path, truth: str, estimate: str):
    folder = recordings / "trajectories" / "evo"
    return read_trajectory(folder / truth), read_trajectory(folder / estimate)


@pytest.mark.parametrize(
    ("truth", "estimate", "align", "rmse", "count", "scale"),
    [
        ("freiburg1_xyz-groundtruth", "freiburg1_xyz-rgbdslam", "se3", "0.013473", 786, "1"),
        (
            "freiburg1_xyz-groundtruth",
            "freiburg1_xyz-ORB_kf_mono",
            "sim3",
            "0.009755",
            32,
            "1.10562",
        ),
        ("fr2_desk_groundtruth", "fr2_desk_ORB", "se3", "0.008144", 2223, "1"),
        ("fr2_desk_groundtruth", "fr2_desk_ORB_kf_mono", "sim3", "0.007900", 122, "2.22834"),
    ],
)
def test_ape_of_published_pair_gives_published_figures(
    recordings, truth, estimate, align, rmse, count, scale
):
    reference, found = pair(recordings, f"{truth}.txt", f"{estimate}.txt")
    result = ape(reference, found, align=align, max_difference_s=ASSOCIATION_S)
    assert len(result.error) == count
    assert f"{result.statistics.rmse:.6f}" == rmse
    assert f"{result.scale:.6g}" == scale


def test_ape_of_rgbdslam_gives_published_statistics(recordings):
    reference, found = pair(
        recordings, "freiburg1_xyz-groundtruth.txt", "freiburg1_xyz-rgbdslam.txt"
    )
    statistics = ape(reference, found, max_difference_s=ASSOCIATION_S).statistics
    printed = [f"{value:.6f}" for value in (statistics.mean, statistics.median, statistics.max)]
    assert printed == ["0.012029", "0.011176", "0.034727"]


# rmse as printed by the evo 1.38.1 programs (evo_ape, evo_rpe) on the same files and options.
@pytest.mark.parametrize(
    ("options", "rmse"),
    [
        (
            {"delta": 1, "delta_unit": "frames", "relation": "translation", "all_pairs": False},
            "0.005759",
        ),
        (
            {"delta": 1, "delta_unit": "frames", "relation": "rotation_deg", "all_pairs": False},
            "0.352827",
        ),
        (
            {"delta": 1, "delta_unit": "frames", "relation": "translation", "all_pairs": True},
            "0.005759",
        ),
        (
            {"delta": 1, "delta_unit": "frames", "relation": "rotation_deg", "all_pairs": True},
            "0.352827",
        ),
        (
            {"delta": 10, "delta_unit": "frames", "relation": "translation", "all_pairs": False},
            "0.014873",
        ),
        (
            {"delta": 10, "delta_unit": "frames", "relation": "rotation_deg", "all_pairs": False},
            "0.708139",
        ),
        (
            {"delta": 10, "delta_unit": "frames", "relation": "translation", "all_pairs": True},
            "0.014046",
        ),
        (
            {"delta": 10, "delta_unit": "frames", "relation": "rotation_deg", "all_pairs": True},
            "0.675829",
        ),
        (
            {"delta": 0.1, "delta_unit": "m", "relation": "translation", "all_pairs": False},
            "0.014305",
        ),
        (
            {"delta": 0.1, "delta_unit": "m", "relation": "rotation_deg", "all_pairs": False},
            "0.684269",
        ),
        (
            {"delta": 0.1, "delta_unit": "m", "relation": "translation", "all_pairs": True},
            "0.013321",
        ),
        (
            {"delta": 0.1, "delta_unit": "m", "relation": "rotation_deg", "all_pairs": True},
            "0.664352",
        ),
        (
            {"delta": 0.3, "delta_unit": "rad", "relation": "translation", "all_pairs": False},
            "0.024186",
        ),
        (
            {"delta": 0.3, "delta_unit": "rad", "relation": "rotation_deg", "all_pairs": False},
            "1.050958",
        ),
        (
            {"delta": 0.3, "delta_unit": "rad", "relation": "translation", "all_pairs": True},
            "0.024948",
        ),
        (
            {"delta": 0.3, "delta_unit": "rad", "relation": "rotation_deg", "all_pairs": True},
            "1.065221",
        ),
        (
            {"delta": 5, "delta_unit": "deg", "relation": "translation", "all_pairs": False},
            "0.014849",
        ),
        (
            {"delta": 5, "delta_unit": "deg", "relation": "rotation_deg", "all_pairs": False},
            "0.719986",
        ),
        (
            {"delta": 5, "delta_unit": "deg", "relation": "translation", "all_pairs": True},
            "0.016533",
        ),
        (
            {"delta": 5, "delta_unit": "deg", "relation": "rotation_deg", "all_pairs": True},
            "0.810007",
        ),
    ],
)
def test_rpe_of_rgbdslam_equals_evo(recordings, options, rmse):
    reference, found = pair(
        recordings, "freiburg1_xyz-groundtruth.txt", "freiburg1_xyz-rgbdslam.txt"
    )
    result = rpe(reference, found, max_difference_s=ASSOCIATION_S, association="nearest", **options)
    assert f"{result.statistics.rmse:.6f}" == rmse


def test_ape_with_the_nearest_rule_uses_poses_twice_as_evo_does(recordings):
    reference, found = pair(recordings, "fr2_desk_groundtruth.txt", "fr2_desk_ORB.txt")
    result = ape(reference, found, max_difference_s=ASSOCIATION_S, association="nearest")
    # evo 1.38.1 prints these for -a --t_max_diff 0.02.
    assert (len(result.error), f"{result.statistics.rmse:.6f}") == (2225, "0.008146")
