"""Time of one row: processor and wall, and its budget."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np


class Clock:
    """Milliseconds of each timed piece of work.

    The processor's time counts all threads of the process, so that a library that starts more than
    it was asked to gains nothing, and other programs on the machine cost nothing.
    """

    def __init__(self, budget_s: float) -> None:  # noqa: D107
        self.budget_s = budget_s
        self.cpu_ms: list[float] = []
        self.wall_ms: list[float] = []

    @contextmanager
    def __call__(self) -> Iterator[None]:
        """Time what is inside the ``with`` block."""
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.cpu_ms.append(1e3 * (time.process_time() - cpu))
            self.wall_ms.append(1e3 * (time.perf_counter() - wall))

    @property
    def spent(self) -> bool:
        """True where the row has used up its budget."""
        return sum(self.wall_ms) > 1e3 * self.budget_s

    def figures(self) -> dict[str, float]:
        """Medians and 90th percentiles, milliseconds."""
        if not self.cpu_ms:
            return {}
        return {
            "cpu_ms": float(np.median(self.cpu_ms)),
            "cpu_ms_p90": float(np.percentile(self.cpu_ms, 90)),
            "wall_ms": float(np.median(self.wall_ms)),
        }
