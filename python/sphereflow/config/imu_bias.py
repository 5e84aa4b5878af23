"""Biases of gyro and accelerometer from velocities."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from sphereflow.config.base import Config

GYRO_SIGMA_RAD_S = 1.75e-4 * math.sqrt(200.0)
"""One reading of a consumer-grade gyro: 0.01 deg/s/sqrt(Hz) at 200 Hz."""

ACCEL_SIGMA_M_S2 = 2e-3 * math.sqrt(200.0)
"""One reading of a consumer-grade accelerometer: 0.2 mg/sqrt(Hz) at 200 Hz."""


@dataclass(frozen=True)
class ImuBiasGains(Config):
    """Gains of the observer (7.4).

    Parameters
    ----------
    lambda_v
        Weight of the velocity's error.
    lambda_g
        Weight of gravity's error, s^2.
    lambda_w
        Weight of the gyro bias's error, m^2.
    lambda_a
        Weight of the accelerometer bias's error, s^2.
    k_v
        Of the velocity, 1/s.
    k_w1
        Of the gyro's bias, 1/s.
    k_g2
        Of gravity by the field, 1/s.
    """

    lambda_v: float = 1.0
    lambda_g: float = 1.0
    lambda_w: float = 1e3
    lambda_a: float = 4.0
    k_v: float = 0.5
    k_w1: float = 0.05
    k_g2: float = 3.0


@dataclass(frozen=True)
class ImuBiasConfig(Config):
    """Settings of ``ImuBiasEstimator``.

    Parameters
    ----------
    method
        An extended Kalman filter, or the thesis's observer (7.4).
    gains
        Gains of the observer.
    gravity_m_s2
        Local norm of gravity.
    gravity_sigma_m_s2
        What is known of it.
    field_dot_down
        Scalar product of the unit vectors of magnetic field and gravity: the sine of the dip;
        None: the magnetometer is not used.
    field_sigma
        Standard deviation of that product in a reading.
    gyro_sigma_rad_s, accel_sigma_m_s2
        Standard deviation of one reading.
    gyro_walk, accel_walk
        How the bias wanders, rad/s/sqrt(s) and m/s^2/sqrt(s).
    gyro_bias_sigma, accel_bias_sigma
        Standard deviation of the bias at the start, rad/s and m/s^2.
    gate
        A velocity beyond this squared distance is left out.
    max_gap_s
        Longer steps are gaps, seconds.
    gyro_limit_rad_s
        Largest rate that the gyro can read, rad/s.
    """

    method: Literal["ekf", "observer"] = "ekf"
    gains: ImuBiasGains = field(default_factory=ImuBiasGains)
    gravity_m_s2: float = 9.81
    gravity_sigma_m_s2: float = 0.005
    field_dot_down: float | None = None
    field_sigma: float = 0.02
    gyro_sigma_rad_s: float = GYRO_SIGMA_RAD_S
    accel_sigma_m_s2: float = ACCEL_SIGMA_M_S2
    gyro_walk: float = 2e-5
    accel_walk: float = 5e-4
    gyro_bias_sigma: float = 0.1
    accel_bias_sigma: float = 0.3
    gate: float = 30.0
    max_gap_s: float = 0.5
    gyro_limit_rad_s: float = 34.9
