"""What comes after the last frame: keyframes compared with each other, and all poses corrected."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sphereflow.journal import Journal

NOT_SETTLED = (
    "the pose graph did not settle: trajectory.tum has the poses of its last step, odometry.tum "
    "those that were measured"
)


@dataclass(frozen=True, slots=True)
class PoseGraph:
    """What the comparison of keyframes came to."""

    keyframes: int
    edges: int
    rejected: int
    failed: int
    converged: bool
    largest_change_m: float


@dataclass(frozen=True, slots=True)
class Correction:
    """A pose graph, or the reason why there is none."""

    pose_graph: PoseGraph | None
    reason: str | None = None

    @property
    def largest_change_m(self) -> float:
        """How far a keyframe was moved at most, metres."""
        return 0.0 if self.pose_graph is None else self.pose_graph.largest_change_m

    @property
    def warnings(self) -> list[str]:
        """What is wrong with it, in words."""
        settled = self.pose_graph is None or self.pose_graph.converged
        return [] if settled else [NOT_SETTLED]


def correct(
    estimator: Any,
    journal: Journal,
    *,
    asked: bool,
    progress: Callable[[int, int], None] | None = None,
) -> Correction:
    """Let the odometry compare its keyframes, and note the corrected poses in the journal."""
    if not asked:
        return Correction(None, "not asked for")
    count = int(estimator.keyframe_count)
    if count < 2:
        counted = "1 keyframe" if count == 1 else f"{count} keyframes"
        return Correction(None, f"{counted}: nothing to compare")
    found = estimator.optimise(progress)
    journal.correct(estimator.trajectory())
    return Correction(
        PoseGraph(
            keyframes=int(found.keyframes),
            edges=int(found.edges),
            rejected=int(found.rejected),
            failed=int(found.failed),
            converged=bool(found.converged),
            largest_change_m=float(found.largest_change_m),
        )
    )
