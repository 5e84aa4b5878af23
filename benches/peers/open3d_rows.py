"""Open3D's odometry and ICP, as they come: default settings, our camera matrix, depth to 10 m."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import open3d as o3d
import sphereflow as sf

from benches.peers.align import Aligned, Matrix, View, metres_with_zeros

MAX_DEPTH_M = 10.0
"""Open3D's default of 3 m would leave half of a room out."""

LEVELS = (10, 5, 3)
"""Iterations of the tensor odometry, coarse to fine: its own default."""


def matrix_of(camera: sf.Camera) -> Matrix:
    """The camera matrix."""
    k = camera.parameters
    return np.array([[k["fx"], 0, k["cx"]], [0, k["fy"], k["cy"]], [0, 0, 1.0]])


def intrinsic_of(camera: sf.Camera) -> o3d.camera.PinholeCameraIntrinsic:
    """The same as the legacy interface wants it."""
    k = camera.parameters
    size = (camera.width, camera.height)
    return o3d.camera.PinholeCameraIntrinsic(*size, k["fx"], k["fy"], k["cx"], k["cy"])


class TensorOdometry:
    """`o3d.t.pipelines.odometry`; option ``method``: PointToPlane or Hybrid."""

    def __init__(self, camera: sf.Camera, options: Mapping[str, Any]) -> None:  # noqa: D107
        self.pipeline = o3d.t.pipelines.odometry
        self.method = getattr(self.pipeline.Method, options["method"])
        self.matrix = o3d.core.Tensor(matrix_of(camera))
        self.criteria = [self.pipeline.OdometryConvergenceCriteria(n) for n in LEVELS]

    def prepare(self, view: View) -> o3d.t.geometry.RGBDImage:
        """Tensors; the pyramids are built in each call."""
        depth = metres_with_zeros(view)[..., None]
        colour = view.colour
        if colour is None:
            colour = np.zeros((*depth.shape[:2], 3), np.uint8)
        image = o3d.t.geometry.Image
        return o3d.t.geometry.RGBDImage(
            image(o3d.core.Tensor(np.ascontiguousarray(colour))), image(o3d.core.Tensor(depth))
        )

    def align(self, first: Any, second: Any, dt_s: float, guess: Matrix) -> Aligned:
        """Source is the second frame, target the first."""
        try:
            found = self.pipeline.rgbd_odometry_multi_scale(
                second,
                first,
                self.matrix,
                o3d.core.Tensor(guess),
                1.0,
                MAX_DEPTH_M,
                self.criteria,
                self.method,
                self.pipeline.OdometryLossParams(),
            )
        except RuntimeError as error:
            return Aligned(None, str(error).splitlines()[0])
        return checked(found.transformation.numpy())


class LegacyOdometry:
    """`o3d.pipelines.odometry` with the hybrid (colour and depth) term."""

    def __init__(self, camera: sf.Camera, options: Mapping[str, Any]) -> None:  # noqa: D107
        self.intrinsic = intrinsic_of(camera)

    def prepare(self, view: View) -> o3d.geometry.RGBDImage:
        """Grey and depth; the pyramids are built in each call."""
        colour = view.colour
        assert colour is not None, "the hybrid term needs colour"
        return o3d.geometry.RGBDImage.create_from_color_and_depth(
            o3d.geometry.Image(np.ascontiguousarray(colour)),
            o3d.geometry.Image(metres_with_zeros(view)),
            depth_scale=1.0,
            depth_trunc=MAX_DEPTH_M,
            convert_rgb_to_intensity=True,
        )

    def align(self, first: Any, second: Any, dt_s: float, guess: Matrix) -> Aligned:
        """Source is the second frame, target the first."""
        odometry = o3d.pipelines.odometry
        good, motion, _ = odometry.compute_rgbd_odometry(
            second,
            first,
            self.intrinsic,
            guess,
            odometry.RGBDOdometryJacobianFromHybridTerm(),
            odometry.OdometryOption(),
        )
        return checked(motion) if good else Aligned(None, "compute_rgbd_odometry() said no")


class PointToPlaneIcp:
    """Point-to-plane ICP with Tukey's weights on voxel grids; option ``voxel_m``."""

    NEIGHBOURS = 30
    ITERATIONS = 30

    def __init__(self, camera: sf.Camera, options: Mapping[str, Any]) -> None:  # noqa: D107
        self.intrinsic = intrinsic_of(camera)
        self.voxel_m = float(options["voxel_m"])

    def prepare(self, view: View) -> o3d.geometry.PointCloud:
        """Cloud, voxel grid, normals."""
        cloud = o3d.geometry.PointCloud.create_from_depth_image(
            o3d.geometry.Image(metres_with_zeros(view)),
            self.intrinsic,
            depth_scale=1.0,
            depth_trunc=MAX_DEPTH_M,
        ).voxel_down_sample(self.voxel_m)
        search = o3d.geometry.KDTreeSearchParamHybrid(2.0 * self.voxel_m, self.NEIGHBOURS)
        cloud.estimate_normals(search)
        return cloud

    def align(self, first: Any, second: Any, dt_s: float, guess: Matrix) -> Aligned:
        """Source is the second frame, target the first."""
        registration = o3d.pipelines.registration
        found = registration.registration_icp(
            second,
            first,
            3.0 * self.voxel_m,
            guess,
            registration.TransformationEstimationPointToPlane(registration.TukeyLoss(self.voxel_m)),
            registration.ICPConvergenceCriteria(max_iteration=self.ITERATIONS),
        )
        return checked(found.transformation)


def checked(motion: Any) -> Aligned:
    """None of Open3D's calls says that it failed but by numbers that are none."""
    motion = np.asarray(motion, np.float64)
    if not np.isfinite(motion).all():
        return Aligned(None, "not a number")
    return Aligned(motion)
