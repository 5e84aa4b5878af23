"""Published bundle adjustment files beside Ceres (pycolmap): same start, loss, stop rules, threads.

    pip install pycolmap
    python benches/peers_solver/files.py FILE... [--threads 1]

BAL and Bundler files have their own f, k1, k2 for each camera, which are estimated (COLMAP's
RADIAL); libmv's one camera is known (COLMAP's OPENCV). Nothing is fixed: costs do not depend on
the gauge.
"""

from __future__ import annotations

import argparse
import os

import numpy as np
from sphereflow.solver import BundleProblem

TOLERANCE = 1e-10
STEPS = 500


def ceres(problem: BundleProblem, threads: int) -> tuple[float, float, float]:
    """Ceres' first and final cost, and the seconds of its iterations."""
    import pyceres  # noqa: F401  (types of pycolmap's summaries)
    import pycolmap

    world = pycolmap.Reconstruction()
    config = pycolmap.BundleAdjustmentConfig()
    for point_m in problem.points_m:
        world.add_point3D(point_m, pycolmap.Track(), np.zeros(3, np.uint8))
    pose, point, pixel = problem.pixels
    own = len(problem.poses) == 1 or problem.camera_of_pose(0) != problem.camera_of_pose(1)
    for k, start in enumerate(problem.poses):
        number = k + 1 if own else 1
        if own or k == 0:
            lens = dict(problem.camera_of_pose(k).parameters)
            names = ("fx", "cx", "cy", "k1", "k2")
            if not own:
                names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
            camera = pycolmap.Camera(
                camera_id=number,
                model="RADIAL" if own else "OPENCV",
                params=[lens[name] for name in names],
                width=1000,
                height=1000,
            )
            world.add_camera_with_trivial_rig(camera)
        seen = np.flatnonzero(pose == k)
        image = pycolmap.Image(
            image_id=k + 1,
            name=str(k),
            camera_id=number,
            points2D=pycolmap.Point2DList([pycolmap.Point2D(uv) for uv in pixel[seen]]),
        )
        inverse = np.linalg.inv(start)
        rigid = pycolmap.Rigid3d(pycolmap.Rotation3d(inverse[:3, :3]), inverse[:3, 3])
        world.add_image_with_trivial_frame(image, rigid)
        for index, observation in enumerate(seen):
            element = pycolmap.TrackElement(k + 1, index)
            world.add_observation(int(point[observation]) + 1, element)
        config.add_image(k + 1)
    options = pycolmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.refine_focal_length = own
    options.refine_extra_params = own
    options.ceres.min_num_residuals_for_cpu_multi_threading = 0
    solver = options.ceres.solver_options
    solver.max_num_iterations = STEPS
    solver.function_tolerance = TOLERANCE
    solver.gradient_tolerance = 1e-10
    solver.parameter_tolerance = 1e-8
    solver.num_threads = threads
    options.ceres.solver_options = solver
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(options, config, world)
    summary = adjuster.solve().ceres_summary
    return summary.initial_cost, summary.final_cost, summary.total_time_in_seconds


def main() -> None:
    """Compare every file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+")
    parser.add_argument("--threads", type=int, default=1)
    arguments = parser.parse_args()
    # some wheels decide for themselves how many threads they start: everybody gets as many cores
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: arguments.threads])
    for file in arguments.files:
        problem = BundleProblem.read(file)
        result = problem.solve(
            max_iterations=STEPS, function_tolerance=TOLERANCE, threads=arguments.threads
        )
        print(f"{file}: {problem!r}")
        line = f"{result.initial_cost:.9e} -> {result.final_cost:.9e}"
        print(f"  sphereflow {line}  {result.solve_s:.3f} s ({result.stop})")
        try:
            first, last, seconds = ceres(BundleProblem.read(file), arguments.threads)
        except ImportError as error:
            print(f"  ceres: not installed ({error.name})")
            continue
        print(f"  ceres      {first:.9e} -> {last:.9e}  {seconds:.3f} s")
        relative = result.final_cost / last - 1.0 if last > 0.0 else float("nan")
        print(f"  cost ours / ceres - 1: {relative:+.1e}; time: {result.solve_s / seconds:.2f}")


if __name__ == "__main__":
    main()
