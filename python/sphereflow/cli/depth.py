"""``sphereflow depth``: dense depth from the images of a recording and the camera's known poses."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from sphereflow.cli.console import FAILED, print_json, print_rows, progress_bar, stop, user_errors
from sphereflow.cli.files import read_trajectory
from sphereflow.cli.options import JsonFlag

EXAMPLES = """[bold]Examples[/bold]

  sphereflow depth rgbd_dataset_freiburg1_xyz --poses rgbd_dataset_freiburg1_xyz/groundtruth.txt \
--out depth

  sphereflow depth room --poses room/groundtruth.txt --out depth --max-frames 100

[bold]Exit status[/bold]  0: depth was measured.  1: in no frame.  2: an option has no meaning."""


def register(app: typer.Typer) -> None:
    """Add the verb to the command."""
    app.command(epilog=EXAMPLES)(depth)


@user_errors(
    "sphereflow info DATA says what was found in the folder; to loose images write rgb.txt, "
    "depth.txt and calibration.toml, and put the images' times before their poses"
)
def depth(
    data: Annotated[Path, typer.Argument(help="Folder of a data set with colour images.")],
    poses: Annotated[Path, typer.Option(help="Trajectory of the camera, world from camera.")],
    out: Annotated[Path, typer.Option(help="Folder for the result; must be new or empty.")],
    calibration: Annotated[
        Path | None, typer.Option(help="Calibration file (TOML) instead of the recording's own.")
    ] = None,
    offset_s: Annotated[
        float, typer.Option(help="Seconds that are added to an image's stamp to find its pose.")
    ] = 0.0,
    max_frames: Annotated[int | None, typer.Option(help="Stop after so many frames.")] = None,
    std_percent: Annotated[
        float, typer.Option(help="Pixels less certain than this are left out of the depth images.")
    ] = 10.0,
    position_sigma_m: Annotated[
        float,
        typer.Option(help="Standard deviation of a pose's place, clock and shutter included."),
    ] = 0.002,
    rotation_sigma_rad: Annotated[
        float, typer.Option(help="Standard deviation of a pose's rotation, likewise.")
    ] = 0.002,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an earlier result in the folder.")
    ] = False,
    as_json: JsonFlag = False,
) -> None:
    """Measure depth everywhere in the images of a camera whose poses are known.

    Writes a recording of the estimated depth (16-bit PNG, 5000 counts a metre, 0 unknown, with its
    images and its list of files), errors.csv (frame by frame) and report.json. Where the recording
    has depth images of its own, the estimate is compared with them.
    """
    from sphereflow.dense import measure_depth

    trajectory = read_trajectory(poses)
    with progress_bar("depth") as progress:
        result = measure_depth(
            data,
            trajectory,
            out,
            calibration=calibration,
            offset_s=offset_s,
            max_frames=max_frames,
            std_percent=std_percent,
            position_sigma_m=position_sigma_m,
            rotation_sigma_rad=rotation_sigma_rad,
            overwrite=overwrite,
            progress=progress,
        )
    if as_json:
        print_json(result | {"result": str(out)})
    else:
        print_rows(_rows(result, out))
    if not result["statuses"].get("updated"):
        raise stop("depth was measured in no frame", f"look at {out / 'report.json'}", FAILED)


def _rows(result: dict[str, Any], out: Path) -> list[tuple[str, str]]:
    rows = [
        ("frames", f"{result['frames']}, {result['without_pose']} without a pose"),
        ("status", ", ".join(f"{n} {name}" for name, n in result["statuses"].items())),
    ]
    error = result["error"]
    if error is None:
        rows.append(("error", "none: no pixel is both certain enough and known in the recording"))
    else:
        rows += [
            ("error, median", f"{error['median_percent']:.2f} % of the depth"),
            ("error, mean", f"{error['mean_percent']:.2f} %"),
            ("compared", f"{100 * error['compared_share']:.1f} % of the pixels with a true depth"),
            ("normalised", f"{error['normalised']:.2f} (error over standard deviation, median)"),
        ]
    for claim in result["by_std"]:
        low, high = claim["std_percent"]
        limits = f"std {low:g} to {high:g} %" if high is not None else f"std above {low:g} %"
        text = f"{100 * claim['share']:.1f} % of the pixels, median error "
        text += f"{claim['median_percent']:.2f} %, normalised {claim['normalised']:.2f}"
        rows.append((limits, text))
    rows.append(("result", str(out)))
    return rows
