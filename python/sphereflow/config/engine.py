"""All settings of a run in one."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from sphereflow.config.base import Config
from sphereflow.config.odometry import GraphConfig, OdometryConfig


@dataclass(frozen=True)
class CloudConfig(Config):
    """Settings of the coloured cloud.

    Parameters
    ----------
    voxel_m
        Edge of a cell, metres: smaller is finer, and more memory.
    stride
        Every so many-th pixel of every so many-th row is taken.
    max_range_m
        Points further along the ray are left out, metres.
    max_points
        Points that a cloud has at most.
    """

    voxel_m: float = 0.02
    stride: int = 4
    max_range_m: float = 5.0
    max_points: int = 20_000_000


@dataclass(frozen=True)
class MapConfig(Config):
    """What of the frames goes into the map.

    Parameters
    ----------
    every
        Of so many frames with a pose one goes into the cloud; 0 for no cloud.
    cloud
        How the cloud is thinned.
    """

    every: int = 3
    cloud: CloudConfig = field(default_factory=CloudConfig)


@dataclass(frozen=True)
class EngineConfig(Config):
    """Settings of a run: what ``sphereflow run --config FILE`` takes.

    Parameters
    ----------
    odometry
        How frames are measured against keyframes.
    graph
        Which keyframes are compared with each other, so that poses can be corrected.
    map
        What goes into the map.
    world
        Axes of the world. 'auto': turned so that gravity points along +y where it is known how the
        IMU sits on the camera; 'first-camera': those of the first camera.
    """

    odometry: OdometryConfig = field(default_factory=OdometryConfig)
    graph: GraphConfig = field(default_factory=GraphConfig)
    map: MapConfig = field(default_factory=MapConfig)
    world: Literal["auto", "first-camera"] = "auto"
