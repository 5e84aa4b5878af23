"""``sphereflow info``: what a recording holds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from sphereflow import io
from sphereflow.cli.console import print_json, print_rows, user_errors
from sphereflow.inspection import inspect_recording

EXAMPLES = """[bold]Examples[/bold]

  sphereflow info rgbd_dataset_freiburg1_xyz

  sphereflow info my_recording --depth-scale 1000 --json"""


def register(app: typer.Typer) -> None:
    """Add the verb to the command."""
    app.command(epilog=EXAMPLES)(info)


@user_errors("give the folder of a TUM, ICL-NUIM, EuRoC or 7-Scenes recording, or one of our own")
def info(
    data: Annotated[Path, typer.Argument(help="Folder of a data set; its kind is guessed.")],
    calibration: Annotated[
        Path | None, typer.Option(help="Calibration file (TOML) instead of the recording's own.")
    ] = None,
    depth_scale: Annotated[
        float | None, typer.Option(help="Depth counts per metre instead of the recording's own.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for programs.")] = False,
) -> None:
    """Say what a recording holds: streams, rates, gaps, calibration, and whether depth is sane."""
    recording = io.open_recording(data, calibration=calibration, depth_scale=depth_scale)
    found = inspect_recording(
        recording, calibration=None if calibration is None else str(calibration)
    )
    if as_json:
        print_json(found)
        return
    print_rows(_rows(found))


def _rows(found: dict[str, Any]) -> list[tuple[str, str]]:
    rows = [
        ("kind", found["kind"]),
        ("frames", _stream(found["timing"])),
        *((name, _stream(timing)) for name, timing in found["streams"].items()),
        ("truth", f"{found['truth_poses']} poses" if found["truth_poses"] else "none"),
        *_camera_rows(found["calibration"]),
    ]
    if found["sync"]:
        rows.append(("sync", ", ".join(f"{k} {value:g}" for k, value in found["sync"].items())))
    depth = found["depth"]
    if depth["metres"]:
        metres = depth["metres"]
        spread = f"{metres['p1']:.2f} to {metres['p99']:.2f} m, median {metres['p50']:.2f} m"
        rows.append(("depth", f"{spread}, {100 * depth['known_share']:.0f} % known"))
    rows += [("unreadable", text) for text in depth["unreadable"]]
    for kind in ("note", "warning", "hint"):
        rows += [(kind, text) for text in found[f"{kind}s"]]
    return rows


def _camera_rows(calibration: dict[str, Any]) -> list[tuple[str, str]]:
    rows = [("calibration", calibration["source"])]
    if calibration["model"] is not None:
        size = f"{calibration['width']}x{calibration['height']}"
        named = ", ".join(f"{name} {value:g}" for name, value in calibration["parameters"].items())
        rows += [("camera", f"{calibration['model']} {size}"), ("parameters", named)]
    if calibration["depth_scale_counts_per_m"] is not None:
        scale = calibration["depth_scale_counts_per_m"]
        rows.append(("depth scale", f"{scale:g} counts per metre"))
    readout_s = calibration["readout_s"]
    known = "unknown" if readout_s is None else f"{1000 * readout_s:.4g} ms"
    corrected = "corrected by the calibration" if calibration["depth_corrected"] else "not known"
    rows += [("read-out", known), ("depth distortion", corrected)]
    return rows


def _stream(timing: dict[str, Any]) -> str:
    if timing["rate_hz"] is None:
        return f"{timing['samples']}"
    gaps = timing["gaps"]
    text = f"{timing['samples']} in {timing['duration_s']:.2f} s, {timing['rate_hz']:.2f} Hz, "
    if not gaps["count"]:
        return text + "no gaps"
    return text + f"{gaps['count']} gaps, the longest {gaps['longest_s']:.3f} s"
