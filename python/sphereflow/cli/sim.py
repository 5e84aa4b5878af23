"""``sphereflow sim``: write a simulated recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sphereflow.cli.console import print_rows, progress_bar, user_errors

EXAMPLES = """[bold]Examples[/bold]

  sphereflow sim --out room --seed 7

  sphereflow sim --out short --duration 2 --rate 15

  sphereflow run room --out result"""


def register(app: typer.Typer) -> None:
    """Add the verb to the command."""
    app.command(epilog=EXAMPLES)(sim)


@user_errors("choose a folder that does not exist yet with --out")
def sim(
    out: Annotated[Path, typer.Option(help="Folder for the recording.")],
    seed: Annotated[int, typer.Option(help="Seed of all noise: same seed, same recording.")] = 0,
    duration: Annotated[
        float | None, typer.Option(help="Seconds to simulate; a whole tour if not given.")
    ] = None,
    rate: Annotated[float, typer.Option(help="Frames a second.")] = 30.0,
) -> None:
    """Simulate a depth camera and its inertial sensors in a room, and write the recording.

    The folder has the layout of the TUM RGB-D benchmark, with the exact motion as
    groundtruth.txt; every program that reads TUM recordings can read it.
    """
    from sphereflow.sim import Simulator

    recording = Simulator(seed=seed, duration_s=duration, rate_hz=rate)
    with progress_bar("simulating") as progress:
        recording.write(out, progress=progress)
    print_rows([("frames", str(len(recording))), ("recording", str(out))])
