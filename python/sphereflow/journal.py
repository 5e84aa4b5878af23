"""What became of every frame of a run, and the arrays made of it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sphereflow
from sphereflow.eval.rotations import quat_xyzw_from_matrix
from sphereflow.interfaces import MotionLike

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]

STATUSES = (
    "started",
    "tracked",
    "weak",
    "coasting",
    "lost",
    "relocalised",
    "skipped",
    "unreadable",
)
"""What can become of a frame; ``unreadable`` ones never reached the engine."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One frame: velocities are of the camera, in its own frame, m/s and rad/s; NaN if unknown."""

    stamp_ns: int
    status: str
    reason: str | None
    reason_code: str | None
    world_from_camera: Array | None
    linear_m_s: Array
    angular_rad_s: Array
    quality: float


@dataclass(slots=True)
class Journal:
    """The frames of a run in their order; ``final`` has their poses in the end."""

    entries: list[Entry] = field(default_factory=list)
    pushed: int = 0
    with_depth: int = 0
    timings_ms: Counter[str] = field(default_factory=Counter)
    final: sphereflow.Trajectory | None = None

    def motion(self, stamp_ns: int, motion: MotionLike, *, with_depth: bool) -> None:
        """Note what the engine said; a pose that it only predicted is not kept."""
        self.pushed += 1
        self.with_depth += with_depth
        pose = np.array(motion.world_from_camera, dtype=np.float64) if motion.has_pose else None
        # A velocity is a measurement only where the motion was measured.
        measured = motion.status in ("tracked", "weak")
        unknown = np.full(3, np.nan)
        self.entries.append(
            Entry(
                stamp_ns=int(stamp_ns),
                status=motion.status,
                reason=motion.reason,
                reason_code=motion.reason_code,
                world_from_camera=pose,
                linear_m_s=np.array(motion.linear_m_s, dtype=float) if measured else unknown,
                angular_rad_s=np.array(motion.angular_rad_s, dtype=float) if measured else unknown,
                quality=float(motion.quality) if measured else float("nan"),
            )
        )
        self.timings_ms.update({name: float(ms) for name, ms in motion.timings_ms.items()})

    def failure(self, stamp_ns: int, status: str, reason: str) -> None:
        """Note a frame that never reached the engine."""
        unknown = np.full(3, np.nan)
        self.entries.append(
            Entry(int(stamp_ns), status, reason, status, None, unknown, unknown, float("nan"))
        )

    @property
    def stamp_ns(self) -> Stamps:
        """Times of all frames, (N,)."""
        return np.array([entry.stamp_ns for entry in self.entries], dtype=np.int64)

    @property
    def has_pose(self) -> NDArray[np.bool_]:
        """Which frames have a pose, (N,)."""
        return np.array([e.world_from_camera is not None for e in self.entries], dtype=bool)

    @property
    def velocities(self) -> tuple[Array, Array]:
        """Linear (m/s) and angular (rad/s) velocities of all frames, (N, 3) each."""
        linear = [entry.linear_m_s for entry in self.entries]
        angular = [entry.angular_rad_s for entry in self.entries]
        return np.reshape(linear, (-1, 3)), np.reshape(angular, (-1, 3))

    @property
    def qualities(self) -> Array:
        """How well determined each motion is, (N,): 1 the best, 0 not at all."""
        return np.array([entry.quality for entry in self.entries], dtype=np.float64)

    @property
    def statuses(self) -> list[str]:
        """Status of every frame."""
        return [entry.status for entry in self.entries]

    @property
    def coverage(self) -> float:
        """Share of the frames that have a pose; frames skipped on purpose are not asked for one.

        A repeated image is skipped too, but has the pose of the image that it repeats.
        """
        posed = self.has_pose
        skipped = np.array([entry.status == "skipped" for entry in self.entries], dtype=bool)
        asked = int((posed | ~skipped).sum())
        return float(posed.sum()) / asked if asked else 0.0

    @property
    def corrected(self) -> bool:
        """Whether the final poses are others than those that were published."""
        return self.final is not None

    @property
    def weak_share(self) -> float:
        """Share of the frames with a pose whose motion is poorly determined."""
        posed = int(self.has_pose.sum())
        return self.statuses.count("weak") / posed if posed else 0.0

    def odometry(self) -> sphereflow.Trajectory | None:
        """Poses as they were published while running, or None where no frame has one."""
        return self._trajectory([entry.world_from_camera for entry in self.entries])

    def trajectory(self) -> sphereflow.Trajectory | None:
        """The final poses, or None where no frame has one."""
        if self.final is None or len(self.final) == 0:
            return self.odometry()
        return self.final

    def _trajectory(self, poses: list[Array | None]) -> sphereflow.Trajectory | None:
        posed = [
            (entry.stamp_ns, pose)
            for entry, pose in zip(self.entries, poses, strict=True)
            if pose is not None
        ]
        if not posed:
            return None
        matrices = np.array([pose for _, pose in posed])
        quats = np.array([quat_xyzw_from_matrix(pose[:3, :3]) for pose in matrices])
        stamps = np.array([stamp for stamp, _ in posed], dtype=np.int64)
        return sphereflow.Trajectory(stamps, matrices[:, :3, 3].copy(), quats)

    def outcomes(self) -> dict[str, Any]:
        """Frames by status, with the reasons: how often each, and its first full text."""
        outcomes: dict[str, Any] = {}
        for status in STATUSES:
            entries = [entry for entry in self.entries if entry.status == status]
            reasons: dict[str, dict[str, Any]] = {}
            for entry in entries:
                if entry.reason is None or entry.reason_code is None:
                    continue
                first = {"first": entry.reason, "first_stamp_ns": entry.stamp_ns}
                reason = reasons.setdefault(
                    entry.reason_code, {"code": entry.reason_code, "frames": 0, **first}
                )
                reason["frames"] += 1
            outcomes[status] = {"frames": len(entries), "reasons": list(reasons.values())}
        return outcomes
