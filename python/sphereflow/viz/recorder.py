"""Records a run for the rerun viewer: frames and map while it goes, everything else at the end.

High-rate data are sent as whole columns, images and clouds at a limited rate: logged one by one
they would be many times the size of the recording itself.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sphereflow
from sphereflow.eval import TrajectoryLike, ape
from sphereflow.eval.rotations import quat_xyzw_from_matrix
from sphereflow.interfaces import CameraLike, FrameLike, MotionLike, distances_of
from sphereflow.journal import Journal
from sphereflow.viz.layout import blueprint
from sphereflow.viz.sdk import rerun

IMAGE_EVERY = 3
"""Frames of which the images are kept: ten a second of a usual camera."""

IMAGE_COLUMNS = 320
"""Images are thinned to about this many columns."""

CLOUD_EVERY = 15
"""Frames after which the map is looked at again; it is sent only if it grew by a fifth."""

CLOUD_POINTS = 150_000
JPEG_QUALITY = 80
TRUTH_DIFFERENCE_S = 0.02
PINHOLE_MODELS = ("pinhole", "opencv")
"""Models drawn as a frustum (lens distortion is not drawn); others show their images only."""


class RunRecorder:
    """Writes ``path`` (``.rrd``) beside and renames it in :meth:`close`.

    The world is that of the first camera: x right, y down, z forward, metres.
    """

    def __init__(self, camera: CameraLike, path: str | Path) -> None:  # noqa: D107
        self._rr = rerun()
        self._path = Path(path)
        self._partial = self._path.with_name(f".{self._path.name}.partial")
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._stride = max(1, round(camera.width / IMAGE_COLUMNS))
        self._first_ns: int | None = None
        self._cloud_size = 0
        self._stream = self._rr.RecordingStream("sphereflow")
        self._stream.save(self._partial, default_blueprint=blueprint(self._rr))
        self._stream.log("world", self._rr.ViewCoordinates.RDF, static=True)
        self._camera(camera)

    def frame(self, index: int, frame: FrameLike, motion: MotionLike | None) -> None:
        """Log the images of every few frames, thinned, and the camera's pose with them."""
        self._set_time(index, frame.stamp_ns)
        if motion is not None and motion.has_pose:
            pose = np.asarray(motion.world_from_camera)
            self._stream.log(
                "world/camera",
                self._rr.Transform3D(
                    translation=pose[:3, 3],
                    quaternion=self._rr.Quaternion(xyzw=quat_xyzw_from_matrix(pose[:3, :3])),
                ),
            )
        if index % IMAGE_EVERY:
            return
        step = self._stride
        if frame.colour is not None:
            image = self._rr.Image(np.ascontiguousarray(frame.colour[::step, ::step]))
            self._stream.log("world/camera/colour", image.compress(jpeg_quality=JPEG_QUALITY))
        metres = distances_of(frame)
        if metres is not None:
            millimetres = _millimetres(metres[::step, ::step])
            self._stream.log("world/camera/depth", self._rr.DepthImage(millimetres, meter=1000.0))

    def cloud(self, index: int, stamp_ns: int, cloud: Callable[[], Any]) -> None:
        """Log the map where it has grown enough to look different; ``cloud`` makes it."""
        if index % CLOUD_EVERY:
            return
        self._set_time(index, stamp_ns)
        self._send_cloud(*cloud().points(), only_if_grown=True)

    def points(self, xyz_m: NDArray[np.float32], rgb: NDArray[np.uint8]) -> None:
        """Log a map that is ready."""
        self._send_cloud(xyz_m, rgb, only_if_grown=False)

    def close(self, journal: Journal | None, truth: TrajectoryLike | None) -> None:
        """Send paths, velocities, scores and statuses, and finish the file."""
        if journal is not None and journal.entries:
            self._columns(journal)
            estimate, measured = journal.trajectory(), journal.odometry()
            if estimate is not None:
                self.paths(estimate, truth)
            if measured is not None and journal.corrected:
                # Where the path was before it was corrected, fainter.
                self._strip("world/odometry", np.asarray(measured.position_m), (110, 130, 150))
        elif truth is not None:
            self._strip("world/truth", np.asarray(truth.position_m), (200, 200, 200))
        self._stream.flush()
        self._stream.disconnect()
        self._partial.replace(self._path)

    def discard(self) -> None:
        """Remove an unfinished file; does nothing after :meth:`close`."""
        self._stream.disconnect()
        self._partial.unlink(missing_ok=True)

    def paths(self, estimate: TrajectoryLike, truth: TrajectoryLike | None) -> None:
        """Log the estimated path, and the true one moved onto it."""
        self._strip("world/path", np.asarray(estimate.position_m), (40, 140, 230))
        if truth is None:
            return
        try:
            error = ape(truth, estimate, max_difference_s=TRUTH_DIFFERENCE_S)
        except sphereflow.SphereflowError as reason:
            text = f"the truth is not shown: {reason}"
            self._stream.log("log", self._rr.TextLog(text, level="WARN"), static=True)
            return
        # The truth's world is another one; in the estimate's both can be compared by eye.
        truth_m = error.alignment.points_back(np.asarray(truth.position_m))
        self._strip("world/truth", truth_m, (200, 200, 200))

    def _camera(self, camera: CameraLike) -> None:
        if camera.model not in PINHOLE_MODELS:
            return
        step, parameters = self._stride, camera.parameters
        columns, rows = -(-camera.width // step), -(-camera.height // step)
        # Every step-th pixel is kept, and rerun counts from the pixel's corner, not its centre.
        pinhole = self._rr.Pinhole(
            focal_length=[parameters["fx"] / step, parameters["fy"] / step],
            principal_point=[parameters["cx"] / step + 0.5, parameters["cy"] / step + 0.5],
            width=columns,
            height=rows,
            camera_xyz=self._rr.ViewCoordinates.RDF,
            image_plane_distance=0.25,
        )
        self._stream.log("world/camera", pinhole, static=True)

    def _set_time(self, index: int, stamp_ns: int) -> None:
        if self._first_ns is None:
            self._first_ns = int(stamp_ns)
        since = np.timedelta64(int(stamp_ns) - self._first_ns, "ns")
        self._stream.set_time("time", duration=since)
        self._stream.set_time("frame", sequence=index)

    def _columns(self, journal: Journal) -> None:
        stamps = journal.stamp_ns
        first = int(stamps[0]) if self._first_ns is None else self._first_ns
        since = (stamps - first).astype("timedelta64[ns]")
        indexes = [
            self._rr.TimeColumn("time", duration=since),
            self._rr.TimeColumn("frame", sequence=np.arange(len(stamps))),
        ]
        linear, angular = journal.velocities
        series = {
            "motion/quality": journal.qualities,
            "motion/has_pose": journal.has_pose.astype(float),
        }
        for axis, name in enumerate(("x", "y", "z")):
            series[f"motion/linear_m_s/{name}"] = linear[:, axis]
            series[f"motion/angular_rad_s/{name}"] = angular[:, axis]
        for path, values in series.items():
            columns = self._rr.Scalars.columns(scalars=values)
            self._stream.send_columns(path, indexes=indexes, columns=columns)
        texts = [f"{e.status}: {e.reason}" if e.reason else e.status for e in journal.entries]
        self._stream.send_columns(
            "log/status", indexes=indexes, columns=self._rr.TextLog.columns(text=texts)
        )

    def _send_cloud(
        self, xyz_m: NDArray[np.float32], rgb: NDArray[np.uint8], *, only_if_grown: bool
    ) -> None:
        if len(xyz_m) == 0 or (only_if_grown and len(xyz_m) < 1.2 * self._cloud_size):
            return
        self._cloud_size = len(xyz_m)
        step = max(1, len(xyz_m) // CLOUD_POINTS)
        cloud = self._rr.Points3D(xyz_m[::step], colors=rgb[::step], radii=0.01)
        self._stream.log("world/map", cloud)

    def _strip(self, entity: str, position_m: NDArray[np.float64], color: tuple[int, ...]) -> None:
        strip = self._rr.LineStrips3D([position_m], colors=[color], radii=0.005)
        self._stream.log(entity, strip, static=True)


def _millimetres(depth_m: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Depth in whole millimetres, 0 where unknown: half the size, and rerun's way of unknown."""
    known = np.isfinite(depth_m)
    counts = np.clip(np.where(known, depth_m, 0.0) * 1000.0, 0.0, 65535.0)
    return np.rint(counts).astype(np.uint16)
