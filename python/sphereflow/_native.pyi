"""Types of the compiled half of sphereflow. Private: import `sphereflow`."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
__all__ = [
    "Camera",
    "DepthFilter",
    "DepthObserver",
    "DepthOdometry",
    "DepthResult",
    "FlowObserver",
    "Frame",
    "FrameIterator",
    "OdometryResult",
    "Recording",
    "RecordingWriter",
    "SimulatedFrame",
    "SimulatedFrames",
    "Simulator",
    "SphereGrid",
    "Trajectory",
    "VariationalDepth",
    "VelocityEstimate",
    "VoxelCloud",
    "__version__",
    "associate",
    "estimate_velocity",
    "horn_schunck",
    "open_recording",
    "rof_denoise",
    "sobolev_depth",
    "tv_l1",
    "tv_l1_depth",
]

_Floats = NDArray[np.float64]
_Status = Literal["started", "tracked", "weak", "lost", "skipped"]
_Along = Literal["axis", "ray"]
_Path = str | PathLike[str]
_DepthStatus = Literal["started", "updated", "unobservable", "unusable", "skipped"]
_TrajectoryFormat = Literal["tum", "kitti", "euroc"]

@final
class Camera:
    @staticmethod
    def pinhole(
        fx: float, fy: float, cx: float, cy: float, width: int, height: int, *, skew: float = 0.0
    ) -> Camera: ...
    @staticmethod
    def opencv(
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        width: int,
        height: int,
        *,
        k1: float = 0.0,
        k2: float = 0.0,
        p1: float = 0.0,
        p2: float = 0.0,
        k3: float = 0.0,
        k4: float = 0.0,
        k5: float = 0.0,
        k6: float = 0.0,
    ) -> Camera: ...
    @staticmethod
    def inverse_polynomial(
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        width: int,
        height: int,
        *,
        k1: float = 0.0,
        k2: float = 0.0,
        k3: float = 0.0,
        k4: float = 0.0,
        dx: float = 0.0,
        dy: float = 0.0,
    ) -> Camera: ...
    @staticmethod
    def fov(
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        w: float,
        width: int,
        height: int,
        *,
        dx: float = 0.0,
        dy: float = 0.0,
    ) -> Camera: ...
    @staticmethod
    def kannala_brandt(
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        k1: float,
        k2: float,
        k3: float,
        k4: float,
        width: int,
        height: int,
    ) -> Camera: ...
    @staticmethod
    def unified(
        fx: float, fy: float, cx: float, cy: float, alpha: float, width: int, height: int
    ) -> Camera: ...
    @staticmethod
    def double_sphere(
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        xi: float,
        alpha: float,
        width: int,
        height: int,
    ) -> Camera: ...
    @staticmethod
    def equirectangular(width: int, height: int) -> Camera: ...
    @staticmethod
    def from_parameters(
        model: str, parameters: Mapping[str, float], width: int, height: int
    ) -> Camera: ...
    @property
    def model(self) -> str: ...
    @property
    def parameters(self) -> dict[str, float]: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    def binned(self, factor: int) -> Camera: ...
    def project(self, points_in_camera: ArrayLike) -> _Floats: ...
    def unproject(self, pixels: ArrayLike) -> _Floats: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class SphereGrid:
    def __new__(cls, camera: Camera) -> SphereGrid: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def rays(self) -> _Floats: ...
    @property
    def solid_angle(self) -> _Floats: ...
    def gradient(self, f: ArrayLike) -> _Floats: ...
    def divergence(self, u: ArrayLike) -> _Floats: ...
    def laplacian(self, f: ArrayLike) -> _Floats: ...

@final
class Trajectory:
    def __new__(
        cls, stamp_ns: ArrayLike, position_m: ArrayLike, quat_xyzw: ArrayLike
    ) -> Trajectory: ...
    @staticmethod
    def read(path: _Path, *, format: _TrajectoryFormat | None = None) -> Trajectory: ...
    @staticmethod
    def read_lenient(
        path: _Path, *, format: _TrajectoryFormat | None = None
    ) -> tuple[Trajectory, list[str]]: ...
    def write(self, path: _Path, *, format: _TrajectoryFormat | None = None) -> None: ...
    @property
    def stamp_ns(self) -> NDArray[np.int64]: ...
    @property
    def position_m(self) -> _Floats: ...
    @property
    def quat_xyzw(self) -> _Floats: ...
    def interpolate(self, stamp_ns: int, *, max_gap_s: float = 0.1) -> _Floats | None: ...
    def __len__(self) -> int: ...

def associate(
    stamp_ns_a: ArrayLike, stamp_ns_b: ArrayLike, max_difference_s: float
) -> NDArray[np.int64]: ...

@final
class VelocityEstimate:
    @property
    def status(self) -> _Status: ...
    @property
    def reason(self) -> str | None: ...
    @property
    def linear_m_s(self) -> _Floats: ...
    @property
    def angular_rad_s(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def score(self) -> float: ...
    @property
    def weak_directions(self) -> list[dict[str, Any]]: ...
    @property
    def known_share(self) -> float: ...
    @property
    def domains(self) -> int: ...
    @property
    def residual_scale(self) -> float: ...

def estimate_velocity(
    camera: Camera,
    depth0_m: ArrayLike,
    depth1_m: ArrayLike,
    dt_s: float,
    *,
    method: Literal["single"] = "single",
    along: _Along = "axis",
    warps: int | None = None,
    domains: int | None = None,
) -> VelocityEstimate: ...

@final
class OdometryResult:
    @property
    def stamp_ns(self) -> int: ...
    @property
    def status(self) -> _Status: ...
    @property
    def reason(self) -> str | None: ...
    @property
    def has_pose(self) -> bool: ...
    @property
    def world_from_camera(self) -> _Floats: ...
    @property
    def position_m(self) -> _Floats: ...
    @property
    def quat_xyzw(self) -> _Floats: ...
    @property
    def linear_m_s(self) -> _Floats: ...
    @property
    def angular_rad_s(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def score(self) -> float: ...
    @property
    def segment(self) -> int: ...
    @property
    def timings_ms(self) -> dict[str, float]: ...

@final
class DepthOdometry:
    def __new__(
        cls,
        camera: Camera,
        *,
        method: Literal["single"] = "single",
        along: _Along = "axis",
        warps: int | None = None,
        domains: int | None = None,
    ) -> DepthOdometry: ...
    @property
    def camera(self) -> Camera: ...
    def push(self, depth_m: ArrayLike | None, stamp_ns: int) -> OdometryResult: ...

@final
class Frame:
    @property
    def stamp_ns(self) -> int: ...
    @property
    def colour(self) -> NDArray[np.uint8] | None: ...
    @property
    def depth_m(self) -> NDArray[np.float32] | None: ...
    @property
    def range_m(self) -> NDArray[np.float32] | None: ...

@final
class FrameIterator:
    def __iter__(self) -> FrameIterator: ...
    def __next__(self) -> Frame: ...

@final
class Recording:
    @property
    def kind(self) -> str: ...
    @property
    def path(self) -> Path: ...
    @property
    def stamp_ns(self) -> NDArray[np.int64]: ...
    @property
    def camera(self) -> Camera | None: ...
    @property
    def calibration_source(self) -> str: ...
    @property
    def depth_scale(self) -> float | None: ...
    @property
    def readout_s(self) -> float | None: ...
    @property
    def truth(self) -> Trajectory | None: ...
    @property
    def colour_registered(self) -> bool: ...
    @property
    def gravity_in_world(self) -> _Floats | None: ...
    @property
    def sync(self) -> dict[str, float] | None: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def imu(self) -> dict[str, NDArray[Any]]: ...
    @property
    def mag(self) -> dict[str, NDArray[Any]]: ...
    def frame(self, index: int) -> Frame: ...
    def frames(
        self, start: int = 0, stop: int | None = None, *, prefetch: int = 8
    ) -> FrameIterator: ...
    def __len__(self) -> int: ...

def open_recording(
    path: _Path,
    *,
    calibration: _Path | None = None,
    depth_scale: float | None = None,
    sync_tolerance_s: float | None = None,
) -> Recording: ...

@final
class RecordingWriter:
    def __new__(
        cls, path: _Path, camera: Camera, *, depth_scale: float = 1000.0
    ) -> RecordingWriter: ...
    def push(
        self, depth_m: ArrayLike, stamp_ns: int, *, colour: ArrayLike | None = None
    ) -> None: ...
    def finish(self) -> None: ...

@final
class SimulatedFrame:
    @property
    def stamp_ns(self) -> int: ...
    @property
    def colour(self) -> NDArray[np.uint8] | None: ...
    @property
    def depth_m(self) -> NDArray[np.float32] | None: ...
    @property
    def range_m(self) -> NDArray[np.float32] | None: ...
    @property
    def exact_depth_m(self) -> NDArray[np.float32]: ...
    @property
    def exact_range_m(self) -> NDArray[np.float32]: ...
    @property
    def exact_grey(self) -> NDArray[np.float32]: ...
    @property
    def world_from_camera(self) -> _Floats: ...
    @property
    def linear_m_s(self) -> _Floats: ...
    @property
    def angular_rad_s(self) -> _Floats: ...

@final
class SimulatedFrames:
    def __iter__(self) -> SimulatedFrames: ...
    def __next__(self) -> SimulatedFrame: ...

@final
class Simulator:
    def __new__(
        cls,
        *,
        scene: Literal["furnished_room", "thesis_room", "ellipsoid", "sphere"] = "furnished_room",
        motion: Literal[
            "room_tour", "hand_held", "trolley", "sinusoids_411", "still"
        ] = "room_tour",
        camera: Camera | None = None,
        duration_s: float | None = None,
        rate_hz: float = 30.0,
        seed: int = 0,
        depth_noise: Literal["kinect", "independent", "none"] = "kinect",
        image_sigma_grey: float = 2.0,
        readout_s: float = 0.0,
        imu: bool = True,
        mag: bool = False,
    ) -> Simulator: ...
    @property
    def kind(self) -> str: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def stamp_ns(self) -> NDArray[np.int64]: ...
    @property
    def truth(self) -> Trajectory: ...
    @property
    def calibration_source(self) -> str: ...
    @property
    def depth_scale(self) -> float | None: ...
    @property
    def readout_s(self) -> float: ...
    @property
    def colour_registered(self) -> bool: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def sync(self) -> dict[str, float] | None: ...
    @property
    def imu(self) -> dict[str, NDArray[Any]]: ...
    @property
    def mag(self) -> dict[str, NDArray[Any]]: ...
    def frames(self, start: int = 0, stop: int | None = None) -> SimulatedFrames: ...
    def render(
        self, world_from_camera: ArrayLike
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint8]]: ...
    def write(
        self, path: _Path, *, progress: Callable[[int, int], object] | None = None
    ) -> None: ...
    def __len__(self) -> int: ...

@final
class VoxelCloud:
    def __new__(cls, voxel_m: float = 0.02, *, max_points: int = 20_000_000) -> VoxelCloud: ...
    def add(
        self,
        depth_m: ArrayLike,
        colour: ArrayLike | None,
        camera: Camera,
        world_from_camera: ArrayLike,
        *,
        stride: int = 4,
        max_range_m: float = 5.0,
        along: _Along = "axis",
    ) -> int: ...
    @property
    def dropped(self) -> int: ...
    def points(self) -> tuple[NDArray[np.float32], NDArray[np.uint8]]: ...
    def write_ply(self, path: _Path) -> None: ...
    def __len__(self) -> int: ...

@final
class DepthFilter:
    def __new__(
        cls,
        camera: Camera,
        *,
        binning: int = 2,
        lags: Sequence[int] = ...,
        sigma_grey: float | None = None,
        initial_range_m: float = 1.0,
        roughness_per_m_rad: float = 0.034,
        brightness: Literal["measured", "constant"] = "measured",
        occlusion: bool = True,
    ) -> DepthFilter: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def world_from_camera(self) -> _Floats: ...
    def step(
        self,
        image: ArrayLike,
        *,
        world_from_camera: ArrayLike | None = None,
        stamp_ns: int | None = None,
        v_m_s: ArrayLike | None = None,
        omega_rad_s: ArrayLike | None = None,
        dt_s: float | None = None,
        v_sigma_m_s: float = 0.0,
        omega_sigma_rad_s: float = 0.0,
    ) -> DepthResult: ...

@final
class DepthResult:
    @property
    def range_m(self) -> NDArray[np.float32]: ...
    @property
    def std_m(self) -> NDArray[np.float32] | None: ...
    @property
    def status(self) -> _DepthStatus: ...
    @property
    def reason(self) -> str | None: ...
    @property
    def sigma_grey(self) -> float: ...
    @property
    def fitting_share(self) -> float: ...

@final
class FlowObserver:
    def __new__(
        cls, camera: Camera, *, gain: float = 500.0, initial_range_m: float = 1.0
    ) -> FlowObserver: ...
    def step(
        self, flow: ArrayLike, *, v_m_s: ArrayLike, omega_rad_s: ArrayLike, dt_s: float
    ) -> DepthResult: ...

@final
class DepthObserver:
    def __new__(
        cls, camera: Camera, *, gain: float = 30.0, initial_range_m: float = 1.0
    ) -> DepthObserver: ...
    def step(
        self, inv_range: ArrayLike, *, v_m_s: ArrayLike, omega_rad_s: ArrayLike, dt_s: float
    ) -> DepthResult: ...

@final
class VariationalDepth:
    @property
    def inv_range(self) -> NDArray[np.float32]: ...
    @property
    def energy(self) -> float: ...
    @property
    def residual(self) -> float: ...
    @property
    def iterations(self) -> int: ...

def horn_schunck(
    image0: ArrayLike,
    image1: ArrayLike,
    *,
    alpha: float = 10.0,
    solver: Literal["jacobi", "sor"] = "jacobi",
    sweeps: int = 50,
    aspect: float = 1.0,
    start: ArrayLike | None = None,
) -> NDArray[np.float32]: ...
def tv_l1(
    image0: ArrayLike,
    image1: ArrayLike,
    *,
    weight: float = 0.1,
    warps: int = 5,
    iterations: int = 30,
    levels: int = 5,
    start: ArrayLike | None = None,
) -> NDArray[np.float32]: ...
def rof_denoise(
    image: ArrayLike, *, weight: float = 0.05, iterations: int = 100
) -> NDArray[np.float32]: ...
def sobolev_depth(
    camera: Camera,
    image0: ArrayLike,
    image1: ArrayLike,
    *,
    v_m_s: ArrayLike,
    omega_rad_s: ArrayLike,
    dt_s: float,
    alpha_m_s: float = 300.0,
    iterations: int = 60,
    start: ArrayLike | None = None,
) -> VariationalDepth: ...
def tv_l1_depth(
    camera: Camera,
    image0: ArrayLike,
    image1: ArrayLike,
    *,
    v_m_s: ArrayLike,
    omega_rad_s: ArrayLike,
    dt_s: float,
    weight: float = 0.5,
    iterations: int = 400,
    gap: float = 1e-3,
    start: ArrayLike | None = None,
) -> VariationalDepth: ...
