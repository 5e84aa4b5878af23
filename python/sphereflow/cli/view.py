"""``sphereflow view``: show a result or a recording in the rerun viewer."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import typer

import sphereflow
from sphereflow.cli.console import FAILED, print_json, stop, user_errors
from sphereflow.cli.options import JsonFlag

EXAMPLES = """[bold]Examples[/bold]

  sphereflow view result

  sphereflow view rgbd_dataset_freiburg1_xyz

  sphereflow view result --save result.rrd"""


def register(app: typer.Typer) -> None:
    """Add the verb to the command."""
    app.command(epilog=EXAMPLES)(view)


@user_errors("give a result folder of `sphereflow run`, a recording, or an .rrd file")
def view(
    target: Annotated[
        Path, typer.Argument(metavar="RESULT_OR_DATA", help="Result, recording or .rrd file.")
    ],
    save: Annotated[
        Path | None, typer.Option(help="Write the .rrd file here and open no window.")
    ] = None,
    max_frames: Annotated[int, typer.Option(help="Frames of a recording to show.")] = 300,
    as_json: JsonFlag = False,
) -> None:
    """Show a result or a recording in the rerun viewer (a window; --save needs none)."""
    from sphereflow import viz

    if not target.exists():
        raise sphereflow.DataError(f"{target}: no such file or folder")
    if save is not None:
        _record(target, save, max_frames)
        if as_json:
            print_json({"written": str(save)})
        else:
            typer.echo(f"wrote {save}")
        return
    with tempfile.TemporaryDirectory(prefix="sphereflow-view-") as folder:
        ready = _ready(target)
        if ready is None:
            ready = _record(target, Path(folder) / "view.rrd", max_frames)
        status = viz.open_viewer(ready)
    if status != 0:
        raise stop(
            f"the viewer ended with status {status}: is there a display?",
            "write a file with --save and open it where there is one",
            FAILED,
        )


def _ready(target: Path) -> Path | None:
    """The recording for the viewer that is already there, if there is one."""
    if target.is_file():
        return target
    found = sorted(target.glob("*.rrd"))
    return found[0] if found else None


def _record(target: Path, path: Path, max_frames: int) -> Path:
    from sphereflow import io, viz

    if (target / "trajectory.tum").is_file():
        return viz.record_result(target, path)
    return viz.record_data(io.open_recording(target), path, max_frames=max_frames)
