"""All settings of a run in one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from sphereflow.config.base import Config
from sphereflow.config.odometry import GraphConfig, OdometryConfig
from sphereflow.errors import ValueRangeError


@dataclass(frozen=True)
class MapConfig(Config):
    """What of the frames goes into the map.

    Parameters
    ----------
    voxel_m
        Edge of a cell, metres: smaller is finer, and more memory.
    every
        Each so many frames one goes into the map: neighbours see the same surface.
    """

    voxel_m: float = 0.02
    every: int = 3

    _compiled: ClassVar[bool] = False

    def _check(self) -> None:
        if not (math.isfinite(self.voxel_m) and self.voxel_m > 0.0):
            raise ValueRangeError(f"voxel_m: expected a positive number, found {self.voxel_m}")
        if self.every < 1:
            raise ValueRangeError(f"every: expected 1 or more, found {self.every}")


@dataclass(frozen=True)
class EngineConfig(Config):
    """Settings of a run: what ``sphereflow run --config FILE`` takes.

    Parameters
    ----------
    world
        Frame of the poses. 'auto': turned so that gravity points along +y where it is known how
        the IMU sits on the camera; 'first-camera': the frame of the first camera.
    odometry
        How motion is measured.
    graph
        Which keyframes are compared, so that poses can be corrected.
    map
        What goes into the map.
    """

    world: Literal["auto", "first-camera"] = "auto"
    odometry: OdometryConfig = field(default_factory=OdometryConfig)
    graph: GraphConfig = field(default_factory=GraphConfig)
    map: MapConfig = field(default_factory=MapConfig)

    _compiled: ClassVar[bool] = False
