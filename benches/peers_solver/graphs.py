"""Pose graphs beside GTSAM: same input, start and residuals.

    pip install gtsam
    python benches/peers_solver/graphs.py [FILE.g2o] [--threads 1] [--full] [--kind torus] [--clean]

Prints the cost that each ends at and the seconds of its iterations; with wrong loops, the root mean
square distance to the truth beside that of the graph without them.
"""

from __future__ import annotations

import argparse
import os
import time

import numpy as np
from sphereflow.solver import PoseGraph

TOLERANCE = 1e-12
STEPS = 100
ROTATION, TRANSLATION = 0.002, 0.02
"""Standard deviations of generated edges: radians, metres."""


def rmse(graph: PoseGraph) -> float:
    """Root mean square distance to the truth, metres."""
    gap = graph.nodes[:, :3, 3] - graph.truth[:, :3, 3]
    return float(np.sqrt(np.mean(np.sum(gap**2, axis=1))))


def gtsam_cost(graph: object, values: object) -> tuple[float, float, int]:
    """GTSAM's final cost, seconds and steps."""
    import gtsam

    params = gtsam.LevenbergMarquardtParams()
    params.setMaxIterations(STEPS)
    params.setRelativeErrorTol(TOLERANCE)
    params.setAbsoluteErrorTol(0.0)
    begin = time.perf_counter()
    optimiser = gtsam.LevenbergMarquardtOptimizer(graph, values, params)
    result = optimiser.optimize()
    return graph.error(result), time.perf_counter() - begin, optimiser.iterations()  # type: ignore[attr-defined]


def from_edges(ours: PoseGraph) -> tuple[object, object]:
    """The same graph for GTSAM."""
    import gtsam

    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for k, node in enumerate(ours.nodes):
        values.insert(k, gtsam.Pose3(node))
    sigmas = np.array([ROTATION] * 3 + [TRANSLATION] * 3)
    noise = gtsam.noiseModel.Diagonal.Sigmas(sigmas)
    for first, second, measured in zip(*ours.edges, strict=True):
        graph.add(gtsam.BetweenFactorPose3(int(first), int(second), gtsam.Pose3(measured), noise))
    fixed = gtsam.noiseModel.Constrained.All(6)
    graph.add(gtsam.PriorFactorPose3(0, gtsam.Pose3(ours.nodes[0]), fixed))
    return graph, values


def compare(name: str, ours: PoseGraph, theirs: tuple[object, object] | None, threads: int) -> None:
    """Solve with both and print both."""
    result = ours.solve(max_iterations=STEPS, function_tolerance=TOLERANCE, threads=threads)
    seconds = result.setup_s + result.solve_s
    print(f"{name}: {ours!r}")
    print(f"  sphereflow {result.final_cost:.9e}  {seconds:.3f} s, {len(result.iterations)} steps")
    if theirs is None:
        print("  gtsam: not installed")
        return
    cost, their_seconds, steps = gtsam_cost(*theirs)
    relative = result.final_cost / cost - 1.0
    ratio = seconds / their_seconds
    print(f"  gtsam      {cost:.9e}  {their_seconds:.3f} s, {steps} steps")
    print(f"  cost ours / gtsam - 1: {relative:+.1e}; time ours / gtsam: {ratio:.2f}")


def main() -> None:
    """Compare them all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", nargs="?")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--full", action="store_true", help="graphs of 10 000 poses")
    parser.add_argument("--kind", choices=("sphere", "torus", "grid"), help="that one alone")
    parser.add_argument("--clean", action="store_true", help="no graphs with wrong loops")
    arguments = parser.parse_args()
    # some wheels decide for themselves how many threads they start: everybody gets as many cores
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: arguments.threads])
    try:
        import gtsam
    except ImportError:
        gtsam = None
    if arguments.file:
        theirs = None
        if gtsam is not None:
            graph, values = gtsam.readG2o(arguments.file, True)
            fixed = gtsam.noiseModel.Constrained.All(6)
            graph.add(gtsam.PriorFactorPose3(0, values.atPose3(0), fixed))
            theirs = (graph, values)
        compare(arguments.file, PoseGraph.read(arguments.file), theirs, arguments.threads)
    side = 100 if arguments.full else 30
    for kind in [arguments.kind] if arguments.kind else ["sphere", "torus", "grid"]:
        ours = PoseGraph.generate(kind, side, side, seed=1)  # type: ignore[arg-type]
        theirs = from_edges(ours) if gtsam is not None else None
        compare(kind, ours, theirs, arguments.threads)
        if arguments.clean:
            continue
        dirty = PoseGraph.generate(kind, side, side, wrong_loops=0.1, seed=1)  # type: ignore[arg-type]
        begin = time.perf_counter()
        result = dirty.solve(switch="gnc", function_tolerance=1e-9, threads=arguments.threads)
        print(
            f"  10 % wrong loops: {rmse(dirty):.4f} m, without {rmse(ours):.4f} m "
            f"(ratio {rmse(dirty) / rmse(ours):.3f}); {len(result.rejected)} edges switched off, "
            f"{time.perf_counter() - begin:.1f} s"
        )


if __name__ == "__main__":
    main()
