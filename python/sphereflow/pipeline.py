"""The main job: a recording in, a folder with trajectory, map, report and pictures out."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sphereflow
from sphereflow import eval as evaluation
from sphereflow import io, odometry, slam
from sphereflow.eval.relations import Relation
from sphereflow.interfaces import RecordingLike, ViewerLike, direction_of, distances_of
from sphereflow.journal import Journal
from sphereflow.report import build_report, write_report
from sphereflow.result_folder import REPORT, ResultFolder

METHODS = ("depth",)
TRUTH_DIFFERENCE_S = 0.02
"""Frames further than this from a true pose are not compared: half a frame at 25 Hz."""

MAP_EVERY = 3
"""Frames put into the map: neighbours see the same surface, a third of them suffices."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class RunResult:
    """What a run made; ``trajectory`` and ``ape`` are None where there is none."""

    folder: Path
    trajectory: sphereflow.Trajectory | None
    coverage: float
    covered: bool
    ape: evaluation.PoseError | None
    report: dict[str, Any]


class Stopwatch:
    """Seconds spent in each stage, by name."""

    def __init__(self) -> None:  # noqa: D107
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Count the time inside the ``with`` block towards ``stage``."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - start


def run(
    data: str | Path | RecordingLike,
    out: str | Path,
    *,
    method: str = "depth",
    calibration: str | Path | None = None,
    depth_scale: float | None = None,
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
        Folder for ``trajectory.tum`` (every frame with a pose), ``odometry.tum`` (the same before
        any later correction), ``map.ply``, ``report.json`` and ``pictures/``. Written beside and
        renamed at the end: it is there whole or not at all.
    method
        ``depth``: motion from the depth images alone.
    calibration, depth_scale
        Calibration file and counts per metre, where the recording's own are missing or wrong.
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
        Called with the frames done and the frames in all.

    Returns
    -------
    RunResult
        Also where coverage is low: look at ``covered``.

    Raises
    ------
    sphereflow.SphereflowError
        Where the recording cannot be read at all or an option has no meaning.
    """
    _check(method, max_frames, min_coverage, voxel_m)
    recording = _opened(data, calibration, depth_scale)
    protect = Path(data) if isinstance(data, (str, Path)) else None
    watch, journal = Stopwatch(), Journal()
    with ExitStack() as stack:
        folder = stack.enter_context(ResultFolder(out, overwrite=overwrite, protect=protect))
        viewer = None if rrd is None else _viewer(recording, folder.inside(rrd))
        if viewer is not None:
            stack.callback(viewer.discard)
        cloud = slam.VoxelCloud(voxel_m)
        sample = _track(recording, max_frames, cloud, journal, watch, viewer, progress)
        warnings = [str(text) for text in recording.warnings]
        with watch("evaluate"):
            errors = _errors(journal, recording.truth)
        with watch("write"):
            trajectory = _write(folder.path, journal, cloud)
            if viewer is not None:
                viewer.close(journal, recording.truth)
            if pictures:
                drawn = _pictures(folder.path / "pictures", journal, recording, cloud, sample)
                warnings += [] if drawn is None else [drawn]
        report = build_report(
            source=str(data) if protect is not None else recording.kind,
            recording=recording,
            method=method,
            journal=journal,
            seconds=watch.seconds,
            errors=errors,
            voxels=len(cloud),
            warnings=warnings,
            min_coverage=min_coverage,
        )
        write_report(folder.path / REPORT, report)
    ape = errors.get("ape")
    return RunResult(
        folder=folder.out,
        trajectory=trajectory,
        coverage=journal.coverage,
        covered=report["covered"],
        ape=ape if isinstance(ape, evaluation.PoseError) else None,
        report=report,
    )


def _track(
    recording: RecordingLike,
    max_frames: int | None,
    cloud: slam.VoxelCloud,
    journal: Journal,
    watch: Stopwatch,
    viewer: ViewerLike | None,
    progress: Progress | None,
) -> Any:
    """Each frame through odometry and map; returns distances from the middle, for a picture."""
    along = direction_of(recording.camera)
    estimator = odometry.DepthOdometry(recording.camera, along=along)
    total = len(recording) if max_frames is None else min(max_frames, len(recording))
    sample = None
    for index, frame in _decoded(recording, total, journal, watch):
        metres = distances_of(frame)
        with watch("odometry"):
            motion = estimator.push(metres, frame.stamp_ns)
        journal.motion(frame.stamp_ns, motion, with_depth=metres is not None)
        if metres is not None and motion.has_pose and index % MAP_EVERY == 0:
            colour = frame.colour if recording.colour_registered else None
            pose = motion.world_from_camera
            with watch("map"):
                cloud.add(metres, colour, recording.camera, pose, along=along)
        if metres is not None and (sample is None or index <= total // 2):
            sample = metres
        if viewer is not None:
            with watch("view"):
                viewer.frame(index, frame, motion)
                viewer.cloud(index, frame.stamp_ns, cloud)
        if progress is not None:
            progress(index + 1, total)
    return sample


def _decoded(
    recording: RecordingLike, total: int, journal: Journal, watch: Stopwatch
) -> Iterator[tuple[int, Any]]:
    """Frames that can be read, with their number; the others are noted in the journal."""
    frames = recording.frames(0, total)
    for index in range(total):
        try:
            with watch("decode"):
                frame = next(frames)
        except StopIteration:
            # Fewer frames than promised: the rest counts as not covered, it does not vanish.
            for stamp in recording.stamp_ns[index:total]:
                journal.failure(int(stamp), "unreadable", "the recording ended before this frame")
            return
        except sphereflow.SphereflowError as error:
            journal.failure(int(recording.stamp_ns[index]), "unreadable", str(error))
            continue
        yield index, frame


def _errors(journal: Journal, truth: Any) -> dict[str, evaluation.PoseError | str]:
    """Errors against the truth, or why there are none; nothing where there is no truth."""
    if truth is None:
        return {}
    trajectory = journal.trajectory()
    if trajectory is None:
        return {"ape": "no frame has a pose"}
    errors: dict[str, evaluation.PoseError | str] = {}
    limit = TRUTH_DIFFERENCE_S
    try:
        errors["ape"] = evaluation.ape(truth, trajectory, max_difference_s=limit)
    except sphereflow.SphereflowError as error:
        errors["ape"] = str(error)
    relations: dict[str, Relation] = {
        "rpe_1s_translation": "translation",
        "rpe_1s_rotation": "rotation_deg",
    }
    for name, relation in relations.items():
        try:
            errors[name] = evaluation.rpe(
                truth,
                trajectory,
                delta=1.0,
                delta_unit="s",
                all_pairs=True,
                relation=relation,
                max_difference_s=limit,
            )
        except sphereflow.SphereflowError as error:
            errors[name] = str(error)
    return errors


def _write(folder: Path, journal: Journal, cloud: slam.VoxelCloud) -> sphereflow.Trajectory | None:
    """Trajectories and map; no file is made of nothing."""
    trajectory = journal.trajectory()
    if trajectory is not None:
        trajectory.write(folder / "odometry.tum", format="tum")
        # Frame-to-frame odometry is corrected by nothing later: both are the same poses.
        trajectory.write(folder / "trajectory.tum", format="tum")
    if len(cloud) > 0:
        cloud.write_ply(folder / "map.ply")
    return trajectory


def _pictures(
    folder: Path, journal: Journal, recording: RecordingLike, cloud: slam.VoxelCloud, sample: Any
) -> str | None:
    """Draw the run; a text says why not, where matplotlib is not installed."""
    from sphereflow.plots import draw_run

    try:
        draw_run(
            folder,
            journal=journal,
            truth=recording.truth,
            cloud=cloud.points(),
            depth_m=sample,
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


def _check(method: str, max_frames: int | None, min_coverage: float, voxel_m: float) -> None:
    if method not in METHODS:
        raise sphereflow.ValueRangeError(
            f"method must be one of {', '.join(METHODS)}, found {method!r}"
        )
    if max_frames is not None and max_frames < 1:
        raise sphereflow.ValueRangeError(f"max_frames must be at least 1, found {max_frames}")
    if not 0.0 <= min_coverage <= 1.0:
        raise sphereflow.ValueRangeError(f"min_coverage must be from 0 to 1, found {min_coverage}")
    if not voxel_m > 0.0:
        raise sphereflow.ValueRangeError(f"voxel_m must be above 0 metres, found {voxel_m}")
