"""Types of the compiled half of sphereflow. Private: import `sphereflow`."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

from sphereflow.config import (
    AlignmentConfig,
    AttitudeConfig,
    DepthFilterConfig,
    DepthObserverConfig,
    EngineConfig,
    FlowObserverConfig,
    HornSchunckConfig,
    ImuBiasConfig,
    NavigationConfig,
    OdometryConfig,
    RangeFlowConfig,
    RofConfig,
    SelfCalibrationConfig,
    SobolevConfig,
    ThesisConfig,
    TvDepthConfig,
    TvL1Config,
    VelocityBiasConfig,
)

__version__: str
__all__ = [
    "AttitudeFilter",
    "AttitudeRun",
    "AttitudeState",
    "BundleProblem",
    "Calibration",
    "Camera",
    "DepthFilter",
    "DepthObserver",
    "DepthOdometry",
    "DepthResult",
    "Engine",
    "FlowObserver",
    "Frame",
    "FrameIterator",
    "ImuBiasEstimator",
    "ImuBiasRun",
    "ImuBiasState",
    "ImuPreintegration",
    "InertialWindow",
    "Information",
    "Motion",
    "NavigationFilter",
    "NavigationState",
    "OdometryResult",
    "PoseGraph",
    "PositionObserver",
    "RangeFlow",
    "Recording",
    "RecordingWriter",
    "SelfCalibration",
    "SelfCalibrator",
    "SimilarityGraph",
    "SimulatedFrame",
    "SimulatedFrames",
    "Simulator",
    "SolverResult",
    "SphereGrid",
    "Trajectory",
    "Update",
    "VariationalDepth",
    "VelocityBiasEstimator",
    "VelocityBiasState",
    "VelocityEstimate",
    "VisualAttitude",
    "VoxelCloud",
    "__version__",
    "_check_config",
    "_default_config",
    "_reason_codes",
    "_restore",
    "associate",
    "calibrate_camera_imu",
    "calibrate_imu_still",
    "calibrate_mag_ellipsoid",
    "estimate_velocity",
    "horn_schunck",
    "information",
    "open_recording",
    "rof_denoise",
    "sobolev_depth",
    "tv_l1",
    "tv_l1_depth",
]

def _default_config(name: str) -> dict[str, Any]: ...
def _check_config(name: str, values: Mapping[str, Any]) -> None: ...
def _reason_codes() -> dict[str, dict[str, list[str]]]: ...
def _restore(class_: str, state: Any) -> Any: ...

_Floats = NDArray[np.float64]
_Status = Literal["started", "tracked", "weak", "coasting", "lost", "relocalised", "skipped"]
_Along = Literal["axis", "ray"]
_Method = Literal["pyramid", "single"]
_Loss = Literal["quadratic", "huber", "cauchy", "tukey"]
_Path = str | PathLike[str]
_DepthStatus = Literal["started", "updated", "unobservable", "unusable", "skipped"]
_TrajectoryFormat = Literal["tum", "kitti", "euroc"]

_ObserverStatus = Literal["starting", "ok", "weak", "skipped"]

@final
class AttitudeState:
    @property
    def quat_xyzw(self) -> _Floats: ...
    @property
    def gyro_bias(self) -> _Floats: ...
    @property
    def status(self) -> _ObserverStatus: ...
    @property
    def reason(self) -> str | None: ...
    @property
    def reason_code(self) -> str | None: ...
    @property
    def reason_values(self) -> dict[str, float | int | str]: ...
    @property
    def at_rest(self) -> bool: ...
    @property
    def mag_disturbed(self) -> bool: ...

@final
class AttitudeRun:
    @property
    def quat_xyzw(self) -> _Floats: ...
    @property
    def gyro_bias(self) -> _Floats: ...
    @property
    def status(self) -> list[_ObserverStatus]: ...
    @property
    def reason(self) -> list[str | None]: ...
    @property
    def reason_code(self) -> list[str | None]: ...
    @property
    def at_rest(self) -> NDArray[np.bool_]: ...
    @property
    def mag_disturbed(self) -> NDArray[np.bool_]: ...
    def __len__(self) -> int: ...

@final
class AttitudeFilter:
    def __new__(
        cls,
        method: Literal["inertial", "invariant"] | None = None,
        *,
        config: AttitudeConfig | None = None,
        world: Literal["enu", "rdf"] | None = None,
        tau_accel_s: float | None = None,
        tau_mag_s: float | None = None,
        motion_bias: bool | None = None,
        rest_bias: bool | None = None,
        reject_disturbance: bool | None = None,
        gyro_limit_rad_s: float | None = None,
        max_gap_s: float | None = None,
    ) -> AttitudeFilter: ...
    def step(
        self,
        gyro_rad_s: ArrayLike,
        accel_m_s2: ArrayLike,
        mag_ut: ArrayLike | None = None,
        *,
        dt_s: float,
    ) -> AttitudeState: ...
    def run(
        self,
        gyro_rad_s: ArrayLike,
        accel_m_s2: ArrayLike,
        mag_ut: ArrayLike | None,
        stamp_ns: ArrayLike,
    ) -> AttitudeRun: ...
    @property
    def state(self) -> AttitudeState: ...

@final
class VisualAttitude:
    def __new__(cls, gain_per_s: float = 2.0) -> VisualAttitude: ...
    def step(
        self,
        gyro_rad_s: ArrayLike,
        visual_quat_xyzw: ArrayLike | None = None,
        *,
        dt_s: float,
    ) -> tuple[_ObserverStatus, str | None]: ...
    @property
    def quat_xyzw(self) -> _Floats | None: ...

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
    @staticmethod
    def from_matrices(stamp_ns: ArrayLike, world_from_camera: ArrayLike) -> Trajectory: ...
    @property
    def stamp_ns(self) -> NDArray[np.int64]: ...
    @property
    def world_from_camera(self) -> _Floats: ...
    @property
    def length_m(self) -> float: ...
    def concatenated(self, other: Trajectory) -> Trajectory: ...
    def transformed(
        self,
        other_from_world: ArrayLike | None = None,
        *,
        camera_from_body: ArrayLike | None = None,
    ) -> Trajectory: ...
    def __add__(self, other: Trajectory, /) -> Trajectory: ...
    def __radd__(self, other: Trajectory, /) -> Trajectory: ...
    @overload
    def __getitem__(self, key: int | np.signedinteger, /) -> tuple[int, _Floats]: ...
    @overload
    def __getitem__(
        self, key: slice | Sequence[int] | Sequence[bool] | NDArray[np.integer | np.bool_], /
    ) -> Trajectory: ...
    def __iter__(self) -> Iterator[tuple[int, _Floats]]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
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
    def reason_code(self) -> str | None: ...
    @property
    def reason_values(self) -> dict[str, float | int | str]: ...
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
    def overlap(self) -> float: ...
    @property
    def flow_px(self) -> float: ...
    @property
    def rejected_share(self) -> float: ...
    @property
    def divided_share(self) -> float: ...
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
    config: AlignmentConfig | ThesisConfig | None = None,
    method: Literal["pyramid", "single", "thesis"] | None = None,
    along: _Along = "axis",
    domains: int | None = None,
    gyro_rad_s: ArrayLike | None = None,
    gyro_std_rad_s: float = 3e-3,
    prior_m_s: ArrayLike | None = None,
    prior_std_m_s: float = 0.1,
    image0: ArrayLike | None = None,
    image1: ArrayLike | None = None,
    brightness_weight: float | None = None,
    max_std_m: float | None = None,
    noise: Literal["disparity", "time_of_flight"] | None = None,
) -> VelocityEstimate: ...

@final
class Information:
    @property
    def matrix(self) -> _Floats: ...
    @property
    def mean_range_m(self) -> float: ...
    @property
    def eigenvalues(self) -> _Floats: ...
    @property
    def directions(self) -> _Floats: ...
    @property
    def score(self) -> float: ...
    @property
    def domains(self) -> int: ...
    def unseen(self, limit: float = 0.01) -> _Floats: ...
    def unseen_names(self, limit: float = 0.01) -> list[str]: ...

def information(camera: Camera, depth_m: ArrayLike, *, along: _Along = "axis") -> Information: ...

@final
class OdometryResult:
    @property
    def keyframe(self) -> int | None: ...
    @property
    def keyframe_from_camera(self) -> _Floats | None: ...
    @property
    def keyframe_covariance(self) -> _Floats | None: ...
    @property
    def rejected_share(self) -> float: ...
    @property
    def divided_share(self) -> float: ...
    @property
    def stamp_ns(self) -> int: ...
    @property
    def status(self) -> _Status: ...
    @property
    def reason(self) -> str | None: ...
    @property
    def reason_code(self) -> str | None: ...
    @property
    def reason_values(self) -> dict[str, float | int | str]: ...
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
        config: OdometryConfig | None = None,
        method: _Method | None = None,
        along: _Along = "axis",
        domains: int | None = None,
        max_std_m: float | None = None,
        keyframes: bool | None = None,
        readout_s: float | None = None,
        depth_corrected: bool = False,
        noise: Literal["disparity", "time_of_flight"] | None = None,
    ) -> DepthOdometry: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def keyframe_count(self) -> int: ...
    def push(
        self,
        depth_m: ArrayLike | None,
        stamp_ns: int,
        *,
        gyro_rad_s: ArrayLike | None = None,
        gyro_std_rad_s: float = 3e-3,
    ) -> OdometryResult: ...

@final
class RangeFlow:
    def __new__(
        cls,
        camera: Camera,
        *,
        config: RangeFlowConfig | None = None,
        levels: Sequence[int] | None = None,
        along: _Along = "axis",
    ) -> RangeFlow: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def levels(self) -> list[int]: ...
    def estimate(
        self,
        depth0_m: ArrayLike,
        depth1_m: ArrayLike,
        dt_s: float,
        *,
        guess: ArrayLike | None = None,
    ) -> VelocityEstimate: ...

@final
class SelfCalibration:
    @property
    def status(self) -> Literal["calibrated", "not observable", "no improvement"]: ...
    @property
    def reason(self) -> str | None: ...
    @property
    def reason_code(self) -> str | None: ...
    @property
    def reason_values(self) -> dict[str, float | int | str]: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def depth_correction(self) -> dict[str, dict[str, float]]: ...
    @property
    def readout_s(self) -> float: ...
    @property
    def parameters(self) -> list[dict[str, Any]]: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def held(self) -> list[dict[str, Any]]: ...
    @property
    def residual_before(self) -> float: ...
    @property
    def residual_after(self) -> float: ...
    @property
    def inflation(self) -> float: ...
    @property
    def frames(self) -> int: ...
    @property
    def pairs(self) -> int: ...
    @property
    def iterations(self) -> int: ...
    @property
    def rms_rate_rad_s(self) -> float: ...
    @property
    def rms_speed_m_s(self) -> float: ...
    def write(self, path: _Path, recording: Recording) -> None: ...

@final
class SelfCalibrator:
    def __new__(
        cls,
        camera: Camera,
        *,
        config: SelfCalibrationConfig | None = None,
        lens: bool | None = None,
        field: bool | None = None,
        readout: bool | None = None,
        readout_s: float | None = None,
        max_pairs: int | None = None,
    ) -> SelfCalibrator: ...
    def push(self, depth_m: ArrayLike, stamp_ns: int) -> OdometryResult: ...
    def solve(self, progress: Callable[[int, int], object] | None = None) -> SelfCalibration: ...
    def __len__(self) -> int: ...

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
class Calibration:
    def __new__(
        cls,
        depth: Camera,
        *,
        colour: Camera | None = None,
        colour_from_depth: ArrayLike | None = None,
        camera_from_imu: ArrayLike | None = None,
        depth_field: Mapping[str, Mapping[str, float]] | None = None,
        readout_s: float | None = None,
        colour_offset_s: float | None = None,
        imu_offset_s: float | None = None,
        deviations: Mapping[str, float] | None = None,
        depth_scale: float = 1000.0,
    ) -> Calibration: ...
    @staticmethod
    def read(path: _Path) -> Calibration: ...
    def write(self, path: _Path) -> None: ...
    def to_toml(self) -> str: ...
    @staticmethod
    def from_toml(text: str) -> Calibration: ...
    def without_depth_field(self) -> Calibration: ...
    def with_readout_s(self, readout_s: float) -> Calibration: ...
    @property
    def depth(self) -> Camera: ...
    @property
    def colour(self) -> Camera | None: ...
    @property
    def colour_from_depth(self) -> _Floats | None: ...
    @property
    def camera_from_imu(self) -> _Floats | None: ...
    @property
    def depth_field(self) -> dict[str, dict[str, float]] | None: ...
    @property
    def readout_s(self) -> float | None: ...
    @property
    def colour_offset_s(self) -> float | None: ...
    @property
    def imu_offset_s(self) -> float | None: ...
    @property
    def deviations(self) -> dict[str, float]: ...
    @property
    def depth_scale(self) -> float: ...
    @property
    def is_registered(self) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...

@final
class Update:
    @property
    def stamp_ns(self) -> int: ...
    @property
    def status(self) -> _Status: ...
    @property
    def reason(self) -> str | None: ...
    @property
    def reason_code(self) -> str | None: ...
    @property
    def reason_values(self) -> dict[str, float | int | str]: ...
    @property
    def has_pose(self) -> bool: ...
    @property
    def world_from_camera(self) -> _Floats: ...
    @property
    def position_m(self) -> _Floats: ...
    @property
    def quat_xyzw(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def quality(self) -> float: ...
    @property
    def segment(self) -> int: ...
    @property
    def is_keyframe(self) -> bool: ...
    @property
    def epoch(self) -> int: ...
    @property
    def linear_m_s(self) -> _Floats: ...
    @property
    def angular_rad_s(self) -> _Floats: ...
    @property
    def timings_ms(self) -> dict[str, float]: ...

@disjoint_base
class Engine:
    def __new__(cls, calibration: Calibration, config: EngineConfig | None = None) -> Engine: ...
    def push_frame(
        self,
        stamp_ns: int,
        *,
        depth_m: ArrayLike | None = None,
        range_m: ArrayLike | None = None,
        colour: ArrayLike | None = None,
        mask: ArrayLike | None = None,
        colour_stamp_ns: int | None = None,
    ) -> Update: ...
    def push_imu(
        self, stamp_ns: ArrayLike, gyro_rad_s: ArrayLike, accel_m_s2: ArrayLike
    ) -> None: ...
    def push_mag(self, stamp_ns: int, mag_ut: Sequence[float]) -> None: ...
    def finish(
        self, progress: Callable[[int, int], object] | None = None
    ) -> dict[str, Any] | None: ...
    def reset(self) -> None: ...
    def cancel(self) -> None: ...
    def trajectory(self, kind: Literal["final", "causal"] = "final") -> Trajectory: ...
    def segment(self, index: int) -> Trajectory: ...
    def keyframes(self) -> Trajectory: ...
    def cloud(self, *, growing: bool = False) -> VoxelCloud: ...
    def write_graph(self, path: _Path) -> None: ...
    @property
    def calibration(self) -> Calibration: ...
    def report(self) -> dict[str, Any]: ...

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
    def depth_corrected(self) -> bool: ...
    @property
    def calibration(self) -> Calibration | None: ...
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
class BundleProblem:
    def __new__(cls) -> BundleProblem: ...
    @staticmethod
    def read(path: _Path) -> BundleProblem: ...
    @staticmethod
    def generate(
        kind: Literal["room", "street"],
        poses: int,
        points: int,
        *,
        track: int = 8,
        depth_sigma_m: float | None = None,
        outliers: float = 0.0,
        seed: int = 0,
    ) -> BundleProblem: ...
    def write(self, path: _Path) -> None: ...
    def add_camera(self, camera: Camera) -> int: ...
    def free_intrinsics(self, camera: int, names: Sequence[str]) -> None: ...
    def add_pose(
        self, world_from_camera: ArrayLike, *, camera: int = 0, fixed: bool = False
    ) -> int: ...
    def fix_pose(self, pose: int) -> None: ...
    def add_points(self, points_m: ArrayLike) -> int: ...
    def add_pixels(
        self, pose: ArrayLike, point: ArrayLike, pixel: ArrayLike, *, sigma_px: float = 1.0
    ) -> None: ...
    def add_point_measurements(
        self, pose: ArrayLike, point: ArrayLike, point_in_camera_m: ArrayLike, *, sigma_m: float
    ) -> None: ...
    def add_inverse_ranges(
        self, pose: ArrayLike, point: ArrayLike, inv_range: ArrayLike, *, sigma: float
    ) -> None: ...
    def add_attitude_prior(
        self, pose: int, world_from_camera: ArrayLike, covariance: ArrayLike
    ) -> None: ...
    def add_pose_prior(
        self, pose: int, world_from_camera: ArrayLike, covariance: ArrayLike
    ) -> None: ...
    def set_imu(self, gravity_m_s2: ArrayLike, body_from_camera: ArrayLike) -> None: ...
    def add_motion(self, pose: int, motion: Motion | None = None) -> None: ...
    def add_imu(self, first: int, second: int, samples: ImuPreintegration) -> None: ...
    def add_bias_prior(
        self, pose: int, motion: Motion, *, gyro_sigma: float, accel_sigma: float
    ) -> None: ...
    def motion(self, pose: int) -> Motion | None: ...
    def marginalise(self, poses: ArrayLike) -> None: ...
    def set_loss(self, name: _Loss, threshold: float = 1.0) -> None: ...
    def solve(
        self,
        *,
        max_iterations: int = 50,
        function_tolerance: float = 1e-6,
        parameter_tolerance: float = 1e-8,
        time_budget_s: float | None = None,
        threads: int = 0,
    ) -> SolverResult: ...
    def covariance(self, poses: ArrayLike) -> _Floats: ...
    @property
    def poses(self) -> _Floats: ...
    @property
    def points_m(self) -> _Floats: ...
    @property
    def pixels(self) -> tuple[NDArray[np.int64], NDArray[np.int64], _Floats]: ...
    def camera_of_pose(self, pose: int) -> Camera: ...
    @property
    def measurements(self) -> int: ...

class _Graph:
    """What graphs of poses and of similarities share."""

    def add_node(self, world_from_body: ArrayLike, *, fixed: bool = False) -> int: ...
    def add_edge(
        self,
        first: int,
        second: int,
        first_from_second: ArrayLike,
        information: ArrayLike,
        *,
        loop_closure: bool = False,
    ) -> int: ...
    def add_prior(self, node: int, world_from_body: ArrayLike, information: ArrayLike) -> None: ...
    def add_gravity(
        self, node: int, world: ArrayLike, body: ArrayLike, *, sigma_rad: float
    ) -> None: ...
    def add_yaw(
        self, node: int, axis: ArrayLike, world_from_body: ArrayLike, *, sigma_rad: float
    ) -> None: ...
    def set_nodes(self, nodes: ArrayLike) -> None: ...
    def solve(
        self,
        *,
        switch: Literal["off", "gnc", "dcs"] = "off",
        threshold: float = 16.8,
        max_iterations: int = 100,
        function_tolerance: float = 1e-6,
        parameter_tolerance: float = 1e-8,
        time_budget_s: float | None = None,
        threads: int = 0,
    ) -> SolverResult: ...
    @property
    def nodes(self) -> _Floats: ...

@final
class PoseGraph(_Graph):
    def __new__(cls) -> PoseGraph: ...
    @staticmethod
    def read(path: _Path) -> PoseGraph: ...
    @staticmethod
    def generate(
        kind: Literal["sphere", "torus", "grid"],
        rings: int,
        ring: int,
        *,
        wrong_loops: float = 0.0,
        seed: int = 0,
    ) -> PoseGraph: ...
    def write(self, path: _Path) -> None: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def truth(self) -> _Floats: ...
    @property
    def edges(self) -> tuple[NDArray[np.int64], NDArray[np.int64], _Floats]: ...

@final
class SimilarityGraph(_Graph):
    def __new__(cls) -> SimilarityGraph: ...

@final
class Motion:
    def __new__(
        cls,
        *,
        velocity_m_s: ArrayLike | None = None,
        gyro_bias_rad_s: ArrayLike | None = None,
        accel_bias_m_s2: ArrayLike | None = None,
    ) -> Motion: ...
    @property
    def velocity_m_s(self) -> _Floats: ...
    @property
    def gyro_bias_rad_s(self) -> _Floats: ...
    @property
    def accel_bias_m_s2(self) -> _Floats: ...

@final
class ImuPreintegration:
    def __new__(
        cls,
        *,
        gyro_sigma: float,
        accel_sigma: float,
        gyro_walk: float,
        accel_walk: float,
        around: Motion | None = None,
    ) -> ImuPreintegration: ...
    def push(self, gyro_rad_s: ArrayLike, accel_m_s2: ArrayLike, dt_s: ArrayLike) -> None: ...
    @property
    def seconds(self) -> float: ...
    def change(self, motion: Motion | None = None) -> tuple[_Floats, _Floats, _Floats]: ...

@final
class InertialWindow:
    def __new__(
        cls, world_from_body: ArrayLike, gravity_m_s2: ArrayLike, motion: Motion | None = None
    ) -> InertialWindow: ...
    def push(self, since_last: ImuPreintegration) -> int: ...
    def add_pose(self, state: int, world_from_body: ArrayLike, covariance: ArrayLike) -> None: ...
    def add_bias_prior(
        self, state: int, motion: Motion, *, gyro_sigma: float, accel_sigma: float
    ) -> None: ...
    def solve(
        self,
        *,
        max_iterations: int = 50,
        function_tolerance: float = 1e-6,
        parameter_tolerance: float = 1e-8,
        time_budget_s: float | None = None,
    ) -> SolverResult: ...
    @property
    def poses(self) -> _Floats: ...
    @property
    def motions(self) -> list[Motion]: ...

@final
class SolverResult:
    @property
    def initial_cost(self) -> float: ...
    @property
    def final_cost(self) -> float: ...
    @property
    def stop(self) -> str: ...
    @property
    def converged(self) -> bool: ...
    @property
    def iterations(self) -> list[dict[str, Any]]: ...
    @property
    def issues(self) -> list[str]: ...
    @property
    def linear_solver(self) -> str | None: ...
    @property
    def rejected(self) -> list[int]: ...
    @property
    def solve_s(self) -> float: ...
    @property
    def setup_s(self) -> float: ...

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
        config: DepthFilterConfig | None = None,
        binning: int | None = None,
        lags: Sequence[int] | None = None,
        sigma_grey: float | None = None,
        initial_range_m: float | None = None,
        roughness_per_m_rad: float | None = None,
        brightness: Literal["measured", "constant"] | None = None,
        occlusion: bool | None = None,
        keyframes: int | None = None,
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
        position_sigma_m: float = 0.0,
        rotation_sigma_rad: float = 0.0,
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
    def reason_code(self) -> str | None: ...
    @property
    def reason_values(self) -> dict[str, float | int | str]: ...
    @property
    def sigma_grey(self) -> float: ...
    @property
    def fitting_share(self) -> float: ...

@final
class FlowObserver:
    def __new__(
        cls,
        camera: Camera,
        *,
        config: FlowObserverConfig | None = None,
        gain: float | None = None,
        initial_range_m: float | None = None,
    ) -> FlowObserver: ...
    def step(
        self, flow: ArrayLike, *, v_m_s: ArrayLike, omega_rad_s: ArrayLike, dt_s: float
    ) -> DepthResult: ...

@final
class DepthObserver:
    def __new__(
        cls,
        camera: Camera,
        *,
        config: DepthObserverConfig | None = None,
        gain: float | None = None,
        initial_range_m: float | None = None,
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
    config: HornSchunckConfig | None = None,
    alpha: float | None = None,
    solver: Literal["jacobi", "sor"] | None = None,
    sweeps: int | None = None,
    aspect: float | None = None,
    start: ArrayLike | None = None,
) -> NDArray[np.float32]: ...
def tv_l1(
    image0: ArrayLike,
    image1: ArrayLike,
    *,
    config: TvL1Config | None = None,
    weight: float | None = None,
    split: float | None = None,
    warps: int | None = None,
    iterations: int | None = None,
    levels: int | None = None,
    presmooth_px: float | None = None,
    median_radius: int | None = None,
    start: ArrayLike | None = None,
) -> NDArray[np.float32]: ...
def rof_denoise(
    image: ArrayLike,
    *,
    config: RofConfig | None = None,
    weight: float | None = None,
    iterations: int | None = None,
) -> NDArray[np.float32]: ...
def sobolev_depth(
    camera: Camera,
    image0: ArrayLike,
    image1: ArrayLike,
    *,
    v_m_s: ArrayLike,
    omega_rad_s: ArrayLike,
    dt_s: float,
    config: SobolevConfig | None = None,
    alpha_m_s: float | None = None,
    iterations: int | None = None,
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
    config: TvDepthConfig | None = None,
    weight: float | None = None,
    iterations: int | None = None,
    gap: float | None = None,
    start: ArrayLike | None = None,
) -> VariationalDepth: ...

@final
class VelocityBiasState:
    @property
    def angular_rad_s(self) -> _Floats: ...
    @property
    def linear_m_s(self) -> _Floats | None: ...
    @property
    def covariance(self) -> _Floats | None: ...
    @property
    def blind_directions(self) -> _Floats: ...
    @property
    def field_energy(self) -> float | None: ...
    @property
    def status(self) -> _ObserverStatus: ...
    @property
    def reason(self) -> str | None: ...
    @property
    def reason_code(self) -> str | None: ...
    @property
    def reason_values(self) -> dict[str, float | int | str]: ...

@final
class VelocityBiasEstimator:
    def __new__(
        cls,
        camera: Camera,
        method: Literal["information", "observer", "normalised"] | None = None,
        *,
        config: VelocityBiasConfig | None = None,
        k_field: float | None = None,
        k_v: float | None = None,
        k_omega: float | None = None,
        lambda_y: float | None = None,
        lambda_d: float | None = None,
        rate_per_s: float | None = None,
        forget_s: float | None = None,
        linear_sigma: float | None = None,
        angular_sigma: float | None = None,
        linear_bias_sigma: float | None = None,
        angular_bias_sigma: float | None = None,
        max_width: int | None = None,
        readout_s: float | None = None,
        timing_sigma_s: float | None = None,
        shared_error_px: float | None = None,
        max_gap_s: float | None = None,
        angular_limit_rad_s: float | None = None,
    ) -> VelocityBiasEstimator: ...
    def step(
        self,
        grey: ArrayLike,
        depth_m: ArrayLike,
        angular_rad_s: ArrayLike,
        linear_m_s: ArrayLike | None = None,
        *,
        dt_s: float,
        along: _Along = "axis",
    ) -> VelocityBiasState: ...
    @property
    def state(self) -> VelocityBiasState: ...

@final
class ImuBiasState:
    @property
    def velocity_m_s(self) -> _Floats: ...
    @property
    def gravity_m_s2(self) -> _Floats: ...
    @property
    def gyro_bias(self) -> _Floats: ...
    @property
    def accel_bias(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats | None: ...
    @property
    def status(self) -> _ObserverStatus: ...
    @property
    def reason(self) -> str | None: ...
    @property
    def reason_code(self) -> str | None: ...
    @property
    def reason_values(self) -> dict[str, float | int | str]: ...

@final
class ImuBiasRun:
    @property
    def sample(self) -> NDArray[np.int64]: ...
    @property
    def velocity_m_s(self) -> _Floats: ...
    @property
    def gravity_m_s2(self) -> _Floats: ...
    @property
    def gyro_bias(self) -> _Floats: ...
    @property
    def accel_bias(self) -> _Floats: ...
    @property
    def status(self) -> list[_ObserverStatus]: ...
    @property
    def reason(self) -> list[str | None]: ...
    @property
    def reason_code(self) -> list[str | None]: ...
    def __len__(self) -> int: ...

@final
class ImuBiasEstimator:
    def __new__(
        cls,
        method: Literal["ekf", "observer"] | None = None,
        *,
        config: ImuBiasConfig | None = None,
        gravity_m_s2: float | None = None,
        field_dot_down: float | None = None,
        gyro_sigma_rad_s: float | None = None,
        accel_sigma_m_s2: float | None = None,
        gyro_walk: float | None = None,
        accel_walk: float | None = None,
        gyro_bias_sigma: float | None = None,
        accel_bias_sigma: float | None = None,
    ) -> ImuBiasEstimator: ...
    def step(
        self,
        gyro_rad_s: ArrayLike,
        accel_m_s2: ArrayLike,
        velocity_m_s: ArrayLike | None = None,
        angular_rad_s: ArrayLike | None = None,
        mag_ut: ArrayLike | None = None,
        *,
        velocity_sigma: float = 0.01,
        angular_sigma: float = 5e-3,
        mean: bool = False,
        dt_s: float,
    ) -> ImuBiasState: ...
    def run(
        self,
        stamp_ns: ArrayLike,
        gyro_rad_s: ArrayLike,
        accel_m_s2: ArrayLike,
        velocity_m_s: ArrayLike,
        angular_rad_s: ArrayLike | None = None,
        mag_ut: ArrayLike | None = None,
        *,
        velocity_sigma: float = 0.01,
        angular_sigma: float = 5e-3,
        mean: bool = False,
        smooth: bool = False,
        loops: int = 1,
    ) -> ImuBiasRun: ...
    @property
    def state(self) -> ImuBiasState: ...
    @property
    def blind_directions(self) -> _Floats: ...

@final
class NavigationState:
    @property
    def stamp_ns(self) -> int: ...
    @property
    def position_m(self) -> _Floats: ...
    @property
    def quat_xyzw(self) -> _Floats: ...
    @property
    def world_from_body(self) -> _Floats: ...
    @property
    def velocity_m_s(self) -> _Floats: ...
    @property
    def gyro_bias(self) -> _Floats: ...
    @property
    def accel_bias(self) -> _Floats: ...
    @property
    def covariance(self) -> _Floats: ...
    @property
    def status(self) -> _ObserverStatus: ...
    @property
    def reason(self) -> str | None: ...
    @property
    def reason_code(self) -> str | None: ...
    @property
    def reason_values(self) -> dict[str, float | int | str]: ...

@final
class NavigationFilter:
    def __new__(
        cls,
        *,
        config: NavigationConfig | None = None,
        gravity_m_s2: ArrayLike | None = None,
        body_from_camera: ArrayLike | None = None,
        gyro_sigma_rad_s: float | None = None,
        accel_sigma_m_s2: float | None = None,
        gyro_walk: float | None = None,
        accel_walk: float | None = None,
        max_delay_s: float | None = None,
    ) -> NavigationFilter: ...
    def push_imu(
        self, stamp_ns: int, gyro_rad_s: ArrayLike, accel_m_s2: ArrayLike
    ) -> tuple[_ObserverStatus, str | None]: ...
    def push_mag(self, stamp_ns: int, mag_ut: ArrayLike) -> tuple[_ObserverStatus, str | None]: ...
    def push_velocity(
        self, stamp_ns: int, velocity_m_s: ArrayLike, covariance: ArrayLike
    ) -> tuple[_ObserverStatus, str | None]: ...
    def push_pose(
        self, stamp_ns: int, world_from_camera: ArrayLike, covariance: ArrayLike
    ) -> tuple[_ObserverStatus, str | None]: ...
    def push_zero_velocity(
        self, stamp_ns: int, sigma_m_s: float = 0.01
    ) -> tuple[_ObserverStatus, str | None]: ...
    def state(self, stamp_ns: int) -> NavigationState | None: ...

@final
class PositionObserver:
    def __new__(
        cls,
        velocity_m_s: ArrayLike,
        position_m: ArrayLike,
        *,
        gravity_m_s2: ArrayLike | None = None,
        k_v: float = 4.0,
        k_vx: float = 4.0,
        k_x: float = 4.0,
    ) -> PositionObserver: ...
    def step(
        self,
        gyro_rad_s: ArrayLike,
        accel_m_s2: ArrayLike,
        world_from_body: ArrayLike,
        velocity_m_s: ArrayLike | None = None,
        position_m: ArrayLike | None = None,
        *,
        dt_s: float,
    ) -> tuple[_ObserverStatus, str | None]: ...
    @property
    def velocity_m_s(self) -> NDArray[np.float64]: ...
    @property
    def position_m(self) -> NDArray[np.float64]: ...

def calibrate_imu_still(
    gyro_rad_s: ArrayLike,
    accel_m_s2: ArrayLike,
    stamp_ns: ArrayLike,
    *,
    gravity_m_s2: float = 9.81,
) -> dict[str, Any]: ...
def calibrate_mag_ellipsoid(mag_ut: ArrayLike) -> dict[str, Any]: ...
def calibrate_camera_imu(
    camera_rad_s: ArrayLike,
    camera_stamp_ns: ArrayLike,
    gyro_rad_s: ArrayLike,
    gyro_stamp_ns: ArrayLike,
    *,
    largest_offset_s: float = 0.1,
) -> dict[str, Any]: ...
