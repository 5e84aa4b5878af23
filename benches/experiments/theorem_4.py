"""Thesis: Theorem 4, Proposition 1, Proposition 2, Proposition 3, Proposition 4, Proposition 6.

The observer (5.16) on the whole sphere, in NumPy, for scenes known in closed form: an ellipsoid,
which hides nothing, and spheroid and sphere painted with their symmetry, which hide one rotation
and three. What is shown: V falls where the gains are above L/2; the errors of the estimates stay
bounded with their gradients, less with larger gains; inputs that differ a little give estimates
that differ a little; the biases of a still camera tend to the true ones if and only if the scene
has no rotation axis, else to those that differ by a motion that it does not show. A camera that
turns against the axis sees its biases all the same, as they turn with it and the axis does not.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from drawing import save
from scipy.ndimage import map_coordinates

Floats = np.ndarray
DT_S = 1 / 42
V_BIAS, W_BIAS = np.array([0.25, 0, 0]), np.array([0.05, 0, 0])
SCENES = {
    "ellipsoid": (np.array([2.0, 1.6, 2.5]), 1.0),
    "spheroid": (np.array([2.0, 2.5, 2.0]), 0.0),
    "sphere": (np.array([2.0, 2.0, 2.0]), 0.0),
}
"""Half axes about the world's origin, and how strong the painting that breaks the symmetry is."""


class Grid:
    """Longitude and latitude of the camera's rays, and the calculus on them."""

    def __init__(self, rows: int) -> None:
        """`rows` of latitude, twice as many of longitude."""
        self.rows, self.columns = rows, 2 * rows
        latitude = (np.arange(rows) + 0.5) * np.pi / rows - np.pi / 2
        longitude = (np.arange(2 * rows) + 0.5) * np.pi / rows - np.pi
        self.latitude, self.longitude = np.meshgrid(latitude, longitude, indexing="ij")
        c, s = np.cos(self.latitude), np.sin(self.latitude)
        cl, sl = np.cos(self.longitude), np.sin(self.longitude)
        self.rays = np.stack([c * sl, s, c * cl], axis=-1)
        self.east = np.stack([cl, 0 * cl, -sl], axis=-1)
        self.south = np.stack([-s * sl, c, -s * cl], axis=-1)
        edges = np.sin((np.arange(rows + 1)) * np.pi / rows - np.pi / 2)
        self.weights = np.repeat(np.diff(edges)[:, None] * np.pi / rows, 2 * rows, axis=1)
        self.step = np.pi / rows

    def _padded(self, values: Floats, pad: int) -> Floats:
        """Rows beyond a pole are those half way round; columns wrap."""
        turned = np.roll(values, self.rows, axis=1)
        tall = np.concatenate([turned[:pad][::-1], values, turned[-pad:][::-1]])
        return np.concatenate([tall[:, -pad:], tall, tall[:, :pad]], axis=1)

    def gradient(self, values: Floats) -> Floats:
        """By central differences."""
        p = self._padded(values, 1)
        south = (p[2:, 1:-1] - p[:-2, 1:-1]) / (2 * self.step)
        east = (p[1:-1, 2:] - p[1:-1, :-2]) / (2 * self.step * np.cos(self.latitude))
        return south[..., None] * self.south + east[..., None] * self.east

    def at(self, values: Floats, rays: Floats) -> Floats:
        """Cubic look-up at other rays."""
        pad = 4
        latitude = np.arcsin(np.clip(rays[..., 1], -1, 1))
        longitude = np.arctan2(rays[..., 0], rays[..., 2])
        row = (latitude + np.pi / 2) / self.step - 0.5 + pad
        column = (longitude + np.pi) / self.step - 0.5 + pad
        return map_coordinates(self._padded(values, pad), [row, column], order=3, mode="nearest")


@dataclass
class Camera:
    """A camera inside a scene: range and brightness of every ray, in closed form."""

    axes: Floats
    painting: float
    centre: Floats = field(default_factory=lambda: np.zeros(3))
    rotation: Floats = field(default_factory=lambda: np.eye(3))

    def see(self, rays: Floats) -> tuple[Floats, Floats]:
        """Brightness and range."""
        world = rays @ self.rotation.T
        direction, start = world / self.axes, self.centre / self.axes
        a, b = np.sum(direction**2, axis=-1), direction @ start
        distance = (-b + np.sqrt(b * b - a * (start @ start - 1))) / a
        point = self.centre + distance[..., None] * world
        lines = np.cos(1.5 * point[..., 1]) if self.axes[1] != self.axes[0] else 0 * point[..., 1]
        marks = np.sin(1.2 * point[..., 0]) + np.cos(1.4 * point[..., 2] + 0.4)
        return lines + self.painting * marks, distance

    def move(self, v: Floats, w: Floats, dt_s: float) -> None:
        """By the body's velocities, at the middle of the step."""
        half = self.rotation @ turn(w * dt_s / 2)
        self.centre = self.centre + half @ v * dt_s
        self.rotation = self.rotation @ turn(w * dt_s)


def turn(vector: Floats) -> Floats:
    """Rotation matrix of a rotation vector."""
    angle = np.linalg.norm(vector)
    x, y, z = vector
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * np.sinc(angle / 2 / np.pi) ** 2 * k @ k


def velocities(t: float) -> tuple[Floats, Floats]:
    """Of the camera: it stays within some decimetres of the origin."""
    v = 0.25 * np.array([np.cos(1.1 * t), np.sin(1.7 * t + 1), np.cos(1.4 * t + 2)])
    return v, 0.3 * np.array([np.sin(0.9 * t), np.cos(1.3 * t), np.sin(1.6 * t + 1)])


@dataclass
class Run:
    """What one run gives, a row a step."""

    linear: Floats
    angular: Floats
    lyapunov: Floats
    slope: Floats
    images: Floats
    shown: Floats
    needed: float


def observe(
    scene: str,
    seconds: float,
    rows: int,
    k: float = 2.0,
    k_v: float = 0.3,
    k_w: float = 0.1,
    off: float = 0.0,
    still: bool = False,
) -> Run:
    """(5.16) with a semi-Lagrangian transport.

    `off` is added to the velocities, as other inputs; a `still` camera does not move.
    """
    grid, lambda_y, lambda_d = Grid(rows), 1.0, 1.0
    camera = Camera(*SCENES[scene], centre=np.array([0.4, 0.1, 0.2]))
    rays, weights = grid.rays, grid.weights
    y, d = camera.see(rays)
    y_hat, d_hat = y.copy(), d.copy()
    w_hat, v_hat = np.zeros(3), np.zeros(3)
    out: list[tuple] = []
    needed = 0.0
    for i in range(int(seconds / DT_S)):
        v, w = (0 * V_BIAS, 0 * W_BIAS) if still else velocities((i + 0.5) * DT_S)
        v_m, w_m = v + V_BIAS + off, w + W_BIAS + off
        camera.move(v, w, DT_S)
        before = d
        y, d = camera.see(rays)
        middle = (before + d) / 2
        left = v_m - v_hat
        flow = np.cross(rays, w_m - w_hat + np.cross(rays, left) / middle[..., None])
        halfway = rays - 0.5 * DT_S * flow
        halfway /= np.linalg.norm(halfway, axis=-1, keepdims=True)
        again = np.stack([grid.at(flow[..., j], halfway) for j in range(3)], axis=-1)
        foot = rays - DT_S * again
        foot /= np.linalg.norm(foot, axis=-1, keepdims=True)
        towards = (rays + foot) @ left / 2
        y_hat = (grid.at(y_hat, foot) + k * DT_S * y) / (1 + k * DT_S)
        d_hat = (grid.at(d_hat, foot) - DT_S * towards + k * DT_S * d) / (1 + k * DT_S)
        y_miss, d_miss = lambda_y * (y_hat - y) * weights, lambda_d * (d_hat - d) * weights
        gy, gd = grid.gradient(y_hat), grid.gradient(d_hat)
        torque = y_miss[..., None] * np.cross(gy, rays) + d_miss[..., None] * np.cross(gd, rays)
        tangent = y_miss[..., None] * gy + d_miss[..., None] * gd
        force = d_miss[..., None] * rays - tangent / d[..., None]  # eta x (eta x g) = -g
        w_hat = w_hat - k_w * DT_S * torque.sum(axis=(0, 1))
        v_hat = v_hat - k_v * DT_S * force.sum(axis=(0, 1))
        wrong_v, wrong_w = v_hat - V_BIAS, w_hat - W_BIAS
        images = 0.5 * np.sum(y_miss * (y_hat - y) + d_miss * (d_hat - d))
        energy = images + wrong_w @ wrong_w / (2 * k_w) + wrong_v @ wrong_v / (2 * k_v)
        errors = grid.gradient(y_hat - y), grid.gradient(d_hat - d)
        steep = max(np.linalg.norm(g, axis=-1).max() for g in errors)
        g = grid.gradient(d)
        away = np.cross(rays, wrong_w + np.cross(rays, wrong_v) / d[..., None])
        unseen = np.sum(g * away, axis=-1) + rays @ wrong_v  # (5.31); below (5.30)
        painted = np.sum(grid.gradient(y) * away, axis=-1)
        shown = float(np.sqrt(np.sum(weights * (unseen**2 + painted**2)) / (4 * np.pi)))
        spread = (2 * rays @ v + np.sum(g * (v - (rays @ v)[..., None] * rays), axis=-1) / d) / d
        out.append((wrong_v, wrong_w, energy, steep, np.sqrt(images), shown))
        needed = max(needed, float(np.abs(spread).max()) / 2)
    columns = [np.array(column) for column in zip(*out, strict=True)]
    return Run(*columns, needed=needed)


def main(out: Path, full: bool = False) -> None:
    """Print what is left, draw the curves."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    seconds, rows = (60.0, 36) if full else (12.0, 24)
    figure, axes = plt.subplots(2, 3, figsize=(15, 8), layout="constrained")
    for scene, still in [(name, still) for still in (False, True) for name in SCENES]:
        run = observe(scene, seconds, rows, still=still)
        label = f"{scene}, {'still' if still else 'moving'} camera"
        t, style = (np.arange(len(run.lyapunov)) + 1) * DT_S, "--" if still else "-"
        axes[0, 0].semilogy(t, np.linalg.norm(run.linear, axis=1), style, label=label)
        axes[0, 1].semilogy(t, np.linalg.norm(run.angular, axis=1), style, label=label)
        axes[0, 2].semilogy(t, run.lyapunov, style, label=label)
        rises = np.diff(run.lyapunov)
        print(
            f"theorem 4, {label}: biases off by {np.linalg.norm(run.linear[-1]):.1e} m/s, "
            f"{np.linalg.norm(run.angular[-1]):.1e} rad/s after {seconds:.0f} s; what the scene "
            f"shows of that {run.shown[-1]:.1e}, at the start {run.shown[0]:.1e}; V falls on "
            f"{np.mean(rises < 0):.1%} of steps, rises at most "
            f"{max(rises.max(), 0) / run.lyapunov[0]:.1e} of its start; k = 2, L/2 = "
            f"{run.needed:.2f}"
        )
    for k in (0.1, 0.5, 2.0, 10.0):
        run = observe("ellipsoid", min(seconds, 20.0), rows, k=k)
        t = (np.arange(len(run.slope)) + 1) * DT_S
        axes[1, 0].semilogy(t, run.slope, label=f"k = {k:g}")
        print(
            f"propositions 2, 3, 6, k = {k:g}: gradient of an estimate's error at most "
            f"{run.slope.max():.3f}, last {run.slope[-1]:.1e}"
        )
    base = observe("ellipsoid", min(seconds, 10.0), rows)
    sizes, differences = np.array([1e-4, 1e-3, 1e-2, 1e-1]), []
    for off in sizes:
        other = observe("ellipsoid", min(seconds, 10.0), rows, off=off)
        # The other run's true biases differ by `off` too; what is compared are the estimates.
        change = np.hstack([other.linear - base.linear, other.angular - base.angular])
        differences.append(np.abs(change).max())
    slope = np.polyfit(np.log(sizes[:3]), np.log(differences[:3]), 1)[0]
    print(
        f"proposition 4: inputs off by 1e-4, estimates by {differences[0]:.1e} at most; "
        f"exponent {slope:.3f}"
    )
    axes[1, 1].loglog(sizes, differences, "o-")
    axes[1, 1].set(xlabel="change of the velocities", ylabel="change of the biases")
    for coarse in (12, 24, 48):
        run = observe("ellipsoid", 8.0, coarse)
        rises = np.maximum(np.diff(run.lyapunov), 0).sum() / run.lyapunov[0]
        print(f"proposition 1, {coarse} rows: V's rises add up to {rises:.1e} of its start")
        axes[1, 2].semilogy(
            (np.arange(len(run.lyapunov)) + 1) * DT_S, run.lyapunov, label=f"{coarse} rows"
        )
    titles = [
        ("Theorem 4: error of the linear bias", "m/s"),
        ("Theorem 4: error of the angular bias", "rad/s"),
        ("Lyapunov function (5.17)", "V"),
        ("Propositions 3, 6: steepest error", "gradient"),
        ("Proposition 4", "change of the biases"),
        ("Proposition 1, by the grid", "V"),
    ]
    for plot, (title, ylabel) in zip(axes.flat, titles, strict=True):
        plot.set(title=title, ylabel=ylabel)
        if title != "Proposition 4":
            plot.set_xlabel("time (s)")
            plot.legend(fontsize="small")
        plot.grid(alpha=0.3)
    save(figure, out / "theorem_4.png", dpi=90)
