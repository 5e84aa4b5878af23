"""Shows a result or a recording: makes a file for the viewer where there is none, and opens it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import sphereflow
from sphereflow.interfaces import RecordingLike
from sphereflow.viz.recorder import RunRecorder
from sphereflow.viz.sdk import rerun


def record_data(recording: RecordingLike, path: str | Path, *, max_frames: int = 300) -> Path:
    """Write the first frames of a data set, and its truth, for the viewer."""
    recorder = RunRecorder(recording.camera, path)
    frames = recording.frames(0, min(max_frames, len(recording)))
    for index in range(min(max_frames, len(recording))):
        try:
            frame = next(frames)
        except StopIteration:
            break
        except sphereflow.SphereflowError:
            continue  # `info` and `run` count frames that cannot be read; a view leaves them out
        recorder.frame(index, frame, None)
    recorder.close(None, recording.truth)
    return Path(path)


def record_result(folder: str | Path, path: str | Path) -> Path:
    """Write the trajectory and the map of a result folder for the viewer."""
    folder, path = Path(folder), Path(path)
    rr = rerun()
    trajectory = sphereflow.Trajectory.read(folder / "trajectory.tum", format="tum")
    partial = path.with_name(f".{path.name}.partial")
    stream: Any = rr.RecordingStream("sphereflow")
    stream.save(partial)
    stream.log("world", rr.ViewCoordinates.RDF, static=True)
    strip = rr.LineStrips3D([trajectory.position_m], colors=[(40, 140, 230)], radii=0.005)
    stream.log("world/path", strip, static=True)
    if (folder / "map.ply").is_file():
        # rerun reads PLY files itself.
        stream.log_file_from_path(folder / "map.ply", entity_path_prefix="world", static=True)
    stream.flush()
    stream.disconnect()
    partial.replace(path)
    return path


def open_viewer(path: str | Path) -> int:
    """Open a file in the viewer's window and wait until it is closed; returns its exit status."""
    rerun()
    command = [sys.executable, "-m", "rerun", str(Path(path))]
    return subprocess.run(command, check=False).returncode
