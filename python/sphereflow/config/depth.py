"""Dense depth from images of known motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sphereflow.config.base import Config


@dataclass(frozen=True)
class DepthFilterConfig(Config):
    """Settings of ``DepthFilter``.

    Parameters
    ----------
    binning
        Pixels to a side of one of the filter's, 1 to 4.
    lags
        Distances in frames to the past images that are compared, increasing, at most eight. Made
        for 60 Hz; halve them at 30.
    sigma_grey
        Standard deviation of the image noise, grey levels; measured where None.
    initial_range_m
        Range everywhere at the start, metres.
    farthest_m
        Surfaces farther than this are not looked for, metres.
    roughness_per_m_rad
        How much 1/Z departs from planes, per metre and radian.
    memory
        Share of the information that survives a frame, above 0.5.
    start_frames
        Frames after the start in which less survives, so that early mistakes are forgotten.
    brightness
        Whether changes of light are measured and taken out, or taken for none.
    occlusion
        Whether past images are left out where a pixel was hidden.
    keyframes
        States of the past that are kept, at most; 0 for none. Only with ``occlusion``.
    """

    binning: int = 2
    lags: tuple[int, ...] = (1, 3, 7, 16, 32, 64)
    sigma_grey: float | None = None
    initial_range_m: float = 1.0
    farthest_m: float = 20.0
    roughness_per_m_rad: float = 0.012
    memory: float = 0.997
    start_frames: int = 30
    brightness: Literal["measured", "constant"] = "measured"
    occlusion: bool = True
    keyframes: int = 24


@dataclass(frozen=True)
class FlowObserverConfig(Config):
    """Settings of ``FlowObserver``.

    Parameters
    ----------
    gain
        k, seconds per metre (the thesis uses 500, and 100 on real data).
    initial_range_m
        Range everywhere at the start, metres.
    farthest_m
        A correction towards a range beyond this is refused, metres.
    least_speed_m_s
        Slower, the range is only carried along, m/s.
    """

    gain: float = 500.0
    initial_range_m: float = 1.0
    farthest_m: float = 20.0
    least_speed_m_s: float = 1e-3


@dataclass(frozen=True)
class DepthObserverConfig(Config):
    """Settings of ``DepthObserver``.

    Parameters
    ----------
    gain
        k, metres per second.
    initial_range_m
        Range everywhere at the start, metres.
    farthest_m
        A correction towards a range beyond this is refused, metres.
    least_speed_m_s
        Slower, the range is only carried along, m/s.
    """

    gain: float = 30.0
    initial_range_m: float = 1.0
    farthest_m: float = 20.0
    least_speed_m_s: float = 1e-3


@dataclass(frozen=True)
class SobolevConfig(Config):
    """Settings of ``sobolev_depth``.

    Parameters
    ----------
    alpha_m_s
        Weight of smoothness, metres per second.
    tolerance
        Relative residual at which to stop.
    iterations
        Iterations at most.
    """

    alpha_m_s: float = 300.0
    tolerance: float = 1e-4
    iterations: int = 60


@dataclass(frozen=True)
class TvDepthConfig(Config):
    """Settings of ``tv_l1_depth``.

    Parameters
    ----------
    weight
        Weight of the data: the thesis's alpha squared.
    beta2
        The thesis's beta squared: it changes the way, not the limit.
    gap
        Relative duality gap at which to stop, 0 to use all iterations.
    iterations
        Iterations at most.
    nearest_m
        Nearest surface, metres.
    """

    weight: float = 0.5
    beta2: float = 20.0
    gap: float = 1e-3
    iterations: int = 400
    nearest_m: float = 0.1
