"""``sphereflow run``: track a recording and write the result into a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sphereflow.cli.console import progress_bar, user_errors
from sphereflow.cli.outcome import finish
from sphereflow.pipeline import run as run_pipeline

EXAMPLES = """[bold]Examples[/bold]

  sphereflow run rgbd_dataset_freiburg1_xyz --out result

  sphereflow run kitchen --out result --rrd result/run.rrd --max-frames 300

  sphereflow run my_recording --out result --calibration camera.toml --depth-scale 1000

[bold]Exit status[/bold]  0: tracked, coverage reached.  1: not.  2: an option has no meaning."""


def register(app: typer.Typer) -> None:
    """Add the verb to the command."""
    app.command(epilog=EXAMPLES)(run)


@user_errors("sphereflow info DATA says what was found in the folder")
def run(
    data: Annotated[Path, typer.Argument(help="Folder of a data set; its kind is guessed.")],
    out: Annotated[Path, typer.Option(help="Folder for the result; must be new or empty.")],
    method: Annotated[str, typer.Option(help="How to track: depth (depth images only).")] = "depth",
    calibration: Annotated[
        Path | None, typer.Option(help="Calibration file (TOML) instead of the recording's own.")
    ] = None,
    depth_scale: Annotated[
        float | None, typer.Option(help="Depth counts per metre instead of the recording's own.")
    ] = None,
    rrd: Annotated[
        Path | None, typer.Option(help="Also record for the rerun viewer in this file.")
    ] = None,
    max_frames: Annotated[int | None, typer.Option(help="Stop after so many frames.")] = None,
    pictures: Annotated[bool, typer.Option(help="Draw pictures of the result.")] = True,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an earlier result in the folder.")
    ] = False,
    min_coverage: Annotated[
        float, typer.Option(help="Share of frames that must have a pose for exit status 0.")
    ] = 0.9,
    voxel: Annotated[float, typer.Option(help="Cell size of the map in metres.")] = 0.02,
) -> None:
    """Track a recording: trajectory, map, report and pictures into one folder.

    Writes trajectory.tum and odometry.tum (time in seconds, position in metres, quaternion xyzw,
    world from camera), map.ply, report.json and pictures/. The folder appears when all is written.
    """
    with progress_bar("tracking") as progress:
        result = run_pipeline(
            data,
            out,
            method=method,
            calibration=calibration,
            depth_scale=depth_scale,
            rrd=rrd,
            max_frames=max_frames,
            pictures=pictures,
            overwrite=overwrite,
            min_coverage=min_coverage,
            voxel_m=voxel,
            progress=progress,
        )
    finish(result, min_coverage)
