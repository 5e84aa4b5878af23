"""``sphereflow run``: track a recording and write the result into a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sphereflow.cli.console import stage_bars, user_errors
from sphereflow.cli.options import JsonFlag, World
from sphereflow.cli.outcome import finish
from sphereflow.config import EngineConfig
from sphereflow.pipeline import run as run_pipeline

EXAMPLES = """[bold]Examples[/bold]

  sphereflow run rgbd_dataset_freiburg1_xyz --out result

  sphereflow run kitchen --out result --rrd result/run.rrd --max-frames 300

  sphereflow run kitchen --out result --readout 0.03

  sphereflow calib depth my_recording --out camera.toml

  sphereflow run my_recording --out result --calibration camera.toml

[bold]Rolling shutter[/bold]  Most depth cameras expose one row after the other, a Kinect v1 within
about 30 ms: a camera that turns at 1 rad/s bends its image by 0.03 rad. Where the time is known,
give it with --readout; where not, [bold]sphereflow calib rolling-shutter[/bold] finds it.

[bold]Distorted depth[/bold]  A lens that is not quite what the calibration says, depth that is bent
towards the corners: every depth camera has both, and the path comes out bent and of a wrong size.
[bold]sphereflow calib depth[/bold] finds both, and the read-out time, from ten seconds of motion.
One file serves all recordings of the same camera.

[bold]Pose graph[/bold]  After the last frame, keyframes that see the same surface are compared, and
all poses fitted to the motions found. odometry.tum keeps the poses as they were measured.

[bold]Exit status[/bold]  0: tracked, coverage reached.  1: not.  2: an option has no meaning."""

STAGES = {"track": "tracking", "compare": "comparing keyframes"}


def register(app: typer.Typer) -> None:
    """Add the verb to the command."""
    app.command(epilog=EXAMPLES)(run)


@user_errors("sphereflow info DATA says what was found in the folder")
def run(
    data: Annotated[Path, typer.Argument(help="Folder of a data set; its kind is guessed.")],
    out: Annotated[Path, typer.Option(help="Folder for the result; must be new or empty.")],
    method: Annotated[str, typer.Option(help="How to track: depth (depth images only).")] = "depth",
    calibration: Annotated[
        Path | None,
        typer.Option(
            help="Calibration file (TOML) instead of the recording's own; calib depth makes one."
        ),
    ] = None,
    depth_scale: Annotated[
        float | None, typer.Option(help="Depth counts per metre instead of the recording's own.")
    ] = None,
    pose_graph: Annotated[
        bool, typer.Option(help="Compare keyframes at the end and correct all poses.")
    ] = True,
    readout: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="Rolling shutter: seconds from the first row to the last (0.03 for a Kinect v1, "
            "0 for none), instead of the calibration's; calib rolling-shutter finds it.",
        ),
    ] = None,
    world: Annotated[
        World, typer.Option(help="y along gravity where it is known, or the first camera's axes.")
    ] = World.AUTO,
    config: Annotated[
        Path | None,
        typer.Option(
            help="Settings (TOML); config dump prints them all, config check reads a file."
        ),
    ] = None,
    rrd: Annotated[
        Path | None, typer.Option(help="Also record for the rerun viewer in this file.")
    ] = None,
    max_frames: Annotated[
        int | None, typer.Option(metavar="N", help="Stop after N frames.")
    ] = None,
    pictures: Annotated[bool, typer.Option(help="Draw pictures of the result.")] = True,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an earlier result in the folder.")
    ] = False,
    min_coverage: Annotated[
        float, typer.Option(help="Share of frames that must have a pose for exit status 0.")
    ] = 0.9,
    voxel: Annotated[
        float | None, typer.Option(help="Cell size of the map in metres (0.02).")
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Track a recording: trajectory, map, report and pictures into one folder.

    Writes trajectory.tum (final) and odometry.tum (as published while running; both: seconds,
    metres, quaternion xyzw, world from camera), segments/, keyframes.tum, graph.g2o,
    calibration.toml, map.ply, report.json and pictures/. The folder appears when all is written.
    """
    with stage_bars(STAGES) as progress:
        result = run_pipeline(
            data,
            out,
            method=method,
            calibration=calibration,
            depth_scale=depth_scale,
            pose_graph=pose_graph,
            config=None if config is None else EngineConfig.from_toml(config),
            readout_s=readout,
            world="auto" if world is World.AUTO else "first-camera",
            rrd=rrd,
            max_frames=max_frames,
            pictures=pictures,
            overwrite=overwrite,
            min_coverage=min_coverage,
            voxel_m=voxel,
            progress=progress,
        )
    finish(result, min_coverage, as_json=as_json)
