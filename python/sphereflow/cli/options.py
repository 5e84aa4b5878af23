"""Options that verbs share: those of ``ape`` and ``rpe`` under evo's names, and settings."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from sphereflow.cli.console import print_json, print_rows
from sphereflow.config import EngineConfig
from sphereflow.eval import PoseError
from sphereflow.eval.alignment import Align
from sphereflow.eval.relations import Relation


class PoseRelation(StrEnum):
    """evo's names of what is compared."""

    FULL = "full"
    TRANS_PART = "trans_part"
    ROT_PART = "rot_part"
    ANGLE_DEG = "angle_deg"
    ANGLE_RAD = "angle_rad"
    POINT_DISTANCE = "point_distance"
    POINT_DISTANCE_ERROR_RATIO = "point_distance_error_ratio"


RELATIONS: dict[PoseRelation, Relation] = {
    PoseRelation.FULL: "full",
    PoseRelation.TRANS_PART: "translation",
    PoseRelation.ROT_PART: "rotation_matrix",
    PoseRelation.ANGLE_DEG: "rotation_deg",
    PoseRelation.ANGLE_RAD: "rotation_rad",
    PoseRelation.POINT_DISTANCE: "distance",
    PoseRelation.POINT_DISTANCE_ERROR_RATIO: "distance_percent",
}


class World(StrEnum):
    """Axes of a run's world."""

    AUTO = "auto"
    FIRST_CAMERA = "first-camera"


class Rule(StrEnum):
    """How poses are matched in time."""

    ONE_TO_ONE = "one_to_one"
    NEAREST = "nearest"


Reference = Annotated[Path, typer.Argument(metavar="REF", help="True trajectory.")]
Estimate = Annotated[Path, typer.Argument(metavar="EST", help="Estimated trajectory.")]
AlignFlag = Annotated[
    bool, typer.Option("-a", "--align", help="Align by least squares (Umeyama), without scale.")
]
ScaleFlag = Annotated[
    bool,
    typer.Option(
        "-s", "--correct_scale", "--correct-scale", help="Estimate the scale; with -a, Sim(3)."
    ),
]
OriginFlag = Annotated[
    bool, typer.Option("--align_origin", "--align-origin", help="Align the first poses only.")
]
RelationOption = Annotated[
    PoseRelation, typer.Option("-r", "--pose_relation", "--pose-relation", help="What to compare.")
]
MaxDifference = Annotated[
    float,
    typer.Option("--t_max_diff", "--t-max-diff", help="Most seconds between matched poses."),
]
Offset = Annotated[
    float, typer.Option("--t_offset", "--t-offset", help="Seconds added to the estimate's times.")
]
RuleOption = Annotated[
    Rule,
    typer.Option(
        "--association", help="one_to_one uses no pose twice; nearest may, exactly as evo does."
    ),
]
Plot = Annotated[
    Path | None, typer.Option("-p", "--plot", help="Draw the error over time into this PNG file.")
]
ConfigFile = Annotated[
    Path | None,
    typer.Option(
        "--config",
        metavar="FILE",
        help="Settings (TOML); what it leaves out keeps its default. "
        "`sphereflow config dump` prints all.",
    ),
]
JsonFlag = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]

NEXT = "check with `sphereflow traj REF EST` that both files hold what you expect"


def read_config(path: Path | None) -> EngineConfig:
    """The settings of a run in a file, or the defaults where there is none."""
    return EngineConfig() if path is None else EngineConfig.from_toml(path)


def alignment_name(align: bool, scale: bool, origin: bool) -> Align:
    """evo's flags as one word."""
    if origin and (align or scale):
        raise typer.BadParameter("--align_origin cannot be used with --align or --correct_scale")
    if origin:
        return "origin"
    if align:
        return "sim3" if scale else "se3"
    return "scale" if scale else "none"


def show(error: PoseError, plot: Path | None, as_json: bool) -> None:
    """Draw if asked for, then print the figures."""
    if plot is not None:
        from sphereflow.plots import draw_error

        draw_error(plot, error)
    if as_json:
        print_json(error.summary())
        return
    unit = f" ({error.unit})" if error.unit else ""
    typer.echo(f"{error.description}{unit}")
    statistics = error.statistics
    names = ("rmse", "mean", "median", "std", "min", "max", "sse")
    rows = [(name, f"{getattr(statistics, name):.6f}") for name in names]
    what = "matched poses" if error.metric == "ape" else "pairs"
    rows.append((what, str(error.pairs)))
    if error.align in ("sim3", "scale"):
        rows.append(("scale", f"{error.scale:.6g}"))
    print_rows(rows)
