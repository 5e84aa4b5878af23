"""Depth from the colour images and the poses of a real kitchen, against the Kinect's depth."""

from pathlib import Path

import numpy as np
import sphereflow as sf
from numpy.typing import NDArray
from sphereflow.depth import DepthFilter

FIRST = 200
FRAMES = 120
LAGS = (1, 3, 9, 24)  # of 30 images in a second
SETTLED = 40
"""Frames before results are judged."""

COLOUR_FOCAL_PX = 525.0
BASELINE_M = 0.025
"""The nominal colour camera of a Kinect, and how far it is to the left of the depth camera."""

POSE_SIGMA = 0.002
"""Metres and radians, as `sphereflow depth` tells the filter."""


def seen_by_colour(depth_m: NDArray[np.float32], focal_px: float) -> NDArray[np.float32]:
    """The depth camera's depth in the colour camera's pixels, NaN where it has none."""
    height, width = depth_m.shape
    y, x = np.nonzero(depth_m > 0)
    z = depth_m[y, x]
    scale = COLOUR_FOCAL_PX / focal_px
    u = np.rint((x - 320) * scale + 320 - COLOUR_FOCAL_PX * BASELINE_M / z).astype(int)
    v = np.rint((y - 240) * scale + 240).astype(int)
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    out = np.full(height * width, np.inf, np.float32)
    np.minimum.at(out, (v * width + u)[inside], z[inside])
    out[~np.isfinite(out)] = np.nan
    return out.reshape(height, width)


def test_depth_of_a_kitchen_is_within_a_tenth_and_as_sure_as_it_may_be(recordings: Path) -> None:
    recording = sf.io.open_recording(recordings / "sevenscenes-kitchen-a")
    truth = recording.truth
    assert truth is not None
    camera = sf.sphere.Camera.pinhole(COLOUR_FOCAL_PX, COLOUR_FOCAL_PX, 320, 240, 640, 480)
    axis = sf.sphere.SphereGrid(camera).rays[..., 2]
    depth_from_colour = np.eye(4)
    depth_from_colour[0, 3] = BASELINE_M
    estimator = DepthFilter(camera, lags=list(LAGS))
    errors: list[float] = []
    claims: list[NDArray[np.float64]] = []
    for index, frame in enumerate(recording.frames(FIRST, FIRST + FRAMES)):
        assert frame.colour is not None
        assert frame.depth_m is not None
        pose = truth.interpolate(frame.stamp_ns)
        assert pose is not None
        result = estimator.step(
            frame.colour.mean(-1),
            world_from_camera=pose @ depth_from_colour,
            stamp_ns=frame.stamp_ns,
            position_sigma_m=POSE_SIGMA,
            rotation_sigma_rad=POSE_SIGMA,
        )
        if index < SETTLED:
            continue
        relative = result.range_m * axis / seen_by_colour(frame.depth_m, 585.0) - 1
        errors.append(float(np.nanmedian(np.abs(relative))))
        std = result.std_m / result.range_m
        known = np.isfinite(relative) & (std < 0.2)
        claims.append(np.stack([relative[known], std[known]]))
    error, std = np.concatenate(claims, axis=1)
    claimed = error.size / (axis.size * len(errors))
    ratio = float(np.sqrt(np.mean((error / std) ** 2)))
    print(f"kitchen, {FRAMES} frames: median error {100 * np.mean(errors):.1f} %")
    print(
        f"{100 * claimed:.0f} % of pixels claimed to 20 %: {100 * np.median(np.abs(error)):.1f} %"
        f" off in the median, error over deviation {ratio:.2f}"
    )
    assert np.mean(errors) < 0.1
    assert claimed > 0.4
    assert 0.5 < ratio < 2
