"""Intel RealSense depth cameras through pyrealsense2."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from sphereflow._native import Camera
from sphereflow.errors import DataError
from sphereflow.sensors.samples import CameraSample, load_sdk, metres

INSTALL = "pip install pyrealsense2"


class RealSense:
    """An open RealSense camera: iterate over it, close it at the end (or use ``with``).

    Depth is registered to colour by the SDK. The inertial sensor is not read: the pipeline hands
    out only the newest reading with each frame and drops the others.

    Parameters
    ----------
    width, height
        Size of both images, pixels.
    rate_hz
        Frames per second.
    timeout_s
        How long a frame is awaited.
    sdk
        The module to use instead of ``pyrealsense2``, for tests.

    Raises
    ------
    MissingExtraError
        Where pyrealsense2 is not installed.
    DataError
        While iterating, where no frame comes in time.
    """

    def __init__(
        self,
        *,
        width: int = 640,
        height: int = 480,
        rate_hz: int = 30,
        timeout_s: float = 5.0,
        sdk: Any = None,
    ) -> None:
        """Open the camera and start both streams."""
        sdk = sdk if sdk is not None else load_sdk("pyrealsense2", INSTALL)
        self._timeout_ms = round(1000 * timeout_s)
        self._pipeline = sdk.pipeline()
        config = sdk.config()
        config.enable_stream(sdk.stream.depth, width, height, sdk.format.z16, rate_hz)
        config.enable_stream(sdk.stream.color, width, height, sdk.format.rgb8, rate_hz)
        profile = self._pipeline.start(config)
        self._scale_m = float(profile.get_device().first_depth_sensor().get_depth_scale())
        self._align = sdk.align(sdk.stream.color)
        stream = profile.get_stream(sdk.stream.color).as_video_stream_profile()
        lens = stream.get_intrinsics()
        self._camera = Camera.pinhole(lens.fx, lens.fy, lens.ppx, lens.ppy, lens.width, lens.height)

    @property
    def camera(self) -> Camera:
        """The colour camera, whose pixels depth has; its distortion, small here, is left out."""
        return self._camera

    def __iter__(self) -> Iterator[CameraSample]:
        """Frames as they come, without end."""
        while True:
            try:
                frames = self._align.process(self._pipeline.wait_for_frames(self._timeout_ms))
            except RuntimeError as error:
                raise DataError(f"RealSense: no frame: {error}") from error
            depth, colour = frames.get_depth_frame(), frames.get_color_frame()
            if not depth or not colour:
                continue  # the SDK lost one of the two
            yield CameraSample(
                stamp_ns=_nanoseconds(depth.get_timestamp()),
                depth_m=metres(depth.get_data(), self._scale_m, "RealSense"),
                colour=np.array(colour.get_data(), dtype=np.uint8),
            )

    def close(self) -> None:
        """Stop the camera."""
        self._pipeline.stop()

    def __enter__(self) -> RealSense:
        """The camera itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the camera."""
        self.close()


def _nanoseconds(milliseconds: float) -> int:
    """Nanoseconds; the product in floating point would be off by 256 of them."""
    whole, part = divmod(milliseconds, 1)
    return int(whole) * 1_000_000 + round(part * 1_000_000)
