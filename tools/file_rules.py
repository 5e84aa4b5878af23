"""Rules of the Rust and Python sources that no other tool holds: lengths, widths, first lines.

A Rust file opens with one `//!` line that says its concept, a Python file with a docstring; no file
is longer than 400 lines, no comment wider than 120 characters.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

MAX_LINES = 400
"""A longer file holds more than one concept. Larger: fewer files, each harder to read."""

MAX_WIDTH = 120
"""Characters of a line with a comment; new ones end before column 100."""

FOLDERS = ("crates", "benches", "tests", "tools", "examples", "python", "fuzz")
SKIPPED = frozenset({"target", "__pycache__", ".venv", "out"})

LONG: dict[str, str] = {
    "tests/errata/test_errata_part_3.py": "one short test a row of docs/errata.md",
    "tests/test_depth_bad_input.py": "one table of wrong calls; to be split by callable",
}
"""Files that may be longer, with the reason."""


def sources(root: Path) -> Iterator[Path]:
    """All Rust and Python sources, sorted."""
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            parts = path.relative_to(root).parts
            if path.suffix in (".rs", ".py") and not SKIPPED.intersection(parts):
                yield path


def problems(root: Path) -> Iterator[str]:
    """What is wrong, as `file:line: what`."""
    known = set()
    for path in sources(root):
        name = path.relative_to(root).as_posix()
        known.add(name)
        lines = path.read_text(encoding="utf-8").splitlines()
        if len(lines) > MAX_LINES and name not in LONG:
            yield f"{name}:{len(lines)}: longer than {MAX_LINES} lines"
        yield from _line_problems(name, lines, "//" if path.suffix == ".rs" else "#")
        first = lines[0] if lines else ""
        opened = (
            first.startswith("//! ") if path.suffix == ".rs" else first.startswith(('"""', "#!"))
        )
        if lines and not opened:
            yield f"{name}:1: does not open with a line that says the file's concept"
    for name in LONG.keys() - known:
        yield f"{name}:1: in the list of long files, but not there"


def _line_problems(name: str, lines: list[str], mark: str) -> Iterator[str]:
    for number, line in enumerate(lines, 1):
        if len(line) > MAX_WIDTH and line.lstrip().startswith(mark) and "http" not in line:
            yield f"{name}:{number}: a comment of {len(line)} characters, more than {MAX_WIDTH}"


def main(arguments: list[str] | None = None) -> int:
    """Print what is wrong; 1 where something is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=Path, default=Path(__file__).parents[1])
    found = list(problems(parser.parse_args(arguments).root))
    print("\n".join(found), file=sys.stderr, end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
