"""The one place where rerun-sdk is imported and its version checked."""

from __future__ import annotations

import importlib
from typing import Any

import sphereflow

OLDEST = (0, 36)
"""First version with the interface used here: the one the extra asks for."""

INSTALL = 'pip install "sphereflow[viz]"'


def rerun() -> Any:
    """The module ``rerun``, new enough."""
    try:
        module = importlib.import_module("rerun")
    except ImportError as error:
        raise sphereflow.MissingExtraError(f"rerun-sdk is not installed: {INSTALL}") from error
    version = str(getattr(module, "__version__", "0.0"))
    major, minor = (int(part) for part in version.split(".")[:2])
    if (major, minor) < OLDEST:
        oldest = ".".join(map(str, OLDEST))
        raise sphereflow.MissingExtraError(
            f"rerun-sdk {version} is too old, {oldest} is needed: {INSTALL}"
        )
    return module


def rrd_reader() -> Any:
    """The class that reads ``.rrd`` files; it moved out of ``experimental`` with rerun 0.40."""
    rerun()
    for name in ("rerun.chunk", "rerun.experimental"):
        try:
            return importlib.import_module(name).RrdReader
        except (ImportError, AttributeError):
            continue
    raise sphereflow.MissingExtraError(
        f"this rerun-sdk cannot read .rrd files back: {INSTALL} --upgrade"
    )
