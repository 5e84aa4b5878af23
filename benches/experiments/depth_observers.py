"""Thesis: Figure 4.3, 4.4, 4.5, 4.6, 4.7, 4.8, 4.9, 4.10, 4.11, 4.12, 4.13, 4.14, 4.15, 4.16.

Error against time of the thesis's observers and variational methods and of the depth filter, for
noise of 0, 1 and 10 grey levels, overview and zoom. At 160x120 pixels and 3 s instead of 640x480
and 4 s, so that all runs take about two minutes.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import sphereflow as sf
from sequence_411 import RATE_HZ, Frame, camera, error_percent, frames, smoothed

WIDTH, HEIGHT = 160, 120
DURATION_S = 3.0
DT_S = 1 / RATE_HZ

Curve = list[float]


def motion(first: Frame, second: Frame) -> dict[str, np.ndarray | float]:
    """Velocities at the middle of two frames."""
    return {
        "v_m_s": 0.5 * (first.linear_m_s + second.linear_m_s),
        "omega_rad_s": 0.5 * (first.angular_rad_s + second.angular_rad_s),
        "dt_s": DT_S,
    }


def run(sigma: float, prefilter_px: float) -> dict[str, Curve]:
    """All methods over one sequence; errors in percent, one a frame from the second on."""
    view = camera(WIDTH, HEIGHT)
    names = ("HS flow + (3.3)", "TV-L1 flow + (3.3)", "Sobolev (2.16)", "TV-L1 depth (2.17)")
    names += ("Sobolev + (3.7)", "TV-L1 depth + (3.7)", "depth filter")
    curves: dict[str, Curve] = {name: [] for name in names}
    by_flow = [sf.depth.FlowObserver(view) for _ in range(2)]
    by_depth = [sf.depth.DepthObserver(view) for _ in range(2)]
    best = sf.depth.DepthFilter(view, binning=1)
    flows: list[np.ndarray | None] = [None, None]
    inverse: list[np.ndarray | None] = [None, None]
    last: Frame | None = None
    last_image = np.zeros((HEIGHT, WIDTH))
    # alpha^2 of the data terms: less where there is noise.
    flow_weight, depth_weight = (0.1, 0.5) if sigma < 5 else (0.05, 0.02)
    for frame in frames(view, sigma, DURATION_S):
        image = smoothed(frame.image, prefilter_px)
        pose = {"world_from_camera": frame.world_from_camera, "stamp_ns": frame.stamp_ns}
        filtered = best.step(frame.image, **pose)
        if last is not None:
            between = motion(last, frame)
            pair = (last_image, image)
            flows[0] = sf.flow.horn_schunck(*pair, solver="sor", sweeps=200, start=flows[0])
            flows[1] = sf.flow.tv_l1(
                *pair, weight=flow_weight, warps=3, iterations=20, levels=1, start=flows[1]
            )
            found = (
                sf.depth.sobolev_depth(view, *pair, **between, start=inverse[0]),
                sf.depth.tv_l1_depth(
                    view, *pair, **between, weight=depth_weight, iterations=150, start=inverse[1]
                ),
            )
            for index, depth in enumerate(found):
                known = bool(np.isfinite(depth.inv_range).all())
                inverse[index] = depth.inv_range if known else inverse[index]
            ranges = [o.step(f, **between).range_m for o, f in zip(by_flow, flows, strict=True)]
            ranges += [1 / np.maximum(g, 0.05) for g in inverse]
            ranges += [
                o.step(d.inv_range, **between).range_m for o, d in zip(by_depth, found, strict=True)
            ]
            ranges.append(filtered.range_m)
            for name, range_m in zip(names, ranges, strict=True):
                curves[name].append(error_percent(range_m, frame.range_m))
        last, last_image = frame, image
    return curves


def figures(curve: Curve) -> tuple[float, float, float]:
    """Error at 2 s, median and largest after 2 s."""
    late = curve[round(2 * RATE_HZ) - 1 :]
    return late[0], float(np.median(late)), float(np.max(late))


def draw(out: Path, name: str, cases: dict[str, dict[str, Curve]], chosen: list[str]) -> None:
    """Overview above, zoom below, one column a noise."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, grid = plt.subplots(
        2, len(cases), figsize=(4 * len(cases), 6), layout="constrained", squeeze=False
    )
    for column, (title, curves) in enumerate(cases.items()):
        for row, top in enumerate((100, 12)):
            axes = grid[row][column]
            for method in chosen:
                values = curves[method]
                axes.plot((1 + np.arange(len(values))) * DT_S, values, label=method)
            axes.set(
                xlabel="time (s)", ylabel="E (%)", ylim=(0, top), title=title if row == 0 else ""
            )
            axes.grid(alpha=0.3)
    grid[0][0].legend(fontsize=8)
    figure.savefig(out / f"{name}.png", dpi=100)
    plt.close(figure)


def main(out: Path) -> None:
    """Print the figures and draw the pictures."""
    settings: list[tuple[str, Callable[[], dict[str, Curve]]]] = [
        ("sigma 0", lambda: run(0.0, 0.0)),
        ("sigma 1", lambda: run(1.0, 0.0)),
        ("sigma 10", lambda: run(10.0, 0.0)),
        ("sigma 10, prefilter 1 px", lambda: run(10.0, 1.0)),
    ]
    cases = {title: compute() for title, compute in settings}
    for title, curves in cases.items():
        for name, curve in curves.items():
            at, median, worst = figures(curve)
            print(f"{title}: {name}: E(2 s) {at:.2f} %, median {median:.2f} %, max {worst:.2f} %")
    best = "depth filter"
    draw(out, "figure_4_3_to_4_8", cases, ["HS flow + (3.3)", "TV-L1 flow + (3.3)", best])
    draw(out, "figure_4_9_to_4_14", cases, ["Sobolev (2.16)", "TV-L1 depth (2.17)", best])
    draw(out, "figure_4_11_to_4_16", cases, ["Sobolev + (3.7)", "TV-L1 depth + (3.7)", best])
