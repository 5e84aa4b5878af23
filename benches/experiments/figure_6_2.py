"""Thesis: Figure 6.2. Thesis: Figure 6.3. Velocities from depth images against the true ones.

The motions of section 6.4, one after another: rest, rotation about y, about z, about x, translation
along z, rapid rotation about y. The thesis moved a Kinect before a laser and a gyro; here the room
is simulated, so that the truth is exact, and the depth has the noise and the steps of a Kinect.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
import sphereflow as sf
from drawing import save

WIDTH, HEIGHT, FOCAL = 640, 480, 525.0
RATE_HZ = 30.0
REST_S, PART_S = 0.5, 2.0
# Axis of the twist [omega, v] and its amplitude, rad/s or m/s, of each part.
PARTS = [(1, 0.5), (2, 0.5), (0, 0.4), (5, 0.3), (1, 1.5)]
SIGMA_INV_M, STEP_INV_M = 1.5e-3, 2.85e-3
METHODS = ["single", "pyramid", "thesis"]
COLOURS = {"single": "tab:blue", "pyramid": "tab:green", "thesis": "tab:orange"}


def twist_at(t_s: float) -> np.ndarray:
    """True [omega, v] in the camera's frame: a whole sine in each part, so that it comes back."""
    twist = np.zeros(6)
    part, phase = divmod((t_s - REST_S) / PART_S, 1.0)
    if 0 <= part < len(PARTS):
        axis, amplitude = PARTS[int(part)]
        twist[axis] = amplitude * np.sin(2 * np.pi * phase)
    return twist


def step(twist: np.ndarray, dt_s: float) -> np.ndarray:
    """The rigid motion of a constant twist, 4x4: the exponential's series."""
    generator = np.zeros((4, 4))
    x, y, z = twist[:3]
    generator[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    generator[:3, 3] = twist[3:]
    result, term = np.eye(4), np.eye(4)
    for k in range(1, 12):
        term = term @ generator * (dt_s / k)
        result = result + term
    return result


def sequence(duration_s: float) -> tuple[sf.Camera, list[np.ndarray], np.ndarray]:
    """Camera, noisy depth images, and the true twist between each image and the next."""
    camera = sf.Camera.pinhole(FOCAL, FOCAL, 0.5 * (WIDTH - 1), 0.5 * (HEIGHT - 1), WIDTH, HEIGHT)
    room = sf.sim.Simulator(camera=camera, depth_noise="none", duration_s=0.1)
    pose = next(room.frames(0, 1)).world_from_camera
    noise = np.random.default_rng(64)
    images, twists = [], []
    dt_s = 1 / RATE_HZ
    for index in range(int(duration_s * RATE_HZ)):
        _, depth_m, _ = room.render(pose)
        images.append(_noisy(depth_m, noise))
        # Constant over the interval, so that it is what log(R, p) / dt must give.
        twists.append(twist_at((index + 0.5) * dt_s))
        pose = pose @ step(twists[-1], dt_s)
    return camera, images, np.array(twists[:-1])


def _noisy(depth_m: np.ndarray, noise: np.random.Generator) -> np.ndarray:
    inverse = 1 / depth_m.astype(np.float64) + noise.normal(0, SIGMA_INV_M, depth_m.shape)
    inverse = np.round(inverse / STEP_INV_M) * STEP_INV_M
    with np.errstate(divide="ignore"):
        return np.where(inverse > 0, 1 / inverse, np.nan).astype(np.float32)


def accepted_methods(camera: sf.Camera, depth_m: np.ndarray) -> list[str]:
    """The methods that this build of the engine has."""
    found = []
    for name in METHODS:
        try:
            sf.odometry.estimate_velocity(camera, depth_m, depth_m, 1 / RATE_HZ, method=name)
            found.append(name)
        except sf.ValueRangeError as error:
            print(f"figures 6.2, 6.3: no method '{name}' here: {error}")
    return found


def estimates(camera: sf.Camera, images: list[np.ndarray], method: str) -> np.ndarray:
    """[omega, v] of each pair, (N, 6); NaN where lost."""
    rows = []
    for first, second in pairwise(images):
        found = sf.odometry.estimate_velocity(camera, first, second, 1 / RATE_HZ, method=method)
        rows.append(np.concatenate([found.angular_rad_s, found.linear_m_s]))
    return np.array(rows)


# Thesis: Figure 6.2, Figure 6.3.
def main(out: Path, duration_s: float = REST_S + PART_S * len(PARTS) + REST_S) -> None:
    """Print the errors and draw both pictures."""
    camera, images, truth = sequence(duration_s)
    time_s = (np.arange(len(truth)) + 0.5) / RATE_HZ
    found = {name: estimates(camera, images, name) for name in accepted_methods(camera, images[0])}
    for name, values in found.items():
        error = values - truth
        v, w = (np.linalg.norm(error[:, part], axis=1) for part in (slice(3, 6), slice(0, 3)))
        print(
            f"figures 6.2, 6.3, {name}: median {np.nanmedian(v):.4f} m/s, "
            f"{np.nanmedian(w):.4f} rad/s; 90th percentile {np.nanpercentile(v, 90):.4f} m/s, "
            f"{np.nanpercentile(w, 90):.4f} rad/s; {np.isnan(v).sum()} of {len(v)} lost"
        )
    draw(out / "figure_6_2.png", time_s, truth[:, 3:], {k: v[:, 3:] for k, v in found.items()}, "v")
    draw(out / "figure_6_3.png", time_s, truth[:, :3], {k: v[:, :3] for k, v in found.items()}, "w")


def draw(
    path: Path, time_s: np.ndarray, truth: np.ndarray, found: dict[str, np.ndarray], what: str
) -> None:
    """Three plots, one an axis: estimates over the truth."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    name, unit = ("v", "m/s") if what == "v" else ("ω", "rad/s")
    figure, axes = plt.subplots(3, 1, figsize=(9, 7), sharex=True, layout="constrained")
    for index, plot in enumerate(axes):
        for method in sorted(found, key=lambda method: method != "thesis"):
            plot.plot(time_s, found[method][:, index], lw=0.9, color=COLOURS[method], label=method)
        plot.plot(time_s, truth[:, index], "k--", lw=0.8, label="truth")
        reach = 1.3 * np.abs(truth).max()
        plot.set(ylabel=f"{name}$_{'xyz'[index]}$ ({unit})", ylim=(-reach, reach))
        plot.grid(alpha=0.3)
    axes[0].legend(ncols=4, loc="upper left", fontsize="small")
    axes[0].set_title(
        "Velocity from pairs of depth images, furnished room, noise of a Kinect, 30 Hz"
    )
    axes[2].set_xlabel("time (s)")
    save(figure, path, dpi=100)
