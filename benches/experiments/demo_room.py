"""The picture of the README: what the simulated camera sees, and the map and path made of it."""

import tempfile
from pathlib import Path

import numpy as np
import sphereflow as sf
from drawing import save


def main(out: Path) -> None:
    """Run the demo and draw its first colour and depth image beside the map from above."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    room = sf.sim.demo(seed=0)
    frame = next(room.frames(0, 1))
    with tempfile.TemporaryDirectory() as folder:
        result = sf.run(room, Path(folder) / "result", pictures=False)
        xyz, rgb = _read_cloud(Path(folder) / "result" / "map.ply")
    path = result.trajectory.position_m
    figure, axes = plt.subplots(
        1, 3, figsize=(15, 4.4), layout="constrained", width_ratios=[4, 4, 5]
    )
    axes[0].imshow(frame.colour)
    axes[0].set_title("colour")
    image = axes[1].imshow(frame.depth_m, cmap="viridis")
    axes[1].set_title("depth, with a Kinect's noise")
    figure.colorbar(image, ax=axes[1], label="m", shrink=0.8)
    below_ceiling = xyz[:, 1] + 0.45 * xyz[:, 2] > -0.6  # the first camera looks down by 24 degrees
    axes[2].scatter(
        xyz[below_ceiling, 0], xyz[below_ceiling, 2], c=rgb[below_ceiling] / 255, s=0.05, marker="."
    )
    axes[2].plot(path[:, 0], path[:, 2], "r-", lw=1.5)
    axes[2].set(title="map and path from above", xlabel="x (m)", ylabel="z (m)", aspect="equal")
    for picture in axes[:2]:
        picture.set_axis_off()
    save(figure, out / "demo.png", dpi=75)
    print(f"demo: ATE {result.ape.statistics.rmse:.4f} m over {len(path)} poses")


def _read_cloud(path: Path) -> tuple[np.ndarray, np.ndarray]:
    raw = path.read_bytes()
    start = raw.index(b"end_header\n") + len(b"end_header\n")
    points = np.frombuffer(raw[start:], dtype=[("xyz", "<f4", 3), ("rgb", "u1", 3)])
    return points["xyz"], points["rgb"]
