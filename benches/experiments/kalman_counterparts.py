"""Thesis: section 7.6, section 9.6.1, section 9.6.2. Each observer beside its Kalman counterpart.

Monte Carlo on one motion known in closed form, sensors sampled at 200 Hz, images at 25 Hz:

- (7.4), in NumPy over all draws and gains at once, against the filter of the same states;
- (9.2) with (9.5), corrected, against the navigation filter.

Printed are errors, how they depend on the gains, and for the filter whether the covariance is
true: the squared error in units of it, a freedom (1 is right).
"""

from pathlib import Path

import numpy as np
from drawing import save
from sphereflow.attitude import VisualAttitude
from sphereflow.navigation import NavigationFilter, PositionObserver
from sphereflow.observers import ImuBiasEstimator

Floats = np.ndarray
DT_S, EVERY = 0.005, 8
GRAVITY = np.array([0, 9.81, 0])
FIELD = np.array([0.35, 0.85, 0.39]) / np.linalg.norm([0.35, 0.85, 0.39])
GYRO_SIGMA, ACCEL_SIGMA = 2.5e-3, 0.028
VELOCITY_SIGMA, ANGULAR_SIGMA = 0.01, 5e-3
PLACE_SIGMA, ATTITUDE_SIGMA = 5e-3, np.radians(0.5)
GYRO_BIAS, ACCEL_BIAS = np.array([0.010, -0.008, 0.012]), np.array([0.072, -0.023, -0.12])
GAINS = {"v": 2.0, "g1": 1.0, "g2": 0.3, "w1": 0.05, "w2": 1e-3, "a": 0.1}


def rotation_of(q: Floats) -> Floats:
    """Matrices of quaternions x, y, z, w."""
    x, y, z, w = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


class Motion:
    """A body that swings and looks around; attitude q_y(yaw) q_x(pitch) q_z(roll)."""

    def __init__(self, seconds: float) -> None:
        """Truth at every sample."""
        t = self.time_s = np.arange(int(seconds / DT_S)) * DT_S
        self.stamp_ns = (np.arange(len(t)) * 5_000_000).astype(np.int64)
        self.quat = self._attitude(t)
        rotation = self.rotation = rotation_of(self.quat)
        h = 1e-4
        slope = (rotation_of(self._attitude(t + h)) - rotation_of(self._attitude(t - h))) / (2 * h)
        skew = np.swapaxes(rotation, 1, 2) @ slope
        self.rate = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
        amplitude, pulse, phase = np.array([0.3, 0.15, 0.2]), np.array([1.5, 2.1, 1.1]), [0, 1, 2]
        angle = np.outer(t, pulse) + phase
        self.place = amplitude * np.sin(angle)
        world = amplitude * pulse * np.cos(angle)
        acceleration = -amplitude * pulse**2 * np.sin(angle)
        self.velocity = np.einsum("nji,nj->ni", rotation, world)
        self.force = np.einsum("nji,nj->ni", rotation, acceleration - GRAVITY)
        self.gravity = np.einsum("nji,j->ni", rotation, GRAVITY)
        self.field = np.einsum("nji,j->ni", rotation, FIELD)

    @staticmethod
    def _attitude(t: Floats) -> Floats:
        yaw, pitch, roll = 0.8 * np.sin(0.7 * t), 0.5 * np.sin(1.1 * t + 1), 0.4 * np.sin(0.9 * t)
        (cy, sy), (cp, sp), (cr, sr) = ((np.cos(a / 2), np.sin(a / 2)) for a in (yaw, pitch, roll))
        return np.stack(
            [
                cy * sp * cr + sy * cp * sr,
                sy * cp * cr - cy * sp * sr,
                cy * cp * sr - sy * sp * cr,
                cy * cp * cr + sy * sp * sr,
            ],
            axis=-1,
        )


class Readings:
    """What the sensors give, one draw."""

    def __init__(self, motion: Motion, seed: int) -> None:
        """Noise of one seed."""
        rng = np.random.default_rng(seed)
        shape = motion.rate.shape

        def noisy(exact: Floats, sigma: float) -> Floats:
            return exact + rng.normal(scale=sigma, size=shape)

        self.gyro = noisy(motion.rate, GYRO_SIGMA) + GYRO_BIAS
        self.accel = noisy(motion.force, ACCEL_SIGMA) + ACCEL_BIAS
        self.mag = noisy(motion.field, 0.01)
        self.velocity = noisy(motion.velocity, VELOCITY_SIGMA)
        self.turning = noisy(motion.rate, ANGULAR_SIGMA)
        self.place = noisy(motion.place, PLACE_SIGMA)
        self.tilt = rng.normal(scale=ATTITUDE_SIGMA, size=shape)
        self.seen = np.arange(shape[0]) % EVERY == 0


def observer(motion: Motion, draws: list[Readings], gains: dict[str, Floats]) -> dict[str, Floats]:
    """Errors of (7.4) for all draws and all gains: axes (sample, gain, draw, 3)."""
    count = len(draws)
    shape = (len(next(iter(gains.values()))), count, 3)
    k = {name: np.asarray(value)[:, None, None] for name, value in gains.items()}
    stack = {
        name: np.stack([getattr(d, name) for d in draws], axis=1)
        for name in ("gyro", "accel", "mag", "velocity", "turning")
    }
    v = np.broadcast_to(stack["velocity"][0], shape).copy()
    g = np.broadcast_to(-stack["accel"][0], shape).copy()
    g *= 9.81 / np.linalg.norm(g, axis=-1, keepdims=True)
    w_b, a_b = np.zeros(shape), np.zeros(shape)
    product = GRAVITY @ FIELD
    out = {name: np.zeros((len(motion.time_s), *shape)) for name in ("gyro", "accel", "velocity")}
    v_m = w_bm = None
    for i in range(len(motion.time_s)):
        w, a, b = stack["gyro"][i], stack["accel"][i], stack["mag"][i]
        if i % EVERY == 0:
            v_m, w_bm = stack["velocity"][i], stack["gyro"][i] - stack["turning"][i]
            v_age = 0.0
        # A velocity is compared with the estimate of its own time: both move alike since.
        miss = v - v_m if v_age == 0.0 else np.zeros(shape)
        share = EVERY if v_age == 0.0 else 0.0  # the correction of eight steps at once
        v_age += DT_S
        seen = np.sum(g * b, axis=-1, keepdims=True) - product
        dv = np.cross(v, w - w_b) + g + a - a_b - share * k["v"] * miss
        dg = np.cross(g, w - w_bm) - share * k["g1"] * miss - k["g2"] * seen * b
        dw = -k["w1"] * (w_b - w_bm) + share * k["w2"] * np.cross(miss, v)
        da = share * k["a"] * miss
        v, g, w_b, a_b = v + DT_S * dv, g + DT_S * dg, w_b + DT_S * dw, a_b + DT_S * da
        out["gyro"][i], out["accel"][i] = w_b - GYRO_BIAS, a_b - ACCEL_BIAS
        out["velocity"][i] = v - motion.velocity[i]
    return out


def imu_filter(motion: Motion, readings: Readings) -> tuple[dict[str, Floats], float]:
    """The filter of the same states: errors over time, squared error a freedom at the end."""
    blank = np.where(readings.seen[:, None], 1.0, np.nan)
    estimator = ImuBiasEstimator(
        "ekf",
        field_dot_down=float(FIELD @ GRAVITY / 9.81),
        gyro_sigma_rad_s=GYRO_SIGMA,
        accel_sigma_m_s2=ACCEL_SIGMA,
    )
    run = estimator.run(
        motion.stamp_ns,
        readings.gyro,
        readings.accel,
        readings.velocity * blank,
        readings.turning * blank,
        readings.mag,
        velocity_sigma=VELOCITY_SIGMA,
        angular_sigma=ANGULAR_SIGMA,
    )
    at = run.sample
    errors = {
        "time_s": motion.time_s[at],
        "gyro": run.gyro_bias - GYRO_BIAS,
        "accel": run.accel_bias - ACCEL_BIAS,
        "velocity": run.velocity_m_s - motion.velocity[at],
        "gravity": run.gravity_m_s2 - motion.gravity[at],
    }
    covariance = estimator.state.covariance
    last = np.concatenate([errors[name][-1] for name in ("velocity", "gravity", "gyro", "accel")])
    # Gravity has two freedoms: its norm is known.
    share = float(last @ np.linalg.pinv(covariance, rcond=1e-9) @ last) / 11
    return errors, share


def turned(quat: Floats, vector: Floats) -> Floats:
    """A quaternion, turned on the right by a small rotation vector."""
    x, y, z, w = quat
    left = np.array([[w, -z, y, x], [z, w, -x, y], [-y, x, w, z], [-x, -y, -z, w]])
    step = left @ np.concatenate([vector / 2, [1.0]])
    return step / np.linalg.norm(step)


def localise(motion: Motion, readings: Readings, gain: float, position_gain: float) -> Floats:
    """(9.2) then (9.5), corrected, from sensors without bias: errors of angle, speed, place."""
    attitude = VisualAttitude(gain)
    position = PositionObserver(
        readings.velocity[0],
        readings.place[0],
        k_v=position_gain,
        k_vx=position_gain,
        k_x=position_gain,
    )
    rows = []
    for i in range(len(motion.time_s)):
        see = readings.seen[i]
        gyro, accel = readings.gyro[i] - GYRO_BIAS, readings.accel[i] - ACCEL_BIAS
        visual = turned(motion.quat[i], readings.tilt[i]) if see else None
        attitude.step(gyro, visual, dt_s=DT_S)
        q = attitude.quat_xyzw
        if q is None:
            continue
        position.step(
            gyro,
            accel,
            q,
            readings.velocity[i] if see else None,
            readings.place[i] if see else None,
            dt_s=DT_S,
        )
        angle = 2 * np.arccos(np.clip(abs(q @ motion.quat[i]), 0, 1))
        rows.append(
            (
                angle,
                np.linalg.norm(position.velocity_m_s - motion.velocity[i]),
                np.linalg.norm(position.position_m - motion.place[i]),
            )
        )
    return np.array(rows)


def navigate(motion: Motion, readings: Readings) -> Floats:
    """The navigation filter on the same readings, biases unknown to it."""
    navigation = NavigationFilter(gyro_sigma_rad_s=GYRO_SIGMA, accel_sigma_m_s2=ACCEL_SIGMA)
    rows = []
    for i, stamp in enumerate(motion.stamp_ns):
        navigation.push_imu(int(stamp), readings.gyro[i], readings.accel[i])
        if readings.seen[i]:
            pose = np.eye(4)
            pose[:3, :3] = rotation_of(turned(motion.quat[i], readings.tilt[i]))
            pose[:3, 3] = readings.place[i]
            navigation.push_pose(int(stamp), pose, (ATTITUDE_SIGMA, PLACE_SIGMA))
            navigation.push_velocity(int(stamp), readings.velocity[i], VELOCITY_SIGMA)
        state = navigation.state(int(stamp))
        if state is None:
            continue
        angle = 2 * np.arccos(np.clip(abs(state.quat_xyzw @ motion.quat[i]), 0, 1))
        rows.append(
            (
                angle,
                np.linalg.norm(state.velocity_m_s - motion.rotation[i] @ motion.velocity[i]),
                np.linalg.norm(state.position_m - motion.place[i]),
            )
        )
    return np.array(rows)


def rms(values: Floats) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def main(out: Path, full: bool = False) -> None:
    """Print the comparisons and draw them."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    seconds, draws = (120.0, 20) if full else (30.0, 4)
    motion = Motion(seconds)
    readings = [Readings(motion, seed) for seed in range(draws)]
    factors = np.geomspace(0.1, 10, 9)
    sweep = {name: GAINS[name] * (factors if name != "v" else 1.0) * np.ones(9) for name in GAINS}
    sweep["g1"] = GAINS["g1"] * np.ones(9)
    found = observer(motion, readings, sweep)
    half = len(motion.time_s) // 2
    filters = [imu_filter(motion, one) for one in readings]
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.5), layout="constrained")
    for name, unit in (("gyro", "rad/s"), ("accel", "m/s^2"), ("velocity", "m/s")):
        norms = np.linalg.norm(found[name][half:], axis=-1)
        errors = np.sqrt(np.mean(norms**2, axis=(0, 2)))
        kalman = [np.linalg.norm(e[name][len(e[name]) // 2 :], axis=1) for e, _ in filters]
        print(
            f"(7.4) against its filter, {draws} draws of {seconds:.0f} s, second half, {name}: "
            f"gains as listed {errors[4]:.2e}, best of the sweep {errors.min():.2e}, "
            f"worst {errors.max():.2e}; filter {rms(np.concatenate(kalman)):.2e} {unit}"
        )
        if name != "velocity":
            axes[0].loglog(factors, errors, "o-", label=f"(7.4), {name} ({unit})")
            axes[0].axhline(rms(np.concatenate(kalman)), ls="--", lw=0.8, color="grey")
    print(
        f"filter of (7.4)'s states: squared error a freedom at the end "
        f"{np.mean([share for _, share in filters]):.2f}"
    )
    axes[0].set(xlabel="factor on the gains", ylabel="rms error", title="(7.4); dashed: its filter")
    motion = Motion(20.0)
    readings = [Readings(motion, seed) for seed in range(draws)]
    half = len(motion.time_s) // 2
    filters = [navigate(motion, one)[half:] for one in readings]
    kalman = [rms(np.concatenate(filters)[:, i]) for i in range(3)]
    gains = np.geomspace(0.25, 32, 8)
    rows = []
    for gain in gains:
        parts = [localise(motion, one, gain, gain)[half:] for one in readings[: max(2, draws // 4)]]
        rows.append([rms(np.concatenate(parts)[:, i]) for i in range(3)])
        print(
            f"(9.2), (9.5) with all gains {gain:g}: {np.degrees(rows[-1][0]):.3f} deg, "
            f"{rows[-1][1]:.4f} m/s, {rows[-1][2]:.4f} m"
        )
    print(
        f"navigation filter, same readings, biases unknown: {np.degrees(kalman[0]):.3f} deg, "
        f"{kalman[1]:.4f} m/s, {kalman[2]:.4f} m"
    )
    table = np.array(rows)
    axes[1].loglog(gains, np.degrees(table[:, 0]), "o-", label="(9.2)")
    axes[1].axhline(np.degrees(kalman[0]), ls="--", label="navigation filter")
    axes[1].set(xlabel="gain (1/s)", ylabel="attitude error (deg)", title="Attitude")
    axes[2].loglog(gains, table[:, 2], "o-", label="(9.5)")
    axes[2].axhline(kalman[2], ls="--", label="navigation filter")
    axes[2].set(xlabel="gain", ylabel="position error (m)", title="Position")
    for plot in axes:
        plot.legend(fontsize="small")
        plot.grid(alpha=0.3)
    save(figure, out / "kalman_counterparts.png", dpi=90)
