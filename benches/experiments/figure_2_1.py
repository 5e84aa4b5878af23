"""Thesis: Figure 2.1. How far the flat image Laplacian is from the sphere's, over the image.

The scene is a plane orthogonal to the optical axis, Gamma = Gamma0 / sqrt(1 + z1^2 + z2^2). The
sphere's Laplacian is the engine's own, on the grid of a 60 x 50 degree pinhole camera; the flat one
is the closed form of section 2.2.1.
"""

from pathlib import Path

import numpy as np
import sphereflow as sf
from drawing import save

WIDTH, HEIGHT = 640, 480


def pinhole(width_deg: float, height_deg: float) -> sf.Camera:
    """A pinhole camera whose image spans the two angles exactly, border to border."""
    fx = 0.5 * WIDTH / np.tan(0.5 * np.radians(width_deg))
    fy = 0.5 * HEIGHT / np.tan(0.5 * np.radians(height_deg))
    return sf.Camera.pinhole(fx, fy, 0.5 * WIDTH - 0.5, 0.5 * HEIGHT - 0.5, WIDTH, HEIGHT)


def discrepancy_percent(camera: sf.Camera) -> np.ndarray:
    """|flat - sphere| / |flat| in percent, (H, W)."""
    grid = sf.SphereGrid(camera)
    gamma = grid.rays[..., 2]
    z1, z2 = grid.rays[..., 0] / gamma, grid.rays[..., 1] / gamma
    radius2 = z1**2 + z2**2
    flat = (radius2 - 2) / (1 + radius2) ** 2.5
    return 100 * np.abs(flat - grid.laplacian(gamma)) / np.abs(flat)


def exact_percent(z1: float, z2: float) -> float:
    """The same from both closed forms of section 2.2.1, at one point of the image plane."""
    n2 = 1 + z1**2 + z2**2
    flat, sphere = (n2 - 3) / n2**2.5, -2 / n2**0.5
    return float(100 * abs(flat - sphere) / abs(flat))


def main(out: Path) -> None:
    """Print the figures and draw the picture."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    for width_deg, height_deg in [(60, 50), (50, 40)]:
        percent = discrepancy_percent(pinhole(width_deg, height_deg))
        inner = percent[1:-1, 1:-1]
        corner = exact_percent(
            np.tan(np.radians(width_deg / 2)), np.tan(np.radians(height_deg / 2))
        )
        print(
            f"figure 2.1, {width_deg} x {height_deg} deg: extreme corner {corner:.1f} % "
            f"(centre of the corner pixel {percent[0, 0]:.1f} %), "
            f"middle of the right side {percent[HEIGHT // 2, -1]:.1f} %, "
            f"middle of the top {percent[0, WIDTH // 2]:.1f} %, median {np.median(inner):.1f} %"
        )
        if (width_deg, height_deg) == (60, 50):
            figure, axes = plt.subplots(figsize=(7, 5), layout="constrained")
            image = axes.imshow(percent, cmap="magma")
            lines = axes.contour(
                percent, levels=[25, 50, 100, 150, 200], colors="w", linewidths=0.8
            )
            axes.clabel(lines, fmt="%d %%")
            axes.set(
                title="Flat against spherical Laplacian of 1/D, plane ahead, 60° x 50°",
                xlabel="column (px)",
                ylabel="row (px)",
            )
            figure.colorbar(image, label="relative difference (%)")
            save(figure, out / "figure_2_1.png", dpi=120)
