"""Biases of measured velocities from images."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from sphereflow.config.base import Config


@dataclass(frozen=True)
class VelocityBiasGains(Config):
    """Gains of the observer in the thesis's units.

    Parameters
    ----------
    k_field
        Correction of the estimated fields, 1/s.
    k_v
        Bias of the linear velocity, m^2/s^2.
    k_omega
        Bias of the angular velocity, rad m/s^2.
    lambda_y
        Weight of the brightness.
    lambda_d
        Weight of the range, m^-2.
    """

    k_field: float = 2.0
    k_v: float = 1e-2
    k_omega: float = 1e-5
    lambda_y: float = 1.0
    lambda_d: float = 5000.0


@dataclass(frozen=True)
class VelocityBiasConfig(Config):
    """Settings of ``VelocityBiasEstimator``.

    Parameters
    ----------
    method
        The information form, the thesis's observer, or the same with gains divided by the Gram
        matrix of the images.
    gains
        Gains of the observer; the normalised one takes field gain and weights from here.
    rate_per_s
        Rate of the normalised observer, 1/s.
    forget_s
        Time constant with which the information form forgets, seconds.
    linear_sigma, angular_sigma
        Standard deviation of one measured velocity, m/s and rad/s.
    linear_bias_sigma, angular_bias_sigma
        Standard deviation of the bias at the start, m/s and rad/s.
    readout_s
        Seconds from the first row of an image to the last: 0 for a global shutter.
    timing_sigma_s
        How well stamps of images and velocities agree, seconds.
    shared_error_px
        Error of an alignment that all its pixels share, pixels of the binned image.
    max_gap_s
        After longer steps the images before are of no use, seconds.
    angular_limit_rad_s
        Largest angular velocity that can be measured, rad/s.
    max_width
        Images are binned until they are at most this wide, pixels.
    window_border
        Part of the image, from its border inwards, over which the window falls to zero.
    """

    method: Literal["information", "observer", "normalised"] = "information"
    gains: VelocityBiasGains = field(default_factory=VelocityBiasGains)
    rate_per_s: float = 1.0
    forget_s: float = 3.0
    linear_sigma: float = 0.01
    angular_sigma: float = 1e-3
    linear_bias_sigma: float = 3.0
    angular_bias_sigma: float = 0.2
    readout_s: float = 0.0
    timing_sigma_s: float = 0.0
    shared_error_px: float = 1.5
    max_gap_s: float = 0.5
    angular_limit_rad_s: float = 34.9
    max_width: int = 160
    window_border: float = 0.15
