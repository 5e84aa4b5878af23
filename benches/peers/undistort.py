"""Frames without lens distortion, for methods that know pinholes only."""

from __future__ import annotations

import numpy as np
import sphereflow as sf
from numpy.typing import NDArray

from benches.peers.align import View


class Undistorted:
    """The pinhole part of a camera, and its frames resampled to it.

    Depth by nearest neighbour, so that none is made up at edges; colour bilinear. Depth along the
    optical axis stays as it is: only the pixels move.
    """

    def __init__(self, camera: sf.Camera) -> None:  # noqa: D107
        k = camera.parameters
        width, height = camera.width, camera.height
        self.camera = sf.Camera.pinhole(k["fx"], k["fy"], k["cx"], k["cy"], width, height)
        self.needed = camera.model != "pinhole"
        ys, xs = np.mgrid[0:height, 0:width]
        pixels = np.stack([xs.ravel(), ys.ravel()], axis=1).astype(float)
        source = camera.project(self.camera.unproject(pixels)).reshape(height, width, 2)
        limit = np.array([width, height]) - 1.0
        self.inside = ((source >= 0) & (source <= limit)).all(axis=2)  # false for NaN
        self.source = np.where(self.inside[..., None], source, 0.0)

    def __call__(self, view: View) -> View:
        """One frame."""
        if not self.needed:
            return view
        nearest = np.rint(self.source).astype(int)
        depth = view.depth_m[nearest[..., 1], nearest[..., 0]]
        depth = np.where(self.inside, depth, np.float32(np.nan))
        colour = None if view.colour is None else self._bilinear(view.colour)
        return View(depth, colour)

    def _bilinear(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        height, width = self.inside.shape
        low = np.floor(self.source).astype(int)
        x0, y0 = np.minimum(low[..., 0], width - 2), np.minimum(low[..., 1], height - 2)
        u = (self.source[..., 0] - x0)[..., None].astype(np.float32)
        v = (self.source[..., 1] - y0)[..., None].astype(np.float32)
        top = image[y0, x0] * (1 - u) + image[y0, x0 + 1] * u
        bottom = image[y0 + 1, x0] * (1 - u) + image[y0 + 1, x0 + 1] * u
        mixed = np.rint(top * (1 - v) + bottom * v)
        return np.where(self.inside[..., None], mixed, 0).astype(np.uint8)
