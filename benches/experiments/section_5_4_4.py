"""Thesis: section 5.4.4, eq. (5.34), Figure 5.9, Figure 5.10. Gyro biases from real images.

A Kinect turned by hand (`tum-fr1-rpy-a` in SPHEREFLOW_DATA); its gyro is simulated from the
recorded truth, with the thesis's bias. As there, the recording is processed again and again:
forwards and backwards in turn, so that no image jumps. Observer (5.34) takes the linear velocity
for zero; the information form leaves it unknown. The thesis's camera turned at 0.15 rad/s; this
one at up to 3.
"""

import os
from itertools import pairwise
from pathlib import Path

import numpy as np
import sphereflow as sf
from drawing import save
from sphereflow.observers import VelocityBiasEstimator

BIAS = np.array([1.0304, -1.0384, 1.2129]) * 1e-3  # section 5.4.4, rad/s
GYRO_SIGMA = 2.5e-3 / np.sqrt(6)  # six readings a frame
READOUT_S = 0.03
APART_NS = 20_000_000  # truth and images of this recording: see the command `info`


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a* b of quaternions x, y, z, w."""
    x, y, z, w = a
    return np.array([[w, z, -y, -x], [-z, w, x, -y], [y, -x, w, -z], [x, y, z, w]]) @ b


def attitude(truth: sf.Trajectory, stamp_ns: int) -> np.ndarray | None:
    """Between two truths; none in a gap."""
    pose = truth.interpolate(stamp_ns, max_gap_s=0.05)
    if pose is None:
        return None
    i = int(np.searchsorted(truth.stamp_ns, stamp_ns))
    a, b = truth.quat_xyzw[i - 1], truth.quat_xyzw[i]
    share = (stamp_ns - truth.stamp_ns[i - 1]) / (truth.stamp_ns[i] - truth.stamp_ns[i - 1])
    q = (1 - share) * a + share * (b if a @ b > 0 else -b)
    return q / np.linalg.norm(q)


def estimators(camera: sf.Camera) -> dict[str, VelocityBiasEstimator]:
    """What is compared."""
    return {
        "(5.34), printed gains": VelocityBiasEstimator(camera, "observer"),
        "(5.34), k_omega times 100": VelocityBiasEstimator(camera, "observer", k_omega=1e-3),
        "information form": VelocityBiasEstimator(
            camera,
            forget_s=1000.0,
            angular_sigma=GYRO_SIGMA,
            angular_bias_sigma=0.05,
            readout_s=READOUT_S,
            timing_sigma_s=0.01,
        ),
    }


def main(out: Path, full: bool = False) -> None:
    """Print the biases after each run and draw them."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    folder = os.environ.get("SPHEREFLOW_DATA")
    if folder is None:
        print("section 5.4.4: SPHEREFLOW_DATA is not set, nothing done")
        return
    recording = sf.io.open_recording(Path(folder) / "tum-fr1-rpy-a")
    frames = []
    for frame in recording.frames():
        if frame.depth_m is None or frame.colour is None:
            continue
        q = attitude(recording.truth, frame.stamp_ns - APART_NS)
        if q is not None:
            grey = np.asarray(frame.colour, np.float32).mean(axis=2)[::4, ::4]
            frames.append((frame.stamp_ns, grey, frame.depth_m[::4, ::4], q))
    whole = recording.camera
    camera = sf.Camera.pinhole(
        whole.parameters["fx"] / 4,
        whole.parameters["fy"] / 4,
        whole.parameters["cx"] / 4,
        whole.parameters["cy"] / 4,
        frames[0][1].shape[1],
        frames[0][1].shape[0],
    )
    compared = estimators(camera)
    found: dict[str, list[np.ndarray]] = {name: [] for name in compared}
    noise = np.random.default_rng(0)
    runs = 6 if full else 2
    order = [i for run in range(runs) for i in range(len(frames))[:: 1 if run % 2 == 0 else -1]]
    for before, now in pairwise(order):
        dt_s = abs(frames[now][0] - frames[before][0]) * 1e-9
        if dt_s == 0:
            continue
        turn = product(frames[before][3], frames[now][3])
        rate = 2 * turn[:3] * np.sign(turn[3]) / dt_s
        gyro = rate + BIAS + noise.normal(scale=GYRO_SIGMA, size=3)
        for name, estimator in compared.items():
            linear = None if name == "information form" else np.zeros(3)
            state = estimator.step(
                frames[now][1], frames[now][2], gyro, linear, dt_s=min(dt_s, 0.4)
            )
            found[name].append(state.angular_rad_s - BIAS)
    figure, axes = plt.subplots(1, 1, figsize=(9, 4.5), layout="constrained")
    for name, rows in found.items():
        norms = np.linalg.norm(rows, axis=1)
        last = np.array(rows[-len(frames) :])
        print(
            f"section 5.4.4, {name}: after {runs} runs off by {norms[-1]:.1e} rad/s, mean of the "
            f"last run {np.linalg.norm(last.mean(axis=0)):.1e}, swing "
            f"{np.abs(last - last.mean(axis=0)).max():.1e}"
        )
        axes.semilogy(np.arange(len(norms)) / len(frames), norms, lw=0.9, label=name)
    axes.set(
        xlabel="runs over the recording, forwards and backwards in turn",
        ylabel="error of the gyro bias (rad/s)",
        title="freiburg1_rpy, gyro simulated from the truth",
    )
    axes.legend()
    axes.grid(alpha=0.3)
    save(figure, out / "section_5_4_4.png", dpi=90)
