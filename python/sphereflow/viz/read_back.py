"""Reads an ``.rrd`` file back and says what is in it: proof that it opens."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import sphereflow
from sphereflow.viz.sdk import rrd_reader


def rows_by_entity(path: str | Path) -> dict[str, int]:
    """Rows of every entity of the first recording in the file, sorted by entity.

    Raises
    ------
    sphereflow.DataError
        Where the file is missing or is no rerun recording.
    """
    path = Path(path)
    if not path.is_file():
        raise sphereflow.DataError(f"{path}: no such file")
    rows: Counter[str] = Counter()
    reader = rrd_reader()
    try:
        for chunk in reader(path).stream().to_chunks():
            rows[str(chunk.entity_path)] += int(chunk.num_rows)
    except (OSError, ValueError, RuntimeError) as error:
        raise sphereflow.DataError(f"{path}: not a readable rerun recording ({error})") from error
    return dict(sorted(rows.items()))
