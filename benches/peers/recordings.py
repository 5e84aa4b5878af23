"""The second part: trajectories on real recordings, against their truth."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import sphereflow as sf
from sphereflow.eval.rotations import quat_xyzw_from_matrix

from benches.peers.align import Matrix, View
from benches.peers.clock import Clock
from benches.peers.table import Row
from benches.peers.tracking import FrameToFrame, FrameToKeyframe, Tracker
from benches.peers.undistort import Undistorted

NAMES = ("tum-fr1-rpy-a", "sevenscenes-kitchen-a")
TRUTH_DIFFERENCE_S = 0.02
"""Frames further than this from a true pose are not compared: as `sphereflow run` does."""


def refusal(row: Row, recording: sf.io.Recording) -> str | None:
    """Why a row cannot run on a recording, if so."""
    if row.colour and not recording.colour_registered:
        return "needs colour registered to depth, which this recording has not"
    return None


def tracker_of(row: Row, camera: sf.Camera, mode: str) -> Tracker:
    """The row in one of its modes."""
    made = row.made_for(camera)
    if mode == "own":
        own: Tracker = made
        return own
    return {"frame": FrameToFrame, "keyframe": FrameToKeyframe}[mode](made, camera)


def measure(
    row: Row, path: Path, mode: str, budget_s: float, max_frames: int | None
) -> dict[str, Any]:
    """The figures of one row in one mode on one recording."""
    recording = sf.io.open_recording(path)
    camera, truth = recording.camera, recording.truth
    if camera is None or truth is None:
        return {"refused": "the recording has no camera parameters or no truth"}
    why = refusal(row, recording)
    if why is not None:
        return {"refused": why}
    undistorted = None if row.is_ours else Undistorted(camera)
    tracker = tracker_of(row, undistorted.camera if undistorted else camera, mode)
    clock, reasons = Clock(budget_s), Counter[str]()
    stamps: list[int] = []
    poses: list[Matrix] = []
    wanted = min(len(recording), max_frames or len(recording))
    # One by one: frames decoded ahead would count as the row's own time.
    for index in range(wanted):
        if clock.spent:
            break
        frame = recording.frame(index)
        if frame.depth_m is None:
            continue
        view = View(frame.depth_m, frame.colour if row.colour else None)
        view = undistorted(view) if undistorted else view
        with clock():
            found = tracker.push(view, frame.stamp_ns)
        stamps.append(frame.stamp_ns)
        poses.append(np.asarray(found.world_from_camera))
        if found.lost:
            reasons[found.reason or "no reason given"] += 1
    figures: dict[str, Any] = {"covered": len(poses), "asked": wanted, "reasons": dict(reasons)}
    figures["lost"] = sum(reasons.values())
    return {**figures, **clock.figures(), **scores(truth, stamps, poses)}


def scores(truth: sf.Trajectory, stamps: list[int], poses: list[Matrix]) -> dict[str, Any]:
    """Absolute error, relative errors over a second; None where they cannot be computed."""
    if len(poses) < 3:
        return {}
    matrices = np.array(poses)
    quaternions = np.array([quat_xyzw_from_matrix(pose[:3, :3]) for pose in poses])
    estimate = sf.Trajectory(np.array(stamps), matrices[:, :3, 3], quaternions)
    limit = {"max_difference_s": TRUTH_DIFFERENCE_S}
    second = {"delta": 1.0, "delta_unit": "s", "all_pairs": True}
    calls = {
        "ate_m": lambda: sf.eval.ape(truth, estimate, **limit),
        "rpe_1s_m": lambda: sf.eval.rpe(truth, estimate, **second, **limit),
        "rpe_1s_rad": lambda: sf.eval.rpe(
            truth, estimate, relation="rotation_rad", **second, **limit
        ),
    }
    figures: dict[str, Any] = {}
    for name, call in calls.items():
        try:
            figures[name] = float(call().statistics.rmse)
        except sf.SphereflowError as error:
            figures[name], figures[f"{name}_reason"] = None, str(error)
    return figures
