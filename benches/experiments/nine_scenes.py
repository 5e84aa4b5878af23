"""Thesis: Theorem 3. The spectrum of the information that one range image has, scene by scene.

Each range image is a closed form: spheres, spheroids, round rooms and walls. What slides on itself
has an eigenvalue of zero; the picture shows the square roots, relative to the largest.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import sphereflow as sf
from drawing import save

Caster = Callable[[np.ndarray, np.ndarray], np.ndarray]

# A camera with no axis along the scenes', and off their centres.
POSITION_M = np.array([0.2, -0.1, 0.3])
CORRIDOR_M = np.array([0.2, -0.1, 0.0])


def attitude(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Turns about x, then y, then z, radians; 3x3."""
    (sx, sy, sz), (cx, cy, cz) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def ellipsoid(*axes_m: float) -> Caster:
    """An ellipsoid about the origin, from inside."""

    def cast(origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        o, r = origin / axes_m, rays / axes_m
        a, b, c = (r * r).sum(-1), r @ o, o @ o - 1
        return (-b + np.sqrt(b * b - a * c)) / a

    return cast


def walls(*list_of_walls: tuple[tuple[float, float, float], float]) -> Caster:
    """Walls `normal . X = distance`, from the side of the origin."""

    def cast(origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        nearest = np.full(rays.shape[:-1], np.inf)
        for normal, distance in list_of_walls:
            n = np.array(normal) / np.linalg.norm(normal)
            with np.errstate(divide="ignore"):
                t = (distance - n @ origin) / (rays @ n)
            nearest = np.where((t > 0) & (t < nearest), t, nearest)
        return np.where(np.isfinite(nearest), nearest, np.nan)

    return cast


def round_room(radius_m: float, half_height_m: float) -> Caster:
    """A round room about the y axis with floor and ceiling, from inside."""
    caps = walls(((0, 1, 0), half_height_m), ((0, -1, 0), half_height_m))

    def cast(origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        o, r = origin[[0, 2]], rays[..., [0, 2]]
        a, b, c = (r * r).sum(-1), r @ o, o @ o - radius_m**2
        with np.errstate(divide="ignore", invalid="ignore"):
            side = (-b + np.sqrt(b * b - a * c)) / a
        return np.fmin(side, caps(origin, rays))

    return cast


SIDES = [((1.0, 0.0, 0.0), 1.0), ((-1.0, 0.0, 0.0), 1.0)]
FLAT = [((0.0, 1.0, 0.0), 1.4), ((0.0, -1.0, 0.0), 1.2)]
BOX = [
    ((sign if axis == 0 else 0.0, sign if axis == 1 else 0.0, sign if axis == 2 else 0.0), half)
    for axis, half in enumerate([1.5, 2.25, 2.0])
    for sign in (1.0, -1.0)
]
# Name, whole sphere or a view of 58 x 45 degrees, place, scene, dimension of what goes unseen.
# Thesis: Theorem 3.
SCENES: list[tuple[str, bool, np.ndarray, Caster, int]] = [
    ("sphere", True, POSITION_M, ellipsoid(2, 2, 2), 3),
    ("spheroid", True, POSITION_M, ellipsoid(2, 1.5, 2), 1),
    ("round room", True, POSITION_M, round_room(2.5, 1.3), 1),
    ("ellipsoid", True, POSITION_M, ellipsoid(2, 1.5, 2.5), 0),
    ("box room", True, POSITION_M, walls(*BOX), 0),
    ("one wall", False, POSITION_M, walls(((0.2, 0.1, 1.0), 2.5)), 3),
    ("two walls", False, CORRIDOR_M, walls(((1, 0, 0.6), 2.0), ((-1, 0, 0.8), 2.2)), 1),
    ("corridor, no end", False, CORRIDOR_M, walls(*SIDES, *FLAT), 1),
    ("corridor, end wall", False, CORRIDOR_M, walls(*SIDES, *FLAT, ((0, 0, 1), 4.0)), 0),
    (
        "corner with floor",
        False,
        CORRIDOR_M,
        walls(((1, 0, 1), 2.0), ((-1, 0, 1), 2.2), ((0, 1, 0.3), 1.2)),
        0,
    ),
]


def look(whole: bool, position_m: np.ndarray, caster: Caster) -> sf.odometry.Information:
    """What the camera at a place sees of a scene."""
    camera = (
        sf.Camera.equirectangular(640, 320)
        if whole
        else sf.Camera.pinhole(290.0, 290.0, 159.5, 119.5, 320, 240)
    )
    rays = sf.SphereGrid(camera).rays
    range_m = caster(position_m, rays @ attitude(0.1, -0.2, 0.3).T)
    if whole:
        return sf.odometry.information(camera, range_m.astype(np.float32), along="ray")
    return sf.odometry.information(camera, (range_m * rays[..., 2]).astype(np.float32))


def main(out: Path) -> None:
    """Print the spectra and draw the picture."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(11, 4.5), layout="constrained")
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.9, 6))
    for place, (name, whole, position_m, caster, unseen) in enumerate(SCENES):
        found = look(whole, position_m, caster)
        relative = found.eigenvalues / found.eigenvalues[-1]
        names = found.unseen_names()
        print(
            f"nine scenes, {name}: {' '.join(f'{v:.2g}' for v in relative)}, "
            f"score {found.score:.4f}, unseen {len(names)} (expected {unseen})"
            + "".join(f"; {text}" for text in names)
        )
        heights = np.sqrt(relative).clip(1e-4)
        axes.bar(place + 0.13 * (np.arange(6) - 2.5), heights, 0.12, bottom=0, color=colours)
    axes.axhline(0.01, color="tab:red", lw=0.8, ls="--", label="below: not observable")
    labels = [name + ("\n360°" if whole else "\n58° x 45°") for name, whole, *_ in SCENES]
    axes.set_xticks(range(len(SCENES)), labels, fontsize="x-small")
    axes.set(
        yscale="log",
        ylim=(1e-4, 1.5),
        ylabel="seen, as a share of the best seen direction",
        title="What one range image lets see of the six velocities (Theorem 3)",
    )
    axes.legend(loc="lower right", fontsize="small")
    save(figure, out / "nine_scenes.png", dpi=100)
