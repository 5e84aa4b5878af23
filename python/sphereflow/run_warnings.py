"""What a reader of a result must know before trusting it, in words."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from sphereflow.interfaces import RecordingLike
from sphereflow.journal import Journal

WEAK_SHARE = 0.1
"""Share of weak frames from which a warning says so; a few are usual before a wall."""

NOT_SETTLED = (
    "the pose graph did not settle: trajectory.tum has the poses of its last step, odometry.tum "
    "those that were published"
)


def warnings_of(recording: RecordingLike, journal: Journal, engine: dict[str, Any]) -> list[str]:
    """The recording's own warnings and the run's."""
    warnings = [str(text) for text in recording.warnings]
    graph = engine["graph"]
    if graph is not None and not graph["converged"]:
        warnings.append(NOT_SETTLED)
    warnings += [_break(before, after) for before, after in pairwise(engine["segments"])]
    if journal.weak_share > WEAK_SHARE:
        warnings.append(
            f"{100 * journal.weak_share:.0f} % of the poses are weak: a direction of motion is "
            "hardly visible in the depth images, and the path may be wrong along it"
        )
    return warnings


def _break(before: dict[str, Any], after: dict[str, Any]) -> str:
    gap_s = (after["first_stamp_ns"] - before["last_stamp_ns"]) / 1e9
    return (
        f"break of {gap_s:.2f} s at {before['last_stamp_ns'] / 1e9:.3f} s: segment "
        f"{after['index']} hangs on the one before by prediction only; segments/ has each by itself"
    )
