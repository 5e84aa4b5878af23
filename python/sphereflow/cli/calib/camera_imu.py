"""``sphereflow calib camera-imu``: rotation and time offset between camera and IMU."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sphereflow.calibration import camera_imu as calibrate
from sphereflow.cli.calib.sensor_report import finish
from sphereflow.cli.console import progress_bar, user_errors

EXAMPLES = """[bold]Examples[/bold]

  sphereflow calib camera-imu turned_about_all_axes

[bold]What to record[/bold]  The camera turned briskly about all three axes in front of furniture,
ten seconds. The rotation carries the IMU's axes to the camera's, and
IMU time = camera time + offset."""


def register(app: typer.Typer) -> None:
    """Add the verb to the group."""
    app.command("camera-imu", epilog=EXAMPLES)(camera_imu)


@user_errors("sphereflow info DATA says what was found in the folder")
def camera_imu(
    data: Annotated[Path, typer.Argument(help="Folder of a data set; its kind is guessed.")],
    max_frames: Annotated[int | None, typer.Option(help="Use the first so many frames.")] = None,
    largest_offset: Annotated[float, typer.Option(help="Largest offset tried, seconds.")] = 0.1,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for programs.")] = False,
) -> None:
    """Find rotation and time offset between camera and IMU from depth images and the gyro."""
    with progress_bar("track") as progress:
        found = calibrate(
            data, max_frames=max_frames, largest_offset_s=largest_offset, progress=progress
        )
    finish(found, "turn the camera briskly about all three axes and record again", as_json=as_json)
