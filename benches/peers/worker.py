"""One row in a process of its own, on one thread: `python -m benches.peers.worker JOB.json`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
ONE_THREAD = (
    "OMP_NUM_THREADS",
    "RAYON_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "TBB_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""Read by the libraries when they are imported, hence a process for each row."""

GRACE_S = 300.0
"""For what the budget does not count: loading frames, one last slow call."""

MARK = "@@figures "


def run_in_process(
    row: Any, part: str, arguments: dict[str, Any], budget_s: float
) -> dict[str, Any]:
    """Runs a row in another process; returns its figures, or ``failed`` with the reason."""
    row_fields = asdict(row)
    job = {"row": row_fields, "part": part, "arguments": {**arguments, "budget_s": budget_s}}
    environment = {**os.environ, **dict.fromkeys(ONE_THREAD, "1")}
    environment["PYTHONPATH"] = os.pathsep.join(
        [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    )
    command = [sys.executable, "-m", "benches.peers.worker", json.dumps(job)]
    try:
        done = subprocess.run(
            command,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=2.0 * budget_s + GRACE_S,
        )
    except subprocess.TimeoutExpired:
        return {"failed": f"did not end within twice its budget of {budget_s:g} s"}
    for line in done.stdout.splitlines():
        if line.startswith(MARK):
            figures: dict[str, Any] = json.loads(line[len(MARK) :])
            return figures
    last = (done.stderr.strip().splitlines() or ["no message"])[-1]
    return {"failed": f"ended with {done.returncode}: {last}"}


def main(text: str) -> None:
    """Runs the job, prints its figures."""
    from benches.peers import pairs, recordings
    from benches.peers.table import Package, Row

    job = json.loads(text)
    fields = job["row"]
    needs = fields.pop("needs")
    row = Row(**fields, needs=Package(**needs) if needs else None)
    arguments = job["arguments"]
    if job["part"] == "pairs":
        figures = pairs.measure(row, **{**arguments, "folder": Path(arguments["folder"])})
    else:
        figures = recordings.measure(row, **{**arguments, "path": Path(arguments["path"])})
    print(MARK + json.dumps(figures))


if __name__ == "__main__":
    main(sys.argv[1])
