"""Checks that what docs/errata.md and docs/claims.md name as shown exists: tests and commands.

python tools/thesis_pages.py
"""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from thesis_tags import SKIPPED, source_files

PAGES = ("docs/errata.md", "docs/claims.md")
CODE = re.compile(r"`([^`]+)`")
FUNCTION = re.compile(r"^\s*(?:pub(?:\([^)]*\))?\s+)?(?:async\s+)?(?:fn|def)\s+(\w+)", re.M)
MODULE = re.compile(r"^\s*(?:pub\s+)?mod\s+(\w+)", re.M)
ROW = re.compile(r"^\|\s*(\d+)\s*\|")
NOT_SHOWN = "not shown"
LEAST = {"docs/errata.md": 54, "docs/claims.md": 26}
"""Rows that a page has at least."""


def rows(text: str) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of the numbered rows of all tables of a page."""
    for line in text.splitlines():
        match = ROW.match(line)
        if match:
            yield int(match[1]), [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def problems(root: Path) -> list[str]:
    """What the pages name that is not there, and rows that name nothing."""
    functions, names = known(root)
    found = []
    for page in PAGES:
        listed = list(rows((root / page).read_text(encoding="utf-8")))
        numbers = [number for number, _ in listed]
        if numbers != list(range(1, len(numbers) + 1)):
            found.append(f"{page}: rows are not numbered one after the other")
        if len(listed) < LEAST[page]:
            found.append(f"{page}: {len(listed)} rows, at least {LEAST[page]} expected")
        for number, cells in listed:
            shown = CODE.findall(cells[-1])
            verdict = cells[-2].lower()
            if not shown and not verdict.startswith(NOT_SHOWN):
                found.append(f"{page}, row {number}: names no test and no command")
            for what in shown:
                reason = missing(root, what, functions, names)
                if reason:
                    found.append(f"{page}, row {number}: `{what}`: {reason}")
    return found


def known(root: Path) -> tuple[frozenset[str], frozenset[str]]:
    """Names of all functions; and of functions, modules and files, which filters of tests match."""
    functions: set[str] = set()
    names: set[str] = set()
    for path in source_files(root):
        text = path.read_text(encoding="utf-8")
        functions.update(FUNCTION.findall(text))
        names.update(MODULE.findall(text))
        names.update((path.stem, path.parent.name))
    return frozenset(functions), frozenset(names | functions)


def missing(root: Path, what: str, functions: frozenset[str], names: frozenset[str]) -> str | None:
    """Why a test or a command cannot be run; none where it can."""
    words = [word for word in shlex.split(what) if "=" not in word or word.startswith("-")]
    if len(words) == 1 and re.fullmatch(r"\w+", words[0]):
        return None if words[0] in functions else "no function of this name"
    match words:
        case ["python", "-m", module, *_]:
            path = root / module.replace(".", "/")
            exists = path.is_dir() or path.with_suffix(".py").is_file()
            return None if exists else "no such module"
        case ["python", script, *arguments]:
            return _script(root, script, arguments)
        case ["pytest", *arguments]:
            paths = [word.split("::")[0] for word in arguments if not word.startswith("-")]
            return None if all((root / path).exists() for path in paths) else "no such file"
        case ["cargo", "test", *arguments]:
            return _cargo(root, arguments, names)
        case ["cargo", "bench", *arguments]:
            bench = arguments[arguments.index("--bench") + 1] if "--bench" in arguments else ""
            folder = root / "benches"
            exists = not bench or (folder / f"{bench}.rs").exists() or (folder / bench).is_dir()
            return None if exists else "no such bench"
        case ["cargo", "run", *arguments]:
            example = (
                arguments[arguments.index("--example") + 1] if "--example" in arguments else ""
            )
            return None if example in names else "no such example"
        case ["make", target, *_]:
            text = (root / "Makefile").read_text(encoding="utf-8")
            return None if re.search(rf"^{re.escape(target)}:", text, re.M) else "no such target"
        case ["sphereflow", *_]:
            return None
    return "neither a test nor a known kind of command"


def _script(root: Path, script: str, arguments: Sequence[str]) -> str | None:
    if not (root / script).is_file():
        return "no such script"
    if script.endswith("run_all.py"):
        folder = (root / script).parent
        absent = [
            a for a in arguments if not a.startswith("-") and not (folder / f"{a}.py").exists()
        ]
        return f"no such experiment: {absent}" if absent else None
    return None


def _cargo(root: Path, arguments: Sequence[str], names: frozenset[str]) -> str | None:
    """The package, the test binary and the filter, wherever the crates have moved to."""
    before = list(arguments[: arguments.index("--")] if "--" in arguments else arguments)
    plain = []
    while before:
        word = before.pop(0)
        if word in ("-p", "--test"):
            value = before.pop(0)
            if word == "-p":
                manifests = (p for p in root.glob("*/*/Cargo.toml") if p.parent.name not in SKIPPED)
                if not any(f'name = "{value}"' in p.read_text(encoding="utf-8") for p in manifests):
                    return f"no such package: {value}"
            elif value not in names:
                return f"no such test binary: {value}"
        elif not word.startswith("-"):
            plain.append(word)
    absent = [word for word in plain if not any(word.split("::")[-1] in name for name in names)]
    return f"no test matches {absent}" if absent else None


def main() -> int:
    """Print what is wrong; returns the exit status."""
    found = problems(Path(__file__).resolve().parent.parent)
    for problem in found:
        print(problem, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
