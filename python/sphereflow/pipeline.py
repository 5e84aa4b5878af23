"""The main job: a recording in, a folder with trajectory, map, report and pictures out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import sphereflow
from sphereflow import eval as evaluation
from sphereflow import io, odometry
from sphereflow.accuracy import TRUTH_DIFFERENCE_S, errors_of
from sphereflow.correction import Correction, correct
from sphereflow.interfaces import RecordingLike, ViewerLike, direction_of, distances_of
from sphereflow.journal import Journal
from sphereflow.mapping import RunMap
from sphereflow.report import build_report, write_report
from sphereflow.result_folder import REPORT, ResultFolder
from sphereflow.settings import Settings, depth_corrected_of
from sphereflow.stopwatch import Stopwatch

Progress = Callable[[str, int, int], None]
"""Called with what is being done (``track``, ``compare`` keyframes, ``map``), the steps done and
the steps in all: frames where it tracks or maps."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """What a run made; a trajectory or error is None where there is none.

    ``trajectory`` and ``ape`` are of the corrected poses, ``odometry`` and ``odometry_ape`` of the
    same frames as they were measured while running.
    """

    folder: Path
    trajectory: sphereflow.Trajectory | None
    odometry: sphereflow.Trajectory | None
    coverage: float
    covered: bool
    ape: evaluation.PoseError | None
    odometry_ape: evaluation.PoseError | None
    report: dict[str, Any]


def run(
    data: str | Path | RecordingLike,
    out: str | Path,
    *,
    method: str = "depth",
    calibration: str | Path | None = None,
    depth_scale: float | None = None,
    pose_graph: bool = True,
    readout_s: float | None = None,
    rrd: str | Path | None = None,
    max_frames: int | None = None,
    pictures: bool = True,
    overwrite: bool = False,
    min_coverage: float = 0.9,
    voxel_m: float = 0.02,
    progress: Progress | None = None,
) -> RunResult:
    """Track a recording and write everything about it into one folder.

    Parameters
    ----------
    data
        A data set's folder (the kind is guessed) or an open recording.
    out
        Folder for ``trajectory.tum`` (every frame with a pose, corrected), ``odometry.tum`` (the
        same frames as they were measured), ``map.ply``, ``report.json`` and ``pictures/``. Written
        beside and renamed at the end: it is there whole or not at all.
    method
        ``depth``: motion from the depth images alone.
    calibration, depth_scale
        Calibration file and counts per metre, where the recording's own are missing or wrong.
    pose_graph
        After the last frame compare keyframes that see the same surface, and correct all poses.
    readout_s
        Rolling shutter: seconds between the exposures of the first and the last row. None takes
        what the calibration says, and 0 where it says nothing.
    rrd
        Also record the run for the rerun viewer in this file (extra ``viz``).
    max_frames
        Stop after so many frames.
    pictures
        Draw the pictures (extra ``plot``; without it they are left out and the report says so).
    overwrite
        Replace an earlier result in ``out``.
    min_coverage
        Share of the frames, from 0 to 1, that must have a pose for ``covered`` to be true.
    voxel_m
        Edge of a cell of the map, metres.
    progress
        Called with the stage, the steps done and the steps in all.

    Returns
    -------
    RunResult
        Also where coverage is low: look at ``covered``.

    Raises
    ------
    sphereflow.SphereflowError
        Where the recording cannot be read at all or an option has no meaning.
    """
    settings = Settings(
        method=method,
        calibration=None if calibration is None else str(calibration),
        depth_scale=depth_scale,
        pose_graph=pose_graph,
        readout_s=readout_s,
        max_frames=max_frames,
        min_coverage=min_coverage,
        voxel_m=voxel_m,
    )
    settings.check()
    recording = _opened(data, calibration, depth_scale)
    protect = Path(data) if isinstance(data, (str, Path)) else None
    source = recording.kind if protect is None else str(data)
    with ExitStack() as stack:
        folder = stack.enter_context(ResultFolder(out, overwrite=overwrite, protect=protect))
        viewer = None if rrd is None else _viewer(recording, folder.inside(rrd))
        if viewer is not None:
            stack.callback(viewer.discard)
        job = _Job(recording, settings, viewer, progress or (lambda what, done, total: None))
        job.track()
        job.correct()
        return job.write(folder, source, pictures=pictures)


class _Job:
    """One run, in the order of its methods."""

    def __init__(
        self,
        recording: RecordingLike,
        settings: Settings,
        viewer: ViewerLike | None,
        progress: Progress,
    ) -> None:
        self.recording, self.settings = recording, settings
        self.viewer, self.progress = viewer, progress
        self.watch, self.journal = Stopwatch(), Journal()
        self.map = RunMap(recording, settings.voxel_m)
        self.correction = Correction(None)
        self.sample: Any = None  # distances from the middle of the run, for a picture
        self.estimator = odometry.DepthOdometry(
            recording.camera,
            along=direction_of(recording.camera),
            readout_s=settings.readout_of(recording)[0],
            depth_corrected=depth_corrected_of(recording),
        )

    def track(self) -> None:
        """Each frame through odometry and map."""
        available, most = len(self.recording), self.settings.max_frames
        total = available if most is None else min(most, available)
        for index, frame in self._decoded(total):
            metres = distances_of(frame)
            with self.watch("odometry"):
                motion = self.estimator.push(metres, frame.stamp_ns)
            self.journal.motion(frame.stamp_ns, motion, with_depth=metres is not None)
            if motion.has_pose:
                with self.watch("map"):
                    self.map.add(index, frame, motion.world_from_camera)
            if metres is not None and (self.sample is None or index <= total // 2):
                self.sample = metres
            if self.viewer is not None:
                with self.watch("view"):
                    self.viewer.frame(index, frame, motion)
                    self.viewer.cloud(index, frame.stamp_ns, self.map.cloud)
            self.progress("track", index + 1, total)

    def correct(self) -> None:
        """Poses from the pose graph, and the map from them where they moved noticeably."""
        with self.watch("compare"):
            self.correction = correct(
                self.estimator,
                self.journal,
                asked=self.settings.pose_graph,
                progress=partial(self.progress, "compare"),
            )
        if self.map.is_stale_after(self.correction.largest_change_m):
            with self.watch("map"):
                self.map.rebuild(self.journal, progress=partial(self.progress, "map"))
        if self.viewer is not None:
            with self.watch("view"):
                self.viewer.points(*self.map.cloud.points())

    def write(self, folder: ResultFolder, source: str, *, pictures: bool) -> RunResult:
        """All files of the result."""
        recording, journal, watch = self.recording, self.journal, self.watch
        warnings = [str(text) for text in recording.warnings] + self.correction.warnings
        with watch("evaluate"):
            errors = errors_of(journal, recording.truth)
        with watch("write"):
            self._write_files(folder.path)
            if self.viewer is not None:
                self.viewer.close(journal, recording.truth)
            if pictures:
                drawn = self._pictures(folder.path / "pictures")
                warnings += [] if drawn is None else [drawn]
        report = build_report(
            source=source,
            recording=recording,
            settings=self.settings,
            journal=journal,
            correction=self.correction,
            seconds=watch.seconds,
            errors=errors,
            voxels=len(self.map.cloud),
            map_rebuilt=self.map.rebuilt,
            warnings=warnings,
        )
        write_report(folder.path / REPORT, report)
        ape, odometry_ape = errors.get("ape"), errors.get("odometry_ape")
        return RunResult(
            folder=folder.out,
            trajectory=journal.trajectory(),
            odometry=journal.odometry(),
            coverage=journal.coverage,
            covered=report["covered"],
            ape=ape if isinstance(ape, evaluation.PoseError) else None,
            odometry_ape=odometry_ape if isinstance(odometry_ape, evaluation.PoseError) else None,
            report=report,
        )

    def _decoded(self, total: int) -> Iterator[tuple[int, Any]]:
        """Frames that can be read, with their number; the others are noted in the journal."""
        stamps, frames = self.recording.stamp_ns, self.recording.frames(0, total)
        for index in range(total):
            try:
                with self.watch("decode"):
                    frame = next(frames)
            except StopIteration:
                # Fewer frames than promised: the rest counts as not covered, it does not vanish.
                for stamp in stamps[index:total]:
                    reason = "the recording ended before this frame"
                    self.journal.failure(int(stamp), "unreadable", reason)
                return
            except sphereflow.SphereflowError as error:
                self.journal.failure(int(stamps[index]), "unreadable", str(error))
                continue
            yield index, frame

    def _write_files(self, folder: Path) -> None:
        """Trajectories and map; no file is made of nothing."""
        measured, corrected = self.journal.odometry(), self.journal.trajectory()
        if measured is not None and corrected is not None:
            measured.write(folder / "odometry.tum", format="tum")
            corrected.write(folder / "trajectory.tum", format="tum")
        if len(self.map.cloud) > 0:
            self.map.cloud.write_ply(folder / "map.ply")

    def _pictures(self, folder: Path) -> str | None:
        """Draw the run; a text says why not, where matplotlib is not installed."""
        from sphereflow.plots import draw_run

        try:
            draw_run(
                folder,
                journal=self.journal,
                truth=self.recording.truth,
                cloud=self.map.cloud.points(),
                depth_m=self.sample,
                max_difference_s=TRUTH_DIFFERENCE_S,
            )
        except sphereflow.MissingExtraError as error:
            return f"no pictures: {error}"
        return None


def _viewer(recording: RecordingLike, path: Path) -> ViewerLike:
    from sphereflow.viz import RunRecorder

    return RunRecorder(recording.camera, path)


def _opened(
    data: str | Path | RecordingLike, calibration: str | Path | None, depth_scale: float | None
) -> RecordingLike:
    recording: RecordingLike = (
        io.open_recording(data, calibration=calibration, depth_scale=depth_scale)
        if isinstance(data, (str, Path))
        else data
    )
    if recording.camera is None:
        raise sphereflow.DataError(
            f"no calibration was found ({recording.calibration_source}): give a calibration file"
        )
    return recording
