"""The settings of a run as they were used, for the engine and for the report."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import sphereflow
from sphereflow._native import Calibration
from sphereflow.config import CovarianceConfig, EngineConfig
from sphereflow.interfaces import RecordingLike

METHODS = ("depth",)

_IDENTITY = [[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1.0]]


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
    voxel_m: float | None = None
    world: Literal["auto", "first-camera"] | None = None
    config: EngineConfig | None = None

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
            (
                self.voxel_m is not None and not self.voxel_m > 0.0,
                f"voxel_m must be above 0 metres, found {self.voxel_m}",
            ),
            (
                self.world not in (None, "auto", "first-camera"),
                f"world must be auto or first-camera, found {self.world!r}",
            ),
        ):
            if wrong:
                raise sphereflow.ValueRangeError(text)

    def engine_config(self, recording: RecordingLike) -> EngineConfig:
        """The engine's settings: those of the file, changed by the options that were given."""
        config = EngineConfig() if self.config is None else self.config
        if not self.pose_graph:
            config = replace(config, graph=replace(config.graph, enabled=False))
        if self.voxel_m is not None:
            cloud = replace(config.map.cloud, voxel_m=self.voxel_m)
            config = replace(config, map=replace(config.map, cloud=cloud))
        if self.world is not None:
            config = replace(config, world=self.world)
        if depth_corrected_of(recording) and self.config is None:
            # Calibrated depth: no part of the covariance grows with the motion.
            covariance = CovarianceConfig(motion_share=0.0)
            alignment = replace(config.odometry.alignment, covariance=covariance)
            config = replace(config, odometry=replace(config.odometry, alignment=alignment))
        return config

    def device_of(self, recording: RecordingLike) -> Calibration:
        """The device as the recording's frames are: depth that is corrected stays as it is."""
        known: Calibration | None = getattr(recording, "calibration", None)
        if known is None:
            camera = recording.camera
            registered = {"colour": camera, "colour_from_depth": _IDENTITY}
            known = Calibration(camera, **(registered if recording.colour_registered else {}))
        if depth_corrected_of(recording):
            known = known.without_depth_field()
        return known.with_readout_s(self.readout_of(recording)[0])

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
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return values | {"config": None if self.config is None else self.config.as_dict()}


def depth_corrected_of(recording: RecordingLike) -> bool:
    """Whether the recording's calibration corrects the distortion of its depth."""
    return bool(getattr(recording, "depth_corrected", False))
