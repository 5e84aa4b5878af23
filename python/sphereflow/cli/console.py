"""What all verbs share on the terminal: errors in one line, and a progress bar."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

import sphereflow
from sphereflow.report import finite

P = ParamSpec("P")
R = TypeVar("R")

FAILED = 1
"""The data could not be read, or the result is not good enough."""

MISUSED = 2
"""The command was given something that has no meaning; also typer's own status for that."""


def user_errors(next_step: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a verb: errors that a user can cause become one line, and what to do next.

    Anything else is a defect and keeps its traceback.
    """

    def decorate(verb: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(verb)
        def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
            try:
                return verb(*args, **kwargs)
            except sphereflow.MissingExtraError as error:
                # It says itself what to do.
                raise stop(str(error), None, FAILED) from error
            except sphereflow.SphereflowError as error:
                misused = isinstance(error, (sphereflow.ValueRangeError, sphereflow.ShapeError))
                raise stop(str(error), next_step, MISUSED if misused else FAILED) from error
            except OSError as error:
                raise stop(_os_error_text(error), next_step, FAILED) from error

        return guarded

    return decorate


def stop(message: str, next_step: str | None, status: int) -> typer.Exit:
    """Print an error and what to do next; returns the exit to raise."""
    typer.secho(f"error: {' '.join(message.split())}", fg=typer.colors.RED, err=True)
    if next_step:
        typer.echo(f"next: {next_step}", err=True)
    return typer.Exit(status)


def _os_error_text(error: OSError) -> str:
    return f"{error.filename}: {error.strerror}" if error.filename else str(error)


@contextmanager
def progress_bar(title: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on standard error while the block runs; nothing where that is no terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda done, total: None
        return
    columns = (TextColumn(title), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def stage_bars(titles: Mapping[str, str]) -> Iterator[Callable[[str, int, int], None]]:
    """A bar for each stage of a job as it begins, titled; nothing where that is no terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda stage, done, total: None
        return
    title = TextColumn("{task.description}")
    columns = (title, BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        tasks = {}

        def tell(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(titles.get(stage, stage), total=total)
            bar.update(tasks[stage], completed=done, total=total)

        yield tell


def print_json(values: Mapping[str, Any]) -> None:
    """Values as JSON on standard output."""
    typer.echo(json.dumps(finite(values), indent=2, allow_nan=False, ensure_ascii=False))


def print_rows(rows: list[tuple[str, str]]) -> None:
    """Names and values in two aligned columns."""
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        typer.echo(f"  {name:<{width}}  {value}")
