"""Optical flow and denoising."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sphereflow.config.base import Config


@dataclass(frozen=True)
class HornSchunckConfig(Config):
    """Settings of ``horn_schunck``.

    Parameters
    ----------
    alpha
        Weight of smoothness, grey levels.
    aspect
        Height over width of a pixel.
    solver
        Jacobi's iteration as printed in the thesis, or over-relaxation ('sor') until converged.
    sweeps
        Sweeps over the image ('sor': at most).
    tolerance_px
        Of 'sor': largest change of a displacement at which to stop, pixels.
    """

    alpha: float = 10.0
    aspect: float = 1.0
    solver: Literal["jacobi", "sor"] = "jacobi"
    sweeps: int = 50
    tolerance_px: float = 1e-4


@dataclass(frozen=True)
class TvL1Config(Config):
    """Settings of ``tv_l1``.

    Parameters
    ----------
    weight
        Weight of the data, per grey level; None for 0.25, and less by the noise.
    split
        How freely the flow that fits the data may leave the smooth one; None for 0.2, and more by
        the noise; 0 for an absolute data term.
    warps
        Linearisations per pyramid level.
    iterations
        Iterations per linearisation.
    levels
        Pyramid levels.
    median_radius
        Radius of the median filter of the flow, 0 for none, 1 or 2.
    presmooth_px
        Standard deviation of the Gaussian that smooths the images, pixels; None for 0.5, and more
        by the noise.
    """

    weight: float | None = None
    split: float | None = None
    warps: int = 5
    iterations: int = 20
    levels: int = 5
    median_radius: int = 1
    presmooth_px: float | None = None


@dataclass(frozen=True)
class RofConfig(Config):
    """Settings of ``rof_denoise``.

    Parameters
    ----------
    weight
        Weight of the data, per grey level: large keeps the image, small smooths it.
    tau
        Time step of the dual iteration, at most 1/4.
    iterations
        Iterations.
    """

    weight: float = 0.05
    tau: float = 0.25
    iterations: int = 100
