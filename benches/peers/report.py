"""The tables: Markdown from results."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from benches.peers.results import Result

NOTES = """\
One thread each. `ms` is the processor's time of a pair or a frame, median, all threads of the
process counted, what the method builds of a single frame included. Pairs: medians and, in
brackets, 90th percentiles of the velocity errors over all pairs; a lost pair counts as infinitely
wrong. Recordings: rms after SE(3) alignment, rms over 1 s, all frames, predicted ones included.
`frame`: each frame against the one before; `keyframe`: against a keyframe changed by one rule for
all (overlap 70 %, median flow 120 pixels), from a constant-velocity guess where the method takes
one (OpenCV's takes none), and against the frame before where that surprises; `own`: by our
odometry. Distorted recordings are undistorted for the peers, ours take them as they are.
"""


def markdown(results: list[Result]) -> str:
    """All tables, with notes and reasons."""
    parts: list[str] = []
    for data in _in_order(r.data.split(",")[0] for r in results if r.part == "pairs"):
        parts += [f"## Simulated pairs, {data} noise", "", *_pairs_table(results, data), ""]
    for data in _in_order(r.data for r in results if r.part == "tracks"):
        parts += [f"## {data}", "", *_tracks_table(results, data), ""]
    parts += [NOTES, *_remarks(results)]
    return "\n".join(parts)


def _in_order(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(cells) + " |" for cells in lines]


def _pairs_table(results: list[Result], noise: str) -> list[str]:
    chosen = [r for r in results if r.part == "pairs" and r.data.split(",")[0] == noise]
    columns = _in_order(r.data for r in chosen)
    head = ["method"]
    for column in columns:
        gap = column.split(", ")[1]
        head += [f"{gap}: ev m/s", "ew rad/s", "pairs", "lost", "ms"]
    rows = []
    for name in _in_order(r.name for r in chosen):
        cells = [name]
        for column in columns:
            found = [r for r in chosen if r.name == name and r.data == column]
            cells += _pair_cells(found[0]) if found else [""] * 5
        rows.append(cells)
    return _table(head, rows)


def _pair_cells(result: Result) -> list[str]:
    figures = result.figures
    if result.status != "measured":
        return [result.status, "", "", "", ""]
    return [
        f"{_number(figures, 'ev_m_s')} ({_number(figures, 'ev_m_s_p90')})",
        f"{_number(figures, 'ew_rad_s')} ({_number(figures, 'ew_rad_s_p90')})",
        _covered(figures),
        str(figures.get("lost", 0)),
        _milliseconds(figures),
    ]


def _tracks_table(results: list[Result], data: str) -> list[str]:
    head = ["method", "mode", "frames", "lost", "ATE m", "RPE 1 s m", "RPE 1 s rad", "ms"]
    rows = []
    for result in results:
        if result.part != "tracks" or result.data != data:
            continue
        figures = result.figures
        if result.status != "measured":
            rows.append([result.name, result.mode, result.status, *[""] * 5])
            continue
        rows.append(
            [
                result.name,
                result.mode,
                _covered(figures),
                str(figures["lost"]),
                _number(figures, "ate_m"),
                _number(figures, "rpe_1s_m"),
                _number(figures, "rpe_1s_rad"),
                _milliseconds(figures),
            ]
        )
    return _table(head, rows)


def _number(figures: dict[str, Any], name: str) -> str:
    value = figures.get(name)
    return "-" if value is None else f"{value:.4f}"


def _milliseconds(figures: dict[str, Any]) -> str:
    value = figures.get("cpu_ms")
    return "-" if value is None else f"{value:.1f}" if value < 100 else f"{value:.0f}"


def _covered(figures: dict[str, Any]) -> str:
    covered, asked = figures.get("covered", 0), figures.get("asked", 0)
    return str(covered) if covered == asked else f"{covered} of {asked} (budget)"


def _remarks(results: list[Result]) -> list[str]:
    lines = []
    for status in ("not installed", "not in this build", "not applicable", "failed"):
        for reason in _in_order(r.reason or "" for r in results if r.status == status):
            names = _in_order(
                r.name for r in results if r.status == status and (r.reason or "") == reason
            )
            lines.append(f"- {status}: {', '.join(names)}: {reason}")
    runs = _in_order(r.measured for r in results if r.status == "measured")
    lines += [f"- measured {run}" for run in runs]
    return lines
