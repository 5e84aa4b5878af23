"""Thesis: Proposition 7, Proposition 8, Proposition 9, Proposition 10. Stability of (7.4).

The errors about a periodic motion are a periodic linear system and a square (7.14): the largest
multiplier of one period says the exponential rate, for every gain, and whether it is below one at
all; the whole nonlinear observer from large and small errors shows how local that is; noise of half
the size leaves errors of half the size.
"""

from pathlib import Path

import numpy as np
from drawing import save

Floats = np.ndarray
PERIOD_S, STEPS = 4.0, 400
GRAVITY = np.array([0, 9.81, 0])
GAINS = {"v": 2.0, "g1": 1.0, "g2": 1.0, "w1": 1.0, "w2": 0.5, "a": 0.3}
START = np.array([0.1, -0.2, 0.15, 0.3, -0.1, 0.2, 0.02, 0.05, -0.03, 0.1, 0.2, -0.1])


def hat(w: Floats) -> Floats:
    """Matrix of the cross product."""
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def motion(t: float, turns: str) -> tuple[Floats, Floats, Floats]:
    """Velocity, rate, unit field in the body, of period PERIOD_S; the field truly turns with it.

    `turns`: about three axes; about one that stays orthogonal to the field; not at all.
    """
    angle = 2 * np.pi * t / PERIOD_S
    speed = np.array([0.3 * np.sin(angle), 0.2 * np.cos(angle), 0.2 * np.sin(2 * angle)])
    if turns == "three axes":
        # Attitude by yaw and pitch; rate and field follow from it.
        yaw, pitch = 0.6 * np.sin(angle), 0.5 * np.sin(2 * angle)
        dyaw, dpitch = (
            0.6 * np.cos(angle) * 2 * np.pi / PERIOD_S,
            1.0 * np.cos(2 * angle) * 2 * np.pi / PERIOD_S,
        )
        c, s = np.cos(pitch), np.sin(pitch)
        about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        rate = np.array([dpitch, 0, 0]) + about_x.T @ np.array([0, dyaw, 0])
        cy, sy = np.cos(yaw), np.sin(yaw)
        attitude = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]) @ about_x
        return speed, rate, attitude.T @ np.array([0.35, 0.85, 0.39])
    field = np.array([0.6, 0.8, 0.0])
    if turns == "none":
        return speed, np.zeros(3), field
    turn = 0.9 * np.sin(angle)
    c, s = np.cos(turn), np.sin(turn)  # about z, orthogonal to the field
    rate = np.array([0, 0, 0.9 * np.cos(angle) * 2 * np.pi / PERIOD_S])
    return speed, rate, np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ field


def matrix(t: float, gains: dict[str, float], turns: str) -> Floats:
    """The linear part of (7.14), errors of velocity, gravity, gyro bias, accelerometer bias."""
    v, w, b = motion(t, turns)
    k, out, one = gains, np.zeros((12, 12)), np.eye(3)
    out[:3] = np.hstack([-hat(w) - k["v"] * one, one, -hat(v), -one])
    out[3:6, :6] = np.hstack([-k["g1"] * one, -hat(w) - k["g2"] * np.outer(b, b)])
    out[6:9, :9] = np.hstack([-k["w2"] * hat(v), 0 * one, -k["w1"] * one])
    out[9:, :3] = k["a"] * one
    return out


def rate_per_s(gains: dict[str, float], turns: str) -> float:
    """Exponential rate of the slowest error: minus the logarithm of the largest multiplier."""
    h, whole = PERIOD_S / STEPS, np.eye(12)
    for i in range(STEPS):
        t = i * h
        a, m, b = (matrix(x, gains, turns) for x in (t, t + h / 2, t + h))
        k1 = a @ whole
        k2 = m @ (whole + h / 2 * k1)
        k3 = m @ (whole + h / 2 * k2)
        k4 = b @ (whole + h * k3)
        whole = whole + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return float(-np.log(np.max(np.abs(np.linalg.eigvals(whole)))) / PERIOD_S)


def paths(starts: Floats, seconds: float, noise: Floats, turns: str = "three axes") -> Floats:
    """Norms of the errors of (7.4) itself over time, from several starts, with a swinging noise.

    `noise` is the amplitude of all of a_m, omega_m, omega_bm, v_m, b_m, one a start."""
    k, h = GAINS, PERIOD_S / STEPS
    x = starts.copy()
    norms = []

    def rates(t: float, x: Floats) -> Floats:
        v, w, b = motion(t, turns)
        xi = (noise * np.sin(7 * t))[:, None] * np.array([1.0, -1, 0.5])
        dv, dg, dw, da = np.split(x, 4, axis=1)
        miss, g_hat, b_m = dv - xi, GRAVITY + dg, b + xi
        seen = np.sum(g_hat * b_m, axis=1) - float(GRAVITY @ b)
        return np.hstack(
            [
                np.cross(v + dv, w + xi - dw) - np.cross(v, w) + dg + xi - da - k["v"] * miss,
                np.cross(dg, w) - k["g1"] * miss - k["g2"] * seen[:, None] * b_m,
                -k["w1"] * (dw - xi) + k["w2"] * np.cross(miss, v + dv),
                k["a"] * miss,
            ]
        )

    for i in range(int(seconds / h)):
        t = i * h
        norms.append(np.linalg.norm(x, axis=1))
        k1 = rates(t, x)
        k2 = rates(t + h / 2, x + h / 2 * k1)
        k3 = rates(t + h / 2, x + h / 2 * k2)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(t + h, x + h * k3))
    return np.array(norms)


def main(out: Path, full: bool = False) -> None:
    """Print rates and bounds, draw them."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (sweep, decay, bound) = plt.subplots(1, 3, figsize=(15, 4.5), layout="constrained")
    for turns in ("three axes", "one axis", "none"):
        print(
            f"proposition 9, {turns}: slowest error falls at "
            f"{rate_per_s(GAINS, turns):.5f} per second"
        )
    factors = np.geomspace(0.05, 20, 25 if full else 9)
    for name in GAINS:
        rates = [rate_per_s(GAINS | {name: GAINS[name] * f}, "three axes") for f in factors]
        sweep.loglog(factors, np.maximum(rates, 1e-6), label=f"k_{name}")
        best = int(np.argmax(rates))
        print(
            f"proposition 9, k_{name} times {factors[0]:.2f} to {factors[-1]:.0f}: rate "
            f"{min(rates):.4f} to {max(rates):.4f} per second, best at {factors[best]:.2f}"
        )
    sweep.set(xlabel="factor on one gain", ylabel="rate (1/s)", title="Slowest rate of (7.14)")
    sweep.legend(fontsize="small")
    seconds = 400.0 if full else 60.0
    sizes = np.array([0.1, 1.0, 10.0])
    norms = paths(sizes[:, None] * START, seconds, np.zeros(3))
    time_s = np.arange(len(norms)) * PERIOD_S / STEPS
    for size, column in zip(sizes, norms.T, strict=True):
        decay.semilogy(time_s, column, label=f"errors times {size:g}")
    predicted = rate_per_s(GAINS, "three axes")
    half = 3 * len(norms) // 4
    found = -np.log(norms[-1] / norms[half]) / (time_s[-1] - time_s[half])
    print(f"proposition 9: predicted {predicted:.4f}, found {np.round(found, 4)} per second")
    decay.set(xlabel="time (s)", ylabel="norm of the errors", title="(7.4) from three starts")
    decay.legend(fontsize="small")
    sizes = np.geomspace(1e-4, 1e-1, 7)
    norms = paths(np.zeros((7, 12)), 2.5 * min(seconds, 160.0), sizes)
    ends = norms[-len(norms) // 4 :].max(axis=0)
    slope = np.polyfit(np.log(sizes[:5]), np.log(ends[:5]), 1)[0]
    print(
        f"proposition 10: error against noise, exponent {slope:.3f}, "
        f"factor {ends[3] / sizes[3]:.2f}"
    )
    bound.loglog(sizes, ends, "o-", label="largest error left")
    bound.loglog(sizes, ends[0] / sizes[0] * sizes, "k--", lw=0.8, label="proportional")
    bound.set(xlabel="amplitude of the noise", ylabel="norm of the errors", title="Proposition 10")
    bound.legend(fontsize="small")
    for axes in (sweep, decay, bound):
        axes.grid(alpha=0.3)
    save(figure, out / "propositions_9_10.png", dpi=90)
