"""Builds THESIS.md from the tags in the sources: equation, where it is done, what shows it.

python tools/thesis_map.py            write THESIS.md
python tools/thesis_map.py --check    fail where it is stale, or a tag or a test is missing
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from thesis_index import EXISTING
from thesis_tags import EmptyTag, Role, Tag, scan

PAGE = "THESIS.md"
TITLES = {
    "eq.": "Equations",
    "section": "Sections",
    "chapter": "Chapters",
    "appendix": "Appendices",
    "Theorem": "Theorems",
    "Proposition": "Propositions",
    "Lemma": "Lemmas",
    "Remark": "Remarks",
    "Table": "Tables",
    "Figure": "Figures",
}
HEAD = """# Where the thesis is in the code

Made by `python tools/thesis_map.py` from the comments that name what they implement or show.
Equations that are printed wrong are followed in their corrected form; the comment there says so.
"""


def problems(tags: Sequence[Tag], empty: Sequence[EmptyTag]) -> list[str]:
    """What is wrong with the tags: nothing cited, cited what does not exist, shown by no test."""
    found = [f"{tag.path}:{tag.line}: the tag cites nothing: {tag.text!r}" for tag in empty]
    for tag in tags:
        if tag.number not in EXISTING[tag.kind]:
            what = f"{tag.kind} {shown(tag.kind, tag.number)}"
            found.append(f"{tag.path}:{tag.line}: the thesis has no {what}")
    for (kind, number), group in groupby(in_order(tags), key=lambda tag: (tag.kind, tag.number)):
        members = list(group)
        roles = {tag.role for tag in members}
        if kind == "eq." and number in EXISTING[kind] and "code" in roles and "test" not in roles:
            first = next(tag for tag in members if tag.role == "code")
            found.append(
                f"{first.path}:{first.line}: eq. ({number}) is implemented, but no test names it"
            )
    return found


def page(tags: Sequence[Tag]) -> str:
    """The text of THESIS.md."""
    parts = [HEAD]
    for kind, group in groupby(in_order(tags), key=lambda tag: tag.kind):
        parts.append(f"\n## {TITLES[kind]}\n\n")
        parts.append("| thesis | implemented | shown by |\n| --- | --- | --- |\n")
        for number, members in groupby(group, key=lambda tag: tag.number):
            rows = list(members)
            code = places(rows, ("code", "other"))
            parts.append(f"| {shown(kind, number)} | {code} | {places(rows, ('test',))} |\n")
    return "".join(parts)


def places(tags: Sequence[Tag], roles: tuple[Role, ...]) -> str:
    """Files and items, sorted, as the text of a table's cell; no line numbers: they go stale."""
    items: dict[str, set[str]] = {}
    for tag in tags:
        if tag.role in roles:
            items.setdefault(tag.path, set()).add(tag.item)
    cells = []
    for path in sorted(items):
        names = ", ".join(f"`{name}`" for name in sorted(items[path]) if name)
        cells.append(f"[{path}]({path})" + (f" {names}" if names else ""))
    return "<br>".join(cells).replace("|", "\\|") or "-"


def in_order(tags: Sequence[Tag]) -> list[Tag]:
    """By kind, then by number as a reader counts: 2.9 before 2.10, appendices last."""
    kinds = list(EXISTING)
    return sorted(tags, key=lambda tag: (kinds.index(tag.kind), number_key(tag.number), tag))


def number_key(number: str) -> list[tuple[int, int, str]]:
    """Sorting key of ``5.4.1`` or ``A.7``."""
    parts = re.split(r"\.", number)
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in parts]


def shown(kind: str, number: str) -> str:
    """A number as the thesis prints it."""
    return f"({number})" if kind == "eq." else number


def main(arguments: Sequence[str] | None = None) -> int:
    """Write or check the page; returns the exit status."""
    parser = argparse.ArgumentParser(description="Build THESIS.md from the tags in the sources.")
    parser.add_argument("--check", action="store_true", help="change nothing, fail if not true")
    parser.add_argument(
        "--root",
        type=Path,
        default=Path(__file__).resolve().parent.parent,
        help="the source tree (default: the one this tool is in)",
    )
    options = parser.parse_args(arguments)
    tags, empty = scan(options.root)
    found = problems(tags, empty)
    target = options.root / PAGE
    # What does not exist is a problem, not a row.
    text = page([tag for tag in tags if tag.number in EXISTING[tag.kind]])
    if options.check:
        if not target.is_file() or target.read_text(encoding="utf-8") != text:
            found.append(f"{PAGE} is stale: run python tools/thesis_map.py")
    else:
        target.write_text(text, encoding="utf-8")
    for problem in found:
        print(problem, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
