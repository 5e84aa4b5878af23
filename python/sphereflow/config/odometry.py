"""When keyframes are made, and which of them are compared."""

from __future__ import annotations

from dataclasses import dataclass, field

from sphereflow.config.alignment import AlignmentConfig
from sphereflow.config.base import Config


@dataclass(frozen=True)
class KeyframeConfig(Config):
    """When a frame becomes a keyframe, and when an alignment is believed.

    Parameters
    ----------
    enabled
        False measures every frame against the one before.
    min_overlap
        Below this share of the keyframe's surface in view the next keyframe is made.
    max_flow_px
        Above this median displacement too, pixels of an image 640 pixels wide.
    least_overlap
        Below this share an alignment is not believed.
    max_surprise_m
        Largest distance between the predicted and the measured position, metres.
    """

    enabled: bool = True
    min_overlap: float = 0.7
    max_flow_px: float = 120.0
    least_overlap: float = 0.3
    max_surprise_m: float = 0.15


@dataclass(frozen=True)
class OdometryConfig(Config):
    """Settings of ``DepthOdometry``.

    Parameters
    ----------
    alignment
        How two images are aligned.
    keyframes
        When keyframes are made.
    readout_s
        Rolling shutter: seconds between the exposures of the first and the last row; negative
        where the last row comes first.
    """

    alignment: AlignmentConfig = field(default_factory=AlignmentConfig)
    keyframes: KeyframeConfig = field(default_factory=KeyframeConfig)
    readout_s: float = 0.0


@dataclass(frozen=True)
class GraphConfig(Config):
    """Which pairs of keyframes are compared, and how far a comparison is trusted.

    Parameters
    ----------
    enabled
        False keeps no keyframes: nothing is corrected afterwards.
    max_angle_rad
        Pairs turned by more than this are not compared, radians.
    max_distance_m
        Pairs further apart are not compared, metres.
    min_overlap
        Pairs that share less of their surface are not compared.
    max_edges
        Largest number of earlier keyframes that one is compared with: those of most overlap.
    floor_m
        Standard deviation of a comparison beyond what its residuals show, metres.
    floor_rad
        The same for rotations, radians.
    rounds
        Rounds of comparing and solving.
    """

    enabled: bool = True
    max_angle_rad: float = 0.6
    max_distance_m: float = 0.8
    min_overlap: float = 0.3
    max_edges: int = 30
    floor_m: float = 4e-3
    floor_rad: float = 3e-3
    rounds: int = 2
