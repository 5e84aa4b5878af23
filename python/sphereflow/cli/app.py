"""Puts the verbs together."""

from __future__ import annotations

from typing import Annotated

import typer

import sphereflow
from sphereflow.cli import ape, calib, config, demo, depth, info, rpe, run, sim, solve, traj, view

app = typer.Typer(
    name="sphereflow",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Where a moving depth camera is, and what the world around it looks like.\n\n"
    "First steps: [bold]sphereflow demo --out demo[/bold] simulates a room and tracks a camera in "
    "it; [bold]sphereflow info DATA[/bold] says what a recording holds; "
    "[bold]sphereflow run DATA --out RESULT[/bold] tracks it.",
)


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"sphereflow {getattr(sphereflow, '__version__', 'unknown')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Options of the command itself."""


for verb in (run, depth, demo, sim, info, calib, ape, rpe, traj, view, solve, config):
    verb.register(app)


def main() -> None:
    """Entry point of the installed command."""
    app()
