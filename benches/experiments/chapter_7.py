"""Thesis: Figure 7.1, 7.2, 7.3, 7.4, 7.5, 7.6. Biases of inertial sensors with depth velocities.

The thesis moved a Kinect with its sensors by hand; here a hand-held camera in a furnished room is
simulated, with the noise of a Kinect, its velocities taken from pairs of depth images, and the
biases that section 7.7 reports added to the sensors. The observer (7.4) and its Kalman counterpart
run over the recording once, then again and again from the biases of the time before.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np
import sphereflow as sf
from drawing import save
from sphereflow.observers import ImuBiasEstimator, ImuBiasRun

RATE_HZ = 24.8  # of the Kinect of section 9.1.1
GYRO_BIAS = np.array([1.04, -0.21, -0.43]) * 1e-3  # section 7.7, rad/s
ACCEL_BIAS = np.array([0.072, -0.023, -0.12])  # section 7.7, m/s^2
IMU_HZ = 125.0  # section 9.1.2
GRAVITY = np.array([0, 9.81, 0])  # y down
FIELD_UT = np.array([5.0, 42.0, 20.0])  # of the earth, world frame
SPIKE_M_S = 0.3  # velocities of depth farther than this from their neighbours' median are left out
LOOPS = 8


class Recording:
    """Sensor samples, and velocities of depth at the samples that have one."""

    def __init__(self, seconds: float, depth_noise: str = "kinect") -> None:
        """Simulate it: IMU_HZ samples of the sensors, RATE_HZ depth images."""
        camera = sf.Camera.pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)
        made = {"camera": camera, "motion": "hand_held", "duration_s": seconds, "imu": False}
        room = sf.sim.Simulator(rate_hz=RATE_HZ, depth_noise=depth_noise, **made)
        path = sf.sim.Simulator(rate_hz=IMU_HZ, **made).truth
        self.stamp_ns = path.stamp_ns[1:-1]
        self._sense(path)
        blank = np.full_like(self.gyro, np.nan)
        self.velocity, self.turning, self.truth = blank.copy(), blank.copy(), blank.copy()
        frames = [(f.stamp_ns, f.depth_m, f.linear_m_s) for f in room.frames()]
        self.lost = 0
        for (before, first, v0), (now, second, v1) in pairwise(frames):
            dt_s = (now - before) * 1e-9
            found = sf.odometry.estimate_velocity(camera, first, second, dt_s)
            # A pair's velocity is that of its middle.
            at = int(np.searchsorted(self.stamp_ns, (now + before) // 2))
            if at >= len(blank):
                continue
            self.truth[at] = (v0 + v1) / 2
            if found.status != "tracked":
                self.lost += 1
                continue
            self.velocity[at], self.turning[at] = found.linear_m_s, found.angular_rad_s
        self._without_spikes()

    def _sense(self, path: sf.Trajectory) -> None:
        """Gyro, accelerometer and magnetometer from the true path by central differences."""
        noise = np.random.default_rng(7)
        h = 1 / IMU_HZ
        x, y, z, w = path.quat_xyzw.T
        rotation = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        ).transpose(2, 0, 1)
        here = rotation[1:-1]
        turn = here.transpose(0, 2, 1) @ (rotation[2:] - rotation[:-2]) / (2 * h)
        rate = np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=1)
        places = path.position_m
        acceleration = (places[2:] - 2 * places[1:-1] + places[:-2]) / h**2
        force = np.einsum("nji,nj->ni", here, acceleration - GRAVITY)
        field = np.einsum("nji,j->ni", here, FIELD_UT)

        def noisy(exact: np.ndarray, sigma: float) -> np.ndarray:
            return exact + noise.normal(scale=sigma, size=exact.shape)

        self.gyro = noisy(rate, 2.5e-3) + GYRO_BIAS
        self.accel = noisy(force, 0.028) + ACCEL_BIAS
        self.mag = noisy(field, 0.01 * float(np.linalg.norm(FIELD_UT)))

    def _without_spikes(self) -> None:
        rows = np.flatnonzero(~np.isnan(self.velocity[:, 0]))
        for i, row in enumerate(rows):
            near = self.velocity[rows[max(0, i - 4) : i + 5]]
            if np.linalg.norm(self.velocity[row] - np.median(near, axis=0)) > SPIKE_M_S:
                self.velocity[row] = self.turning[row] = np.nan
                self.lost += 1

    @property
    def time_s(self) -> np.ndarray:
        """Time since the first sample."""
        return (self.stamp_ns - self.stamp_ns[0]) * 1e-9

    def run(self, method: str, loops: int = 1) -> ImuBiasRun:
        """The states of an estimator, of the last of `loops` runs."""
        down = float(FIELD_UT @ GRAVITY / np.linalg.norm(FIELD_UT) / np.linalg.norm(GRAVITY))
        return ImuBiasEstimator(method, field_dot_down=down).run(
            self.stamp_ns,
            self.gyro,
            self.accel,
            self.velocity,
            self.turning,
            self.mag,
            velocity_sigma=0.05,
            angular_sigma=0.02,
            loops=loops,
        )

    def velocity_error(self, run: ImuBiasRun) -> np.ndarray:
        """Errors of the velocity where the truth is known, m/s, (N, 3)."""
        known = ~np.isnan(self.truth[run.sample, 0])
        return (run.velocity_m_s - self.truth[run.sample])[known]


def rms(rows: np.ndarray) -> float:
    """Root of the mean squared norm."""
    return float(np.sqrt(np.mean(np.sum(rows**2, axis=1))))


def report(recording: Recording, what: str) -> tuple[dict, dict]:
    """Print what one recording gives; its runs, once and looped, by method."""
    measured = ~np.isnan(recording.velocity[:, 0])
    raw = (recording.velocity - recording.truth)[measured]
    print(
        f"chapter 7, {what}: {measured.sum()} velocities of depth, {recording.lost} left out, "
        f"rms error {rms(raw):.4f} m/s"
    )
    once = {name: recording.run(name) for name in ("observer", "ekf")}
    looped = {name: [recording.run(name, k + 1) for k in range(LOOPS)] for name in once}
    for name in once:
        for label, run in (("once", once[name]), (f"{LOOPS} loops", looped[name][-1])):
            last = slice(-len(run) // 4, None)
            w, a = run.gyro_bias[last] - GYRO_BIAS, run.accel_bias[last] - ACCEL_BIAS
            print(
                f"chapter 7, {what}, {name}, {label}, last quarter: "
                f"gyro bias mean off {np.linalg.norm(w.mean(axis=0)):.1e}, "
                f"swing {np.abs(w - w.mean(axis=0)).max():.1e} rad/s; accelerometer bias mean off "
                f"{np.linalg.norm(a.mean(axis=0)):.4f}, swing "
                f"{np.abs(a - a.mean(axis=0)).max():.4f} m/s^2; "
                f"velocity rms {rms(recording.velocity_error(run)):.4f} m/s"
            )
    return once, looped


def main(out: Path, full: bool = False) -> None:
    """Print the biases and draw the six figures."""
    seconds = 160.0 if full else 40.0
    report(Recording(seconds, "independent"), "independent noise")
    recording = Recording(seconds)
    once, looped = report(recording, "noise of a Kinect")
    _draw(out, recording, once, looped)


def _draw(out: Path, recording: Recording, once: dict, looped: dict) -> None:
    time_s = recording.time_s
    biases = {"gyro": (GYRO_BIAS, "rad/s"), "accelerometer": (ACCEL_BIAS, "m/s²")}
    attribute = {"gyro": "gyro_bias", "accelerometer": "accel_bias"}
    for offset, runs, when in ((1, once, "one run"), (4, looped, f"{LOOPS} runs on end")):
        for shift, (sensor, (truth, unit)) in enumerate(biases.items()):
            curves = {}
            for name, run in runs.items():
                parts = run if isinstance(run, list) else [run]
                t = [time_s[part.sample] + k * time_s[-1] for k, part in enumerate(parts)]
                values = [getattr(part, attribute[sensor]) for part in parts]
                curves[name] = (np.concatenate(t), np.concatenate(values))
            _components(
                out / f"figure_7_{offset + shift}.png",
                curves,
                truth,
                f"bias of the {sensor} ({unit})",
                f"Estimated bias of the {sensor}, {when}: (7.4) and its Kalman counterpart",
            )
    measured = ~np.isnan(recording.velocity[:, 0])
    known = ~np.isnan(recording.truth[:, 0])
    truth = (time_s[known], recording.truth[known])
    noisy = (time_s[measured], recording.velocity[measured])
    first = once["observer"]
    last = looped["observer"][-1]
    _velocities(
        out / "figure_7_3.png",
        {
            "geometric flow": noisy,
            "(7.4)": (time_s[first.sample], first.velocity_m_s),
            "truth": truth,
        },
        "Velocity of pairs of depth images, and filtered by (7.4)",
    )
    _velocities(
        out / "figure_7_6.png",
        {
            "biases from zero": (time_s[first.sample], first.velocity_m_s),
            f"biases of {LOOPS - 1} runs before": (time_s[last.sample], last.velocity_m_s),
            "truth": truth,
        },
        "Velocity filtered by (7.4), from zero biases and from those of loops",
    )


def _components(path: Path, curves: dict, truth: np.ndarray, ylabel: str, title: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(9, 4.5), layout="constrained")
    for i, colour in enumerate(("tab:blue", "tab:orange", "tab:green")):
        for name, (t, values) in curves.items():
            keep = slice(None, None, max(1, len(t) // 2000))
            style = "-" if name == "observer" else ":"
            label = f"{'xyz'[i]}, {'(7.4)' if name == 'observer' else 'Kalman'}"
            axes.plot(t[keep], values[keep, i], style, color=colour, lw=1, label=label)
        axes.axhline(truth[i], color=colour, lw=0.6, ls="--")
    reach = np.ptp(truth) + 3 * np.abs(truth).max()
    axes.set(xlabel="time (s)", ylabel=ylabel, title=title, ylim=(-reach, reach))
    axes.legend(ncols=3, fontsize="small")
    axes.grid(alpha=0.3)
    save(figure, path)


def _velocities(path: Path, curves: dict, title: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, plots = plt.subplots(3, 1, figsize=(9, 7), sharex=True, layout="constrained")
    for i, plot in enumerate(plots):
        for (name, (t, values)), colour in zip(
            curves.items(), ("tab:red", "tab:blue", "black"), strict=True
        ):
            plot.plot(t, values[:, i], color=colour, lw=0.8, label=name)
        plot.set(ylabel=f"v$_{'xyz'[i]}$ (m/s)", ylim=(-1.2, 1.2))
        plot.grid(alpha=0.3)
    plots[0].set_title(title)
    plots[0].legend(ncols=3, fontsize="small")
    plots[2].set_xlabel("time (s)")
    save(figure, path)
