"""What the pipeline asks of a recording, a camera and an odometry: anything that has it will do."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Literal, Protocol

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
    """One frame: distances in metres, NaN where unknown."""

    @property
    def stamp_ns(self) -> int:
        """Time of exposure, integer nanoseconds."""

    @property
    def colour(self) -> Colour | None:
        """Image (H, W, 3), or None."""

    @property
    def depth_m(self) -> DepthImage | None:
        """Depth along the optical axis (H, W), or None."""

    @property
    def range_m(self) -> DepthImage | None:
        """Range along the ray (H, W), what a 360-degree camera has instead, or None."""


def distances_of(frame: FrameLike) -> DepthImage | None:
    """Depth of a frame, or its range where it has that instead; None where it has neither."""
    return frame.range_m if frame.depth_m is None else frame.depth_m


def direction_of(camera: CameraLike) -> Literal["axis", "ray"]:
    """Along what the camera's distances are: a 360-degree camera has no optical axis."""
    return "ray" if camera.model == "equirectangular" else "axis"


class RecordingLike(Protocol):
    """A data set that is open: its length, its camera, its frames one after the other.

    Used too where a recording has them: ``sync``, ``imu``, ``mag`` and ``notes``; ``readout_s``
    (float or None: seconds between the exposures of its first and last row) and
    ``depth_corrected`` (bool: the distortion of its depth was calibrated and is undone).
    """

    @property
    def kind(self) -> str:
        """Which data set it is, or what made it."""

    @property
    def stamp_ns(self) -> Stamps:
        """Times of all frames, integer nanoseconds (N,)."""

    @property
    def camera(self) -> Any:
        """The camera of the depth images, or None where no calibration was found."""

    @property
    def calibration_source(self) -> str:
        """Where the calibration is from, in words."""

    @property
    def depth_scale(self) -> float | None:
        """Depth counts per metre, or None where depth has no counts."""

    @property
    def colour_registered(self) -> bool:
        """Whether a pixel of the colour image sees what the same pixel of the depth image does."""

    @property
    def truth(self) -> TrajectoryLike | None:
        """The true motion, or None."""

    @property
    def warnings(self) -> list[str]:
        """What was wrong with the data, in words."""

    def __len__(self) -> int: ...  # noqa: D105

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[Any]:
        """Frames in order; a bad one raises a ``SphereflowError`` and the next call goes on."""


class MotionLike(Protocol):
    """What the engine says of one frame."""

    @property
    def status(self) -> str:
        """One of ``sphereflow.journal.STATUSES``."""

    @property
    def reason(self) -> str | None:
        """Why it is weak, lost or skipped."""

    @property
    def has_pose(self) -> bool:
        """Whether the pose was measured or defined, and not only predicted."""

    @property
    def world_from_camera(self) -> Array:
        """The pose (4, 4)."""

    @property
    def linear_m_s(self) -> Array:
        """Linear velocity in the camera's frame (3,)."""

    @property
    def angular_rad_s(self) -> Array:
        """Angular velocity in the camera's frame (3,)."""

    @property
    def reason_code(self) -> str | None:
        """The same as a word that stays from version to version."""

    @property
    def quality(self) -> float:
        """How well determined the motion is, 0 to 1."""

    @property
    def segment(self) -> int:
        """Number of the chain of measurements."""

    @property
    def timings_ms(self) -> Mapping[str, float]:
        """Milliseconds by stage."""


class ViewerLike(Protocol):
    """Something that looks on while the pipeline runs and changes nothing."""

    def frame(self, index: int, frame: FrameLike, motion: MotionLike | None) -> None:
        """See one frame and what came of it."""

    def cloud(self, index: int, stamp_ns: int, cloud: Callable[[], Any]) -> None:
        """See the map as it is now; ``cloud`` makes it."""

    def points(self, xyz_m: NDArray[np.float32], rgb: Colour) -> None:
        """See the map as it is in the end."""

    def discard(self) -> None:
        """Leave nothing half written behind; does nothing after ``close``."""

    def close(self, journal: Any, truth: TrajectoryLike | None) -> None:
        """See the whole run and finish."""
