"""Biases of velocities from images, in the thesis's simulation.

Thesis: Figure 5.4. Thesis: Figure 5.5. Thesis: Figure 5.6. Thesis: Figure 5.7.
A room painted with sinusoids is seen by a camera of 50 x 40 degrees at 42 Hz, biases being 2.5 m/s
and 0.05 rad/s, without noise and with that of section 5.4.3. The observer (5.33) with the printed
gains (its source corrected, its discretisation stable) stands beside its normalised form and the
information form. The thesis's path is only plotted; here it is that of section 4.1.1.
"""

from pathlib import Path

import numpy as np
import sphereflow as sf
from drawing import save
from sphereflow.observers import VelocityBiasEstimator

WIDTH, HEIGHT, RATE_HZ, SECONDS = 160, 120, 42.0, 20.0
BINNED = 4  # means of 4 x 4 pixels of 640 x 480 have a quarter of the noise
ANGULAR_BIAS, LINEAR_BIAS = np.array([0.05, 0, 0]), np.array([2.5, 0, 0])
EXACT = {"grey": 0.0, "depth": 0.0, "linear": 0.0, "angular": 0.0}
NOISE = {"grey": 30.0 / BINNED, "depth": 0.25 / BINNED, "linear": 0.05, "angular": 0.005}


def room() -> sf.sim.Simulator:
    """The room of the thesis and its camera."""
    fx = 0.5 * WIDTH / np.tan(np.radians(25))
    fy = 0.5 * HEIGHT / np.tan(np.radians(20))
    camera = sf.Camera.pinhole(fx, fy, 0.5 * WIDTH - 0.5, 0.5 * HEIGHT - 0.5, WIDTH, HEIGHT)
    return sf.sim.Simulator(
        scene="thesis_room",
        motion="sinusoids_411",
        camera=camera,
        rate_hz=RATE_HZ,
        duration_s=SECONDS,
        depth_noise="none",
        image_sigma_grey=0.0,
        imu=False,
    )


def estimators(camera: sf.Camera, noise: dict[str, float]) -> dict[str, VelocityBiasEstimator]:
    """What is compared."""
    sigma = {
        "linear_sigma": max(noise["linear"], 1e-3),
        "angular_sigma": max(noise["angular"], 1e-4),
    }
    return {
        "(5.33), printed gains": VelocityBiasEstimator(camera, "observer"),
        "(5.33), normalised": VelocityBiasEstimator(camera, "normalised"),
        "information form": VelocityBiasEstimator(camera, "information", **sigma),
    }


def errors(noise: dict[str, float]) -> dict[str, np.ndarray]:
    """Errors of linear and angular bias after each frame, camera frame, (N, 2, 3)."""
    simulator, rng = room(), np.random.default_rng(0)
    compared = estimators(simulator.camera, noise)
    found: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {name: [] for name in compared}
    dt_s, before = 1 / RATE_HZ, None
    for frame in simulator.frames():
        pose = frame.world_from_camera
        # The mean velocities over the step, as two instants half way.
        angular, linear = np.zeros(3), np.zeros(3)
        if before is not None:
            angular = 0.5 * (before.angular_rad_s + frame.angular_rad_s)
            linear = before.world_from_camera[:3, :3].T @ (
                pose[:3, 3] - before.world_from_camera[:3, 3]
            )
            linear = linear / dt_s - 0.5 * dt_s * np.cross(angular, linear / dt_s)
        before = frame
        grey = frame.exact_grey + rng.normal(scale=noise["grey"] + 1e-12, size=(HEIGHT, WIDTH))
        depth = frame.exact_range_m + rng.normal(scale=noise["depth"] + 1e-12, size=(HEIGHT, WIDTH))
        angular = angular + ANGULAR_BIAS + rng.normal(scale=noise["angular"] + 1e-12, size=3)
        linear = linear + LINEAR_BIAS + rng.normal(scale=noise["linear"] + 1e-12, size=3)
        for name, estimator in compared.items():
            state = estimator.step(
                grey.astype(np.float32),
                depth.astype(np.float32),
                angular,
                linear,
                dt_s=dt_s,
                along="ray",
            )
            v = np.zeros(3) if state.linear_m_s is None else state.linear_m_s
            found[name].append((v - LINEAR_BIAS, state.angular_rad_s - ANGULAR_BIAS))
    return {name: np.array(rows) for name, rows in found.items()}


def main(out: Path) -> None:
    """Print the figures and draw the pictures."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    for noise, numbers, title in [
        (EXACT, ("5_4", "5_5"), "without noise"),
        (NOISE, ("5_6", "5_7"), "with noise"),
    ]:
        found = errors(noise)
        for name, rows in found.items():
            norms = np.linalg.norm(rows, axis=2)
            after = norms[int(RATE_HZ) :].max(axis=0)
            last = norms[-int(3 * RATE_HZ) :].max(axis=0)
            print(
                f"section 5.4.3 {title}, {name}: "
                f"from 1 s {after[0]:.4f} m/s, {after[1]:.1e} rad/s; "
                f"last 3 s {last[0]:.4f} m/s, {last[1]:.1e} rad/s"
            )
        for column, unit in enumerate(("m/s", "rad/s")):
            what = ("linear", "angular")[column]
            figure, (parts, norms) = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
            name, rows = next(iter(found.items()))
            time_s = np.arange(len(rows)) / RATE_HZ
            for axis, label in enumerate("xyz"):
                parts.plot(time_s, rows[:, column, axis], label=label)
            parts.set(title=f"{name}: components, camera frame", ylabel=f"error ({unit})")
            for name, rows in found.items():
                norms.semilogy(time_s, np.linalg.norm(rows[:, column], axis=1), label=name)
            norms.set(title="norms of the three estimators", ylabel=f"norm of the error ({unit})")
            for axes in (parts, norms):
                axes.set_xlabel("time (s)")
                axes.legend()
                axes.grid(visible=True, alpha=0.3)
            figure.suptitle(f"Error of the {what} bias, {title}; true biases 2.5 m/s, 0.05 rad/s")
            save(figure, out / f"figure_{numbers[column]}.png", dpi=110)
