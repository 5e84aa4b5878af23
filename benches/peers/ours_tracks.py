"""Rows of ours that make a trajectory: `DepthOdometry` with options."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sphereflow as sf

from benches.peers.align import View
from benches.peers.tracking import Tracked


class Odometry:
    """`sphereflow.odometry.DepthOdometry` with options; raises where the build has none such."""

    def __init__(self, camera: sf.Camera, options: Mapping[str, Any]) -> None:  # noqa: D107
        self.odometry = sf.odometry.DepthOdometry(camera, **options)

    def push(self, view: View, stamp_ns: int) -> Tracked:
        """The next frame."""
        found = self.odometry.push(view.depth_m, stamp_ns)
        reason = found.reason if found.status == "lost" else None
        return Tracked(found.world_from_camera, found.status == "lost", reason)
