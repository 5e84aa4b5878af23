"""``sphereflow calib rolling-shutter``: the read-out time from the camera's motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sphereflow.calibration import calibrate_rolling_shutter
from sphereflow.cli.calib.report import finish, stages
from sphereflow.cli.console import user_errors

EXAMPLES = """[bold]Examples[/bold]

  sphereflow calib rolling-shutter my_recording --out camera.toml

[bold]What to record[/bold]  A camera that turns: at 1 rad/s a read-out of 30 ms bends the image by
0.03 rad, at 0.1 rad/s by less than what else is wrong with depth.

[bold]Exit status[/bold]  0: calibrated.  1: not observable; no file is written."""


def register(app: typer.Typer) -> None:
    """Add the verb to the group."""
    app.command(name="rolling-shutter", epilog=EXAMPLES)(rolling_shutter)


@user_errors("sphereflow info DATA says what was found in the folder")
def rolling_shutter(
    data: Annotated[Path, typer.Argument(help="Folder of a data set; its kind is guessed.")],
    out: Annotated[Path, typer.Option(help="Calibration file (TOML) to write.")],
    calibration: Annotated[
        Path | None, typer.Option(help="Calibration so far, instead of the recording's own.")
    ] = None,
    depth_scale: Annotated[
        float | None, typer.Option(help="Depth counts per metre instead of the recording's own.")
    ] = None,
    max_frames: Annotated[int | None, typer.Option(help="Use the first so many frames.")] = None,
    max_pairs: Annotated[
        int | None, typer.Option(help="Pairs of frames at most; time grows with them.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for programs.")] = False,
) -> None:
    """Find the rolling shutter's read-out time from the camera's motion; nothing else changes.

    Row y of H is exposed (y / H - 1/2) times it after the frame's stamp. [bold]calib depth[/bold]
    finds it too, together with lens and depth.
    """
    with stages() as tell:
        calibrated = calibrate_rolling_shutter(
            data,
            calibration=calibration,
            depth_scale=depth_scale,
            max_frames=max_frames,
            max_pairs=max_pairs,
            progress=tell,
        )
    finish(calibrated, out, as_json=as_json)
