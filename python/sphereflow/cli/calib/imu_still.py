"""``sphereflow calib imu-still``: biases and noise densities from a recording at rest."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sphereflow.calibration import imu_still as calibrate
from sphereflow.cli.calib.sensor_report import finish
from sphereflow.cli.console import user_errors

EXAMPLES = """[bold]Examples[/bold]

  sphereflow calib imu-still lying_on_the_table

[bold]What to record[/bold]  Half a minute with the sensor lying still. Rest shows the gyro's bias,
the noise of both sensors, and of the accelerometer's bias only the part along the vertical."""


def register(app: typer.Typer) -> None:
    """Add the verb to the group."""
    app.command("imu-still", epilog=EXAMPLES)(imu_still)


@user_errors("sphereflow info DATA says what was found in the folder")
def imu_still(
    data: Annotated[Path, typer.Argument(help="Folder of a data set; its kind is guessed.")],
    gravity: Annotated[float, typer.Option(help="Local norm of gravity, m/s^2.")] = 9.81,
    max_seconds: Annotated[
        float | None, typer.Option(help="Use the first so many seconds.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for programs.")] = False,
) -> None:
    """Find biases and noise densities of gyro and accelerometer at rest."""
    found = calibrate(data, gravity_m_s2=gravity, max_seconds=max_seconds)
    finish(found, "record at least ten seconds without touching the sensor", as_json=as_json)
