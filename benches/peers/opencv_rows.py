"""OpenCV's odometry (5 or later), as it comes: default settings, our camera matrix."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
import sphereflow as sf

from benches.peers.align import Aligned, Matrix, View, metres_with_zeros

cv2.setNumThreads(1)


class OpencvOdometry:
    """`cv2.Odometry`; options: ``kind`` DEPTH or RGB_DEPTH, ``algorithm`` COMMON or FAST.

    Its Python face takes no first guess. Depth beyond its default limit of 4 m is left out by it.
    """

    def __init__(self, camera: sf.Camera, options: Mapping[str, Any]) -> None:  # noqa: D107
        k = camera.parameters
        matrix = np.array([[k["fx"], 0, k["cx"]], [0, k["fy"], k["cy"]], [0, 0, 1]], np.float32)
        settings = cv2.OdometrySettings()
        settings.setCameraMatrix(matrix)
        kind = getattr(cv2, f"ODOMETRY_TYPE_{options['kind']}")
        algorithm = getattr(cv2, f"ODOMETRY_ALGO_TYPE_{options['algorithm']}")
        self.settings = settings  # kept alive as long as the odometry
        self.odometry = cv2.Odometry(kind, settings, algorithm)

    def prepare(self, view: View) -> cv2.OdometryFrame:
        """Pyramids and normals."""
        depth = metres_with_zeros(view)
        if view.colour is None:
            grey = np.zeros(depth.shape, np.uint8)
        else:
            grey = cv2.cvtColor(np.ascontiguousarray(view.colour), cv2.COLOR_RGB2GRAY)
        frame = cv2.OdometryFrame(depth, grey)
        self.odometry.prepareFrame(frame)
        return frame

    def align(self, first: Any, second: Any, dt_s: float, guess: Matrix) -> Aligned:
        """``Rt * second = first``."""
        try:
            good, motion = self.odometry.compute(second, first)
        except cv2.error as error:
            return Aligned(None, str(error).splitlines()[0])
        if not good or not np.isfinite(motion).all():
            return Aligned(None, "compute() said no")
        return Aligned(np.asarray(motion, np.float64))
