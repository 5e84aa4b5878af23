"""``sphereflow demo``: simulate a walk through a room and track it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sphereflow.cli.console import progress_bar, stage_bars, user_errors
from sphereflow.cli.options import JsonFlag
from sphereflow.cli.outcome import finish
from sphereflow.cli.run import STAGES
from sphereflow.pipeline import run as run_pipeline

EXAMPLES = """[bold]Examples[/bold]

  sphereflow demo --out demo

  sphereflow demo --out demo --no-pose-graph --max-frames 200 --overwrite

  sphereflow demo --out demo --rrd demo/demo.rrd --overwrite"""


def register(app: typer.Typer) -> None:
    """Add the verb to the command."""
    app.command(epilog=EXAMPLES)(demo)


@user_errors("choose another folder with --out, or replace an earlier result with --overwrite")
def demo(
    out: Annotated[Path, typer.Option(help="Folder for the result.")],
    seed: Annotated[int, typer.Option(help="Seed of all noise: same seed, same result.")] = 0,
    pose_graph: Annotated[
        bool, typer.Option(help="Compare keyframes at the end and correct all poses.")
    ] = True,
    rrd: Annotated[
        Path | None, typer.Option(help="Also record for the rerun viewer in this file.")
    ] = None,
    max_frames: Annotated[
        int | None, typer.Option(metavar="N", help="Stop after N frames.")
    ] = None,
    pictures: Annotated[bool, typer.Option(help="Draw pictures of the result.")] = True,
    keep_recording: Annotated[
        bool, typer.Option("--keep-recording", help="Also write the simulated recording to OUT.")
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an earlier result in the folder.")
    ] = False,
    min_coverage: Annotated[
        float, typer.Option(help="Share of frames that must have a pose for exit status 0.")
    ] = 0.9,
    as_json: JsonFlag = False,
) -> None:
    """Simulate a depth camera in a room, track it, and compare with the exact truth.

    Needs no data and no device. Writes what [bold]run[/bold] writes, and prints the errors against
    the simulated motion. Its camera exposes all rows at once: there is no read-out time to give.
    """
    from sphereflow import sim

    recording = sim.demo(seed=seed)
    with stage_bars(STAGES) as progress:
        result = run_pipeline(
            recording,
            out,
            pose_graph=pose_graph,
            rrd=rrd,
            max_frames=max_frames,
            pictures=pictures,
            overwrite=overwrite,
            min_coverage=min_coverage,
            progress=progress,
        )
    if keep_recording:
        with progress_bar("writing") as progress:
            recording.write(result.folder / "recording", progress=progress)
    finish(result, min_coverage, as_json=as_json)
