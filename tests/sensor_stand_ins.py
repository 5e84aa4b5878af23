"""Objects with the interface of the cameras' SDKs, and pictures of their own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

SIZE = (4, 6)
"""Height and width of the stand-ins' images."""


def depth_counts(index: int) -> np.ndarray:
    """Counts of depth; the first pixel is unknown."""
    counts = np.full(SIZE, 1000 + index, dtype=np.uint16)
    counts[0, 0] = 0
    return counts


class Frame:
    """A frame of pyrealsense2."""

    def __init__(self, data: np.ndarray, timestamp_ms: float) -> None:
        self._data, self._timestamp_ms = data, timestamp_ms

    def get_data(self) -> np.ndarray:
        return self._data

    def get_timestamp(self) -> float:
        return self._timestamp_ms


class RealSensePipeline:
    """A pipeline of three frames, of which the second lacks its colour; then nothing comes."""

    def __init__(self) -> None:
        self.count, self.stopped = 0, False

    def start(self, _config: Any) -> Any:
        lens = SimpleNamespace(fx=600.0, fy=601.0, ppx=2.5, ppy=1.5, width=6, height=4)
        video = SimpleNamespace(get_intrinsics=lambda: lens)
        stream = SimpleNamespace(as_video_stream_profile=lambda: video)
        sensor = SimpleNamespace(get_depth_scale=lambda: 0.001)
        device = SimpleNamespace(first_depth_sensor=lambda: sensor)
        return SimpleNamespace(get_device=lambda: device, get_stream=lambda _kind: stream)

    def wait_for_frames(self, timeout_ms: int) -> Any:
        if self.count == 3:
            raise RuntimeError(f"Frame didn't arrive within {timeout_ms}")
        index, self.count = self.count, self.count + 1
        colour = Frame(np.full((*SIZE, 3), index, dtype=np.uint8), 0.0)
        depth = Frame(depth_counts(index), 1_700_000_000_000.0 + 33.25 * index)
        return SimpleNamespace(
            get_depth_frame=lambda: depth,
            get_color_frame=lambda: None if index == 1 else colour,
        )

    def stop(self) -> None:
        self.stopped = True


def realsense(pipeline: RealSensePipeline) -> Any:
    """The module pyrealsense2."""
    return SimpleNamespace(
        pipeline=lambda: pipeline,
        config=lambda: SimpleNamespace(enable_stream=lambda *_: None),
        stream=SimpleNamespace(depth=1, color=2),
        format=SimpleNamespace(z16=1, rgb8=2),
        align=lambda _stream: SimpleNamespace(process=lambda frames: frames),
    )


class ImuTimeoutError(Exception):
    """K4ATimeoutException of pyk4a."""


class AzureDevice:
    """A device with two frames, and three inertial readings before each."""

    def __init__(self, _config: Any, device_id: int) -> None:
        self.device_id, self.count, self.readings, self.running = device_id, 0, 0, False
        matrix = np.array([[600.0, 0, 640], [0, 601, 360], [0, 0, 1]])
        self.calibration = SimpleNamespace(get_camera_matrix=lambda _kind: matrix)

    def start(self) -> None:
        self.running = True

    def stop(self) -> None:
        self.running = False

    def get_capture(self) -> Any:
        index, self.count, self.readings = self.count, self.count + 1, 3
        bgra = np.zeros((*SIZE, 4), dtype=np.uint8)
        bgra[:] = [1, 2, 3, 255]
        return SimpleNamespace(
            transformed_depth=depth_counts(index) if index < 2 else None,
            color=bgra,
            depth_timestamp_usec=33_333 * (index + 1),
        )

    def get_imu_sample(self, timeout: int) -> dict[str, Any]:
        assert timeout == 0
        if self.readings == 0:
            raise ImuTimeoutError
        self.readings -= 1
        stamp = 33_333 * self.count - 600 * self.readings
        return {
            "acc_sample": (0.0, 0.0, -9.81),
            "acc_timestamp": stamp,
            "gyro_sample": (0.1, 0.2, 0.3),
            "gyro_timestamp": stamp,
            "temperature": 30.0,
        }


def azure() -> Any:
    """The module pyk4a."""
    return SimpleNamespace(
        Config=lambda **settings: settings,
        ColorResolution=SimpleNamespace(RES_720P=1),
        DepthMode=SimpleNamespace(NFOV_UNBINNED=2),
        FPS=SimpleNamespace(FPS_30=2),
        CalibrationType=SimpleNamespace(COLOR=1),
        PyK4A=AzureDevice,
        K4ATimeoutException=ImuTimeoutError,
    )
