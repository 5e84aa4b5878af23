"""Frames from anywhere as a recording: an iterable of frames with a calibration."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sphereflow._native import Calibration
from sphereflow.interfaces import FrameLike


class FrameSource:
    """What the pipeline asks of a recording, over frames that come once, however many."""

    kind = "frames"
    truth = None
    calibration_source = "given with the frames"
    depth_corrected = False

    def __init__(self, frames: Iterable[FrameLike], calibration: Calibration) -> None:  # noqa: D107
        self._frames, self.calibration = iter(frames), calibration
        self._stamps: list[int] = []
        self.warnings: list[str] = []

    @property
    def camera(self) -> Any:
        """The depth camera."""
        return self.calibration.depth

    @property
    def depth_scale(self) -> None:
        """Depth comes in metres."""
        return None

    @property
    def colour_registered(self) -> bool:
        """Whether a colour pixel sees what the same depth pixel does."""
        return self.calibration.is_registered

    @property
    def readout_s(self) -> float | None:
        """Read-out time of the calibration."""
        return self.calibration.readout_s

    @property
    def stamp_ns(self) -> NDArray[np.int64]:
        """Stamps of the frames so far."""
        return np.array(self._stamps, dtype=np.int64)

    def __len__(self) -> int:
        """Frames so far."""
        return len(self._stamps)

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[FrameLike]:
        """The frames, once; ``stop`` of them at most."""
        while stop is None or len(self._stamps) < stop:
            frame = next(self._frames, None)
            if frame is None:
                return
            self._stamps.append(int(frame.stamp_ns))
            yield frame
