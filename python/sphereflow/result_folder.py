"""A folder of results that is there whole or not at all: written beside, then renamed."""

from __future__ import annotations

import ctypes
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
        self._overwrite = overwrite
        self._protect = protect
        self.check()
        self.path = self.out

    def check(self) -> None:
        """Raise where ``out`` holds something that must not be replaced.

        Asked at the beginning, before any work, and again at the end: another run may have filled
        the folder meanwhile.
        """
        _check(self.out, self._overwrite, self._protect)

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
        """Rename to ``out``, or remove everything where something went wrong.

        Where ``out`` was filled meanwhile and may not be replaced, the work is not thrown away: it
        stays in the temporary folder, which the error names.
        """
        if kind is not None:
            shutil.rmtree(self.path, ignore_errors=True)
            return
        try:
            self._publish()
        except (OSError, sphereflow.SphereflowError) as failure:
            raise sphereflow.DataError(
                f"{failure}; the finished result is in {self.path}"
            ) from failure

    def inside(self, path: str | Path) -> Path:
        """Where to write ``path`` now: in the temporary folder if it is to be inside ``out``."""
        absolute = Path(os.path.abspath(path))
        if absolute.is_relative_to(self.out):
            absolute = self.path / absolute.relative_to(self.out)
        absolute.parent.mkdir(parents=True, exist_ok=True)
        return absolute

    def _publish(self) -> None:
        self.check()
        try:
            # A rename replaces an empty folder, and fails on one that is not: no other run's result
            # is lost between the check and this.
            self.path.rename(self.out)
            return
        except OSError:
            if not (self._overwrite and self.out.is_dir()):
                raise
        if _exchange(self.path, self.out):
            shutil.rmtree(self.path, ignore_errors=True)
            return
        before = Path(f"{self.path}.before")
        self.out.rename(before)
        try:
            self.path.rename(self.out)
        except OSError:
            before.rename(self.out)
            raise
        shutil.rmtree(before)


AT_FDCWD, RENAME_EXCHANGE = -100, 2
"""Arguments of Linux's renameat2: relative to the working folder; both names change places."""


def _exchange(first: Path, second: Path) -> bool:
    """Give two folders each other's name in one step; False where the system cannot.

    One step, so that a process that is killed never leaves nothing under the name.
    """
    try:
        renameat2 = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return False
    names = os.fsencode(first), os.fsencode(second)
    return bool(renameat2(AT_FDCWD, names[0], AT_FDCWD, names[1], RENAME_EXCHANGE) == 0)


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
