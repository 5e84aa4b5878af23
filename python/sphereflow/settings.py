"""The settings of a run as they were used, for the odometry and for the report."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import sphereflow
from sphereflow.interfaces import RecordingLike

METHODS = ("depth",)


@dataclass(frozen=True, slots=True)
class Settings:
    """What was asked for."""

    method: str = "depth"
    calibration: str | None = None
    depth_scale: float | None = None
    pose_graph: bool = True
    readout_s: float | None = None
    max_frames: int | None = None
    min_coverage: float = 0.9
    voxel_m: float = 0.02

    def check(self) -> None:
        """Raise a ``ValueRangeError`` for a setting that has no meaning."""
        for wrong, text in (
            (
                self.method not in METHODS,
                f"method must be one of {', '.join(METHODS)}, found {self.method!r}",
            ),
            (
                self.max_frames is not None and self.max_frames < 1,
                f"max_frames must be at least 1, found {self.max_frames}",
            ),
            (
                not 0.0 <= self.min_coverage <= 1.0,
                f"min_coverage must be from 0 to 1, found {self.min_coverage}",
            ),
            (not self.voxel_m > 0.0, f"voxel_m must be above 0 metres, found {self.voxel_m}"),
        ):
            if wrong:
                raise sphereflow.ValueRangeError(text)

    def readout_of(self, recording: RecordingLike) -> tuple[float, str]:
        """The read-out time to use, seconds, and where it is from."""
        if self.readout_s is not None:
            return float(self.readout_s), "given"
        known: float | None = getattr(recording, "readout_s", None)
        if known is not None:
            return float(known), "recording"
        return 0.0, "unknown: taken as 0, all rows exposed at once"

    def as_dict(self) -> dict[str, Any]:
        """By name, for the report."""
        return asdict(self)


def depth_corrected_of(recording: RecordingLike) -> bool:
    """Whether the recording's calibration corrects the distortion of its depth."""
    return bool(getattr(recording, "depth_corrected", False))
