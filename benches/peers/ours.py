"""Rows of ours that align two frames: the weak form and the point-wise flow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sphereflow as sf

from benches.peers.align import Aligned, Matrix, View
from benches.peers.motion import motion_of


class WeakForm:
    """`sphereflow.odometry.estimate_velocity`; raises where the build knows no such option.

    ``colour`` gives it the images too.
    """

    def __init__(self, camera: sf.Camera, options: Mapping[str, Any]) -> None:  # noqa: D107
        self.camera, self.options = camera, dict(options)
        self.colour = self.options.pop("colour", False)
        # An option that this build does not know is refused here, not in the middle of a run.
        wall = np.full((camera.height, camera.width), 2.0, np.float32)
        sf.odometry.estimate_velocity(camera, wall, wall, 0.03, **self.options)

    def prepare(self, view: View) -> View:
        """Nothing: the call does it all."""
        return view

    def align(self, first: View, second: View, dt_s: float, guess: Matrix) -> Aligned:
        """One call; it takes no guess."""
        images = {"image0": first.colour, "image1": second.colour} if self.colour else {}
        found = sf.odometry.estimate_velocity(
            self.camera, first.depth_m, second.depth_m, dt_s, **images, **self.options
        )
        return aligned(found, dt_s)


class PointWise:
    """`sphereflow.odometry.RangeFlow`: DIFODO-like, our own peer."""

    def __init__(self, camera: sf.Camera, options: Mapping[str, Any]) -> None:  # noqa: D107
        self.flow = sf.odometry.RangeFlow(camera, **options)

    def prepare(self, view: View) -> View:
        """Nothing: the call does it all."""
        return view

    def align(self, first: View, second: View, dt_s: float, guess: Matrix) -> Aligned:
        """From the guess."""
        guessed = None if np.array_equal(guess, np.eye(4)) else guess
        found = self.flow.estimate(first.depth_m, second.depth_m, dt_s, guess=guessed)
        return aligned(found, dt_s)


class AtRest:
    """A camera that never moved: what any figure must be held against."""

    def __init__(self, camera: sf.Camera, options: Mapping[str, Any]) -> None:  # noqa: D107
        pass

    def prepare(self, view: View) -> None:
        """Nothing."""

    def align(self, first: None, second: None, dt_s: float, guess: Matrix) -> Aligned:
        """The identity."""
        return Aligned(np.eye(4))


def aligned(found: sf.odometry.VelocityEstimate, dt_s: float) -> Aligned:
    """A velocity as a motion; lost stays lost."""
    if found.status == "lost":
        return Aligned(None, found.reason)
    return Aligned(motion_of(found.linear_m_s, found.angular_rad_s, dt_s))
