"""``sphereflow traj``: look at trajectory files and convert them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import sphereflow
from sphereflow.cli.console import print_json, print_rows, user_errors
from sphereflow.cli.files import FORMATS, Format, read_trajectory
from sphereflow.cli.options import JsonFlag
from sphereflow.report import path_length_m, timing_of_stamps

EXAMPLES = """[bold]Examples[/bold]

  sphereflow traj groundtruth.txt result/trajectory.tum

  sphereflow traj state_groundtruth.csv --format euroc --save_as_tum groundtruth.tum

  sphereflow traj a.tum b.tum --plot both.png"""


def register(app: typer.Typer) -> None:
    """Add the verb to the command."""
    app.command(epilog=EXAMPLES)(traj)


@user_errors("formats are tum, kitti and euroc; name the format with --format if it is not found")
def traj(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Trajectory files.")],
    file_format: Annotated[
        Format | None, typer.Option("--format", help="Format of the files, if not guessed right.")
    ] = None,
    save_as_tum: Annotated[
        Path | None, typer.Option("--save_as_tum", "--save-as-tum", help="Write TUM to this file.")
    ] = None,
    save_as_kitti: Annotated[
        Path | None,
        typer.Option("--save_as_kitti", "--save-as-kitti", help="Write KITTI to this file."),
    ] = None,
    save_as_euroc: Annotated[
        Path | None,
        typer.Option("--save_as_euroc", "--save-as-euroc", help="Write EuRoC to this file."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("-p", "--plot", help="Draw all of them into this PNG file.")
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Print what trajectory files hold, convert one, or draw several."""
    targets = {Format.TUM: save_as_tum, Format.KITTI: save_as_kitti, Format.EUROC: save_as_euroc}
    wanted = {name: path for name, path in targets.items() if path is not None}
    if wanted and len(files) != 1:
        raise typer.BadParameter(f"one file can be converted at a time, {len(files)} were given")
    read = {path: read_trajectory(path, file_format) for path in files}
    written = [*wanted.values()] + ([] if plot is None else [plot])
    for name, target in wanted.items():
        read[files[0]].write(target, format=FORMATS[name])
    if plot is not None:
        from sphereflow.plots import draw_trajectories

        draw_trajectories(plot, {str(path): np.asarray(t.position_m) for path, t in read.items()})
    if as_json:
        found = {str(path): _values(trajectory) for path, trajectory in read.items()}
        print_json({"trajectories": found, "written": [str(path) for path in written]})
        return
    for path, trajectory in read.items():
        typer.echo(str(path))
        print_rows(_rows(trajectory))
    for target in written:
        typer.echo(f"wrote {target}")


def _values(trajectory: sphereflow.Trajectory) -> dict[str, Any]:
    position_m = np.asarray(trajectory.position_m)
    extent = np.ptp(position_m, axis=0).tolist() if len(trajectory) else None
    return {
        "poses": len(trajectory),
        "path_length_m": path_length_m(position_m),
        "extent_m": extent,
        "timing": timing_of_stamps(trajectory.stamp_ns),
    }


def _rows(trajectory: sphereflow.Trajectory) -> list[tuple[str, str]]:
    timing = timing_of_stamps(trajectory.stamp_ns)
    position_m = np.asarray(trajectory.position_m)
    rows = [("poses", str(len(trajectory)))]
    if len(trajectory) == 0:
        return rows
    length = path_length_m(position_m)
    extent = np.ptp(position_m, axis=0)
    rows.append(("path length", f"{length:.6f} m"))
    rows.append(("extent", " x ".join(f"{side:.3f}" for side in extent) + " m (x y z)"))
    if timing["rate_hz"] is not None:
        gaps = timing["gaps"]
        duration = timing["duration_s"]
        rows.append(("duration", f"{duration:.6f} s"))
        rows.append(("rate", f"{timing['rate_hz']:.2f} Hz (mean)"))
        rows.append(("mean speed", f"{length / duration:.3f} m/s"))
        rows.append(("gaps", f"{gaps['count']}, the longest {gaps['longest_s']:.3f} s"))
    return rows
