"""Errors of dense depth by the deviation that was claimed for them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_Image = NDArray[np.float32]

_LIMITS_PERCENT = (0.0, 2.0, 5.0, 10.0, 20.0, 50.0, np.inf)


class ErrorByStd:
    """Collects relative errors in classes of relative standard deviation."""

    def __init__(self) -> None:  # noqa: D107
        self._errors: list[list[_Image]] = [[] for _ in _LIMITS_PERCENT[1:]]
        self._ratios: list[list[_Image]] = [[] for _ in _LIMITS_PERCENT[1:]]
        self._pixels = 0

    def add(self, depth_m: _Image, truth_m: _Image, deviation: _Image) -> None:
        """Add an image: estimate, truth (NaN unknown) and claimed relative deviation."""
        both = np.isfinite(depth_m) & np.isfinite(truth_m) & np.isfinite(deviation)
        # Every ninth pixel says the same.
        both[1::3] = False
        both[2::3] = False
        both[:, 1::3] = False
        both[:, 2::3] = False
        error = np.abs(depth_m[both] / truth_m[both] - 1)
        claimed = deviation[both]
        self._pixels += int(both.sum())
        for index in range(len(self._errors)):
            low, high = _LIMITS_PERCENT[index : index + 2]
            inside = (claimed >= low / 100) & (claimed < high / 100)
            self._errors[index].append(error[inside])
            self._ratios[index].append(error[inside] / claimed[inside])

    def rows(self) -> list[dict[str, Any]]:
        """One row a class: share of the pixels with a truth, median error, error over deviation."""
        rows = []
        for index in range(len(self._errors)):
            errors = np.concatenate([*self._errors[index], np.empty(0, np.float32)])
            if errors.size == 0:
                continue
            ratios = np.concatenate(self._ratios[index])
            low, high = _LIMITS_PERCENT[index : index + 2]
            rows.append(
                {
                    "std_percent": [low, None if high == np.inf else high],
                    "share": errors.size / self._pixels,
                    "median_percent": 100 * float(np.median(errors)),
                    "normalised": float(np.median(ratios) / 0.6745),
                }
            )
        return rows
