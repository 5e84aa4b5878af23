"""What the verbs print of a self-calibration, and its end: file, text, exit status."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from sphereflow.calibration import Calibrated
from sphereflow.cli.console import FAILED, print_json, print_rows, progress_bar, stop
from sphereflow.odometry import SelfCalibration


@contextmanager
def stages() -> Iterator[Callable[[str, int, int], None]]:
    """A bar for the frames and one for the steps."""
    with progress_bar("track") as track, progress_bar("calibrate") as solve:
        bars = {"track": track, "calibrate": solve}
        yield lambda what, done, total: bars[what](done, total)


def finish(calibrated: Calibrated, out: Path, *, as_json: bool) -> None:
    """Write the file where there is a calibration, and print the report."""
    found = calibrated.found
    if found.status == "calibrated":
        calibrated.write(out)
    if as_json:
        print_json(as_dict(found))
    else:
        print_rows(_rows(found))
    if found.status != "calibrated":
        raise stop(
            f"{found.status}: {found.reason}",
            "record the camera turning and moving in front of furniture; no file was written",
            FAILED,
        )
    if not as_json:
        typer.echo(f"  written to {out}; use it with: sphereflow run DATA --calibration {out}")


def as_dict(found: SelfCalibration) -> dict[str, Any]:
    """Everything that was found, for programs."""
    names = (
        "status",
        "reason",
        "frames",
        "pairs",
        "iterations",
        "residual_before",
        "residual_after",
        "inflation",
        "rms_rate_rad_s",
        "rms_speed_m_s",
        "readout_s",
        "depth_correction",
        "parameters",
        "held",
    )
    camera = {"model": found.camera.model, **found.camera.parameters}
    return {name: getattr(found, name) for name in names} | {"camera": camera}


def _rows(found: SelfCalibration) -> list[tuple[str, str]]:
    motion = f"{found.rms_rate_rad_s:.2f} rad/s, {found.rms_speed_m_s:.2f} m/s rms"
    residual = f"{1e3 * found.residual_before:.2f} to {1e3 * found.residual_after:.2f} e-3 1/m"
    rows = [
        ("motion", f"{motion}; {found.frames} frames, {found.pairs} pairs"),
        ("residual", f"{residual}, median over the pairs"),
    ]
    for parameter in found.parameters:
        held = "" if parameter["observable"] else f"  held; prior {parameter['prior_std']:.5f}"
        value = f"{parameter['value']:+.5f} +- {parameter['std']:.5f}{held}"
        rows.append((parameter["name"], value))
    for combination in found.held:
        shares = combination["shares"].items()
        named = " ".join(f"{share:+.1f} {name}" for name, share in shares)
        rows.append(("not shown", f"{named}: {100 * combination['std_share']:.0f} % of its prior"))
    return rows
