"""What a run came to, on the terminal, and its exit status."""

from __future__ import annotations

from typing import Any

from sphereflow.cli.console import FAILED, print_json, print_rows, stop
from sphereflow.pipeline import RunResult
from sphereflow.report import BUSY_STAGES


def finish(result: RunResult, min_coverage: float, *, as_json: bool = False) -> None:
    """Print the summary of a run, or its report; exit with status 1 where coverage is too low."""
    report = result.report
    if as_json:
        print_json(report | {"result": str(result.folder)})
    else:
        print_rows(_summary(result))
    if not result.covered:
        outcomes = report["outcomes"]
        lost = [r["first"] for o in outcomes.values() for r in o["reasons"]]
        why = f"; first reason: {lost[0]}" if lost else ""
        raise stop(
            f"coverage {result.coverage:.3f} is below {min_coverage:g}{why}",
            f"look at {result.folder / 'report.json'}, or lower --min-coverage",
            FAILED,
        )


def _summary(result: RunResult) -> list[tuple[str, str]]:
    report = result.report
    outcomes = report["outcomes"]
    counts = ", ".join(f"{o['frames']} {name}" for name, o in outcomes.items() if o["frames"])
    rate = report["frames_per_s"]
    rows = [
        ("input", f"{report['input']['kind']}, {report['frames']} frames"),
        ("frames", counts or "none"),
        ("coverage", f"{100 * result.coverage:.1f} % of the frames have a pose"),
        ("calibration", _calibration(report)),
        ("read-out", f"{1000 * report['readout_s']:g} ms ({report['readout_source']})"),
        ("pose graph", _pose_graph(report)),
        ("world", _world(report)),
        ("path length", f"{report['path_length_m']:.3f} m"),
        ("map", _map(report)),
        ("speed", "unknown" if rate is None else f"{rate:.1f} frames/s ({_stages(report)})"),
    ]
    rows += _errors(report)
    rows += [("warning", text) for text in report["warnings"]["texts"]]
    rows.append(("result", str(result.folder)))
    return rows


def _stages(report: dict[str, Any]) -> str:
    """Seconds of the stages that the speed counts."""
    seconds = report["seconds"]
    names = [name for name in BUSY_STAGES if name in seconds]
    return ", ".join(f"{name} {seconds[name]:.1f} s" for name in names)


def _calibration(report: dict[str, Any]) -> str:
    depth = "depth corrected" if report["depth_corrected"] else "depth as it is"
    return f"{report['calibration']['source']}; {depth}"


def _pose_graph(report: dict[str, Any]) -> str:
    graph = report["pose_graph"]
    if graph is None:
        return f"none: {report['no_pose_graph_because']}"
    texts = [f"{graph['keyframes']} keyframes", f"{graph['edges']} edges"]
    texts += [f"{graph[name]} {name}" for name in ("rejected", "failed") if graph[name]]
    texts.append(f"largest change {1000 * graph['largest_change_m']:.1f} mm")
    return ", ".join(texts)


def _world(report: dict[str, Any]) -> str:
    because = report["world"]["because"]
    return str(report["world"]["frame"]) + (f" ({because})" if because else "")


def _map(report: dict[str, Any]) -> str:
    points = f"{report['map_points']} points"
    return f"{points}, at the final poses"


def _errors(report: dict[str, Any]) -> list[tuple[str, str]]:
    """Errors of the trajectory; those of the odometry too where they are others."""
    corrected = report["pose_graph"] is not None
    return [
        (name, _error(error))
        for name, error in report["truth"].items()
        if corrected or not name.startswith("odometry_")
    ]


def _error(error: Any) -> str:
    if isinstance(error, str):
        return f"none: {error}"
    value, unit = error["statistics"]["rmse"], error["unit"]
    return f"rmse {value:.6f} {unit} over {error['pairs']} ({error['description']})"
