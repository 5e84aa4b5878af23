"""Builds THESIS.md from the tags in the sources: equation, where it is done, what shows it.

python tools/thesis_map.py            write THESIS.md
python tools/thesis_map.py --check    fail where it is stale, or a tag, test or equation is missing

A page is stale where a file, an item or a number changed; lines that moved alone do not count.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from thesis_index import EXISTING
from thesis_tags import EmptyTag, Role, Tag, scan

Without = Sequence[tuple[str, list[str]]]

PAGE = "THESIS.md"
WITHOUT = "tools/thesis_without.toml"
LINE = re.compile(r"#L\d+")
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
Equations that are printed wrong are followed in their corrected form
([docs/errata.md](docs/errata.md)). What it claims in numbers, and what was measured here, is in
[docs/claims.md](docs/claims.md).
"By test only" means that no line of the product does it, and that a test holds it.
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


def page(tags: Sequence[Tag], without: Without = ()) -> str:
    """The text of THESIS.md."""
    parts = [HEAD]
    for kind, group in groupby(in_order(tags), key=lambda tag: tag.kind):
        parts.append(f"\n## {TITLES[kind]}\n\n")
        parts.append("| thesis | implemented | shown by |\n| --- | --- | --- |\n")
        for number, members in groupby(group, key=lambda tag: tag.number):
            rows = list(members)
            code = places(rows, ("code",)) or places(rows, ("other",))
            test = places(rows, ("test",))
            parts.append(f"| {shown(kind, number)} | {code or 'by test only'} | {test or '-'} |\n")
    if without:
        parts.append("\n## Equations without a row\n\n| thesis | why |\n| --- | --- |\n")
        for reason, group in without:
            parts.append(f"| {', '.join(shown('eq.', n) for n in group)} | {reason} |\n")
    return "".join(parts)


def read_without(root: Path) -> list[tuple[str, list[str]]]:
    """Reasons, and the equations that have no tag for each of them."""
    path = root / WITHOUT
    if not path.is_file():
        return []
    groups = tomllib.loads(path.read_text(encoding="utf-8")).values()
    return [(group["reason"], list(group["equations"])) for group in groups]


def accounted(tags: Sequence[Tag], without: Without) -> tuple[int, list[str]]:
    """How many equations have a row or a reason, and what is wrong with the rest."""
    tagged = {tag.number for tag in tags if tag.kind == "eq."}
    listed = [number for _, group in without for number in group]
    found = [
        f"{WITHOUT}: eq. ({number}) {why}"
        for number in listed
        for why, wrong in (
            ("is no equation of the thesis", number not in EXISTING["eq."]),
            ("has a tag: take it off the list", number in tagged),
            ("is listed twice", listed.count(number) > 1),
        )
        if wrong
    ]
    missing = EXISTING["eq."] - tagged - set(listed)
    found += [
        f"{WITHOUT}: eq. ({number}) has neither a tag nor a reason"
        for number in sorted(missing, key=number_key)
    ]
    return len(EXISTING["eq."]) - len(missing), found


def places(tags: Sequence[Tag], roles: tuple[Role, ...]) -> str:
    """Files and items with their lines, sorted, as the text of a table's cell; empty where none."""
    items: dict[str, dict[str, int]] = {}
    for tag in tags:
        if tag.role in roles:
            lines = items.setdefault(tag.path, {})
            lines[tag.item] = min(tag.line, lines.get(tag.item, tag.line))
    cells = []
    for path in sorted(items):
        names = items[path]
        cell = f"[{path}]({path}#L{min(names.values())})"
        linked = ", ".join(f"[`{name}`]({path}#L{names[name]})" for name in sorted(names) if name)
        cells.append(cell + (f" {linked}" if linked else ""))
    return "<br>".join(cells).replace("|", "\\|")


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
    without = read_without(options.root)
    if without:  # a small tree may do without
        count, unaccounted = accounted(tags, without)
        found += unaccounted
        print(f"{count} of {len(EXISTING['eq.'])} equations accounted for")
    # What does not exist is a problem, not a row.
    text = page([tag for tag in tags if tag.number in EXISTING[tag.kind]], without)
    if options.check:
        written = target.read_text(encoding="utf-8") if target.is_file() else ""
        if LINE.sub("", written) != LINE.sub("", text):
            found.append(f"{PAGE} is stale: run python tools/thesis_map.py")
    else:
        target.write_text(text, encoding="utf-8")
    for problem in found:
        print(problem, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
