"""From aligned frames to a trajectory: the drivers that all rows share.

``FrameToFrame`` aligns each frame with the one before. ``FrameToKeyframe`` aligns it with a
keyframe that is changed by the same rule for all rows, from a constant-velocity guess where the
method takes one. Both skip repeated images, refuse motions that no hand makes, and predict lost
frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import sphereflow as sf

from benches.peers.align import Aligned, Aligner, Matrix, View
from benches.peers.motion import inverse, motion_of, rotation_vector, twist_of

MAX_SPEED_M_S, MAX_RATE_RAD_S = 4.0, 8.0
"""Faster is no hand-held camera: the same gate as ours."""

MAX_SURPRISE_M, MAX_SURPRISE_RAD = 0.05, 0.1
"""An alignment with a keyframe is believed this near to the prediction: ten times what a hand's
accelerations do within a thirtieth of a second. Without this Open3D and ICP run away."""

MIN_OVERLAP = 0.7
MAX_FLOW_PX = 120.0
"""A keyframe is changed below this overlap and beyond this median flow."""

RULE_STRIDE = 16
"""The rule looks at every so many-th pixel."""


@dataclass(frozen=True, slots=True)
class Tracked:
    """What became of a frame; a lost one's pose is predicted."""

    world_from_camera: Matrix
    lost: bool = False
    reason: str | None = None


class Tracker(Protocol):
    """A trajectory frame by frame."""

    def push(self, view: View, stamp_ns: int) -> Tracked:
        """The next frame."""


class FrameToFrame:
    """Each frame against the one before, from rest."""

    def __init__(self, aligner: Aligner, camera: sf.Camera) -> None:  # noqa: D107
        self.aligner, self.camera = aligner, camera
        self.pose: Matrix = np.eye(4)
        self.twist: tuple[Matrix, Matrix] | None = None
        self.before: tuple[Any, View, int] | None = None

    def push(self, view: View, stamp_ns: int) -> Tracked:
        """The next frame."""
        if self.before is not None and same(self.before[1], view):
            return Tracked(self.pose)
        ready = self.aligner.prepare(view)
        if self.before is None:
            self.start(ready, view, stamp_ns)
            return Tracked(self.pose)
        dt_s = (stamp_ns - self.before[2]) * 1e-9
        found = self.measure(ready, view, dt_s)
        if found.first_from_second is not None:
            self.twist = twist_of(found.first_from_second, dt_s)
        self.pose = self.pose @ self.predicted(dt_s)
        self.before = (ready, view, stamp_ns)
        return Tracked(self.pose, found.first_from_second is None, found.reason)

    def predicted(self, dt_s: float) -> Matrix:
        """The step that the last measured velocity makes; none before the first."""
        return np.eye(4) if self.twist is None else motion_of(*self.twist, dt_s)

    def start(self, ready: Any, view: View, stamp_ns: int) -> None:
        """The first frame."""
        self.before = (ready, view, stamp_ns)

    def measure(self, ready: Any, view: View, dt_s: float) -> Aligned:
        """The motion since the frame before."""
        assert self.before is not None
        return plausible(self.aligner.align(self.before[0], ready, dt_s, np.eye(4)), dt_s)


class FrameToKeyframe(FrameToFrame):
    """Each frame against a keyframe, from a constant-velocity guess."""

    def start(self, ready: Any, view: View, stamp_ns: int) -> None:
        """The first frame is the first keyframe."""
        super().start(ready, view, stamp_ns)
        self.set_key(ready, view, stamp_ns)

    def set_key(self, ready: Any, view: View, stamp_ns: int) -> None:
        """A new keyframe; the camera's pose in it is remembered apart."""
        self.key, self.key_rule = ready, KeyframeRule(self.camera, view)
        self.key_from_before: Matrix = np.eye(4)
        self.key_age_ns = 0

    def measure(self, ready: Any, view: View, dt_s: float) -> Aligned:
        """Against the keyframe; failing that against the frame before, which ends the keyframe.

        An alignment that surprises has failed too.
        """
        assert self.before is not None
        self.key_age_ns += round(dt_s * 1e9)
        predicted = self.predicted(dt_s)
        guess = self.key_from_before @ predicted
        found = self.aligner.align(self.key, ready, self.key_age_ns * 1e-9, guess)
        if found.first_from_second is not None:
            step = inverse(self.key_from_before) @ found.first_from_second
            against_key = plausible(Aligned(step), dt_s)
            surprised = self.twist is not None and is_surprise(predicted, step)
            if against_key.first_from_second is not None and not surprised:
                self.key_from_before = found.first_from_second
                if self.key_rule.is_over(self.key_from_before):
                    self.set_key(ready, view, 0)
                return against_key
        retried = super().measure(ready, view, dt_s)
        self.set_key(ready, view, 0)
        return retried


class KeyframeRule:
    """Whether a keyframe is still good: how much of it is in view, and how far it has moved."""

    def __init__(self, camera: sf.Camera, view: View) -> None:  # noqa: D107
        half = RULE_STRIDE // 2
        ys, xs = np.mgrid[half : camera.height : RULE_STRIDE, half : camera.width : RULE_STRIDE]
        depth = view.depth_m[ys, xs].astype(float).ravel()
        pixels = np.stack([xs.ravel(), ys.ravel()], axis=1).astype(float)
        rays = camera.unproject(pixels)
        good = np.isfinite(depth) & (depth > 0) & np.isfinite(rays).all(axis=1)
        self.camera, self.pixels = camera, pixels[good]
        self.points = rays[good] * (depth[good] / rays[good, 2])[:, None]

    def is_over(self, key_from_current: Matrix) -> bool:
        """True below the overlap or beyond the flow."""
        if not len(self.points):
            return True
        back = inverse(key_from_current)
        found = self.camera.project(self.points @ back[:3, :3].T + back[:3, 3])
        low, high = -0.5, np.array([self.camera.width, self.camera.height]) - 0.5
        inside = ((found >= low) & (found < high)).all(axis=1)  # false for NaN
        if inside.mean() < MIN_OVERLAP:
            return True
        flow = np.linalg.norm(found[inside] - self.pixels[inside], axis=1)
        return bool(np.median(flow) > MAX_FLOW_PX)


def same(a: View, b: View) -> bool:
    """True for a repeated image."""
    return np.array_equal(a.depth_m, b.depth_m, equal_nan=True)


def is_surprise(predicted: Matrix, measured: Matrix) -> bool:
    """True where two steps differ by more than a hand can do."""
    apart = inverse(predicted) @ measured
    moved, turned = np.linalg.norm(apart[:3, 3]), np.linalg.norm(rotation_vector(apart[:3, :3]))
    return bool(moved > MAX_SURPRISE_M or turned > MAX_SURPRISE_RAD)


def plausible(found: Aligned, dt_s: float) -> Aligned:
    """Refuses what no hand-held camera does in that time."""
    motion = found.first_from_second
    if motion is None:
        return found
    speed = float(np.linalg.norm(motion[:3, 3])) / dt_s
    rate = float(np.linalg.norm(rotation_vector(motion[:3, :3]))) / dt_s
    if speed > MAX_SPEED_M_S or rate > MAX_RATE_RAD_S:
        return Aligned(None, "implausible motion")
    return found
