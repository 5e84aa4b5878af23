"""The command: which rows on which data, and where the tables go."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import sphereflow as sf

from benches.peers import pairs, recordings, report, results
from benches.peers.results import Result, Status
from benches.peers.table import ROWS, Row
from benches.peers.worker import run_in_process

EPILOG = """\
examples, from the root of the repository:
  pip install '.[peers]'                                   Open3D, OpenCV; rows without say so
  python -m benches.peers --pairs 100                      simulated pairs only
  SPHEREFLOW_DATA=... python -m benches.peers --pairs 0 --recordings tum-fr1-rpy-a
  python -m benches.peers --pairs 100 --only ours --merge out/peers/peers.json
                                                           ours anew, the peers' rows as they were
  python -m benches.peers --list                           the rows

Writes peers.md and peers.json into --out. Each row is a process of its own with one thread.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the comparison; 0 where every row that could run did."""
    options = _parser().parse_args(arguments)
    rows = [row for row in ROWS if _chosen(row, options.only)]
    if options.list:
        print("\n".join(row.name for row in rows))
        return 0
    if not rows:
        print(f"--only {' '.join(options.only)} names no row; see --list", file=sys.stderr)
        return 2
    folders = _folders(options.recordings)
    old: list[Result] = []
    for path in options.merge:
        old = results.merged(old, results.read(path))
    options.out.mkdir(parents=True, exist_ok=True)
    found: list[Result] = []
    for result in _measured(rows, folders, options):
        found.append(result)
        print(_line(result), flush=True)
        _keep(results.merged(old, found), options.out)
    if not old and not found:
        print("nothing to do: see --help", file=sys.stderr)
        return 2
    print(_keep(results.merged(old, found), options.out))
    return 1 if any(result.status == "failed" for result in found) else 0


def _keep(found: list[Result], folder: Path) -> str:
    """Writes the results in the order of the table of rows; returns the text."""
    order = {row.name: number for number, row in enumerate(ROWS)}
    found = sorted(found, key=lambda result: order.get(result.name, len(order)))
    text = report.markdown(found)
    results.write(folder / "peers.json", found)
    (folder / "peers.md").write_text(text)
    return text


def measure(row: Row, part: str, data: str, mode: str, **arguments: Any) -> Result:
    """One result: in a process of its own, or why not."""
    state = _state(row)
    if state is None:
        figures = run_in_process(row, part, arguments.pop("job"), arguments.pop("budget_s"))
        if "refused" in figures:
            state = ("not applicable", figures["refused"])
        elif "failed" in figures:
            state = ("failed", figures["failed"])
        else:
            here = results.here_and_now()
            return Result(part, data, mode, row.name, row.is_ours, "measured", None, figures, here)
    status, reason = state
    return Result(part, data, mode, row.name, row.is_ours, status, reason)


def _state(row: Row) -> tuple[Status, str] | None:
    """Why a row cannot run here; None where it can."""
    if row.needs is not None:
        absent = row.needs.absent()
        return None if absent is None else ("not installed", absent)
    try:
        row.made_for(sf.Camera.pinhole(525.0, 525.0, 319.5, 239.5, 640, 480))
    except (TypeError, sf.ValueRangeError) as error:
        return "not in this build", str(error).splitlines()[0]
    return None


def _measured(
    rows: list[Row], folders: list[Path], options: argparse.Namespace
) -> Iterator[Result]:
    budget_s = options.budget
    with tempfile.TemporaryDirectory(prefix="peers-") as scratch:
        for noise in options.noise if options.pairs else ():
            print(f"drawing {options.pairs} pairs with {noise} noise ...", flush=True)
            pairs.draw(Path(scratch), noise, options.pairs, options.tour)
            for gap in pairs.GAPS:
                for row in rows:
                    if not row.pairs:
                        continue
                    job = {"folder": scratch, "noise": noise, "gap": gap}
                    data = pairs.cell_name(noise, gap)
                    yield measure(row, "pairs", data, "pair", job=job, budget_s=budget_s)
    for folder in folders:
        for row in rows:
            for mode in row.tracks:
                job = {"path": str(folder), "mode": mode, "max_frames": options.max_frames}
                yield measure(row, "tracks", folder.name, mode, job=job, budget_s=budget_s)


def _chosen(row: Row, only: list[str]) -> bool:
    if not only:
        return True
    kind = "ours" if row.is_ours else "peers"
    return any(word == kind or word.lower() in row.name.lower() for word in only)


def _folders(names: list[str] | None) -> list[Path]:
    root = os.environ.get("SPHEREFLOW_DATA")
    if names is None:
        names = [n for n in recordings.NAMES if root and (Path(root) / n).is_dir()]
        if not root:
            print("recordings are left out: SPHEREFLOW_DATA names no folder", file=sys.stderr)
    folders = [Path(name) if root is None else Path(root) / name for name in names]
    for folder in folders:
        if not folder.is_dir():
            raise SystemExit(f"--recordings: {folder} is no folder (SPHEREFLOW_DATA={root})")
    return folders


def _line(result: Result) -> str:
    shown = {
        name: round(value, 4) if isinstance(value, float) else value
        for name, value in result.figures.items()
        if name not in ("reasons", "asked")
    }
    return f"{result.data}, {result.name}, {result.mode}: {result.reason or shown}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benches.peers",
        description=__doc__ + " Other people's odometry and ours, on the same frames in one run.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--pairs", type=int, default=100, metavar="N", help="simulated pairs (100; 0: none)")
    add(
        "--noise", nargs="+", choices=pairs.NOISES, default=pairs.NOISES, help="of the pairs (both)"
    )
    add("--tour", type=float, default=pairs.TOUR_S, metavar="S", help="the pairs' tour (25 s)")
    add(
        "--recordings",
        nargs="*",
        metavar="NAME",
        help=f"folders in SPHEREFLOW_DATA ({', '.join(recordings.NAMES)}; without a name: none)",
    )
    add(
        "--only", nargs="+", default=[], metavar="WORD", help="ours, peers, or part of a row's name"
    )
    add(
        "--merge",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE.json",
        help="keep the results of earlier runs where this one has none",
    )
    add("--out", type=Path, default=Path("out/peers"), metavar="FOLDER", help="(out/peers)")
    add("--budget", type=float, default=300.0, metavar="S", help="seconds for each row (300)")
    add("--max-frames", type=int, metavar="N", help="of each recording (all)")
    add("--list", action="store_true", help="print the rows and stop")
    return parser
