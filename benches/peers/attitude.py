"""Attitude on the BROAD trials: ours beside vqf, imufusion and ahrs, on the same data in one run.

python benches/peers/attitude.py FOLDER      FOLDER holds broad-a
python benches/peers/attitude.py --speed     a million samples at once, beside vqf

vqf, imufusion, ahrs and scipy come from PyPI; whichever is missing is left out and named. Rows
"published" are the errors of Madgwick and Mahony in published_rmse.csv of the folder: with one gain
for all trials, and with each trial's best gain.
"""

from __future__ import annotations

import argparse
import csv
import importlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from sphereflow.attitude import AttitudeFilter

Trial = dict[str, Any]


def ours(trial: Trial, method: str = "inertial") -> np.ndarray:
    """Attitudes, w first."""
    stamp_ns = np.round(np.arange(len(trial["gyr"])) * trial["dt"] * 1e9).astype(np.int64)
    run = AttitudeFilter(method).run(trial["gyr"], trial["acc"], trial["mag"], stamp_ns)  # type: ignore[arg-type]
    return run.quat_xyzw[:, [3, 0, 1, 2]]


def with_vqf(trial: Trial) -> np.ndarray:
    """VQF in its real-time form at its defaults."""
    vqf = importlib.import_module("vqf").VQF(trial["dt"])
    return np.asarray(vqf.updateBatch(trial["gyr"], trial["acc"], trial["mag"])["quat9D"])


def with_imufusion(trial: Trial) -> np.ndarray:
    """imufusion's AHRS with its bias estimator, East-North-Up, at its example's settings."""
    imufusion = importlib.import_module("imufusion")
    settings, bias_settings = imufusion.AhrsSettings(), imufusion.BiasSettings()
    settings.convention, settings.sample_rate = imufusion.CONVENTION_ENU, 1 / trial["dt"]
    settings.gain, settings.gyroscope_range = 0.5, 2000
    settings.acceleration_rejection = settings.magnetic_rejection = 10
    settings.rejection_timeout = bias_settings.stationary_period = 5
    bias_settings.sample_rate = 1 / trial["dt"]
    ahrs, bias = imufusion.Ahrs(), imufusion.Bias()
    ahrs.set_settings(settings)
    bias.set_settings(bias_settings)
    out = np.empty((len(trial["gyr"]), 4))
    gyr = np.degrees(trial["gyr"])
    acc = trial["acc"] / 9.81
    for i in range(len(out)):
        ahrs.update(bias.update(gyr[i]), acc[i], trial["mag"][i])
        out[i] = ahrs.get_quaternion()
    return out


def with_ahrs(trial: Trial, name: str) -> np.ndarray:
    """A filter of the ahrs package at its defaults; Madgwick's world is north, west, up."""
    filters = importlib.import_module("ahrs").filters
    found = getattr(filters, name)(
        gyr=trial["gyr"], acc=trial["acc"], mag=1e3 * trial["mag"], frequency=1 / trial["dt"]
    )
    if name != "Madgwick":
        return np.asarray(found.Q)
    # From north, west, up to east, north, up: a quarter turn about the vertical.
    half = np.sqrt(0.5)
    w, x, y, z = np.asarray(found.Q).T
    return np.stack([w - z, x - y, y + x, z + w], 1) * half


def rmse_deg(quat: np.ndarray, trial: Trial) -> tuple[float, float, float]:
    """Total, heading and inclination error, degrees, over the samples that count."""
    w1, x1, y1, z1 = quat.T
    w2, x2, y2, z2 = (trial["truth"] * [1, -1, -1, -1]).T
    w = w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2
    z = w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2
    counts = trial["counts"] & np.isfinite(w)
    w, z = w[counts], z[counts]
    angles = (
        2 * np.arccos(np.clip(np.abs(w), 0, 1)),
        2 * np.arctan(z / w),
        2 * np.arccos(np.clip(np.sqrt(w**2 + z**2), 0, 1)),
    )
    total, heading, inclination = (float(np.degrees(np.sqrt(np.mean(a**2)))) for a in angles)
    return total, heading, inclination


METHODS: dict[str, Callable[[Trial], np.ndarray]] = {
    "ours": ours,
    "ours, invariant (9.4)": lambda trial: ours(trial, "invariant"),
    "vqf": with_vqf,
    "imufusion": with_imufusion,
    "ahrs Madgwick": lambda trial: with_ahrs(trial, "Madgwick"),
    "ahrs Mahony": lambda trial: with_ahrs(trial, "Mahony"),
}


def trials(folder: Path) -> dict[str, Trial]:
    """The trials of a folder."""
    from scipy.io import loadmat

    found = {}
    for path in sorted(folder.glob("*.mat")):
        raw = loadmat(path, squeeze_me=True)
        found[path.stem] = {
            "gyr": np.ascontiguousarray(raw["imu_gyr"], float),
            "acc": np.ascontiguousarray(raw["imu_acc"], float),
            "mag": np.ascontiguousarray(raw["imu_mag"], float),
            "truth": raw["opt_quat"],
            "counts": raw["movement"] == 1,
            "dt": 1 / float(raw["sampling_rate"]),
        }
    return found


def speed() -> None:
    """Seconds for a million samples."""
    rng, count = np.random.default_rng(0), 1_000_000
    trial = {
        "gyr": rng.normal(scale=0.5, size=(count, 3)),
        "acc": rng.normal(size=(count, 3)) + np.array([0, 0, 9.81]),
        "mag": np.tile([0.0, 20.0, -40.0], (count, 1)),
        "dt": 0.0035,
    }
    for name in ("ours", "vqf") * 3:
        start = time.perf_counter()
        METHODS[name](trial)
        print(f"{name:8s} {time.perf_counter() - start:.3f} s for a million samples")


def main() -> None:
    """Print a table, or the speed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--speed", action="store_true")
    arguments = parser.parse_args()
    if arguments.speed or arguments.folder is None:
        speed()
        return
    table(arguments.folder)


def published(folder: Path, names: list[str]) -> dict[str, list[float]]:
    """Total errors of the trials by method, degrees, as published with the benchmark."""
    with (folder / "published_rmse.csv").open() as file:
        rows = list(csv.DictReader(file))
    found: dict[str, list[float]] = {}
    for method in ("madgwick", "mahony"):
        for gain, column in [("one gain", "_at_TAGP"), ("best gain", "_best")]:
            own = {
                row["trial"]: float(row["total_rmse_deg" + column])
                for row in rows
                if row["algorithm"] == method
            }
            found[f"{method}, {gain}"] = [own[name] for name in names]
    return found


def table(folder: Path) -> None:
    """Errors of every method on every trial; at last ours over vqf, trial by trial."""
    loaded = trials(folder)
    totals: dict[str, list[float]] = {}
    print("columns: total (heading/inclination) RMSE, deg, of", ", ".join(loaded))
    for name, method in METHODS.items():
        try:
            rows = [rmse_deg(method(trial), trial) for trial in loaded.values()]
        except ModuleNotFoundError as error:
            print(f"{name}: left out, {error.name} is not installed")
            continue
        totals[name] = [row[0] for row in rows]
        texts = [f"{total:.2f} ({heading:.2f}/{tilt:.2f})" for total, heading, tilt in rows]
        print(f"{name:22s} mean {np.mean(totals[name]):.3f} deg: " + "  ".join(texts))
    for method, errors in published(folder, list(loaded)).items():
        texts = [f"{error:.2f}" for error in errors]
        print(f"published {method:20s} mean {np.mean(errors):.3f} deg: " + "  ".join(texts))
    if "vqf" in totals:
        ratios = np.divide(totals["ours"], totals["vqf"])
        print(f"ours / vqf: at most {ratios.max():.3f}: " + "  ".join(f"{r:.3f}" for r in ratios))


if __name__ == "__main__":
    main()
