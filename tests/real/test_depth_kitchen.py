"""Depth from the colour images and the poses of a real kitchen, against the Kinect's depth."""

from pathlib import Path

import numpy as np
import sphereflow as sf
from numpy.typing import NDArray
from sphereflow.depth import DepthFilter

FIRST = 200
FRAMES = 120
STRETCHES = range(0, 500, 100)
STRETCH = 100
LAGS = (1, 2, 4, 8, 16, 32)
"""The defaults', of 30 images in a second."""
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


def depth_of(
    recording: sf.io.Recording, first: int, count: int
) -> tuple[float, float, NDArray[np.float64]]:
    """Median error of images once settled, in the mean; the share of pixels claimed to 20 %, and
    their errors and deviations, relative."""
    truth = recording.truth
    assert truth is not None
    camera = sf.sphere.Camera.pinhole(COLOUR_FOCAL_PX, COLOUR_FOCAL_PX, 320, 240, 640, 480)
    axis = sf.sphere.SphereGrid(camera).rays[..., 2]
    depth_from_colour = np.eye(4)
    depth_from_colour[0, 3] = BASELINE_M
    estimator = DepthFilter(camera, lags=list(LAGS))
    errors: list[float] = []
    claims: list[NDArray[np.float64]] = []
    for index, frame in enumerate(recording.frames(first, first + count)):
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
    claimed = np.concatenate(claims, axis=1)
    return float(np.mean(errors)), claimed.shape[1] / (axis.size * len(errors)), claimed


def test_depth_of_a_kitchen_is_within_a_tenth_and_as_sure_as_it_may_be(recordings: Path) -> None:
    recording = sf.io.open_recording(recordings / "sevenscenes-kitchen-a")
    median, claimed, (error, std) = depth_of(recording, FIRST, FRAMES)
    ratio = float(np.sqrt(np.mean((error / std) ** 2)))
    print(f"kitchen, {FRAMES} frames: median error {100 * median:.1f} %")
    print(
        f"{100 * claimed:.0f} % of pixels claimed to 20 %: {100 * np.median(np.abs(error)):.1f} %"
        f" off in the median, error over deviation {ratio:.2f}"
    )
    assert median < 0.1
    assert claimed > 0.4
    assert 0.5 < ratio < 2


def test_depth_of_a_kitchen_begun_anywhere_is_as_sure_as_it_may_be(recordings: Path) -> None:
    """One stretch says little: small changes of the filter move its error by a tenth of it."""
    recording = sf.io.open_recording(recordings / "sevenscenes-kitchen-a")
    found = [depth_of(recording, first, STRETCH) for first in STRETCHES]
    medians, shares, claims = zip(*found, strict=True)
    error, std = np.concatenate(claims, axis=1)
    ratio = float(np.sqrt(np.mean((error / std) ** 2)))
    each = ", ".join(f"{100 * median:.1f}" for median in medians)
    print(f"kitchen begun anew every {STRETCH} frames: median errors {each} %")
    print(
        f"mean {100 * np.mean(medians):.1f} %; {100 * np.mean(shares):.0f} % of pixels claimed to"
        f" 20 %: {100 * np.median(np.abs(error)):.1f} % off in the median, error over deviation"
        f" {ratio:.2f}"
    )
    assert np.mean(medians) < 0.15
    assert np.mean(shares) > 0.3
    assert 0.5 < ratio < 2
