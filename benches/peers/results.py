"""What a run found: one result for each row and column, kept as JSON that later runs can merge."""

from __future__ import annotations

import json
import os
import platform
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

Status = Literal["measured", "not installed", "not in this build", "not applicable", "failed"]

FORMAT = 1
"""Of the JSON file; a file of another format is not merged."""


@dataclass(frozen=True, slots=True)
class Result:
    """One row in one column: ``part`` pairs or tracks, ``data`` says on what, ``mode`` how."""

    part: str
    data: str
    mode: str
    name: str
    ours: bool
    status: Status
    reason: str | None = None
    figures: dict[str, Any] = field(default_factory=dict)
    measured: str = ""

    @property
    def key(self) -> tuple[str, str, str, str]:
        """What makes two results the same measurement."""
        return self.part, self.data, self.mode, self.name


def here_and_now() -> str:
    """Machine, versions and day, in a line."""
    names = [
        line.split(":")[1].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ] or [platform.processor()]
    versions = []
    for package in ("sphereflow", "opencv-python-headless", "opencv-contrib-python", "open3d"):
        try:
            versions.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    day = datetime.now(UTC).strftime("%Y-%m-%d")
    return f"{day}; {names[0]}, {os.cpu_count()} cores; {', '.join(versions)}"


def merged(old: list[Result], new: list[Result]) -> list[Result]:
    """The new results, and the old ones that they do not replace.

    A row that could not run now does not push out one that could then.
    """
    by_key = {result.key: result for result in old}
    for result in new:
        before = by_key.get(result.key)
        worse = result.status == "not installed" and before and before.status == "measured"
        if not worse:
            by_key[result.key] = result
    return list(by_key.values())


def read(path: Path) -> list[Result]:
    """Results of an earlier run."""
    stored = json.loads(path.read_text())
    if stored.get("format") != FORMAT:
        found = stored.get("format")
        raise SystemExit(f"{path}: expected results of format {FORMAT}, found {found}")
    return [Result(**entry) for entry in stored["results"]]


def write(path: Path, results: list[Result]) -> None:
    """Written beside and renamed: whole or not at all."""
    text = json.dumps({"format": FORMAT, "results": [asdict(r) for r in results]}, indent=1)
    beside = path.with_name(path.name + ".part")
    beside.write_text(text + "\n")
    beside.replace(path)
