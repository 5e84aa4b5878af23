"""``sphereflow calib``: calibrate a sensor from a recording; one verb a file."""

from __future__ import annotations

import typer

from sphereflow.cli.calib import camera_imu, depth, imu_still, mag_ellipsoid, rolling_shutter

HELP = """Calibrate a sensor from a recording of its motion.

[bold]depth[/bold] finds what is left of the lens, the smooth error of 1/Z and the read-out time;
[bold]rolling-shutter[/bold] the read-out time alone. No target and no true poses are needed.
[bold]imu-still[/bold], [bold]mag-ellipsoid[/bold] and [bold]camera-imu[/bold] are for the other
sensors."""


def register(app: typer.Typer) -> None:
    """Add the group to the command."""
    group = typer.Typer(no_args_is_help=True, rich_markup_mode="rich", help=HELP)
    for verb in (depth, rolling_shutter, imu_still, mag_ellipsoid, camera_imu):
        verb.register(group)
    app.add_typer(group, name="calib")
