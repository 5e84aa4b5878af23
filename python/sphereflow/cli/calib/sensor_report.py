"""What the verbs print of a sensor's calibration, and its end: text and exit status."""

from __future__ import annotations

from typing import Any

import numpy as np

from sphereflow.cli.console import FAILED, print_json, print_rows, stop


def finish(found: dict[str, Any], next_step: str, *, as_json: bool) -> None:
    """Print what was found; a recording that does not show it ends with status 1."""
    if as_json:
        values = {name: np.asarray(v).tolist() if _many(v) else v for name, v in found.items()}
        print_json(values)
    else:
        print_rows([(name, _text(value)) for name, value in found.items() if value is not None])
    if found["status"] != "ok":
        raise stop(f"{found['status']}: {found['reason']}", next_step, FAILED)


def _many(value: Any) -> bool:
    return isinstance(value, np.ndarray)


def _text(value: Any) -> str:
    if _many(value):
        return " ".join(f"{number:.6g}" for number in np.ravel(value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
