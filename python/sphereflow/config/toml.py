"""Configs as TOML: a reader that says what is wrong, and a writer for what configs hold."""

from __future__ import annotations

import dataclasses
import inspect
import json
import math
import os
import tempfile
import textwrap
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sphereflow.errors import DataError, FileAccessError, MissingFileError

WIDTH = 98
"""Columns of a comment."""


def values_of(text: str) -> dict[str, Any]:
    """The tables of a text."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise DataError(f"expected TOML, found: {error}") from error


def read(path: str | Path) -> dict[str, Any]:
    """The tables of a file."""
    try:
        return values_of(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise MissingFileError(f"{path}: expected a TOML file, found none") from error
    except OSError as error:
        raise FileAccessError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: expected UTF-8 text, found other bytes") from error
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


def write(path: str | Path, text: str) -> None:
    """Write beside the path, then rename."""
    path = Path(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    except OSError as error:
        raise FileAccessError(f"{path}: {error.strerror}") from error
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except OSError as error:
        Path(name).unlink(missing_ok=True)
        raise FileAccessError(f"{path}: {error.strerror}") from error


def text_of(config: Any, *, comments: bool) -> str:
    """A config, its own settings first, then a table for each config in it."""
    lines = list(_table(config, "", comments=comments))
    return "\n".join(lines).strip("\n") + "\n"


def value_text(value: Any) -> str:
    """A value as TOML: floats with the fewest digits that are the same float."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        if math.isfinite(value):
            return repr(value)
        return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, tuple):
        return f"[{', '.join(value_text(item) for item in value)}]"
    return str(value)


def _table(config: Any, path: str, *, comments: bool) -> Iterator[str]:
    meanings = meanings_of(type(config)) if comments else {}
    inner = []
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            inner.append((field.name, value))
            continue
        if comments:
            yield ""
            yield from _comment(meanings.get(field.name, ""))
        if value is not None:
            yield f"{field.name} = {value_text(value)}"
        elif comments:
            yield f"# {field.name} ="
    for name, value in inner:
        yield ""
        if comments:
            yield from _comment(meanings.get(name, ""))
        yield f"[{path}{name}]"
        yield from _table(value, f"{path}{name}.", comments=comments)


def _comment(text: str) -> list[str]:
    return [f"# {line}" for line in textwrap.wrap(text, WIDTH)]


def meanings_of(kind: type[Any]) -> dict[str, str]:
    """What each setting means: the Parameters section of the class's docstring."""
    meanings: dict[str, str] = {}
    _, _, section = (inspect.getdoc(kind) or "").partition("Parameters\n----------\n")
    names: list[str] = []
    for line in section.splitlines():
        if not line.strip():
            break
        if line.startswith(" "):
            for name in names:
                meanings[name] = f"{meanings.get(name, '')} {line.strip()}".strip()
        else:
            names = [name.strip() for name in line.split(",")]
    return meanings
