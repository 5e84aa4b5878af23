"""What the pipeline asks of a recording, a camera and an odometry: anything that has it will do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from sphereflow.eval.arrays import TrajectoryLike

Array = NDArray[np.float64]
Colour = NDArray[np.uint8]
DepthImage = NDArray[np.float32]
Stamps = NDArray[np.int64]


class CameraLike(Protocol):
    """A camera model with its parameters by name (``fx``, ``fy``, ...)."""

    @property
    def width(self) -> int:
        """Columns of an image."""

    @property
    def height(self) -> int:
        """Rows of an image."""

    @property
    def model(self) -> str:
        """Name of the model, for example ``pinhole``."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """Parameters by name, lengths in pixels."""


class FrameLike(Protocol):
    """One frame: depth in metres along the optical axis, NaN where unknown."""

    @property
    def stamp_ns(self) -> int:
        """Time of exposure, integer nanoseconds."""

    @property
    def colour(self) -> Colour | None:
        """Image (H, W, 3), or None."""

    @property
    def depth_m(self) -> DepthImage | None:
        """Depth (H, W), or None."""


@runtime_checkable
class RecordingLike(Protocol):
    """A data set that is open: its length, its camera, its frames one after the other."""

    kind: str
    stamp_ns: Stamps
    camera: Any
    depth_scale: float
    truth: Any
    calibration_source: str
    colour_registered: bool
    warnings: Any
    imu: Any

    def __len__(self) -> int: ...  # noqa: D105

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[Any]:
        """Frames in order; a bad one raises a ``SphereflowError`` and the next call goes on."""


class MotionLike(Protocol):
    """What an odometry says of one frame."""

    status: str
    reason: str | None
    has_pose: bool
    world_from_camera: Array
    linear_m_s: Array
    angular_rad_s: Array
    covariance: Array
    score: float
    timings_ms: Mapping[str, float]


class ViewerLike(Protocol):
    """Something that looks on while the pipeline runs and changes nothing."""

    def frame(self, index: int, frame: FrameLike, motion: MotionLike | None) -> None:
        """See one frame and what came of it."""

    def cloud(self, index: int, stamp_ns: int, cloud: Any) -> None:
        """See the map as it is now."""

    def discard(self) -> None:
        """Leave nothing half written behind; does nothing after ``close``."""

    def close(self, journal: Any, truth: TrajectoryLike | None) -> None:
        """See the whole run and finish."""
