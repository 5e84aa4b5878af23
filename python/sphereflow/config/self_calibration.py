"""What a depth camera's self-calibration estimates, and from which pairs of frames."""

from __future__ import annotations

from dataclasses import dataclass

from sphereflow.config.base import Config


@dataclass(frozen=True)
class SelfCalibrationConfig(Config):
    """Settings of ``SelfCalibrator``.

    Parameters
    ----------
    lens
        Estimate what is left of the lens: focal lengths, principal point, distortion.
    field
        Estimate the smooth field by which 1/Z is wrong.
    readout
        Estimate the rolling shutter's read-out time.
    readout_s
        The read-out time so far, seconds; 0 for a global shutter.
    iterations
        Gauss-Newton steps.
    block
        Side of the averaged blocks of pixels for an image 640 pixels wide, 1 to 32.
    domains
        Number of domains wanted.
    max_pairs
        Pairs of frames at most; time grows with them.
    min_pairs
        Fewer pairs than this say nothing.
    min_gap
        The two frames of a pair are at least so many frames apart.
    max_gap
        And at most so many.
    min_motion_m
        A pair must have moved this far, metres.
    max_turn_rad
        And must not have turned further, radians.
    max_distance_m
        And must not have moved further, metres.
    lens_std
        Prior: how far a distortion term bends the rays at the border, at unit distance.
    focal_std
        Prior: relative error of the focal lengths and of the principal point.
    field_std
        Prior: how much a term of the field changes 1/Z where it is largest.
    readout_std_s
        Prior: read-out time, seconds.
    observable_share
        Observable is what the motion reduced to this share of the prior's deviation.
    least_noise
        Residuals are never weighted as better than this, 1/m.
    """

    lens: bool = True
    field: bool = True
    readout: bool = True
    readout_s: float = 0.0
    iterations: int = 6
    block: int = 8
    domains: int = 500
    max_pairs: int = 300
    min_pairs: int = 12
    min_gap: int = 5
    max_gap: int = 20
    min_motion_m: float = 0.05
    max_turn_rad: float = 0.6
    max_distance_m: float = 0.8
    lens_std: float = 0.03
    focal_std: float = 0.005
    field_std: float = 0.02
    readout_std_s: float = 0.02
    observable_share: float = 0.5
    least_noise: float = 2e-5
