"""The sequence of section 4.1.1 for the experiments, at half its size."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import sphereflow as sf

RATE_HZ = 60.0


def camera(width: int, height: int) -> sf.Camera:
    """50 x 40 degrees, border to border."""
    fx = 0.5 * width / np.tan(np.radians(25))
    fy = 0.5 * height / np.tan(np.radians(20))
    return sf.Camera.pinhole(fx, fy, 0.5 * width - 0.5, 0.5 * height - 0.5, width, height)


@dataclass(frozen=True, slots=True)
class Frame:
    """An image with noise and what is true of it."""

    t_s: float
    stamp_ns: int
    image: np.ndarray
    range_m: np.ndarray
    world_from_camera: np.ndarray
    linear_m_s: np.ndarray
    angular_rad_s: np.ndarray


def frames(
    view: sf.Camera, sigma: float, duration_s: float, scene: str = "thesis_room", seed: int = 1
) -> Iterator[Frame]:
    """Thesis: section 4.1.1. Brightness of integers 1 to 256 and normal noise of `sigma`."""
    simulator = sf.sim.Simulator(
        scene=scene,
        motion="sinusoids_411",
        camera=view,
        rate_hz=RATE_HZ,
        duration_s=duration_s,
        depth_noise="none",
        imu=False,
    )
    noise = np.random.default_rng(seed)
    for index, frame in enumerate(simulator.frames()):
        image = np.clip(np.round(frame.exact_grey), 1, 256)
        yield Frame(
            t_s=index / RATE_HZ,
            stamp_ns=frame.stamp_ns,
            image=image + sigma * noise.standard_normal(image.shape),
            range_m=frame.exact_range_m,
            world_from_camera=frame.world_from_camera,
            linear_m_s=frame.linear_m_s,
            angular_rad_s=frame.angular_rad_s,
        )


def error_percent(range_m: np.ndarray, truth_m: np.ndarray) -> float:
    """Thesis: section 4.1.1. The global relative error E, percent."""
    return 100 * float(np.mean(np.abs(range_m - truth_m) / truth_m))


def smoothed(image: np.ndarray, sigma_px: float) -> np.ndarray:
    """A Gaussian prefilter; zero for none."""
    if sigma_px == 0:
        return image
    radius = int(np.ceil(3 * sigma_px))
    kernel = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma_px) ** 2)
    kernel /= kernel.sum()
    padded = np.pad(image, radius, mode="edge")
    height, width = image.shape
    rows = sum(w * padded[i : i + height] for i, w in enumerate(kernel))
    return sum(w * rows[:, i : i + width] for i, w in enumerate(kernel))
