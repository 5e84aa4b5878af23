"""sphereflow: where a moving camera is, and what the world around it looks like.

A camera is a sphere of rays. From depth images the engine finds the camera's velocities, integrates
them to a trajectory, and builds a map; every result carries a status and a covariance.

Six lines on your own arrays::

    import sphereflow as sf
    camera = sf.Camera.pinhole(525, 525, 319.5, 239.5, 640, 480)
    odometry = sf.odometry.DepthOdometry(camera)
    for stamp_ns, depth_m in my_frames:          # (480, 640) float32 metres, NaN or 0 = unknown
        result = odometry.push(depth_m, stamp_ns)
        print(result.status, result.world_from_camera)

Units are SI, stamps integer nanoseconds, quaternions x, y, z, w, camera axes x right, y down,
z forward; see CONVENTIONS.md.
"""

import typing as _typing

from sphereflow import (
    attitude,
    depth,
    errors,
    eval,
    flow,
    io,
    navigation,
    observers,
    odometry,
    sensors,
    sim,
    slam,
    solver,
    sphere,
)
from sphereflow._native import (
    Calibration,
    Camera,
    SphereGrid,
    Trajectory,
    Update,
    __version__,
    associate,
)
from sphereflow.errors import (
    DataError,
    DtypeError,
    FileAccessError,
    MissingExtraError,
    MissingFileError,
    ShapeError,
    SphereflowError,
    TimeOrderError,
    ValueRangeError,
)

if _typing.TYPE_CHECKING:
    from sphereflow import calibration, config
    from sphereflow.engine import Engine, ImuBatch, MagSample, RgbdFrame
    from sphereflow.pipeline import run

__all__ = [
    "Calibration",
    "Camera",
    "DataError",
    "DtypeError",
    "Engine",
    "FileAccessError",
    "ImuBatch",
    "MagSample",
    "MissingExtraError",
    "MissingFileError",
    "RgbdFrame",
    "ShapeError",
    "SphereGrid",
    "SphereflowError",
    "TimeOrderError",
    "Trajectory",
    "Update",
    "ValueRangeError",
    "__version__",
    "associate",
    "attitude",
    "calibration",
    "config",
    "depth",
    "errors",
    "eval",
    "flow",
    "io",
    "navigation",
    "observers",
    "odometry",
    "run",
    "sensors",
    "sim",
    "slam",
    "solver",
    "sphere",
]


_LATE = {
    "Engine": "sphereflow.engine",
    "ImuBatch": "sphereflow.engine",
    "MagSample": "sphereflow.engine",
    "RgbdFrame": "sphereflow.engine",
    "calibration": "",
    "config": "",
    "run": "sphereflow.pipeline",
}
"""What is imported only when it is used, and from where: `import sphereflow` stays quick."""


def __getattr__(name: str) -> _typing.Any:
    """Import what is late."""
    if name not in _LATE:
        raise AttributeError(f"module 'sphereflow' has no attribute {name!r}")
    import importlib

    home = _LATE[name]
    if not home:
        return importlib.import_module(f"sphereflow.{name}")
    return getattr(importlib.import_module(home), name)


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
