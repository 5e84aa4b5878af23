"""``sphereflow ba`` and ``sphereflow pgo``: solve a problem that stands in a file."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import typer

from sphereflow.cli.console import print_json, print_rows, stop, user_errors
from sphereflow.solver import BundleProblem, PoseGraph, SolverResult

BA_EXAMPLES = """[bold]Examples[/bold]

  sphereflow ba problem-49-7776-pre.txt --out adjusted.txt

  sphereflow ba bundle.out --loss huber --threshold 2"""

PGO_EXAMPLES = """[bold]Examples[/bold]

  sphereflow pgo parking-garage.g2o --out optimised.g2o

  sphereflow pgo graph.g2o --switch gnc"""


class LossName(StrEnum):
    """Losses of whitened residuals."""

    QUADRATIC = "quadratic"
    HUBER = "huber"
    CAUCHY = "cauchy"
    TUKEY = "tukey"


class Switch(StrEnum):
    """How wrong loop edges are told from right ones."""

    OFF = "off"
    GNC = "gnc"
    DCS = "dcs"


LOSSES: dict[LossName, Literal["quadratic", "huber", "cauchy", "tukey"]] = {
    LossName.QUADRATIC: "quadratic",
    LossName.HUBER: "huber",
    LossName.CAUCHY: "cauchy",
    LossName.TUKEY: "tukey",
}
SWITCHES: dict[Switch, Literal["off", "gnc", "dcs"]] = {
    Switch.OFF: "off",
    Switch.GNC: "gnc",
    Switch.DCS: "dcs",
}

Out = Annotated[Path | None, typer.Option("--out", help="Write the result to this file.")]
Steps = Annotated[int, typer.Option("--max-iterations", help="Steps tried at most.")]
Tolerance = Annotated[
    float,
    typer.Option("--tolerance", help="Stop where a step changes the cost by less, relatively."),
]
Budget = Annotated[
    float | None, typer.Option("--time-budget", help="Begin no step after so many seconds.")
]
Threads = Annotated[int, typer.Option("--threads", help="Threads; 0 is all cores.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]

SHOWN = 10
"""Issues that are printed one by one."""


def register(app: typer.Typer) -> None:
    """Add the verbs to the command."""
    app.command(epilog=BA_EXAMPLES)(ba)
    app.command(epilog=PGO_EXAMPLES)(pgo)


@user_errors("BAL, Bundler (bundle.out) and libmv files are read")
def ba(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="BAL, Bundler or libmv problem.")],
    out: Out = None,
    loss: Annotated[LossName, typer.Option("--loss", help="Loss.")] = LossName.QUADRATIC,
    threshold: Annotated[float, typer.Option("--threshold", help="Of the loss, pixels.")] = 1.0,
    max_iterations: Steps = 100,
    tolerance: Tolerance = 1e-8,
    time_budget: Budget = None,
    threads: Threads = 0,
    as_json: Json = False,
) -> None:
    """Adjust poses, points and intrinsics of a bundle adjustment problem."""
    _check_folder(out)
    problem = BundleProblem.read(file)
    problem.set_loss(LOSSES[loss], threshold)
    result = problem.solve(
        max_iterations=max_iterations,
        function_tolerance=tolerance,
        time_budget_s=time_budget,
        threads=threads,
    )
    if out is not None:
        problem.write(out)
    _show(repr(problem), result, out, as_json)


@user_errors("g2o files with VERTEX_SE3:QUAT and EDGE_SE3:QUAT are read")
def pgo(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="g2o pose graph.")],
    out: Out = None,
    switch: Annotated[Switch, typer.Option("--switch", help="Of wrong loop edges.")] = Switch.OFF,
    threshold: Annotated[
        float, typer.Option("--threshold", help="Squared residual from which a loop is doubted.")
    ] = 16.8,
    max_iterations: Steps = 100,
    tolerance: Tolerance = 1e-8,
    time_budget: Budget = None,
    threads: Threads = 0,
    as_json: Json = False,
) -> None:
    """Optimise a pose graph."""
    _check_folder(out)
    graph = PoseGraph.read(file)
    for what in graph.warnings:
        typer.echo(f"warning: {file}: {what}", err=True)
    result = graph.solve(
        switch=SWITCHES[switch],
        threshold=threshold,
        max_iterations=max_iterations,
        function_tolerance=tolerance,
        time_budget_s=time_budget,
        threads=threads,
    )
    if out is not None:
        graph.write(out)
    _show(repr(graph), result, out, as_json)


def _check_folder(out: Path | None) -> None:
    """Before the work: a result that cannot be written is lost."""
    if out is not None and not out.resolve().parent.is_dir():
        raise stop(f"--out {out}: there is no such folder", "make the folder first", 2)


def _show(title: str, result: SolverResult, out: Path | None, as_json: bool) -> None:
    if as_json:
        print_json(
            {
                "initial_cost": result.initial_cost,
                "final_cost": result.final_cost,
                "stop": result.stop,
                "iterations": result.iterations,
                "issues": result.issues,
                "rejected": result.rejected,
                "setup_s": result.setup_s,
                "solve_s": result.solve_s,
            }
        )
    else:
        typer.echo(title)
        typer.echo(f"{'step':>4}  {'cost':>16}  {'gradient':>10}  {'lambda':>8}  {'seconds':>8}")
        typer.echo(f"{0:>4}  {result.initial_cost:>16.9e}")
        for number, step in enumerate(result.iterations, start=1):
            mark = "" if step["accepted"] else "  refused"
            typer.echo(
                f"{number:>4}  {step['cost']:>16.9e}  {step['gradient']:>10.2e}  "
                f"{step['lambda']:>8.1e}  {step['elapsed_s']:>8.3f}{mark}"
            )
        print_rows(_rows(result))
        for issue in result.issues[:SHOWN]:
            typer.echo(f"warning: {issue}", err=True)
        if len(result.issues) > SHOWN:
            typer.echo(f"warning: and {len(result.issues) - SHOWN} more", err=True)
    if out is not None:
        typer.echo(f"wrote {out}", err=as_json)
    if not result.converged and result.stop != "nothing_to_do":
        next_step = "the result is the best found; raise --max-iterations or --time-budget"
        raise stop(f"did not converge: {result.stop}", next_step, 1)


def _rows(result: SolverResult) -> list[tuple[str, str]]:
    rows = [
        ("cost", f"{result.initial_cost:.9e} -> {result.final_cost:.9e}"),
        ("stopped by", result.stop),
        ("set-up", f"{result.setup_s:.3f} s"),
        ("iterations", f"{result.solve_s:.3f} s"),
    ]
    if result.linear_solver is not None:
        rows.append(("reduced system", result.linear_solver))
    if result.rejected:
        rows.append(("edges switched off", str(len(result.rejected))))
    return rows
