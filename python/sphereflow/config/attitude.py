"""Attitude from inertial sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from sphereflow.config.base import Config

_DEG = math.pi / 180.0


@dataclass(frozen=True)
class AttitudeConfig(Config):
    """Settings of ``AttitudeFilter``.

    Parameters
    ----------
    method
        The estimator of today's standard, or the invariant observer of the thesis's section 9.4.
    world
        Frame of the answers: x east, y north, z up ('enu'); or x east, y down, z north ('rdf').
    tau_accel_s
        Time constant of the inclination's correction, seconds.
    tau_mag_s
        Time constant of the heading's correction, seconds.
    motion_bias
        Estimate the gyro's bias while moving.
    rest_bias
        Estimate the gyro's bias at rest.
    reject_disturbance
        Leave out a disturbed magnetic field.
    bias_clip_rad_s
        Largest bias of an axis, rad/s.
    bias_sigma_start_rad_s
        Standard deviation of the bias at the start, rad/s.
    bias_sigma_motion_rad_s
        Standard deviation that the bias reaches in motion, rad/s.
    bias_sigma_rest_rad_s
        Standard deviation that the bias reaches at rest, rad/s.
    bias_forgetting_s
        Time in which the bias forgets 0.1 deg/s, seconds.
    invariant_gain
        Gain of the invariant observer's attitude, 1/s.
    invariant_bias_gain
        Gain of the invariant observer's bias, 1/s^2.
    gyro_limit_rad_s
        Largest rate that the gyro can read, rad/s.
    max_gap_s
        Longer time steps are gaps, seconds.
    """

    method: Literal["inertial", "invariant"] = "inertial"
    world: Literal["enu", "rdf"] = "enu"
    tau_accel_s: float = 3.0
    tau_mag_s: float = 9.0
    motion_bias: bool = True
    rest_bias: bool = True
    reject_disturbance: bool = True
    bias_clip_rad_s: float = 2.0 * _DEG
    bias_sigma_start_rad_s: float = 0.5 * _DEG
    bias_sigma_motion_rad_s: float = 0.1 * _DEG
    bias_sigma_rest_rad_s: float = 0.03 * _DEG
    bias_forgetting_s: float = 100.0
    invariant_gain: float = 0.3
    invariant_bias_gain: float = 0.02
    gyro_limit_rad_s: float = 2000.0 * _DEG
    max_gap_s: float = 0.5
