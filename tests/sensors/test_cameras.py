"""The cameras' adapters against stand-ins of the same interface."""

from __future__ import annotations

import sys
from itertools import islice

import numpy as np
import pytest
import sensor_stand_ins as stand_ins
import sphereflow as sf


def test_realsense_gives_metres_with_stamps_and_passes_over_half_frames() -> None:
    pipeline = stand_ins.RealSensePipeline()
    with sf.sensors.RealSense(sdk=stand_ins.realsense(pipeline), timeout_s=0.1) as camera:
        first, third = islice(camera, 2)
        with pytest.raises(sf.errors.DataError, match="within 100"):
            next(iter(camera))
    assert pipeline.stopped
    assert first.stamp_ns == 1_700_000_000_000_000_000
    assert third.stamp_ns - first.stamp_ns == 66_500_000
    assert np.isnan(first.depth_m[0, 0])
    np.testing.assert_allclose(third.depth_m[1], 1.002, rtol=1e-6)  # float32
    assert third.colour.shape == (4, 6, 3)
    assert third.colour[0, 0, 0] == 2


def test_azure_kinect_gives_registered_depth_red_first_and_its_inertial_readings() -> None:
    with sf.sensors.AzureKinect(sdk=stand_ins.azure()) as camera:
        frames = iter(camera)
        first, second = next(frames), next(frames)
        with pytest.raises(sf.errors.DataError, match="depth and colour"):
            next(frames)
    assert (first.stamp_ns, second.stamp_ns) == (33_333_000, 66_666_000)
    assert first.colour[0, 0].tolist() == [3, 2, 1]
    assert [reading.stamp_ns for reading in second.imu] == [65_466_000, 66_066_000, 66_666_000]
    assert second.imu[0].accel_m_s2 == (0.0, 0.0, -9.81)


@pytest.mark.parametrize(
    ("camera", "module"),
    [(sf.sensors.RealSense, "pyrealsense2"), (sf.sensors.AzureKinect, "pyk4a")],
)
def test_camera_without_its_sdk_says_what_to_install(
    camera: type, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(sf.MissingExtraError, match=f"pip install {module}"):
        camera()


def test_depth_of_a_wrong_type_is_refused() -> None:
    with pytest.raises(sf.errors.DataError, match="uint16"):
        sf.sensors.samples.metres(np.zeros((4, 6)), 0.001, "camera")
