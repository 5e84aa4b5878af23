"""Inertial and magnetic sensors calibrated from a recording; each says what the motion showed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import sphereflow
from sphereflow import observers, odometry
from sphereflow.io import open_recording

Found = dict[str, Any]
"""What was found, with `status` and `reason`."""

FEWEST_RATES = 20
"""So many angular velocities of the camera tell a rotation and an offset."""


def imu_still(
    data: str | Path, *, gravity_m_s2: float = 9.81, max_seconds: float | None = None
) -> Found:
    """Biases and noise densities from a recording at rest.

    Parameters
    ----------
    data
        Folder of a recording with gyro and accelerometer.
    gravity_m_s2
        Local norm of gravity.
    max_seconds
        Use the first so many seconds.
    """
    samples = open_recording(data).imu
    stamp_ns = samples["stamp_ns"]
    if not len(stamp_ns) or np.isnan(samples["gyro_rad_s"]).all():
        raise sphereflow.DataError(f"{data}: expected gyro and accelerometer, found neither or one")
    keep = np.full(len(stamp_ns), True)
    if max_seconds is not None:
        keep = stamp_ns - stamp_ns[0] <= max_seconds * 1e9
    return observers.calibrate_imu_still(
        samples["gyro_rad_s"][keep],
        samples["accel_m_s2"][keep],
        stamp_ns[keep],
        gravity_m_s2=gravity_m_s2,
    )


def mag_ellipsoid(data: str | Path) -> Found:
    """Hard and soft iron from a recording in which the magnetometer was turned all ways."""
    readings = open_recording(data).mag["mag_ut"]
    if not len(readings):
        raise sphereflow.DataError(f"{data}: expected a magnetometer, found none")
    return observers.calibrate_mag_ellipsoid(readings)


def camera_imu(
    data: str | Path,
    *,
    max_frames: int | None = None,
    largest_offset_s: float = 0.1,
    progress: Callable[[int, int], object] | None = None,
) -> Found:
    """Rotation and time offset between camera and IMU, from geometric flow against the gyro.

    Parameters
    ----------
    data
        Folder of a recording with depth and gyro, turned about all axes.
    max_frames
        Use the first so many frames.
    largest_offset_s
        Offsets up to this size are tried.
    progress
        Told the frames done and the frames in all.
    """
    recording = open_recording(data)
    if recording.camera is None:
        raise sphereflow.DataError(f"{data}: expected a camera calibration, found none")
    samples = recording.imu
    if not len(samples["stamp_ns"]) or np.isnan(samples["gyro_rad_s"]).all():
        raise sphereflow.DataError(f"{data}: expected a gyro, found none")
    flow = odometry.DepthOdometry(recording.camera)
    total = min(len(recording), max_frames or len(recording))
    rates, middles, last = [], [], None
    for index, frame in enumerate(recording.frames(0, total)):
        if progress is not None:
            progress(index, total)
        if frame.depth_m is None:
            continue
        result = flow.push(frame.depth_m, frame.stamp_ns)
        if last is not None and result.status in ("tracked", "weak"):
            rates.append(result.angular_rad_s)
            middles.append((last + result.stamp_ns) // 2)
        last = result.stamp_ns
    if len(rates) < FEWEST_RATES:
        raise sphereflow.DataError(
            f"{data}: expected at least {FEWEST_RATES} pairs of frames that could be tracked, "
            f"found {len(rates)} in {total} frames"
        )
    return observers.calibrate_camera_imu(
        np.array(rates).reshape(-1, 3),
        np.array(middles, np.int64),
        samples["gyro_rad_s"],
        samples["stamp_ns"],
        largest_offset_s=largest_offset_s,
    )
