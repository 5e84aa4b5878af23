"""The rows: one line for each method and mode. A new mode is a new line."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import sphereflow as sf


@dataclass(frozen=True, slots=True)
class Package:
    """An optional dependency: what to import, and what to install."""

    module: str
    pip: str

    def absent(self) -> str | None:
        """What to do where it is not installed; None where it is."""
        if importlib.util.find_spec(self.module) is not None:
            return None
        return f"{self.module} is not installed: pip install '{self.pip}' (or 'sphereflow[peers]')"


OPENCV = Package("cv2", "opencv-python-headless>=5")
OPEN3D = Package("open3d", "open3d>=0.19")


@dataclass(frozen=True, slots=True)
class Row:
    """One method with its settings.

    ``pairs``: runs on the simulated pairs; ``tracks``: the modes in which it runs on recordings,
    ``frame`` and ``keyframe`` by the driver that all rows share, ``own`` by its own odometry.
    """

    name: str
    build: str
    options: Mapping[str, Any] = field(default_factory=dict)
    needs: Package | None = None
    colour: bool = False
    pairs: bool = True
    tracks: tuple[str, ...] = ("frame", "keyframe")

    @property
    def is_ours(self) -> bool:
        """True for the rows that this project makes; they take distorted images as they are."""
        return self.needs is None

    def made_for(self, camera: sf.Camera) -> Any:
        """The method for one camera; errors are the method's own."""
        module, name = self.build.split(":")
        return getattr(importlib.import_module(f"benches.peers.{module}"), name)(
            camera, self.options
        )


def _weak(name: str, **options: Any) -> Row:
    return Row(f"ours, {name}", "ours:WeakForm", options, tracks=())


def _track(name: str, **options: Any) -> Row:
    return Row(f"ours, {name}", "ours_tracks:Odometry", options, pairs=False, tracks=("own",))


def _opencv(kind: str, algorithm: str = "COMMON") -> Row:
    options = {"kind": kind, "algorithm": algorithm}
    name = f"OpenCV Odometry {kind}" + ("" if algorithm == "COMMON" else f" {algorithm}")
    modes = ("frame", "keyframe") if algorithm == "COMMON" else ("frame",)
    build = "opencv_rows:OpencvOdometry"
    return Row(name, build, options, OPENCV, colour=kind != "DEPTH", tracks=modes)


def _tensor(name: str, method: str) -> Row:
    options = {"method": method}
    colour = method != "PointToPlane"
    return Row(f"Open3D tensor {name}", "open3d_rows:TensorOdometry", options, OPEN3D, colour)


ROWS: tuple[Row, ...] = (
    Row("at rest", "ours:AtRest", tracks=("frame",)),
    _weak("thesis", method="thesis"),
    _weak("single", method="single"),
    _weak("pyramid", method="pyramid"),
    Row(
        "ours, pyramid, with brightness",
        "ours:WeakForm",
        {"colour": True},
        colour=True,
        tracks=(),
    ),
    _track("single f2f", method="single", keyframes=False),
    _track("pyramid f2f", keyframes=False),
    _track("keyframes"),
    _track("keyframes, read-out 30 ms", readout_s=0.03),
    Row("point-wise 16, 8, 4", "ours:PointWise", {"levels": (16, 8, 4)}),
    Row("point-wise 16, 8, 4, 2", "ours:PointWise", {"levels": (16, 8, 4, 2)}),
    _opencv("DEPTH"),
    _opencv("DEPTH", "FAST"),
    _opencv("RGB_DEPTH"),
    _tensor("point-to-plane", "PointToPlane"),
    _tensor("hybrid", "Hybrid"),
    Row(
        "Open3D legacy hybrid",
        "open3d_rows:LegacyOdometry",
        needs=OPEN3D,
        colour=True,
        tracks=("frame",),
    ),
    Row(
        "Open3D ICP point-to-plane 5 cm",
        "open3d_rows:PointToPlaneIcp",
        {"voxel_m": 0.05},
        OPEN3D,
        tracks=("keyframe",),
    ),
)
