"""Finds the tags in the sources: what they cite, and the item of the code they stand at."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Role = Literal["code", "test", "other"]

FOLDERS = ("crates", "python", "tests", "benches", "examples")
SUFFIXES = (".rs", ".py")
SKIPPED = frozenset({"target", "__pycache__", ".venv"})

# Anywhere in a Rust comment; in Python anywhere: comments and docstrings.
TAG = re.compile(r"\bThesis:\s*(?P<text>.*?)(?=\bThesis:|$)")
RUST_COMMENT = re.compile(r"//.*$")
# A tag that breaks off here goes on in the next line of the comment.
BROKEN_OFF = re.compile(
    r"(?:,|\b(?:and|or|to|eqs?\.|[Ee]quations?|[Ss]ections?|[Cc]hapters?|[Aa]ppendix"
    r"|Theorems?|Propositions?|Remarks?|Tables?|Figures?|Figs?\.))\s*$"
)
CONTINUED = re.compile(r"^\s*(?://[/!]?|#)?\s*(?P<text>[^/#\s].*)$")
SEPARATOR = r"\s*(?:,\s*and|,|and|or|to|-|–)\s*"
DOTTED = r"(?:\d+|[A-Z])(?:\.\d+)+"
WHOLE = r"\d+\b(?!\.\d)"
# How each kind is written, and its numbers: equations always in brackets.
KINDS = {
    "eq.": (r"[Ee]qs?\.|[Ee]quations?", rf"\({DOTTED}\)"),
    "section": (r"(?:[Ss]ub)?[Ss]ections?", DOTTED),
    "chapter": (r"[Cc]hapters?", WHOLE),
    "appendix": (r"[Aa]ppendix", r"[A-Z]\b(?!\.)"),
    "Theorem": (r"Theorems?", WHOLE),
    "Proposition": (r"Propositions?", WHOLE),
    "Lemma": (r"Lemmas?", WHOLE),
    "Remark": (r"Remarks?", WHOLE),
    "Table": (r"Tables?", DOTTED),
    "Figure": (r"Figures?|Figs?\.", DOTTED),
}
CITATION = re.compile(
    "|".join(
        rf"\b(?:{words})\s*(?P<k{index}>{number}(?:{SEPARATOR}{number})*)"
        for index, (words, number) in enumerate(KINDS.values())
    )
)
ANY_NUMBER = r"\(?(?:\d+|[A-Z])(?:\.\d+)*\)?"
RANGE = re.compile(rf"({ANY_NUMBER})\s*(?:to|-|–)\s*({ANY_NUMBER})")

RUST_ITEM = re.compile(
    r"^\s*(?:pub(?:\([^)]*\))?\s+)?(?:const\s+|async\s+|unsafe\s+)*"
    r"(?:fn|struct|enum|trait|type|mod|static|const|union|macro_rules!)\s+(?P<name>\w+)"
    r"|^\s*impl(?:<[^>]*>)?\s+(?P<impl>[^{]+?)\s*(?:where.*)?\{"
)
PYTHON_ITEM = re.compile(r"^\s*(?:async\s+)?(?:def|class)\s+(?P<name>\w+)")
RUST_SKIP = re.compile(r"^\s*(?://|#!?\[|$|\)\]|\])")
PYTHON_SKIP = re.compile(r"^\s*(?:#|@|$)")
TEST_FILE = re.compile(r"(?:\w+_)?tests?\.rs|test_\w+\.py|conftest\.py")
TEST_MODULE = re.compile(r"^\s*#\[cfg\((?:all\()?test\b")


@dataclass(frozen=True, order=True, slots=True)
class Tag:
    """One citation at one place; ``item`` is a function, a type, or empty for the whole file."""

    kind: str
    number: str
    role: Role
    path: str
    item: str
    line: int


@dataclass(frozen=True, order=True, slots=True)
class EmptyTag:
    """A tag in which nothing that the thesis could have is cited."""

    path: str
    line: int
    text: str


def scan(root: Path) -> tuple[list[Tag], list[EmptyTag]]:
    """All tags under ``root``, sorted."""
    tags: set[Tag] = set()
    empty: list[EmptyTag] = []
    for path in source_files(root):
        for found in tags_of_file(path, path.relative_to(root).as_posix()):
            if isinstance(found, Tag):
                tags.add(found)
            else:
                empty.append(found)
    return sorted(tags), sorted(empty)


def source_files(root: Path) -> list[Path]:
    """The Rust and Python files that may have tags, sorted."""
    files = [
        path
        for folder in FOLDERS
        for path in (root / folder).rglob("*")
        if path.suffix in SUFFIXES and not SKIPPED.intersection(path.relative_to(root).parts)
    ]
    return sorted(files)


def tags_of_file(path: Path, name: str) -> Iterator[Tag | EmptyTag]:
    """Tags of one file, whose name in the tree is ``name``."""
    lines = path.read_text(encoding="utf-8").splitlines()
    rust = path.suffix == ".rs"
    for index in range(len(lines)):
        for text in texts(lines, index, rust=rust):
            cited = list(citations(text))
            if not cited:
                yield EmptyTag(name, index + 1, text)
            item = item_at(lines, index, rust=rust)
            role = role_of(name, lines, index, rust=rust)
            for kind, number in cited:
                yield Tag(kind, number, role, name, item, index + 1)


def texts(lines: list[str], index: int, *, rust: bool) -> Iterator[str]:
    """What each tag of one line says, with the next line where it breaks off."""
    line = lines[index]
    if rust:
        comment = RUST_COMMENT.search(line)
        line = comment[0] if comment else ""
    for match in TAG.finditer(line):
        text = match["text"]
        if match.end() == len(line) and BROKEN_OFF.search(text) and index + 1 < len(lines):
            below = CONTINUED.match(lines[index + 1])
            text += f" {below['text']}" if below else ""
        yield text


def citations(text: str) -> Iterator[tuple[str, str]]:
    """Kind and number of everything cited: ``eq. (3.7), (3.8) and section 5.4.1``."""
    for match in CITATION.finditer(text):
        for index, kind in enumerate(KINDS):
            numbers = match[f"k{index}"]
            if numbers is not None:
                for number in _expanded(numbers):
                    yield kind, number


def _expanded(numbers: str) -> list[str]:
    """Single numbers of a list in which ranges, ``(7.1) to (7.4)``, stand for all between."""
    found = [number.strip("()") for number in re.findall(ANY_NUMBER, numbers)]
    for first, last in RANGE.findall(numbers):
        head, _, low = first.strip("()").rpartition(".")
        other, _, high = last.strip("()").rpartition(".")
        if head == other and low.isdigit() and high.isdigit():
            prefix = f"{head}." if head else ""
            found += [f"{prefix}{n}" for n in range(int(low) + 1, int(high))]
    return found


def item_at(lines: list[str], index: int, *, rust: bool) -> str:
    """Name of the item that the comment at ``index`` belongs to.

    The item right below it where it documents one, else the one whose body it is in.
    """
    if rust and lines[index].lstrip().startswith("//!"):
        return ""
    pattern, skip = (RUST_ITEM, RUST_SKIP) if rust else (PYTHON_ITEM, PYTHON_SKIP)
    below = next((line for line in lines[index:] if not skip.match(line)), "")
    documented = pattern.match(below)
    if documented:
        return _name(documented)
    indent = _indent(lines[index])
    for line in reversed(lines[:index]):
        enclosing = pattern.match(line)
        if enclosing and _indent(line) < indent:
            return _name(enclosing)
    return ""


def role_of(name: str, lines: list[str], index: int, *, rust: bool) -> Role:
    """Whether a line is part of a test, of the code, or of a bench or an example."""
    parts = name.split("/")
    file = parts[-1]
    if "tests" in parts or TEST_FILE.fullmatch(file):
        return "test"
    if rust and any(_opens_tests(lines, above) for above in range(index)):
        return "test"
    return "other" if parts[0] in ("benches", "examples") or "benches" in parts else "code"


def _opens_tests(lines: list[str], index: int) -> bool:
    """Whether ``#[cfg(test)]`` here is that of a module with a body: tests are last in a file."""
    if not TEST_MODULE.match(lines[index]):
        return False
    below = next((line for line in lines[index + 1 :] if not RUST_SKIP.match(line)), "")
    return bool(re.match(r"\s*(?:pub\s+)?mod\s+\w+\s*\{", below))


def _name(match: re.Match[str]) -> str:
    groups = match.groupdict()
    return " ".join((groups["name"] or groups.get("impl") or "").split())


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())
