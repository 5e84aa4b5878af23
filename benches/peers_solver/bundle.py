"""Bundle adjustment beside Ceres (pycolmap), GTSAM and SciPy: same input, start, loss, threads.

    pip install pycolmap gtsam scipy
    python benches/peers_solver/bundle.py [--threads 1] [--full] [--only 'street 200']

Prints the cost that each ends at and the seconds for its iterations and for its set-up. Costs are
half the sum of the losses of residuals in pixels; the first two poses are fixed. Ceres chooses its
own linear solver as COLMAP configures it. GTSAM has the same residuals, holds the two poses by
constraints and stops by its own rule; its time includes its ordering.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable

import numpy as np
from sphereflow.solver import BundleProblem

TOLERANCE = 1e-10
STEPS = 400
"""By reweighting alone, with outliers, the others converge linearly."""
SMALL = 6_000
"""Residuals up to which SciPy is asked: without derivatives it takes minutes beyond."""
MEDIUM = 8_000
"""Pixels up to which GTSAM is asked: it takes minutes beyond."""
THEIRS: dict[str, int] = {}
"""Steps that Ceres is given, where fewer."""
ENDS: dict[str, BundleProblem] = {}
"""Where ours and Ceres ended, for ``--cross``."""

Row = tuple[str, float, float, float]


def ours(make: Callable[[], BundleProblem], threads: int, loss: tuple[str, float]) -> Row:
    """Sphereflow."""
    problem = make()
    problem.set_loss(*loss)  # type: ignore[arg-type]
    result = problem.solve(max_iterations=STEPS, function_tolerance=TOLERANCE, threads=threads)
    name = f"sphereflow ({result.linear_solver}, {len(result.iterations)} steps, {result.stop})"
    ENDS["ours"] = problem
    return name, result.final_cost, result.solve_s, result.setup_s


def ceres(make: Callable[[], BundleProblem], threads: int, loss: tuple[str, float]) -> Row:
    """Ceres, with COLMAP's compiled cost functions."""
    import pyceres  # noqa: F401  (types of pycolmap's summaries)
    import pycolmap

    problem = make()
    camera = dict(problem.camera_of_pose(0).parameters)
    begin = time.perf_counter()
    world = pycolmap.Reconstruction()
    size = {"width": 640, "height": 480}
    intrinsics = [camera[name] for name in ("fx", "fy", "cx", "cy")]
    world.add_camera_with_trivial_rig(
        pycolmap.Camera(camera_id=1, model="PINHOLE", params=intrinsics, **size)
    )
    pose, point, pixel = problem.pixels
    starts = problem.poses
    for point_m in problem.points_m:
        world.add_point3D(point_m, pycolmap.Track(), np.zeros(3, np.uint8))
    config = pycolmap.BundleAdjustmentConfig()
    for k, start in enumerate(starts):
        seen = np.flatnonzero(pose == k)
        image = pycolmap.Image(
            image_id=k + 1,
            name=str(k),
            camera_id=1,
            points2D=pycolmap.Point2DList([pycolmap.Point2D(uv) for uv in pixel[seen]]),
        )
        inverse = np.linalg.inv(start)
        rigid = pycolmap.Rigid3d(pycolmap.Rotation3d(inverse[:3, :3]), inverse[:3, 3])
        world.add_image_with_trivial_frame(image, rigid)
        for index, observation in enumerate(seen):
            element = pycolmap.TrackElement(k + 1, index)
            world.add_observation(int(point[observation]) + 1, element)
        config.add_image(k + 1)
    for k in (0, 1):
        config.set_constant_rig_from_world_pose(world.image(k + 1).frame_id)
    config.set_constant_cam_intrinsics(1)
    options = pycolmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.ceres.loss_function_type = getattr(
        pycolmap.LossFunctionType, {"quadratic": "TRIVIAL"}.get(loss[0], loss[0].upper())
    )
    options.ceres.loss_function_scale = loss[1]
    options.ceres.min_num_residuals_for_cpu_multi_threading = 0
    solver = options.ceres.solver_options
    solver.max_num_iterations = THEIRS.get("steps", STEPS)
    solver.function_tolerance = TOLERANCE
    solver.gradient_tolerance = 1e-10
    solver.parameter_tolerance = 1e-8
    solver.num_threads = threads
    options.ceres.solver_options = solver
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(options, config, world)
    setup = time.perf_counter() - begin
    summary = adjuster.solve().ceres_summary
    ENDS["ceres"] = moved(problem, world)
    steps = summary.num_successful_steps + summary.num_unsuccessful_steps
    kind = str(summary.linear_solver_type_used).rsplit(".", maxsplit=1)[-1].lower()
    name = f"ceres ({kind}, {steps} steps, {summary.num_threads_used} threads)"
    return name, summary.final_cost, summary.total_time_in_seconds, setup


def moved(problem: BundleProblem, world: object) -> BundleProblem:
    """The problem where COLMAP's reconstruction is."""
    poses = np.tile(np.eye(4), (len(problem.poses), 1, 1))
    for k in range(len(poses)):
        poses[k, :3] = world.image(k + 1).cam_from_world().inverse().matrix()  # type: ignore[attr-defined]
    points = [world.point3D(k + 1).xyz for k in range(len(problem.points_m))]  # type: ignore[attr-defined]
    return in_pixels(problem, poses, np.array(points))


def cross(threads: int, loss: tuple[str, float]) -> None:
    """Whether each stays where the other ended: then these are two minima."""
    ours_end, ceres_end = ENDS["ours"], ENDS["ceres"]
    row = ours(lambda: ceres_end, threads, loss)
    print(f"  from Ceres' end, {row[0]:<38} cost {row[1]:.9e}")
    row = ceres(lambda: ours_end, threads, loss)
    print(f"  from our end, {row[0]:<41} cost {row[1]:.9e}")


def gtsam_lm(make: Callable[[], BundleProblem], threads: int, loss: tuple[str, float]) -> Row:
    """GTSAM's Levenberg-Marquardt with Ceres' defaults."""
    import gtsam

    del threads  # the wheel decides
    problem = make()
    camera = dict(problem.camera_of_pose(0).parameters)
    begin = time.perf_counter()
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    lens = gtsam.Cal3_S2(camera["fx"], camera["fy"], 0.0, camera["cx"], camera["cy"])
    noise = gtsam.noiseModel.Unit.Create(2)
    if loss[0] != "quadratic":
        estimators = gtsam.noiseModel.mEstimator
        robust = getattr(estimators, loss[0].capitalize()).Create(loss[1])
        noise = gtsam.noiseModel.Robust.Create(robust, noise)
    pose, point, pixel = problem.pixels
    for k, start in enumerate(problem.poses):
        values.insert(gtsam.symbol("x", k), gtsam.Pose3(start))
        if k < 2:
            fixed = gtsam.noiseModel.Constrained.All(6)
            graph.add(gtsam.PriorFactorPose3(gtsam.symbol("x", k), gtsam.Pose3(start), fixed))
    for k, point_m in enumerate(problem.points_m):
        values.insert(gtsam.symbol("l", k), point_m)
    factor = gtsam.GenericProjectionFactorCal3_S2
    for k in range(len(pose)):
        keys = gtsam.symbol("x", int(pose[k])), gtsam.symbol("l", int(point[k]))
        graph.add(factor(pixel[k], noise, *keys, lens))
    params = gtsam.LevenbergMarquardtParams.CeresDefaults()
    params.setMaxIterations(STEPS)
    params.setRelativeErrorTol(TOLERANCE)
    params.setAbsoluteErrorTol(0.0)
    optimiser = gtsam.LevenbergMarquardtOptimizer(graph, values, params)
    setup = time.perf_counter() - begin
    begin = time.perf_counter()
    result = optimiser.optimize()
    seconds = time.perf_counter() - begin
    return f"gtsam ({optimiser.iterations()} steps)", graph.error(result), seconds, setup


def scipy_trf(make: Callable[[], BundleProblem], threads: int, loss: tuple[str, float]) -> Row:
    """SciPy's trust region with sparse differences."""
    from scipy.optimize import least_squares
    from scipy.sparse import lil_matrix
    from scipy.spatial.transform import Rotation

    del threads
    problem = make()
    camera = dict(problem.camera_of_pose(0).parameters)
    pose, point, pixel = problem.pixels
    starts, free = np.linalg.inv(problem.poses), len(problem.poses) - 2
    turn0 = Rotation.from_matrix(starts[:, :3, :3])

    def residuals(x: np.ndarray) -> np.ndarray:
        step = np.zeros((free + 2, 6))
        step[2:] = x[: 6 * free].reshape(free, 6)
        turn = Rotation.from_rotvec(step[:, :3]) * turn0
        seen = turn[pose].apply(x[6 * free :].reshape(-1, 3)[point])
        seen = seen + starts[pose, :3, 3] + step[pose, 3:]
        u = camera["fx"] * seen[:, 0] / seen[:, 2] + camera["cx"]
        v = camera["fy"] * seen[:, 1] / seen[:, 2] + camera["cy"]
        both = np.stack([u, v], axis=1) - pixel
        if loss[0] == "huber":
            # a loss of the norm of both components, as the square of a scaled residual
            norm = np.maximum(np.linalg.norm(both, axis=1), 1e-150)
            rho = np.where(norm <= loss[1], norm**2, 2 * loss[1] * norm - loss[1] ** 2)
            both = both * (np.sqrt(rho) / norm)[:, None]
        return both.ravel()

    start = np.concatenate([np.zeros(6 * free), problem.points_m.ravel()])
    pattern = lil_matrix((2 * len(pose), len(start)), dtype=int)
    for k in range(len(pose)):
        at = 6 * free + 3 * point[k]
        pattern[2 * k : 2 * k + 2, at : at + 3] = 1
        if pose[k] >= 2:
            pattern[2 * k : 2 * k + 2, 6 * (pose[k] - 2) : 6 * (pose[k] - 1)] = 1
    begin = time.perf_counter()
    found = least_squares(
        residuals,
        start,
        jac_sparsity=pattern,
        x_scale="jac",
        method="trf",
        ftol=1e-12,
        xtol=1e-12,
        max_nfev=200,
    )
    return f"scipy ({found.nfev} evaluations)", found.cost, time.perf_counter() - begin, 0.0


def main() -> None:
    """Compare them all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--full", action="store_true", help="also 500 poses x 100 000 points")
    parser.add_argument("--only", help="rows that begin so, as 'room 500'")
    parser.add_argument("--ceres-steps", type=int, help="end Ceres after so many steps")
    parser.add_argument("--cross", action="store_true", help="begin again where the other ended")
    arguments = parser.parse_args()
    if arguments.ceres_steps is not None:
        THEIRS["steps"] = arguments.ceres_steps
    # some wheels decide for themselves how many threads they start: everybody gets as many cores
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: arguments.threads])
    cases = [
        ("room", 10, 500, 0.0),
        ("room", 10, 500, 0.1),
        ("street", 10, 500, 0.0),
        ("street", 10, 500, 0.1),
        ("room", 15, 2000, 0.0),
        ("room", 15, 2000, 0.1),
        ("street", 20, 2000, 0.0),
        ("street", 20, 2000, 0.1),
        ("room", 30, 2000, 0.0),
        ("room", 30, 2000, 0.1),
        ("room", 100, 10_000, 0.0),
        ("street", 200, 20_000, 0.0),
        ("street", 200, 20_000, 0.1),
    ]
    if arguments.full:
        sizes = [(kind, 500, 100_000) for kind in ("street", "room")]
        cases += [(*size, outliers) for size in sizes for outliers in (0.0, 0.1)]
    for kind, poses, points, outliers in cases:
        title = f"{kind} {poses} x {points}, {outliers:.0%} outliers"
        if arguments.only and not title.startswith(arguments.only):
            continue
        # a loss with one minimum: others end where their path leads
        loss = ("huber", 1.0) if outliers else ("quadratic", 1.0)

        def make(
            kind: str = kind, poses: int = poses, points: int = points, outliers: float = outliers
        ) -> BundleProblem:
            made = BundleProblem.generate(kind, poses, points, outliers=outliers, seed=1)  # type: ignore[arg-type]
            return in_pixels(made)

        print(f"{title}, {loss[0]}, {make()!r}", flush=True)
        first: Row | None = None
        for solver in (ours, ceres, gtsam_lm, scipy_trf):
            if solver is scipy_trf and len(make().pixels[0]) * 2 > SMALL:
                continue
            if solver is gtsam_lm and len(make().pixels[0]) > MEDIUM:
                continue
            try:
                row = solver(make, arguments.threads, loss)
            except ImportError as error:
                print(f"  {solver.__name__}: not installed ({error.name})")
                continue
            first = first or row
            relative = row[1] / first[1] - 1.0
            print(
                f"  {row[0]:<55} cost {row[1]:.9e} ({relative:+.1e})  "
                f"{row[2]:8.3f} s (ours / this {first[2] / row[2]:6.3f}), set-up {row[3]:.3f} s",
                flush=True,
            )
        if arguments.cross and "ceres" in ENDS:
            cross(arguments.threads, loss)


def in_pixels(
    made: BundleProblem, poses: np.ndarray | None = None, points_m: np.ndarray | None = None
) -> BundleProblem:
    """The same problem (elsewhere) with standard deviations of one pixel, as the others count."""
    problem = BundleProblem()
    problem.add_camera(made.camera_of_pose(0))
    for k, pose in enumerate(made.poses if poses is None else poses):
        problem.add_pose(pose, fixed=k < 2)
    problem.add_points(made.points_m if points_m is None else points_m)
    problem.add_pixels(*made.pixels)
    return problem


if __name__ == "__main__":
    main()
