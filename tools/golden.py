"""Writes tests/golden: the poses of the simulated tour, which changes must leave as they are.

``python tools/golden.py`` after a change that means to alter them; its commit says why.
"""

from __future__ import annotations

import sys
from pathlib import Path

import sphereflow as sf

FOLDER = Path(__file__).parent.parent / "tests" / "golden"
KINDS = ("causal", "final")

DURATION_S = 6.0
"""Of the demo's tour at 10 Hz: a corner of the table, some ten keyframes."""


def tour() -> dict[str, sf.Trajectory]:
    """Poses of the tour by their kind: the demo's room, walk and noise, in small images."""
    camera = sf.Camera.pinhole(131.25, 131.25, 79.5, 59.5, 160, 120)
    room = sf.sim.Simulator(seed=0, camera=camera, duration_s=DURATION_S, rate_hz=10.0)
    with sf.Engine(room.camera) as engine:
        for frame in room.frames():
            engine.push(frame)
    return {"causal": engine.trajectory("causal"), "final": engine.trajectory("final")}


def main(folder: Path) -> None:
    """Write the tour's poses."""
    folder.mkdir(parents=True, exist_ok=True)
    for kind, poses in tour().items():
        poses.write(folder / f"tour_{kind}.tum", format="tum")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
