"""The map of a run: built while it goes, built again where its poses were corrected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sphereflow
from sphereflow import slam
from sphereflow.interfaces import FrameLike, RecordingLike, direction_of, distances_of
from sphereflow.journal import Array, Journal

MAP_EVERY = 3
"""Frames put into the map: neighbours see the same surface, a third of them suffices."""


class RunMap:
    """Every few frames of a recording as a cloud in the world of its first camera."""

    def __init__(self, recording: RecordingLike, voxel_m: float) -> None:  # noqa: D107
        self.voxel_m = voxel_m
        self.cloud = slam.VoxelCloud(voxel_m)
        self.rebuilt = False
        self._recording = recording
        self._along = direction_of(recording.camera)

    def add(self, index: int, frame: FrameLike, pose: Array) -> None:
        """Add a frame that has distances, if its number is one of those that the map takes."""
        metres = distances_of(frame)
        if metres is None or index % MAP_EVERY:
            return
        colour = frame.colour if self._recording.colour_registered else None
        self.cloud.add(metres, colour, self._recording.camera, pose, along=self._along)

    def is_stale_after(self, largest_change_m: float) -> bool:
        """Whether poses moved so far that surfaces are in other voxels: by half of one."""
        return largest_change_m > 0.5 * self.voxel_m

    def rebuild(
        self, journal: Journal, *, progress: Callable[[int, int], None] | None = None
    ) -> None:
        """Read the frames again and add them with the poses that the journal has now."""
        self.cloud, self.rebuilt = slam.VoxelCloud(self.voxel_m), True
        count = len(journal.entries)
        # In their order: a simulator draws a single frame only after all before it.
        frames = self._recording.frames(0, count)
        for index in range(count):
            try:
                frame: Any = next(frames)
            except StopIteration:
                return
            except sphereflow.SphereflowError:
                continue  # it could not be read the first time either
            pose = journal.pose(index)
            if pose is not None:
                self.add(index, frame, pose)
            if progress is not None:
                progress(index + 1, count)
