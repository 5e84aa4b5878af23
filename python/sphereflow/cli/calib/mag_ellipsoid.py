"""``sphereflow calib mag-ellipsoid``: hard and soft iron of a magnetometer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sphereflow.calibration import mag_ellipsoid as calibrate
from sphereflow.cli.calib.sensor_report import finish
from sphereflow.cli.console import user_errors

EXAMPLES = """[bold]Examples[/bold]

  sphereflow calib mag-ellipsoid turned_all_ways

[bold]What to record[/bold]  The sensor turned slowly all ways, at one place away from iron. A
reading is then corrected by: correction (reading - hard_iron)."""


def register(app: typer.Typer) -> None:
    """Add the verb to the group."""
    app.command("mag-ellipsoid", epilog=EXAMPLES)(mag_ellipsoid)


@user_errors("turn the sensor all ways: heads up, on its back, on its sides")
def mag_ellipsoid(
    data: Annotated[Path, typer.Argument(help="Folder of a data set; its kind is guessed.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for programs.")] = False,
) -> None:
    """Find hard and soft iron from a recording in which the sensor was turned all ways."""
    finish(calibrate(data), "turn the sensor all ways and record again", as_json=as_json)
