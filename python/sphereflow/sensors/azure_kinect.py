"""Azure Kinect through pyk4a, which needs Microsoft's system library."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from sphereflow._native import Camera
from sphereflow.errors import DataError
from sphereflow.sensors.samples import CameraSample, ImuReading, load_sdk, metres

INSTALL = "pip install pyk4a, and install Microsoft's libk4a 1.4 with its depth engine"
COUNT_M = 1e-3
"""Metres of a count of depth: the device measures millimetres."""


class AzureKinect:
    """An open Azure Kinect: iterate over it, close it at the end (or use ``with``).

    Depth is registered to colour by the SDK, and the inertial readings between two frames come with
    the second one. All stamps are of the device's clock.

    Parameters
    ----------
    device
        Number of the device, 0 for the first.
    sdk
        The module to use instead of ``pyk4a``, for tests.

    Raises
    ------
    MissingExtraError
        Where pyk4a or Microsoft's library is not installed.
    DataError
        While iterating, where an image of a pair is missing.
    """

    def __init__(self, device: int = 0, *, sdk: Any = None) -> None:
        """Open the device and start its cameras."""
        self._sdk = sdk if sdk is not None else load_sdk("pyk4a", INSTALL)
        config = self._sdk.Config(
            color_resolution=self._sdk.ColorResolution.RES_720P,
            depth_mode=self._sdk.DepthMode.NFOV_UNBINNED,
            camera_fps=self._sdk.FPS.FPS_30,
            synchronized_images_only=True,
        )
        self._device = self._sdk.PyK4A(config, device_id=device)
        self._device.start()
        matrix = self._device.calibration.get_camera_matrix(self._sdk.CalibrationType.COLOR)
        self._camera = Camera.pinhole(
            matrix[0][0], matrix[1][1], matrix[0][2], matrix[1][2], 1280, 720
        )

    @property
    def camera(self) -> Camera:
        """The colour camera, whose pixels depth has; its distortion is left out."""
        return self._camera

    def __iter__(self) -> Iterator[CameraSample]:
        """Frames as they come, without end."""
        while True:
            capture = self._device.get_capture()
            depth, colour = capture.transformed_depth, capture.color
            if depth is None or colour is None:
                raise DataError("Azure Kinect: expected depth and colour, found one of them")
            yield CameraSample(
                stamp_ns=1000 * int(capture.depth_timestamp_usec),
                depth_m=metres(depth, COUNT_M, "Azure Kinect"),
                colour=np.ascontiguousarray(np.asanyarray(colour)[:, :, 2::-1]),  # from BGRA
                imu=tuple(self._imu()),
            )

    def _imu(self) -> Iterator[ImuReading]:
        """The readings that wait in the device's queue."""
        while True:
            try:
                reading = self._device.get_imu_sample(timeout=0)
            except self._sdk.K4ATimeoutException:
                return
            gyro, accel = reading["gyro_sample"], reading["acc_sample"]
            yield ImuReading(
                stamp_ns=1000 * int(reading["acc_timestamp"]),
                gyro_rad_s=(float(gyro[0]), float(gyro[1]), float(gyro[2])),
                accel_m_s2=(float(accel[0]), float(accel[1]), float(accel[2])),
            )

    def close(self) -> None:
        """Stop the camera."""
        self._device.stop()

    def __enter__(self) -> AzureKinect:
        """The camera itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the camera."""
        self.close()
