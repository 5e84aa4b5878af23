"""Print the tables of BENCHMARKS.md: run it again to check them.

    python benches/figures.py                      # simulator and demo only
    SPHEREFLOW_DATA=... python benches/figures.py  # and the real recordings

Each run is a process of its own, so that peak memory is the run's.
"""

import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import sphereflow as sf

TUM, KITCHEN = "tum-fr1-rpy-a", "sevenscenes-kitchen-a"
TUM_READOUT_S = "0.03"
COMMAND = Path(sys.executable).parent / "sphereflow"
SIM_FRAMES = 150


def machine() -> str:
    """Processor, cores and versions, in a line."""
    names = [
        line.split(":")[1].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    processor = names[0] if names else platform.processor()
    return (
        f"{processor}, {os.cpu_count()} cores, Python {platform.python_version()}, "
        f"sphereflow {sf.__version__}"
    )


def simulator_rows() -> list[str]:
    """Frames per second of the simulator, with and without noise."""
    rows = ["| simulator, 640x480 unless said | frames/s |", "| --- | --- |"]
    wide = sf.Camera.equirectangular(1024, 512)
    cases = {
        "furnished room, Kinect and image noise": sf.sim.Simulator(),
        "furnished room, no noise": sf.sim.Simulator(depth_noise="none", image_sigma_grey=0.0),
        "furnished room, rolling shutter 30 ms, noise": sf.sim.Simulator(readout_s=0.03),
        "thesis room, no noise": sf.sim.Simulator(
            scene="thesis_room", motion="sinusoids_411", depth_noise="none", image_sigma_grey=0.0
        ),
        "furnished room, 360 degrees 1024x512, no noise": sf.sim.Simulator(
            camera=wide, depth_noise="none", image_sigma_grey=0.0
        ),
    }
    for name, simulator in cases.items():
        count = min(SIM_FRAMES, len(simulator))
        start = time.perf_counter()
        for _ in simulator.frames(0, count):
            pass
        rows.append(f"| {name} | {count / (time.perf_counter() - start):.0f} |")
    return rows


def scale_and_rest(truth: sf.Trajectory, estimate: sf.Trajectory) -> tuple[float, float]:
    """Scale that would fit the estimate to the truth best, and the ATE of a camera at rest."""
    fitted = sf.eval.ape(truth, estimate, align="sim3", max_difference_s=0.02)
    path = fitted.reference_position_m
    rest = np.sqrt(((path - path.mean(axis=0)) ** 2).sum(axis=1).mean())
    return fitted.scale, float(rest)


HEADS = [
    "`sphereflow run`",
    "frames",
    "lost",
    "coverage",
    "ATE odometry m",
    "ATE m",
    "at rest m",
    "scale",
    "RPE 1 s m",
    "RPE 1 s deg",
    "keyframes, edges",
    "odometry ms",
    "comparing s",
    "frames/s",
    "peak MiB",
]


def row(cells: list[str]) -> str:
    """A line of a table."""
    return "| " + " | ".join(cells) + " |"


def run_row(name: str, command: list[str], true_path: sf.Trajectory) -> str:
    """One run of the command line, read from the files that it writes."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "result"
        subprocess.run(
            [COMMAND, *command, "--out", out, "--no-pictures"],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        report = json.loads((out / "report.json").read_text())
        scale, rest = scale_and_rest(true_path, sf.Trajectory.read(out / "trajectory.tum"))
    error = {key: value["statistics"]["rmse"] for key, value in report["truth"].items()}
    graph = report["pose_graph"]
    return row(
        [
            name,
            str(report["frames"]),
            str(report["outcomes"]["lost"]["frames"]),
            f"{100 * report['coverage']:.1f} %",
            f"{error['odometry_ape']:.4f}",
            f"{error['ape']:.4f}",
            f"{rest:.3f}",
            f"{scale:.3f}",
            f"{error['odometry_rpe_1s_translation']:.4f}, {error['rpe_1s_translation']:.4f}",
            f"{error['odometry_rpe_1s_rotation']:.2f}, {error['rpe_1s_rotation']:.2f}",
            f"{graph['keyframes']}, {graph['edges']}",
            f"{sum(report['front_ms_per_frame'].values()):.1f}",
            f"{report['seconds']['compare']:.1f}",
            f"{report['frames_per_s']:.0f}",
            f"{report['peak_memory_bytes'] / 2**20:.0f}",
        ]
    )


def calibrated(data: Path, out: Path) -> float:
    """Writes the calibration that the recording's own motion gives; seconds it took."""
    start = time.perf_counter()
    subprocess.run(
        [COMMAND, "calib", "depth", data, "--out", out], check=True, stdout=subprocess.DEVNULL
    )
    return time.perf_counter() - start


def truth_of(folder: Path) -> sf.Trajectory:
    """The true motion of a recording."""
    truth = sf.io.open_recording(folder).truth
    assert truth is not None, f"{folder} has no truth"
    return truth


def run_rows() -> list[str]:
    """The main job, on the simulated room and on the recordings there are, in every mode."""
    rows = [row(HEADS), row(["---"] * len(HEADS))]
    drawn = "demo room, seed 0 (frames/s includes drawing it)"
    rows.append(run_row(drawn, ["demo"], sf.sim.demo(seed=0).truth))
    data = os.environ.get("SPHEREFLOW_DATA")
    if not data:
        return rows
    tum, kitchen = Path(data) / TUM, Path(data) / KITCHEN
    truth = truth_of(tum)
    rows.append(run_row(f"{TUM}, as it is", ["run", str(tum)], truth))
    readout = ["run", str(tum), "--readout", TUM_READOUT_S]
    rows.append(run_row(f"{TUM}, `--readout {TUM_READOUT_S}`", readout, truth))
    with tempfile.TemporaryDirectory() as folder:
        camera = Path(folder) / "camera.toml"
        seconds = calibrated(tum, camera)
        name = f"{TUM}, `--calibration` made of it by `calib depth` in {seconds:.0f} s"
        rows.append(run_row(name, ["run", str(tum), "--calibration", str(camera)], truth))
    rows.append(run_row(f"{KITCHEN}, as it is", ["run", str(kitchen)], truth_of(kitchen)))
    return rows


if __name__ == "__main__":
    print(machine())
    print("\n" + "\n".join(simulator_rows()))
    print("\n" + "\n".join(run_rows()))
