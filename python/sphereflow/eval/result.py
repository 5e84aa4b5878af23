"""What an evaluation returns: the errors, their statistics, and how they came about."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sphereflow.eval.alignment import Align, Alignment

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Statistics:
    """Of the errors: all in their unit, but ``sse``, which is in its square."""

    rmse: float
    mean: float
    median: float
    std: float
    min: float
    max: float
    sse: float

    @classmethod
    def of(cls, error: Array) -> Statistics:
        """Statistics of at least one error; ``std`` divides by N, as evo's does."""
        squares = np.square(error)
        return cls(
            rmse=float(np.sqrt(squares.mean())),
            mean=float(error.mean()),
            median=float(np.median(error)),
            std=float(error.std()),
            min=float(error.min()),
            max=float(error.max()),
            sse=float(squares.sum()),
        )


@dataclass(frozen=True, slots=True)
class PoseError:
    """Errors of an estimate against a reference.

    Attributes
    ----------
    metric
        ``ape`` or ``rpe``.
    relation, unit
        What is compared, and the unit of ``error`` ("m", "deg", "rad", "%" or "" for none).
    error
        One number per pose (ape) or per pair of poses (rpe), (K,).
    stamp_ns
        Time of each error on the estimate's clock, (K,); of the later pose for rpe.
    statistics
        Of ``error``.
    align, alignment
        The kind asked for, and what was found: reference_from_estimate.
    matches
        Rows of reference and estimate taken at the same time, (M, 2).
    spans
        For rpe the earlier and later match of each error, (K, 2); None for ape.
    reference_position_m, estimate_position_m
        Matched positions, the estimate's aligned, (M, 3).
    description
        One line that says what was computed.
    """

    metric: Literal["ape", "rpe"]
    relation: str
    unit: str
    error: Array
    stamp_ns: Integers
    statistics: Statistics
    align: Align
    alignment: Alignment
    matches: Integers
    spans: Integers | None
    reference_position_m: Array
    estimate_position_m: Array
    description: str

    @property
    def pairs(self) -> int:
        """How many poses (ape) or pairs of poses (rpe) were compared."""
        return len(self.error)

    @property
    def scale(self) -> float:
        """Scale of the alignment: 1 unless it was estimated."""
        return self.alignment.scale

    def summary(self) -> dict[str, Any]:
        """Everything but the long arrays, as plain values for JSON."""
        return {
            "metric": self.metric,
            "relation": self.relation,
            "unit": self.unit,
            "description": self.description,
            "pairs": self.pairs,
            "matched_poses": len(self.matches),
            "statistics": asdict(self.statistics),
            "align": self.align,
            "scale": self.scale,
            "reference_from_estimate": self.alignment.matrix.tolist(),
        }
