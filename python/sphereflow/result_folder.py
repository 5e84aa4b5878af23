"""A folder of results that is there whole or not at all: written beside, then renamed."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from types import TracebackType

import sphereflow

REPORT = "report.json"


class ResultFolder:
    """``with ResultFolder(out) as folder``: write into ``folder.path``, it becomes ``out``.

    Parameters
    ----------
    out
        The folder to be. A folder that is there and not empty is refused.
    overwrite
        Replace an earlier result. Only a folder with a ``report.json`` is replaced, so that a
        mistyped name cannot delete anything else.
    protect
        A path that must not be inside ``out``: the input.
    """

    def __init__(  # noqa: D107
        self, out: str | Path, *, overwrite: bool = False, protect: Path | None = None
    ) -> None:
        self.out = Path(os.path.abspath(out))
        _check(self.out, overwrite, protect)
        self.path = self.out

    def __enter__(self) -> ResultFolder:
        """Make the temporary folder beside ``out``."""
        self.out.parent.mkdir(parents=True, exist_ok=True)
        made = tempfile.mkdtemp(prefix=f".{self.out.name}.partial-", dir=self.out.parent)
        self.path = Path(made)
        # mkdtemp makes it private; a result is as readable as any other new folder.
        mask = os.umask(0)
        os.umask(mask)
        self.path.chmod(0o777 & ~mask)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Rename to ``out``, or remove everything where something went wrong."""
        try:
            if kind is None:
                self._publish()
        finally:
            shutil.rmtree(self.path, ignore_errors=True)

    def inside(self, path: str | Path) -> Path:
        """Where to write ``path`` now: in the temporary folder if it is to be inside ``out``."""
        absolute = Path(os.path.abspath(path))
        if absolute.is_relative_to(self.out):
            absolute = self.path / absolute.relative_to(self.out)
        absolute.parent.mkdir(parents=True, exist_ok=True)
        return absolute

    def _publish(self) -> None:
        if not self.out.exists():
            self.path.rename(self.out)
            return
        before = Path(f"{self.path}.before")
        self.out.rename(before)
        try:
            self.path.rename(self.out)
        except OSError:
            before.rename(self.out)
            raise
        shutil.rmtree(before)


def _check(out: Path, overwrite: bool, protect: Path | None) -> None:
    if protect is not None and Path(os.path.abspath(protect)).is_relative_to(out):
        raise sphereflow.ValueRangeError(f"out: {out} holds the input {protect}; choose another")
    if not out.exists():
        return
    if not out.is_dir():
        raise sphereflow.DataError(f"out: {out} is a file, a folder is needed")
    if not any(out.iterdir()):
        return
    if not overwrite:
        raise sphereflow.DataError(
            f"out: {out} is not empty; choose another folder, or overwrite the result in it"
        )
    if not (out / REPORT).is_file():
        raise sphereflow.DataError(
            f"out: {out} has no {REPORT}, so it is no result of an earlier run; not overwritten"
        )
