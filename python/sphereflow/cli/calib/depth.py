"""``sphereflow calib depth``: lens, depth error and read-out time from the camera's motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sphereflow.calibration import calibrate_depth
from sphereflow.cli.calib.report import finish, stages
from sphereflow.cli.console import user_errors

EXAMPLES = """[bold]Examples[/bold]

  sphereflow calib depth my_recording --out camera.toml

  sphereflow run other_recording --calibration camera.toml --out result

[bold]What to record[/bold]  About ten seconds, the camera in the hand in front of furniture: turn
it about all three axes, move it to and fro, look at things near and far. One wall is not enough.

[bold]What it prints[/bold]  Each parameter with its standard deviation. "held" means that the
motion did not show it by itself: it is near its prior, and only combinations with others are known.

[bold]Exit status[/bold]  0: calibrated.  1: nothing was observable; no file is written."""


def register(app: typer.Typer) -> None:
    """Add the verb to the group."""
    app.command(epilog=EXAMPLES)(depth)


@user_errors("sphereflow info DATA says what was found in the folder")
def depth(
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
    readout: Annotated[bool, typer.Option(help="Also find the read-out time.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for programs.")] = False,
) -> None:
    """Calibrate a depth camera from its motion alone: no target, no true poses.

    Pairs of frames a fraction of a second apart agree on a rigid motion only where the rays, the
    depths and the times of the rows are right. The unit of length is not among what this shows.
    """
    with stages() as tell:
        calibrated = calibrate_depth(
            data,
            calibration=calibration,
            depth_scale=depth_scale,
            max_frames=max_frames,
            max_pairs=max_pairs,
            readout=readout,
            progress=tell,
        )
    finish(calibrated, out, as_json=as_json)
