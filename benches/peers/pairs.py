"""The first part: pairs of frames of the simulated furnished room, with known velocities."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import sphereflow as sf

from benches.peers.align import View
from benches.peers.clock import Clock
from benches.peers.motion import inverse, twist_of
from benches.peers.table import Row

NOISES = ("independent", "kinect")
GAPS = (1, 4)
"""Frames between the two of a pair: 33 and 133 ms at 30 Hz."""

RATE_HZ = 30.0
TOUR_S = 25.0


def simulator(noise: str, tour_s: float = TOUR_S) -> sf.sim.Simulator:
    """The room and the motion; seeds are the simulator's default."""
    return sf.sim.Simulator(
        scene="furnished_room",
        motion="room_tour",
        duration_s=tour_s,
        rate_hz=RATE_HZ,
        depth_noise=noise,
    )


def cell_name(noise: str, gap: int) -> str:
    """What the table calls a noise and a gap."""
    return f"{noise}, {round(1e3 * gap / RATE_HZ)} ms"


def draw(folder: Path, noise: str, count: int, tour_s: float = TOUR_S) -> None:
    """Draws ``count`` pairs, spread evenly over the tour, one file each."""
    drawn = simulator(noise, tour_s)
    last = len(drawn) - max(GAPS) - 1
    starts = np.linspace(0, last, count).astype(int).tolist()
    wanted = {start + index for start in starts for index in (0, *GAPS)}
    (folder / noise).mkdir(parents=True)
    # In one pass: the simulator's frames are made one after the other.
    kept: dict[int, sf.sim.SimulatedFrame] = {}
    for number, frame in enumerate(drawn.frames(0, max(wanted) + 1)):
        if number in wanted:
            kept[number] = frame
        for pair in [i for i, start in enumerate(starts) if start + max(GAPS) == number]:
            _store(folder / noise / f"{pair:04d}.npz", kept, starts[pair])
        kept.pop(number - max(GAPS), None)


def _store(path: Path, frames: dict[int, sf.sim.SimulatedFrame], start: int) -> None:
    arrays: dict[str, Any] = {}
    for index in (0, *GAPS):
        frame = frames[start + index]
        arrays[f"depth{index}"] = frame.depth_m
        arrays[f"colour{index}"] = frame.colour
        arrays[f"pose{index}"] = frame.world_from_camera
        arrays[f"stamp{index}"] = frame.stamp_ns
    np.savez(path, **arrays)


def measure(row: Row, folder: Path, noise: str, gap: int, budget_s: float) -> dict[str, Any]:
    """The figures of one row on one noise and one gap."""
    files = sorted((folder / noise).glob("*.npz"))
    aligner = row.made_for(simulator(noise).camera)
    clock, reasons = Clock(budget_s), Counter[str]()
    errors: list[tuple[float, float]] = []
    for path in files:
        if clock.spent:
            break
        with np.load(path) as stored:
            first, second = (View(stored[f"depth{i}"], stored[f"colour{i}"]) for i in (0, gap))
            truth = inverse(stored["pose0"]) @ stored[f"pose{gap}"]
            dt_s = float(stored[f"stamp{gap}"] - stored["stamp0"]) * 1e-9
        with clock():
            ready = [aligner.prepare(view) for view in (first, second)]
            found = aligner.align(*ready, dt_s, np.eye(4))
        if found.first_from_second is None:
            reasons[found.reason or "no reason given"] += 1
            errors.append((np.inf, np.inf))
            continue
        (v, w), (true_v, true_w) = twist_of(found.first_from_second, dt_s), twist_of(truth, dt_s)
        errors.append((float(np.linalg.norm(v - true_v)), float(np.linalg.norm(w - true_w))))
    return {**scores(errors), **clock.figures(), "asked": len(files), "reasons": dict(reasons)}


def scores(errors: list[tuple[float, float]]) -> dict[str, Any]:
    """Medians and 90th percentiles over all pairs; a lost one counts as infinitely wrong."""
    if not errors:
        return {"covered": 0, "lost": 0}
    figures: dict[str, Any] = {
        "covered": len(errors),
        "lost": sum(not np.isfinite(v) for v, _ in errors),
    }
    for name, values in zip(("ev_m_s", "ew_rad_s"), np.array(errors).T, strict=True):
        for share, suffix in ((50, ""), (90, "_p90")):
            # "higher" meets no infinity half-way
            found = float(np.percentile(values, share, method="higher"))
            figures[name + suffix] = found if np.isfinite(found) else None
    return figures
