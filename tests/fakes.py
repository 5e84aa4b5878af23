"""A recording, an odometry and a map that know the answer: what surrounds them is tested."""

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
    camera: SimpleNamespace = field(
        default_factory=lambda: SimpleNamespace(
            width=COLUMNS,
            height=ROWS,
            model="pinhole",
            parameters={"fx": 30.0, "fy": 30.0, "cx": 15.5, "cy": 11.5},
        )
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


class FakeOdometry:
    """Returns the true motion plus ``drift_m`` a frame, which ``optimise`` takes away.

    Frames listed in ``lost`` are lost; every tenth frame is a keyframe.
    """

    lost: tuple[int, ...] = ()
    drift_m: float = 0.0
    converged: bool = True
    made: ClassVar[list[FakeOdometry]] = []

    def __init__(self, camera, *, along="axis", readout_s=0.0, depth_corrected=False) -> None:
        self.camera, self.readout_s, self.depth_corrected = camera, readout_s, depth_corrected
        self.posed: list[int] = []
        self.optimised = False
        self.made.append(self)

    @property
    def keyframe_count(self) -> int:
        return (len(self.posed) + 9) // 10

    def push(self, depth_m, stamp_ns):
        index = round((stamp_ns - FIRST_NS) / STEP_NS)
        lost = index in self.lost or depth_m is None
        status = "lost" if lost else "started" if index == 0 else "tracked"
        if not lost:
            self.posed.append(index)
        return SimpleNamespace(
            status=status,
            reason=_reason(index, depth_m) if lost else None,
            has_pose=not lost,
            world_from_camera=self._pose(index, self.drift_m),
            linear_m_s=np.array([0.1, 0.0, 1.2]),
            angular_rad_s=np.array([0.0, 0.6, 0.0]),
            covariance=np.eye(6) * 1e-6,
            score=0.4,
            timings_ms={"pyramid": 0.5, "solve": 1.5},
        )

    def optimise(self, progress=None):
        self.optimised = True
        if progress is not None:
            progress(self.keyframe_count, self.keyframe_count)
        return SimpleNamespace(
            keyframes=self.keyframe_count,
            edges=2 * self.keyframe_count,
            rejected=1,
            failed=0,
            converged=self.converged,
            largest_change_m=self.drift_m * max(self.posed, default=0),
        )

    def trajectory(self) -> sphereflow.Trajectory:
        poses = [self._pose(index, 0.0 if self.optimised else self.drift_m) for index in self.posed]
        position = np.array([pose[:3, 3] for pose in poses])
        half = 0.01 * np.array(self.posed)
        quats = np.stack([0 * half, np.sin(half), 0 * half, np.cos(half)], axis=1)
        return sphereflow.Trajectory(stamps(max(self.posed) + 1)[self.posed], position, quats)

    def _pose(self, index: int, drift_m: float) -> np.ndarray:
        pose = np.linalg.inv(true_pose(0)) @ true_pose(index)
        pose[1, 3] += drift_m * index
        return pose


def _reason(index, depth_m):
    if depth_m is None:
        return "the frame has no depth image"
    return f"{index} usable domains, 8 needed"


class FakeCloud:
    def __init__(self, voxel_m: float) -> None:
        self.positions: list[np.ndarray] = []
        self.colours: list[np.ndarray] = []

    def add(self, depth_m, colour, camera, world_from_camera, *, along="axis") -> None:
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
