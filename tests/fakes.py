"""A recording and an engine that know the answer: what surrounds them is tested."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import sphereflow

STEP_NS = 33_333_333
FIRST_NS = 1_700_000_000_123_456_789
ROWS, COLUMNS = 24, 32


def turn_about_y(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def true_pose(index: int) -> np.ndarray:
    """A camera that walks a bent path: world from camera."""
    pose = np.eye(4)
    pose[:3, :3] = turn_about_y(0.02 * index)
    pose[:3, 3] = [np.sin(0.05 * index), 0.1 * np.cos(0.11 * index), 0.04 * index]
    return pose


def stamps(count: int) -> np.ndarray:
    return FIRST_NS + STEP_NS * np.arange(count, dtype=np.int64)


def trajectory(count: int) -> sphereflow.Trajectory:
    half = 0.01 * np.arange(count)
    quats = np.stack([0 * half, np.sin(half), 0 * half, np.cos(half)], axis=1)
    position = np.array([true_pose(index)[:3, 3] for index in range(count)])
    return sphereflow.Trajectory(stamps(count), position, quats)


@dataclass
class FakeRecording:
    """``bad`` frames cannot be read, ``blind`` ones have no depth; it may break off at ``ends``."""

    count: int = 60
    bad: tuple[int, ...] = ()
    ends: int | None = None
    blind: tuple[int, ...] = ()
    colour_registered: bool = True
    depth_scale: float = 5000.0
    depth_factor: float = 1.0
    kind: str = "fake"
    calibration_source: str = "made up for a test"
    warnings: list[str] = field(default_factory=list)
    has_truth: bool = True
    readout_s: float | None = None
    depth_corrected: bool = False
    camera: sphereflow.Camera = field(
        default_factory=lambda: sphereflow.Camera.pinhole(30.0, 30.0, 15.5, 11.5, COLUMNS, ROWS)
    )

    def __len__(self) -> int:
        return self.count

    @property
    def stamp_ns(self) -> np.ndarray:
        return stamps(self.count)

    @property
    def truth(self):
        return trajectory(self.count) if self.has_truth else None

    def frames(self, start=0, stop=None):
        return FakeFrames(self, start, self.count if stop is None else stop)

    def frame(self, index: int) -> SimpleNamespace:
        if index in self.bad:
            raise sphereflow.DataError(f"depth/{index}.png: 17 bytes are missing")
        rows, columns = np.mgrid[:ROWS, :COLUMNS]
        depth = (2.0 + 0.01 * columns + 0.001 * index).astype(np.float32) * self.depth_factor
        depth[:2] = np.nan
        colour = np.stack([rows * 10, columns * 8, 0 * rows + 90], axis=2).astype(np.uint8)
        return SimpleNamespace(
            stamp_ns=int(self.stamp_ns[index]),
            colour=colour,
            depth_m=None if index in self.blind else depth,
            range_m=None,
        )


class FakeFrames:
    """Goes on after an error, as the compiled iterator does."""

    def __init__(self, recording: FakeRecording, start: int, stop: int) -> None:
        self.recording, self.next, self.stop = recording, start, stop

    def __iter__(self):
        return self

    def __next__(self):
        if self.next >= self.stop or self.next == self.recording.ends:
            raise StopIteration
        self.next += 1
        return self.recording.frame(self.next - 1)


class FakeEngine:
    """Publishes the true motion plus ``drift_m`` a frame, which ``finish`` takes away.

    Frames listed in ``lost`` are lost; every tenth frame is a keyframe; ``breaks`` begin segments.
    """

    lost: tuple[int, ...] = ()
    breaks: tuple[int, ...] = ()
    weak: tuple[int, ...] = ()
    drift_m: float = 0.0
    converged: bool = True
    made: ClassVar[list[FakeEngine]] = []

    def __init__(self, calibration, config) -> None:
        self.calibration, self.config = calibration, config
        self.posed: list[int] = []
        self.graph: dict | None = None
        self.cloud = FakeCloud()
        self.made.append(self)

    @property
    def keyframe_count(self) -> int:
        return (len(self.posed) + 9) // 10

    def push_frame(self, frame):
        index = round((frame.stamp_ns - FIRST_NS) / STEP_NS)
        lost = index in self.lost or frame.depth_m is None
        status = "lost" if lost else "started" if index == 0 else "tracked"
        if index in self.weak:
            status = "weak"
        pose = self._pose(index, self.drift_m)
        if not lost:
            self.posed.append(index)
            self.cloud.add(frame.depth_m, frame.colour, pose)
        return SimpleNamespace(
            status=status,
            reason=_reason(index, frame.depth_m) if lost else None,
            reason_code=_code(frame.depth_m) if lost else None,
            has_pose=not lost,
            world_from_camera=pose,
            linear_m_s=np.array([0.1, 0.0, 1.2]),
            angular_rad_s=np.array([0.0, 0.6, 0.0]),
            covariance=np.eye(6) * 1e-6,
            quality=0.4,
            segment=self._segment_of(index),
            timings_ms={"pyramid": 0.5, "solve": 1.5},
        )

    def finish(self, progress=None):
        if not self.config.graph.enabled or self.keyframe_count < 2:
            return
        if progress is not None:
            progress(self.keyframe_count, self.keyframe_count)
        self.graph = {
            "keyframes": self.keyframe_count,
            "edges": 2 * self.keyframe_count,
            "rejected": 1,
            "failed": 0,
            "converged": self.converged,
            "interrupted": False,
            "largest_change_m": self.drift_m * max(self.posed, default=0),
        }

    @property
    def report(self):
        segments = []
        for index in range(len(self.breaks) + 1):
            posed = [frame for frame in self.posed if self._segment_of(frame) == index]
            if posed:
                ends = stamps(max(posed) + 1)[[posed[0], posed[-1]]].tolist()
                entry = {"index": index, "first_stamp_ns": ends[0], "last_stamp_ns": ends[1]}
                segments.append(entry | {"frames": len(posed)})
        return {
            "graph": self.graph,
            "segments": segments,
            "coverage_weak": len(self.weak) / max(len(self.posed), 1),
            "keyframes": self.keyframe_count,
            "world": "first-camera",
            "world_because": "made up for a test",
        }

    @property
    def map(self):
        return SimpleNamespace(keyframes=self._trajectory(self.posed[::10]), cloud=self.cloud)

    def growing_cloud(self):
        return self.cloud

    def write_graph(self, path) -> None:
        path.write_text("")

    def trajectory(self, kind="final") -> sphereflow.Trajectory:
        return self._trajectory(self.posed)

    def segment(self, index) -> sphereflow.Trajectory:
        return self._trajectory([i for i in self.posed if self._segment_of(i) == index])

    def _segment_of(self, index: int) -> int:
        return sum(index >= start for start in self.breaks)

    def _trajectory(self, frames) -> sphereflow.Trajectory:
        drift_m = self.drift_m if self.graph is None else 0.0
        poses = [self._pose(index, drift_m) for index in frames]
        position = np.array([pose[:3, 3] for pose in poses]).reshape(-1, 3)
        half = 0.01 * np.array(frames, dtype=float)
        quats = np.stack([0 * half, np.sin(half), 0 * half, np.cos(half)], axis=1)
        return sphereflow.Trajectory(stamps(max(frames, default=0) + 1)[frames], position, quats)

    def _pose(self, index: int, drift_m: float) -> np.ndarray:
        pose = np.linalg.inv(true_pose(0)) @ true_pose(index)
        pose[1, 3] += drift_m * index
        return pose


def _code(depth_m):
    return "no_depth" if depth_m is None else "few_domains"


def _reason(index, depth_m):
    if depth_m is None:
        return "the frame has no depth image"
    return f"{index} usable domains, 8 needed"


class FakeCloud:
    def __init__(self) -> None:
        self.positions: list[np.ndarray] = []
        self.colours: list[np.ndarray] = []

    def add(self, depth_m, colour, world_from_camera) -> None:
        rows, columns = np.nonzero(np.isfinite(depth_m))
        z = depth_m[rows, columns]
        points = np.stack([(columns - 15.5) / 30.0 * z, (rows - 11.5) / 30.0 * z, z], axis=1)
        self.positions.append(points @ world_from_camera[:3, :3].T + world_from_camera[:3, 3])
        grey = np.zeros((len(z), 3), dtype=np.uint8)
        self.colours.append(grey if colour is None else colour[rows, columns])

    def __len__(self) -> int:
        return len(self.points()[0])

    def points(self):
        if not self.positions:
            return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint8)
        return np.vstack(self.positions).astype(np.float32), np.vstack(self.colours)

    def write_ply(self, path) -> None:
        xyz, _ = self.points()
        head = "ply\nformat ascii 1.0\nelement vertex {}\n" + "".join(
            f"property float {axis}\n" for axis in "xyz"
        )
        body = "\n".join(" ".join(f"{value:.4f}" for value in row) for row in xyz)
        path.write_text(head.format(len(xyz)) + "end_header\n" + body + "\n")
