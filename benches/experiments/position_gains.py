"""Thesis: eq. (9.9), section 9.6.2. What "gains large enough" means for the position observer.

A constant tilt theta of the attitude leaves the steady errors X~ = g theta / (k_vx + k_v k_X) and
V~ = k_X X~ (found by running the observer, too); the linear part decays at the real part of its
slower pole, whatever the positive gains; noise of the position passes the more the larger they are.
"""

from pathlib import Path

import numpy as np
from drawing import save
from sphereflow.navigation import PositionObserver

TILT = np.radians(0.5)
DT_S = 0.005
G = 9.81
PLACE_SIGMA, SPEED_SIGMA = 5e-3, 0.01


def poles(k_v: float, k_vx: float, k_x: float) -> np.ndarray:
    """Of (9.9) without the terms of the attitude's error, one axis."""
    return np.linalg.eigvals(np.array([[-k_x, 1.0], [-k_vx, -k_v]]))


def steady(k: float, noise: bool, seconds: float) -> tuple[float, float]:
    """Errors of a body at rest whose attitude is tilted, or whose inputs are noisy: m, m/s."""
    rng = np.random.default_rng(0)
    observer = PositionObserver([0.0, 0, 0], [0.0, 0, 0], k_v=k, k_vx=k, k_x=k)
    tilt = 0.0 if noise else TILT
    quat = [np.sin(tilt / 2), 0, 0, np.cos(tilt / 2)]
    rows = []
    for _ in range(int(seconds / DT_S)):
        v = rng.normal(scale=SPEED_SIGMA * noise, size=3)
        x = rng.normal(scale=PLACE_SIGMA * noise, size=3)
        observer.step([0.0, 0, 0], [0, -G, 0], quat, v, x, dt_s=DT_S)
        rows.append((np.linalg.norm(observer.position_m), np.linalg.norm(observer.velocity_m_s)))
    last = np.array(rows)[len(rows) // 2 :]
    return tuple(np.sqrt(np.mean(last**2, axis=0)))


def main(out: Path) -> None:
    """Print the errors and draw them over the gains."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    gains = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    rows = []
    for k in gains:
        place, speed = steady(k, False, 12.0)
        noise, _ = steady(k, True, 12.0)
        formula = G * TILT / (k + k * k)
        slow = poles(k, k, k)
        rows.append((place, formula, noise))
        print(
            f"(9.5), gains {k:g}: 0.5 deg of tilt leave {1e3 * place:.2f} mm (formula "
            f"{1e3 * formula:.2f}), {1e3 * speed:.1f} mm/s (formula {1e3 * k * formula:.1f}); "
            f"noise {1e3 * noise:.2f} mm; poles {np.round(slow, 2)}"
        )
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    table = 1e3 * np.array(rows)
    left.loglog(gains, table[:, 0], "o", label="tilt of 0.5 deg, found")
    left.loglog(gains, table[:, 1], "k--", label="g theta / (k_vx + k_v k_X)")
    left.loglog(gains, table[:, 2], "s-", label="noise of 5 mm and 0.01 m/s")
    left.set(xlabel="all gains", ylabel="rms error (mm)", title="Position observer (9.5)")
    left.legend(fontsize="small")
    k_x, k_vx = np.meshgrid(np.linspace(-2, 8, 101), np.linspace(-8, 8, 101))
    rate = np.array(
        [
            [-poles(4.0, b, a).real.max() for a, b in zip(*row, strict=True)]
            for row in zip(k_x, k_vx, strict=True)
        ]
    )
    shown = right.contourf(k_x, k_vx, rate, levels=np.arange(-6, 6.5, 1), cmap="RdBu")
    right.contour(k_x, k_vx, rate, levels=[0], colors="k")
    right.set(xlabel="k_X", ylabel="k_vx", title="Decay rate (1/s), k_v = 4")
    figure.colorbar(shown)
    left.grid(alpha=0.3)
    save(figure, out / "position_gains.png", dpi=90)
