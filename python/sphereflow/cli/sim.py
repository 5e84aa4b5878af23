"""``sphereflow sim``: write a simulated recording."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from sphereflow.cli.console import print_json, print_rows, progress_bar, user_errors
from sphereflow.cli.options import JsonFlag

EXAMPLES = """[bold]Examples[/bold]

  sphereflow sim --out room --seed 7

  sphereflow sim --out short --duration 2 --rate 15

  sphereflow run room --out result

  sphereflow sim --out paint --scene thesis_room --motion sinusoids_411 --rate 60"""


class Scene(StrEnum):
    """Worlds."""

    FURNISHED_ROOM = "furnished_room"
    THESIS_ROOM = "thesis_room"
    ELLIPSOID = "ellipsoid"
    SPHERE = "sphere"


class Motion(StrEnum):
    """Paths of the camera."""

    ROOM_TOUR = "room_tour"
    HAND_HELD = "hand_held"
    TROLLEY = "trolley"
    SINUSOIDS_411 = "sinusoids_411"
    STILL = "still"


class DepthNoise(StrEnum):
    """Faults of the depth camera."""

    KINECT = "kinect"
    INDEPENDENT = "independent"
    NONE = "none"


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
    scene: Annotated[Scene, typer.Option(help="The world.")] = Scene.FURNISHED_ROOM,
    motion: Annotated[Motion, typer.Option(help="How the camera moves.")] = Motion.ROOM_TOUR,
    depth_noise: Annotated[
        DepthNoise, typer.Option(help="What the depth camera adds.")
    ] = DepthNoise.KINECT,
    image_sigma: Annotated[float, typer.Option(help="Noise of the image, grey levels.")] = 2.0,
    readout: Annotated[
        float, typer.Option(help="Rolling shutter: seconds from first to last row; 0 for none.")
    ] = 0.0,
    mag: Annotated[bool, typer.Option(help="Also a magnetometer, in a room with iron.")] = False,
    as_json: JsonFlag = False,
) -> None:
    """Simulate a depth camera and its inertial sensors in a room, and write the recording.

    The folder has the layout of the TUM RGB-D benchmark, with the exact motion as
    groundtruth.txt; every program that reads TUM recordings can read it.
    """
    from sphereflow.sim import Simulator

    recording = Simulator(
        scene=scene.value,
        motion=motion.value,
        depth_noise=depth_noise.value,
        image_sigma_grey=image_sigma,
        readout_s=readout,
        mag=mag,
        seed=seed,
        duration_s=duration,
        rate_hz=rate,
    )
    with progress_bar("simulating") as progress:
        recording.write(out, progress=progress)
    if as_json:
        print_json({"frames": len(recording), "recording": str(out)})
    else:
        print_rows([("frames", str(len(recording))), ("recording", str(out))])
