"""Optical flow of two Middlebury pairs: ours beside OpenCV's and scikit-image's TV-L1, one thread.

    SPHEREFLOW_DATA=... RAYON_NUM_THREADS=1 python -m benches.peers.flow [--repeat N] [--only ours]

OpenCV's DualTVL1 is in `opencv-contrib-python-headless`, the other in `scikit-image`; a row whose
package is missing says so. Endpoint error over the pixels with a known flow. Warm rows start from
the flow of the same method's default settings, as the next image of a video does.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import sphereflow as sf
from numpy.typing import NDArray
from PIL import Image

Flow = NDArray[np.float32]
Method = Callable[[Flow, Flow], Flow]

PAIRS = ("RubberWhale", "Grove2")


def read_flow(path: Path) -> Flow:
    """Read a Middlebury .flo file; unknown flow is NaN."""
    raw = path.read_bytes()
    width, height = np.frombuffer(raw, np.int32, 2, 4)
    flow = np.frombuffer(raw, np.float32, 2 * width * height, 12).reshape(height, width, 2).copy()
    flow[np.abs(flow).max(axis=2) > 1e9] = np.nan
    return flow


def read_grey(path: Path) -> Flow:
    """Brightness, 0 to 255."""
    return np.asarray(Image.open(path).convert("L"), np.float32)


def ours() -> Iterator[tuple[str, Method]]:
    """Our rows."""
    yield "sphereflow tv_l1, defaults", sf.flow.tv_l1
    yield "sphereflow horn_schunck, 50 Jacobi sweeps", sf.flow.horn_schunck

    def converged(a: Flow, b: Flow) -> Flow:
        return sf.flow.horn_schunck(a, b, solver="sor", sweeps=300)

    yield "sphereflow horn_schunck, SOR, one level", converged
    memory: dict[int, Flow] = {}

    def warm(a: Flow, b: Flow) -> Flow:
        key = hash(a.tobytes())
        if key not in memory:
            memory[key] = sf.flow.tv_l1(a, b)
        return sf.flow.tv_l1(a, b, levels=1, warps=3, iterations=20, start=memory[key])

    yield "sphereflow tv_l1, warm 3x20", warm


def opencv() -> Iterator[tuple[str, Method]]:
    """OpenCV's rows."""
    import cv2

    cv2.setNumThreads(1)

    # It takes 8-bit images or floats from 0 to 1.
    def bytes_of(a: Flow) -> NDArray[np.uint8]:
        return a.astype(np.uint8)

    default = cv2.optflow.createOptFlow_DualTVL1()
    yield "OpenCV DualTVL1, defaults", lambda a, b: default.calc(bytes_of(a), bytes_of(b), None)
    short = cv2.optflow.createOptFlow_DualTVL1()
    short.setScalesNumber(1)
    short.setWarpingsNumber(3)
    short.setOuterIterations(1)
    short.setInnerIterations(20)
    short.setUseInitialFlow(True)
    memory: dict[int, Flow] = {}

    def warm(a: Flow, b: Flow) -> Flow:
        key = hash(a.tobytes())
        if key not in memory:
            memory[key] = default.calc(bytes_of(a), bytes_of(b), None)
        return short.calc(bytes_of(a), bytes_of(b), memory[key].copy())

    yield "OpenCV DualTVL1, warm, 1 scale 3 warps 20 iterations", warm
    dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    yield "OpenCV DIS medium", lambda a, b: dis.calc(bytes_of(a), bytes_of(b), None)


def skimage() -> Iterator[tuple[str, Method]]:
    """scikit-image's row."""
    from skimage.registration import optical_flow_tvl1

    def flow(a: Flow, b: Flow) -> Flow:
        # Scaled as it asks for; (row, column) order.
        down, right = optical_flow_tvl1(a / 255, b / 255, dtype=np.float32)
        return np.stack([right, down], axis=2)

    yield "scikit-image optical_flow_tvl1, defaults", flow


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", nargs="*", default=["ours", "opencv", "skimage"])
    arguments = parser.parse_args()
    repeat, only = arguments.repeat, arguments.only
    root = os.environ.get("SPHEREFLOW_DATA")
    if root is None:
        sys.exit("SPHEREFLOW_DATA is not set: it names the folder that holds flow-middlebury")
    folder = Path(root) / "flow-middlebury"
    print("| method | " + " | ".join(f"{p} px, ms" for p in PAIRS) + " |")
    print("| --- |" + " --- |" * len(PAIRS))
    families = {"ours": ours, "opencv": opencv, "skimage": skimage}
    for family in (families[name] for name in only):
        try:
            for name, method in family():
                print(f"| {name} | {' | '.join(cell(folder, p, method, repeat) for p in PAIRS)} |")
        except (ImportError, AttributeError, SystemError) as error:
            print(f"| {family.__name__} | not run: {error} |", flush=True)


def cell(folder: Path, pair: str, method: Method, repeat: int) -> str:
    """Endpoint error and best time of a pair."""
    truth = read_flow(folder / "other-gt-flow" / pair / "flow10.flo")
    images = folder / "other-data" / pair
    first, second = (read_grey(images / f"frame1{i}.png") for i in (0, 1))
    method(first, second)
    times = []
    for _ in range(repeat):
        begun = time.perf_counter()
        found = method(first, second)
        times.append(time.perf_counter() - begun)
    error = float(np.nanmean(np.linalg.norm(found - truth, axis=2)))
    return f"{error:.3f}, {1e3 * min(times):.0f}"


if __name__ == "__main__":
    main()
