"""Thesis: section 4.1.1. The depth filter at full size: error and normalised deviation."""

from pathlib import Path

import numpy as np
import sphereflow as sf
from drawing import save
from sequence_411 import camera, error_percent, frames


def curve(
    scene: str, sigma: float, duration_s: float
) -> tuple[list[float], list[float], list[float]]:
    """Times, errors E in percent, and root mean square of error over deviation."""
    view = camera(640, 480)
    depth_filter = sf.depth.DepthFilter(view)
    times, errors, normalised = [], [], []
    for frame in frames(view, sigma, duration_s, scene):
        result = depth_filter.step(
            frame.image, world_from_camera=frame.world_from_camera, stamp_ns=frame.stamp_ns
        )
        if result.std_m is None or result.status == "started":
            continue
        times.append(frame.t_s)
        errors.append(error_percent(result.range_m, frame.range_m))
        ratio = (result.range_m - frame.range_m) / result.std_m
        normalised.append(float(np.sqrt(np.mean(ratio**2))))
    return times, errors, normalised


def main(out: Path) -> None:
    """Print the figures and draw the picture."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (above, below) = plt.subplots(2, 1, figsize=(7, 6), sharex=True, layout="constrained")
    for scene, sigma in [("thesis_room", 0.0), ("thesis_room", 10.0), ("ellipsoid", 10.0)]:
        times, errors, normalised = curve(scene, sigma, 4.0)
        late = [e for t, e in zip(times, errors, strict=True) if t >= 2]
        half = errors[min(range(len(times)), key=lambda i: abs(times[i] - 0.5))]
        print(
            f"depth filter, {scene}, sigma {sigma:g}: E(0.5 s) {half:.2f} %, 2 to 4 s mean "
            f"{np.mean(late):.3f} %, max {np.max(late):.3f} %, "
            f"normalised {np.median(normalised):.2f}"
        )
        label = f"{scene}, sigma {sigma:g}"
        above.plot(times, errors, label=label)
        below.plot(times, normalised, label=label)
    above.set(ylabel="E (%)", ylim=(0, 2), title="Depth filter, 640x480, 60 Hz")
    above.legend()
    below.set(ylabel="error / deviation (rms)", xlabel="time (s)", ylim=(0, 5))
    save(figure, out / "depth_filter.png", dpi=100)
