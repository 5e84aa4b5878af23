"""Codes of reasons: the table in the documents, and the codes of the results."""

import re
from pathlib import Path

import numpy as np
import sphereflow as sf
from sphereflow import _native

TABLE = Path(__file__).parent.parent / "docs" / "reason-codes.md"
ROW = re.compile(r"^\| (\w+) \| `(\w+)` \| ([^|]*)\| [^|]+ \|$", re.MULTILINE)
CAMERA = sf.Camera.pinhole(60.0, 60.0, 39.5, 29.5, 80, 60)


def test_reason_codes_table_and_enums_agree() -> None:
    listed: dict[str, dict[str, list[str]]] = {}
    for of, code, values in ROW.findall(TABLE.read_text(encoding="utf-8")):
        listed.setdefault(of, {})[code] = re.findall(r"`(\w+)`", values)
    assert listed == _native._reason_codes()


def test_reason_of_a_frame_without_depth_has_code_and_no_values() -> None:
    odometry = sf.odometry.DepthOdometry(CAMERA)
    result = odometry.push(None, 0)
    assert (result.status, result.reason_code, result.reason_values) == ("lost", "no_depth", {})


def test_reason_of_an_unknown_image_has_the_share() -> None:
    odometry = sf.odometry.DepthOdometry(CAMERA)
    result = odometry.push(np.full((60, 80), np.nan, np.float32), 0)
    assert result.reason_code == "few_known_pixels"
    assert result.reason_values == {"share": 0.0}


def test_reason_of_a_good_frame_is_none() -> None:
    odometry = sf.odometry.DepthOdometry(CAMERA)
    result = odometry.push(np.full((60, 80), 2.0, np.float32), 0)
    assert result.status == "started"
    assert (result.reason, result.reason_code, result.reason_values) == (None, None, {})


def test_reason_of_an_observer_names_the_sensor() -> None:
    attitude = sf.attitude.AttitudeFilter()
    state = attitude.step([np.nan, 0, 0], [0, 0, 9.81], dt_s=0.01)
    assert state.reason_code == "not_finite"
    assert state.reason_values == {"sensor": "gyro"}
    run = attitude.run([[np.nan, 0, 0]], [[0, 0, 9.81]], None, [10**9])
    assert run.reason_code == ["not_finite"]
