"""``sphereflow ape``: absolute error of a trajectory against the truth."""

from __future__ import annotations

import typer

from sphereflow.cli import options
from sphereflow.cli.console import user_errors
from sphereflow.cli.files import read_pair
from sphereflow.eval import ape as absolute_error

EXAMPLES = """[bold]Examples[/bold]

  sphereflow ape groundtruth.txt result/trajectory.tum -a

  sphereflow ape groundtruth.txt monocular.tum -as --t_max_diff 0.02 --plot error.png

  sphereflow ape groundtruth.txt result/trajectory.tum -a -r angle_deg --json"""


def register(app: typer.Typer) -> None:
    """Add the verb to the command."""
    app.command(epilog=EXAMPLES)(ape)


@user_errors(options.NEXT)
def ape(
    ref: options.Reference,
    est: options.Estimate,
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
    """Absolute pose error (ATE): how far each pose is from the truth, by evo's definition."""
    error = absolute_error(
        *read_pair(ref, est),
        align=options.alignment_name(align, correct_scale, align_origin),
        relation=options.RELATIONS[pose_relation],
        max_difference_s=t_max_diff,
        offset_s=t_offset,
        association=association.value,
    )
    options.show(error, plot, as_json)
