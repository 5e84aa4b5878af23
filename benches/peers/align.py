"""What every row can do: align two frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class View:
    """A frame as the rows are given it: metres (NaN unknown), RGB or None."""

    depth_m: NDArray[np.float32]
    colour: NDArray[np.uint8] | None


@dataclass(frozen=True, slots=True)
class Aligned:
    """The motion ``first_from_second`` (4, 4), or None and why."""

    first_from_second: Matrix | None
    reason: str | None = None


class Aligner(Protocol):
    """One method with its settings, for one camera."""

    def prepare(self, view: View) -> Any:
        """What the method builds of one frame alone; done once for each frame."""

    def align(self, first: Any, second: Any, dt_s: float, guess: Matrix) -> Aligned:
        """The motion between two prepared frames; ``guess`` is the identity where there is none."""


def metres_with_zeros(view: View) -> NDArray[np.float32]:
    """Depth as most libraries want it: zero where unknown."""
    return np.nan_to_num(view.depth_m, nan=0.0).astype(np.float32)
