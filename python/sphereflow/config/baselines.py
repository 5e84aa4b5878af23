"""The methods that the odometry is measured against."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from sphereflow.config.alignment import AlignmentConfig, CovarianceConfig
from sphereflow.config.base import Config


@dataclass(frozen=True)
class RangeFlowConfig(Config):
    """Settings of ``RangeFlow``.

    Parameters
    ----------
    levels
        Sides of the averaged blocks of pixels, one solve each, coarse to fine. Noise of the
        gradients grows as they shrink, and biases the result towards zero.
    block_known_share
        A block needs this share of known pixels.
    max_jump
        Largest difference of neighbouring blocks over the mean: more is a jump.
    sweeps
        Reweighted solves (Cauchy) on each level.
    block_noise
        Noise of the difference of two block means of the inverse depth, 1/m.
    good_residual_scale
        A residual up to this, in units of ``block_noise``, is never held against a motion.
    max_unexplained_share
        Beyond it, the largest residual as a share of what a camera at rest would leave.
    max_residual_scale
        Largest residual of any rigid motion, in units of ``block_noise``.
    min_known_share
        Smallest share of blocks known in both images.
    min_blocks
        Smallest number of blocks with a gradient.
    weak_score
        A score below this is the status 'weak'.
    unobservable_score
        A direction whose score is below this is not estimated at all.
    unobservable_std_m_s
        Deviation claimed for a direction that was not estimated, m/s.
    max_speed_m_s
        Faster is implausible, m/s.
    max_rate_rad_s
        Faster is implausible, rad/s.
    covariance
        From the covariance of the solve to an honest one.
    """

    levels: tuple[int, ...] = (16, 8, 4)
    block_known_share: float = 0.8
    max_jump: float = 0.12
    sweeps: int = 6
    block_noise: float = 1.5e-3
    good_residual_scale: float = 5.0
    max_unexplained_share: float = 0.5
    max_residual_scale: float = 20.0
    min_known_share: float = 0.1
    min_blocks: int = 40
    weak_score: float = 0.03
    unobservable_score: float = 0.01
    unobservable_std_m_s: float = 1.0
    max_speed_m_s: float = 4.0
    max_rate_rad_s: float = 8.0
    covariance: CovarianceConfig = field(default_factory=CovarianceConfig)


@dataclass(frozen=True)
class ThesisConfig(Config):
    """Settings of ``estimate_velocity`` with method 'thesis'.

    Parameters
    ----------
    domains
        Number of domains wanted, 6 to 100000: Table 6.1 has 40 to 1000.
    overlap
        Rectangles twice as wide and high, each overlapping its neighbours by half.
    time
        Where in time the contour integrals of (6.3) are taken: at the first image ('forward'), or
        the mean of both.
    weights
        The same for each domain, as the thesis ran it, or by the noise of its volume.
    min_domains
        Smallest number of domains without a hole, 7 or more.
    limits
        What the status is judged by; the rest of it has no effect.
    """

    domains: int = 200
    overlap: bool = False
    time: Literal["forward", "trapezoid"] = "trapezoid"
    weights: Literal["equal", "domain_noise"] = "equal"
    min_domains: int = 12
    limits: AlignmentConfig = field(default_factory=AlignmentConfig)
