"""Thesis: Figure 4.3, 4.4, 4.5, 4.6, 4.7, 4.8, 4.9, 4.10, 4.11, 4.12, 4.13, 4.14, 4.15, 4.16.

Error against time of the thesis's observers and variational methods and of the depth filter, for
noise of 0, 1 and 10 grey levels, overview and zoom, over the thesis's 4 s. With `--full` at its
640x480 pixels too, which takes about half an hour of two cores; else at 160x120, in two minutes.
"""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import sphereflow as sf
from drawing import save
from sequence_411 import RATE_HZ, Frame, camera, error_percent, frames, smoothed

DURATION_S = 4.0
DT_S = 1 / RATE_HZ

# Below this the baseline between two frames is so short that every method's error rises.
SLOW_M_S = 0.2

Curve = list[float]


def motion(first: Frame, second: Frame) -> dict[str, np.ndarray | float]:
    """Velocities at the middle of two frames."""
    return {
        "v_m_s": 0.5 * (first.linear_m_s + second.linear_m_s),
        "omega_rad_s": 0.5 * (first.angular_rad_s + second.angular_rad_s),
        "dt_s": DT_S,
    }


@dataclass(frozen=True, slots=True)
class Case:
    """One run of all methods."""

    width: int
    height: int
    sigma: float
    prefilter_px: float
    # Iterations of the TV-L1 depth from the solution of the frame before.
    iterations: int


NAMES = (
    "HS flow + (3.3)",
    "TV-L1 flow + (3.3)",
    "Sobolev (2.16)",
    "TV-L1 depth (2.17)",
    "Sobolev + (3.7)",
    "TV-L1 depth + (3.7)",
    "depth filter",
)


def variational(
    case: Case,
    view: sf.Camera,
    pair: tuple[np.ndarray, np.ndarray],
    between: dict[str, np.ndarray | float],
    starts: list[np.ndarray | None],
) -> tuple[sf.depth.VariationalDepth, sf.depth.VariationalDepth]:
    """Inverse ranges by both priors."""
    # alpha^2 of the data: less where there is noise.
    weight = 0.5 if case.sigma < 5 else 0.02
    return (
        sf.depth.sobolev_depth(view, *pair, **between, start=starts[0]),
        sf.depth.tv_l1_depth(
            view, *pair, **between, weight=weight, iterations=case.iterations, start=starts[1]
        ),
    )


def run(case: Case) -> dict[str, Curve]:
    """All methods over one sequence; errors in percent, one a frame from the second on."""
    view = camera(case.width, case.height)
    curves: dict[str, Curve] = {name: [] for name in (*NAMES, "speed")}
    by_flow = [sf.depth.FlowObserver(view) for _ in range(2)]
    by_depth = [sf.depth.DepthObserver(view) for _ in range(2)]
    best = sf.depth.DepthFilter(view) if case.width > 320 else sf.depth.DepthFilter(view, binning=1)
    flows: list[np.ndarray | None] = [None, None]
    inverse: list[np.ndarray | None] = [None, None]
    last: Frame | None = None
    last_image = np.zeros((case.height, case.width))
    # alpha^2 of the data follows the noise by itself, unless a prefilter hides it.
    flow_weight = 0.05 if case.prefilter_px > 0 else None
    for frame in frames(view, case.sigma, DURATION_S):
        image = smoothed(frame.image, case.prefilter_px)
        pose = {"world_from_camera": frame.world_from_camera, "stamp_ns": frame.stamp_ns}
        filtered = best.step(frame.image, **pose)
        if last is not None:
            between = motion(last, frame)
            pair = (last_image, image)
            flows[0] = sf.flow.horn_schunck(*pair, solver="sor", sweeps=200, start=flows[0])
            short = {"warps": 3, "iterations": 20, "levels": 1} if flows[1] is not None else {}
            flows[1] = sf.flow.tv_l1(*pair, weight=flow_weight, start=flows[1], **short)
            found = variational(case, view, pair, between, inverse)
            for index, depth in enumerate(found):
                known = bool(np.isfinite(depth.inv_range).all())
                inverse[index] = depth.inv_range if known else inverse[index]
            ranges = [o.step(f, **between).range_m for o, f in zip(by_flow, flows, strict=True)]
            ranges += [1 / np.maximum(g, 0.05) for g in inverse]
            ranges += [
                o.step(d.inv_range, **between).range_m for o, d in zip(by_depth, found, strict=True)
            ]
            ranges.append(filtered.range_m)
            for name, range_m in zip(NAMES, ranges, strict=True):
                curves[name].append(error_percent(range_m, frame.range_m))
            curves["speed"].append(float(np.linalg.norm(between["v_m_s"])))
        last, last_image = frame, image
    return curves


def figures(curve: Curve) -> tuple[float, float, float]:
    """Error at 2 s, median and largest after 2 s."""
    late = curve[round(2 * RATE_HZ) - 1 :]
    return late[0], float(np.median(late)), float(np.max(late))


def zoom_top(curves: list[Curve]) -> float:
    """Upper end of a zoom: above what the thesis's methods settle at, where that shows both."""
    better, worse = sorted(float(np.median(curve[round(RATE_HZ) :])) for curve in curves)
    top = 1.5 * worse if worse < 10 * better else 2.5 * better
    return min(max(4.0, top), 20.0)


def draw(
    out: Path, name: str, cases: dict[str, dict[str, Curve]], chosen: tuple[str, str], size: str
) -> None:
    """Overview above, zoom below, one column a case; slow spells are grey."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, grid = plt.subplots(
        2, len(cases), figsize=(4 * len(cases), 6.4), layout="constrained", squeeze=False
    )
    for column, (title, curves) in enumerate(cases.items()):
        times = (1 + np.arange(len(curves["speed"]))) * DT_S
        slow = np.asarray(curves["speed"]) < SLOW_M_S
        for row, top in enumerate((100.0, zoom_top([curves[method] for method in chosen]))):
            axes = grid[row][column]
            axes.fill_between(
                times, 0, top, where=slow, color="0.9", label=f"|v| below {SLOW_M_S} m/s"
            )
            for method in (*chosen, NAMES[-1]):
                axes.plot(times, curves[method], label=method, linewidth=1.4)
            axes.set(xlabel="time (s)", ylabel="E (%)", ylim=(0, top), xlim=(0, DURATION_S))
            axes.set_title(title if row == 0 else "zoom", fontsize=10)
            axes.grid(alpha=0.3)
    handles, labels = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), fontsize=9)
    figure.supxlabel(f"room of section 4.1.1, {size} pixels, {RATE_HZ:.0f} Hz", fontsize=9)
    save(figure, out / f"{name}.png", dpi=100)


def main(out: Path, full: bool = False) -> None:
    """Print the figures and draw the pictures."""
    width, height, iterations = (640, 480, 400) if full else (160, 120, 150)
    prefilter_px = 1.5 if full else 1.0
    filtered = f"sigma 10, prefilter {prefilter_px:g} px"
    settings = {
        "sigma 0": (0.0, 0.0),
        "sigma 1": (1.0, 0.0),
        "sigma 10": (10.0, 0.0),
        filtered: (10.0, prefilter_px),
    }
    jobs = [Case(width, height, *noise, iterations) for noise in settings.values()]
    # New processes: those that are forked would share the engine's threads.
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        cases = dict(zip(settings, pool.map(run, jobs), strict=True))
    for title, curves in cases.items():
        for name in NAMES:
            at, median, worst = figures(curves[name])
            print(f"{title}: {name}: E(2 s) {at:.2f} %, median {median:.2f} %, max {worst:.2f} %")
    size = f"{width}x{height}"

    def chosen(**thesis: str) -> dict[str, dict[str, Curve]]:
        """Cases under their titles, with the thesis's numbers where it shows them."""
        keys = {"s0": "sigma 0", "s1": "sigma 1", "s10": "sigma 10", "filtered": filtered}
        return {f"{thesis[key]}{keys[key]}": cases[keys[key]] for key in thesis}

    draw(
        out,
        "figure_4_3_to_4_8",
        chosen(s0="4.3, 4.4: ", s1="4.5, 4.6: ", s10="4.7, 4.8: ", filtered=""),
        ("HS flow + (3.3)", "TV-L1 flow + (3.3)"),
        size,
    )
    draw(
        out,
        "figure_4_9_to_4_14",
        chosen(s0="4.9, 4.10: ", s1="", s10="4.13, 4.14: ", filtered=""),
        ("Sobolev (2.16)", "TV-L1 depth (2.17)"),
        size,
    )
    draw(
        out,
        "figure_4_11_to_4_16",
        chosen(s0="4.11, 4.12: ", s1="", s10="4.15, 4.16: ", filtered=""),
        ("Sobolev + (3.7)", "TV-L1 depth + (3.7)"),
        size,
    )
