"""How two depth images are aligned."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from sphereflow.config.base import Config


@dataclass(frozen=True)
class CovarianceConfig(Config):
    """From the covariance of the solve to an honest one.

    Per pair of images ``C = scale^2 N^-1 + (floor_m + motion_share d)^2 I``, with the inverse of
    the normal matrix ``N`` and the motion ``d`` over the pair in metres.

    Parameters
    ----------
    scale
        Factor on the standard deviation of the solve.
    floor_m
        What remains with no motion at all, metres.
    motion_share
        Share of the motion, from the distortion of the depth camera; 0 for a calibrated one.
    """

    scale: float = 2.0
    floor_m: float = 3e-3
    motion_share: float = 0.03


@dataclass(frozen=True)
class NoiseConfig(Config):
    """How the noise of the depth depends on the distance.

    Parameters
    ----------
    model
        'disparity' (structured light, stereo): the same in 1/Z at all distances.
        'time_of_flight': ``floor_m + share * range`` in the range.
    floor_m
        Of 'time_of_flight': deviation near the camera, metres.
    share
        Of 'time_of_flight': what comes with the range, as a share of it.
    """

    model: Literal["disparity", "time_of_flight"] = "disparity"
    floor_m: float = 2e-3
    share: float = 1e-3


@dataclass(frozen=True)
class AlignmentConfig(Config):
    """Settings of ``estimate_velocity`` and, within ``OdometryConfig``, of ``DepthOdometry``.

    Parameters
    ----------
    block
        Side of the averaged blocks of pixels for an image 640 pixels wide, 1 to 32; others have
        larger or smaller ones. Larger is faster and sees less.
    levels
        Levels of blocks, each twice as wide as the one before, 1 to 6: more for larger motions.
    coarse_solves
        Solves on the coarsest of several levels; on the others there is one.
    warps
        Further solves on the finest level.
    block_known_share
        A block needs this share of known pixels.
    max_jump
        Largest spread of the inverse depth within a block over its mean: more is a jump.
    max_bend
        Bend of the inverse depth across three blocks, 1/m, from which there is an edge.
    domains
        Number of domains wanted on the finest level; small images get fewer.
    domain_known_share
        A domain needs this share of its blocks known in both images.
    sweeps
        Reweighted solves (Cauchy).
    domain_noise
        Noise of the difference of two domain means of the inverse depth, 1/m.
    noise
        How the noise depends on the distance.
    good_residual_scale
        A residual up to this, in units of ``domain_noise``, is never held against a motion.
    max_unexplained_share
        Beyond it, the largest residual as a share of what a camera at rest would leave.
    max_residual_scale
        Largest residual of any rigid motion, in units of ``domain_noise``.
    max_divided_share
        From this share of the domains on that follow a second motion the scene is divided.
    min_known_share
        Smallest share of blocks known in both images.
    min_domains
        Smallest number of usable domains.
    weak_score
        A score below this is the status 'weak'.
    unobservable_score
        A direction whose score is below this is not estimated: it takes the prior's value.
    max_std_m
        A direction whose predicted deviation is above this is held at the prior too, metres per
        pair; infinite for no limit.
    unobservable_std_m_s
        Deviation claimed for a direction that was not estimated, m/s.
    max_speed_m_s
        Faster is implausible, m/s.
    max_rate_rad_s
        Faster is implausible, rad/s.
    max_gap_s
        Longest time between two images that is still bridged, seconds.
    brightness_weight
        What a block's brightness counts, as a share of an independent measurement.
    covariance
        From the covariance of the solve to an honest one.
    """

    block: int = 2
    levels: int = 3
    coarse_solves: int = 2
    warps: int = 0
    block_known_share: float = 0.8
    max_jump: float = 0.12
    max_bend: float = 1.5e-3
    domains: int = 500
    domain_known_share: float = 0.3
    sweeps: int = 6
    domain_noise: float = 8e-4
    noise: NoiseConfig = field(default_factory=NoiseConfig)
    good_residual_scale: float = 5.0
    max_unexplained_share: float = 0.5
    max_residual_scale: float = 20.0
    max_divided_share: float = 0.2
    min_known_share: float = 0.1
    min_domains: int = 40
    weak_score: float = 0.03
    unobservable_score: float = 0.01
    max_std_m: float = math.inf
    unobservable_std_m_s: float = 1.0
    max_speed_m_s: float = 4.0
    max_rate_rad_s: float = 8.0
    max_gap_s: float = 0.5
    brightness_weight: float = 0.003
    covariance: CovarianceConfig = field(default_factory=CovarianceConfig)
