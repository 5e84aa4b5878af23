"""The main job: a recording in, a folder with trajectory, map, report and pictures out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, cast

import sphereflow
from sphereflow import eval as evaluation
from sphereflow import io
from sphereflow._native import Calibration
from sphereflow.accuracy import TRUTH_DIFFERENCE_S, errors_of
from sphereflow.config import EngineConfig
from sphereflow.engine import Engine, Readings
from sphereflow.interfaces import FrameLike, RecordingLike, ViewerLike, distances_of
from sphereflow.journal import Journal
from sphereflow.report import build_report, write_report
from sphereflow.result_folder import REPORT, ResultFolder
from sphereflow.run_warnings import warnings_of
from sphereflow.settings import Settings
from sphereflow.sources import FrameSource
from sphereflow.stopwatch import Stopwatch

Progress = Callable[[str, int, int], None]
"""Called with what is being done (``track``, ``compare`` keyframes), the steps done and the steps
in all: frames where it tracks; 0 where their number is not known."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """What a run made; a trajectory or error is None where there is none.

    ``trajectory`` and ``ape`` are of the final poses, ``odometry`` and ``odometry_ape`` of the same
    frames as they were published while running.
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
    data: str | Path | RecordingLike | Iterable[FrameLike],
    out: str | Path,
    *,
    method: str = "depth",
    calibration: str | Path | Calibration | None = None,
    depth_scale: float | None = None,
    config: EngineConfig | None = None,
    pose_graph: bool = True,
    readout_s: float | None = None,
    world: Literal["auto", "first-camera"] | None = None,
    rrd: str | Path | None = None,
    max_frames: int | None = None,
    pictures: bool = True,
    overwrite: bool = False,
    min_coverage: float = 0.9,
    voxel_m: float | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """Track a recording and write everything about it into one folder.

    Parameters
    ----------
    data
        A data set's folder (the kind is guessed), an open recording, or any iterable of frames
        (``sphereflow.RgbdFrame``), which needs a ``calibration``.
    out
        Folder for the result; `CONVENTIONS.md` lists its files. Written beside and renamed at the
        end: it is there whole or not at all.
    method
        ``depth``: motion from the depth images alone.
    calibration, depth_scale
        Calibration (a file, for a folder) and counts per metre, where the recording's own are
        missing or wrong.
    config
        Settings of the engine; the arguments beside it change theirs.
    pose_graph
        After the last frame compare keyframes that see the same surface, and correct all poses.
    readout_s
        Rolling shutter: seconds between the exposures of the first and the last row. None takes
        what the calibration says, and 0 where it says nothing.
    world
        ``auto``: y along gravity where the inertial sensor shows it; ``first-camera``.
    rrd
        Also record the run for the rerun viewer in this file (extra ``viz``).
    max_frames
        Stop after this number of frames.
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
    given = isinstance(calibration, (str, Path))
    settings = Settings(
        method=method,
        calibration=str(calibration) if given else None,
        depth_scale=depth_scale,
        pose_graph=pose_graph,
        readout_s=readout_s,
        max_frames=max_frames,
        min_coverage=min_coverage,
        voxel_m=voxel_m,
        world=world,
        config=config,
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
        job.finish()
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
        self.engine = Engine(settings.device_of(recording), settings.engine_config(recording))
        self.sample: Any = None  # distances from the middle of the run, for a picture
        self.unseen: list[str] = []  # why the viewer's file was given up

    def track(self) -> None:
        """Each frame through the engine."""
        total, readings = self._total(), Readings(self.recording)
        for index, frame in self._decoded(total):
            metres = distances_of(frame)
            with self.watch("engine"):
                for batch in readings.until(frame.stamp_ns):
                    self.engine.push(batch)
                update = self.engine.push_frame(frame)
            self.journal.motion(frame.stamp_ns, update, with_depth=metres is not None)
            if metres is not None and (self.sample is None or index <= (total or 0) // 2):
                self.sample = metres
            self._look(partial(_look_on, index, frame, update, self.engine.growing_cloud))
            self.progress("track", index + 1, total or 0)

    def finish(self) -> None:
        """Keyframes compared with each other, all poses fitted, the cloud at them."""
        with self.watch("compare"):
            self.engine.finish(partial(self.progress, "compare"))
        if self.engine.report["graph"] is not None:
            self.journal.final = self.engine.trajectory("final")
        self._look(lambda viewer: viewer.points(*self.engine.map.cloud.points()))

    def write(self, folder: ResultFolder, source: str, *, pictures: bool) -> RunResult:
        """All files of the result."""
        recording, journal, watch = self.recording, self.journal, self.watch
        engine = self.engine.report
        warnings = warnings_of(recording, journal, engine)
        with watch("evaluate"):
            errors = errors_of(journal, recording.truth)
        with watch("write"):
            points = self._write_files(folder.path, engine)
            self._look(lambda viewer: viewer.close(journal, recording.truth))
            warnings += self.unseen
            if pictures:
                drawn = self._pictures(folder.path / "pictures")
                warnings += [] if drawn is None else [drawn]
        report = build_report(
            source=source,
            recording=recording,
            settings=self.settings,
            journal=journal,
            engine=engine,
            seconds=watch.seconds,
            errors=errors,
            points=points,
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

    def _look(self, action: Callable[[ViewerLike], None]) -> None:
        """Let the viewer look on; a file that cannot be written costs only itself."""
        if self.viewer is None:
            return
        try:
            with self.watch("view"):
                action(self.viewer)
        except OSError as error:
            self.unseen.append(f"no file for the viewer: {error}")
            self.viewer = None

    def _total(self) -> int | None:
        """Frames to come, None where their number is open."""
        most = self.settings.max_frames
        if isinstance(self.recording, FrameSource):
            return most
        available = len(self.recording)
        return available if most is None else min(most, available)

    def _decoded(self, total: int | None) -> Iterator[tuple[int, Any]]:
        """Frames that can be read, with their number; the others are noted in the journal."""
        stamps, frames = self.recording.stamp_ns, self.recording.frames(0, total)
        index = 0
        while total is None or index < total:
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
            else:
                yield index, frame
            index += 1

    def _write_files(self, folder: Path, engine: dict[str, Any]) -> int:
        """Trajectories, map, graph and calibration; no file is made of nothing. Points written."""
        published, final = self.journal.odometry(), self.journal.trajectory()
        if published is not None and final is not None:
            published.write(folder / "odometry.tum", format="tum")
            final.write(folder / "trajectory.tum", format="tum")
            (folder / "segments").mkdir()
            for segment in engine["segments"]:
                poses = self.engine.segment(segment["index"])
                name = f"{segment['index']:03d}.tum"
                poses.write(folder / "segments" / name, format="tum")
        mapped = self.engine.map
        if len(mapped.keyframes):
            mapped.keyframes.write(folder / "keyframes.tum", format="tum")
            self.engine.write_graph(folder / "graph.g2o")
        if len(mapped.cloud):
            mapped.cloud.write_ply(folder / "map.ply")
        known = getattr(self.recording, "calibration", None)
        calibration = self.engine.calibration if known is None else known
        readout_s = self.settings.readout_of(self.recording)[0]
        calibration.with_readout_s(readout_s).write(folder / "calibration.toml")
        return len(mapped.cloud)

    def _pictures(self, folder: Path) -> str | None:
        """Draw the run; a text says why not, where matplotlib is not installed."""
        from sphereflow.plots import draw_run

        try:
            draw_run(
                folder,
                journal=self.journal,
                truth=self.recording.truth,
                cloud=self.engine.map.cloud.points(),
                depth_m=self.sample,
                max_difference_s=TRUTH_DIFFERENCE_S,
            )
        except sphereflow.MissingExtraError as error:
            return f"no pictures: {error}"
        return None


def _look_on(
    index: int, frame: FrameLike, update: Any, cloud: Callable[[], Any], viewer: ViewerLike
) -> None:
    viewer.frame(index, frame, update)
    viewer.cloud(index, frame.stamp_ns, cloud)


def _viewer(recording: RecordingLike, path: Path) -> ViewerLike:
    from sphereflow.viz import RunRecorder

    return RunRecorder(recording.camera, path)


def _opened(
    data: str | Path | RecordingLike | Iterable[FrameLike],
    calibration: str | Path | Calibration | None,
    depth_scale: float | None,
) -> RecordingLike:
    if isinstance(data, (str, Path)):
        if isinstance(calibration, Calibration):
            raise sphereflow.DtypeError(
                "calibration: expected a file for a folder of data, found a Calibration"
            )
        recording: RecordingLike = io.open_recording(
            data, calibration=calibration, depth_scale=depth_scale
        )
    elif hasattr(data, "frames"):
        recording = cast(RecordingLike, data)
    elif isinstance(calibration, Calibration):
        recording = FrameSource(data, calibration)
    else:
        raise sphereflow.DtypeError(
            "calibration: expected a sphereflow.Calibration with an iterable of frames, found "
            f"{type(calibration).__name__}"
        )
    if recording.camera is None:
        raise sphereflow.DataError(
            f"no calibration was found ({recording.calibration_source}): give a calibration file"
        )
    return recording
