"""``sphereflow rpe``: error of the motion over steps of a trajectory (drift)."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from sphereflow.cli import options
from sphereflow.cli.console import user_errors
from sphereflow.cli.files import read_pair
from sphereflow.eval import rpe as relative_error
from sphereflow.eval.pairs import DeltaUnit

EXAMPLES = """[bold]Examples[/bold]

  sphereflow rpe groundtruth.txt result/trajectory.tum --delta 1 --delta_unit s --all_pairs

  sphereflow rpe groundtruth.txt result/trajectory.tum -d 10 -u f -r angle_deg

  sphereflow rpe groundtruth.txt result/trajectory.tum -d 1 -u m --plot drift.png"""


class Unit(StrEnum):
    """evo's letters for the unit of a step, and s for seconds."""

    FRAMES = "f"
    SECONDS = "s"
    METRES = "m"
    RADIANS = "r"
    DEGREES = "d"


UNITS: dict[Unit, DeltaUnit] = {
    Unit.FRAMES: "frames",
    Unit.SECONDS: "s",
    Unit.METRES: "m",
    Unit.RADIANS: "rad",
    Unit.DEGREES: "deg",
}


def register(app: typer.Typer) -> None:
    """Add the verb to the command."""
    app.command(epilog=EXAMPLES)(rpe)


@user_errors(options.NEXT)
def rpe(
    ref: options.Reference,
    est: options.Estimate,
    delta: Annotated[float, typer.Option("-d", "--delta", help="Length of a step.")] = 1.0,
    delta_unit: Annotated[
        Unit,
        typer.Option(
            "-u",
            "--delta_unit",
            "--delta-unit",
            help="f frames, s seconds, m metres of path, r radians or d degrees of turning.",
        ),
    ] = Unit.FRAMES,
    all_pairs: Annotated[
        bool,
        typer.Option("--all_pairs", "--all-pairs", help="Begin a step at every pose."),
    ] = False,
    delta_tol: Annotated[
        float,
        typer.Option(
            "-t", "--delta_tol", "--delta-tol", help="Share of delta a step may be off (all pairs)."
        ),
    ] = 0.1,
    pairs_from_reference: Annotated[
        bool,
        typer.Option(
            "--pairs_from_reference", "--pairs-from-reference", help="Measure steps in the truth."
        ),
    ] = False,
    align: options.AlignFlag = False,
    correct_scale: options.ScaleFlag = False,
    align_origin: options.OriginFlag = False,
    pose_relation: options.RelationOption = options.PoseRelation.TRANS_PART,
    t_max_diff: options.MaxDifference = 0.01,
    t_offset: options.Offset = 0.0,
    association: options.RuleOption = options.Rule.ONE_TO_ONE,
    plot: options.Plot = None,
    as_json: options.JsonFlag = False,
) -> None:
    """Relative pose error (RPE): how much motion over a step is wrong, by evo's definition."""
    error = relative_error(
        *read_pair(ref, est),
        delta=delta,
        delta_unit=UNITS[delta_unit],
        relation=options.RELATIONS[pose_relation],
        align=options.alignment_name(align, correct_scale, align_origin),
        all_pairs=all_pairs,
        delta_tolerance=delta_tol,
        pairs_from="reference" if pairs_from_reference else "estimate",
        max_difference_s=t_max_diff,
        offset_s=t_offset,
        association=association.value,
    )
    options.show(error, plot, as_json)
