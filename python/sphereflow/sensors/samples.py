"""What a camera gives: one RGB-D frame with its stamp, and the inertial readings since the last."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sphereflow.errors import DataError, MissingExtraError


@dataclass(frozen=True)
class ImuReading:
    """One reading of gyro and accelerometer, in the sensor's own axes.

    Parameters
    ----------
    stamp_ns
        Time of the reading on the clock of the frames, nanoseconds.
    gyro_rad_s
        Angular velocity, rad/s.
    accel_m_s2
        Specific force, m/s^2: at rest it points up.
    """

    stamp_ns: int
    gyro_rad_s: tuple[float, float, float]
    accel_m_s2: tuple[float, float, float]


@dataclass(frozen=True)
class CameraSample:
    """One frame: depth in the colour camera's pixels, and colour.

    Parameters
    ----------
    stamp_ns
        Time of the depth image on the device's clock, nanoseconds.
    depth_m
        ``(height, width)`` float32, metres along the optical axis; NaN where unknown.
    colour
        ``(height, width, 3)`` uint8, red first.
    imu
        Readings since the last frame, oldest first.
    """

    stamp_ns: int
    depth_m: npt.NDArray[np.float32]
    colour: npt.NDArray[np.uint8]
    imu: tuple[ImuReading, ...] = ()


def load_sdk(module: str, install: str) -> Any:
    """A maker's package, or an error that says how to install it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingExtraError(f"{module} cannot be imported ({error}): {install}") from error


def metres(counts: Any, scale_m: float, device: str) -> npt.NDArray[np.float32]:
    """Depth of an image of 16-bit counts of ``scale_m`` metres; 0 is unknown."""
    image = np.asanyarray(counts)
    if image.ndim != 2 or image.dtype != np.uint16:
        found = f"{image.dtype} of shape {image.shape}"
        raise DataError(f"{device}: depth: expected 2-d uint16, found {found}")
    depth_m: npt.NDArray[np.float32] = image.astype(np.float32) * np.float32(scale_m)
    depth_m[image == 0] = np.nan
    return depth_m
