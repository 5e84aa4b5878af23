"""``sphereflow config``: settings as TOML, with what each means, and a check of a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from sphereflow.cli.console import print_json, print_rows, user_errors
from sphereflow.config import CONFIGS, Config
from sphereflow.errors import ValueRangeError

HELP = """Settings: print the defaults as TOML, check a file.

A file needs only the settings that differ: what it leaves out keeps its default."""

DUMP_EXAMPLES = """[bold]Examples[/bold]

  sphereflow config dump > settings.toml

  sphereflow config dump depth-filter

  sphereflow config dump odometry --json

[bold]Exit status[/bold]  0: printed.  2: there is no such name."""

CHECK_EXAMPLES = """[bold]Examples[/bold]

  sphereflow config check settings.toml

  sphereflow config check filter.toml --as depth-filter

[bold]Exit status[/bold]  0: every setting is valid.  1: the file cannot be read, or is no TOML.
2: a setting is unknown, of a wrong type or out of its range."""

NAMES = f"One of {', '.join(CONFIGS)}."
Json = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]


def register(app: typer.Typer) -> None:
    """Add the group to the command."""
    group = typer.Typer(no_args_is_help=True, rich_markup_mode="rich", help=HELP)
    group.command(epilog=DUMP_EXAMPLES)(dump)
    group.command(epilog=CHECK_EXAMPLES)(check)
    app.add_typer(group, name="config")


@user_errors("sphereflow config dump --help lists the names")
def dump(
    name: Annotated[
        str, typer.Argument(help=f"Whose settings; engine: those of sphereflow run. {NAMES}")
    ] = "engine",
    as_json: Json = False,
) -> None:
    """Print the default settings as TOML, with what each means."""
    config = named(name)()
    if as_json:
        print_json(config.as_dict())
    else:
        typer.echo(config.to_toml(comments=True), nl=False)


@user_errors("sphereflow config dump NAME prints all settings with what they mean")
def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Settings, TOML.")],
    name: Annotated[str, typer.Option("--as", help=f"Whose settings they are. {NAMES}")] = "engine",
    as_json: Json = False,
) -> None:
    """Check a file of settings, and print those that differ from their defaults."""
    kind = named(name)
    config = kind.from_toml(file)
    if as_json:
        print_json({"config": name, "settings": config.as_dict()})
        return
    changed = differences(config, kind())
    print_rows([("checked", f"{file} as {name}: valid"), *changed])
    if not changed:
        typer.echo("every setting has its default")


def named(name: str) -> type[Config]:
    """The config of a name."""
    if name not in CONFIGS:
        raise ValueRangeError(f"name: expected one of {', '.join(CONFIGS)}, found '{name}'")
    return CONFIGS[name]


def differences(config: Config, default: Config, path: str = "") -> list[tuple[str, str]]:
    """Dotted keys of the settings that are not the default, with both values."""
    rows: list[tuple[str, str]] = []
    for key, usual in default.as_dict().items():
        value: Any = getattr(config, key)
        if isinstance(value, Config):
            rows += differences(value, getattr(default, key), f"{path}{key}.")
        elif value != usual:
            rows.append((f"{path}{key}", f"{value} (default {usual})"))
    return rows
