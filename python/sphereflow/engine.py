"""The main job as an object: samples in, updates out, and at the end trajectory, map and report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import sphereflow
from sphereflow._native import Calibration, Trajectory, Update, VoxelCloud
from sphereflow._native import Engine as NativeEngine
from sphereflow.config import EngineConfig
from sphereflow.interfaces import FrameLike

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ImuBatch:
    """Inertial readings in the sensor's own frame: stamps (N,), rad/s and m/s^2 (N, 3).

    At rest the accelerometer reads upwards with norm 9.81. NaN where a sensor is absent.
    """

    stamp_ns: NDArray[np.int64]
    gyro_rad_s: Floats
    accel_m_s2: Floats


@dataclass(frozen=True, slots=True)
class MagSample:
    """A reading of the magnetometer, microtesla, (3,)."""

    stamp_ns: int
    mag_ut: Floats


@dataclass(frozen=True, slots=True)
class RgbdFrame:
    """One frame of your own arrays.

    Parameters
    ----------
    stamp_ns
        Time, integer nanoseconds; that of the depth image where the images have their own.
    depth_m, range_m
        Distances along the optical axis, or along the ray (360-degree cameras), metres, (H, W), NaN
        where unknown; None where the frame has none.
    colour
        RGB, (H, W, 3) uint8, or None.
    mask
        (H, W) bool, True where depth is to be ignored: people, the robot's own arm.
    colour_stamp_ns
        The colour image's own time, where it has one.
    """

    stamp_ns: int
    depth_m: NDArray[np.float32] | None = None
    colour: NDArray[np.uint8] | None = None
    range_m: NDArray[np.float32] | None = None
    mask: NDArray[np.bool_] | None = None
    colour_stamp_ns: int | None = None


Sample = FrameLike | ImuBatch | MagSample


@dataclass(frozen=True, slots=True)
class Map:
    """What an engine has mapped: poses of keyframes, and a coloured cloud."""

    keyframes: Trajectory
    cloud: VoxelCloud


class Engine:
    """Tracks a depth camera and maps what it sees; same samples, same bits.

    Parameters
    ----------
    calibration
        The device; a bare ``Camera`` is taken for the depth camera of one.
    config
        Settings; the defaults suit a hand-held depth camera.

    Examples
    --------
    >>> import numpy as np
    >>> import sphereflow as sf
    >>> camera = sf.Camera.pinhole(60, 60, 39.5, 29.5, 80, 60)
    >>> with sf.Engine(camera) as engine:
    ...     update = engine.push(sf.RgbdFrame(0, depth_m=np.full((60, 80), 2.0, np.float32)))
    >>> update.status
    'started'
    """

    def __init__(  # noqa: D107
        self, calibration: Calibration | sphereflow.Camera, config: EngineConfig | None = None
    ) -> None:
        if isinstance(calibration, sphereflow.Camera):
            calibration = Calibration(calibration)
        self.config = EngineConfig() if config is None else config
        self._native = NativeEngine(calibration, self.config)

    def __enter__(self) -> Engine:
        """The engine; leaving the block finishes it, unless something was raised."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Compare keyframes and fit all poses."""
        if kind is None:
            self.finish()

    def push(self, sample: Sample) -> Update | None:
        """Take the next sample; what became of it, where it is a frame, else None.

        Inertial readings come before the first frame whose stamp is later than theirs.

        Raises
        ------
        ShapeError, DtypeError
            Naming the argument; the engine is as before.
        """
        if isinstance(sample, ImuBatch):
            self._native.push_imu(sample.stamp_ns, sample.gyro_rad_s, sample.accel_m_s2)
            return None
        if isinstance(sample, MagSample):
            x, y, z = np.asarray(sample.mag_ut, dtype=np.float64).tolist()
            self._native.push_mag(sample.stamp_ns, (x, y, z))
            return None
        return self.push_frame(sample)

    def push_frame(self, frame: FrameLike) -> Update:
        """Take the next frame: anything that has what ``RgbdFrame`` has."""
        return self._native.push_frame(
            frame.stamp_ns,
            depth_m=frame.depth_m,
            range_m=frame.range_m,
            colour=frame.colour,
            mask=getattr(frame, "mask", None),
            colour_stamp_ns=getattr(frame, "colour_stamp_ns", None),
        )

    def run(self, source: Iterable[Sample]) -> Iterator[Update]:
        """Push every sample of a recording or iterable; an update a frame.

        A recording's inertial readings are pushed before the frames that they precede.
        """
        frames = getattr(source, "frames", None)
        samples = source if frames is None else with_readings(source, frames())
        for sample in samples:
            update = self.push(sample)
            if update is not None:
                yield update

    def finish(self, progress: Callable[[int, int], None] | None = None) -> dict[str, Any] | None:
        """Compare keyframes that see the same surface, fit all poses, and put the cloud at them.

        Returns
        -------
        dict or None
            ``keyframes``, ``edges``, ``rejected``, ``failed``, ``converged``, ``interrupted``,
            ``largest_change_m``; None where there was nothing to compare.
        """
        return self._native.finish(progress)

    def reset(self) -> None:
        """Forget everything but calibration and settings."""
        self._native.reset()

    def cancel(self) -> None:
        """End ``finish`` from another thread; the poses are whole."""
        self._native.cancel()

    def trajectory(self, kind: Literal["final", "causal"] = "final") -> Trajectory:
        """Poses of all frames that have one: ``final``, or ``causal`` as they were published."""
        return self._native.trajectory(kind)

    def segment(self, index: int) -> Trajectory:
        """Final poses of one chain of measurements; ``report`` lists them."""
        return self._native.segment(index)

    def growing_cloud(self) -> VoxelCloud:
        """The cloud of all keyframes but the newest, for looking on while it grows."""
        return self._native.cloud(growing=True)

    def write_graph(self, path: Any) -> None:
        """Write keyframes and the motions measured between them as a g2o file."""
        self._native.write_graph(path)

    @property
    def map(self) -> Map:
        """Keyframes as they are now, and the cloud as ``finish`` put it together."""
        return Map(self._native.keyframes(), self._native.cloud())

    @property
    def calibration(self) -> Calibration:
        """What is known of the device."""
        return self._native.calibration

    @property
    def report(self) -> dict[str, Any]:
        """The numbers of the run so far: frames, coverage, segments, world, graph."""
        return self._native.report()


def with_readings(recording: Any, frames: Iterable[FrameLike]) -> Iterator[Sample]:
    """Frames with the recording's inertial readings before those that they precede."""
    feed = Readings(recording)
    for frame in frames:
        yield from feed.until(frame.stamp_ns)
        yield frame


class Readings:
    """The inertial readings of a recording in order."""

    def __init__(self, recording: Any) -> None:  # noqa: D107
        imu = getattr(recording, "imu", None) or {}
        self._imu = imu if len(imu.get("stamp_ns", ())) else None
        self._done = 0

    def until(self, stamp_ns: int) -> Iterator[ImuBatch]:
        """The readings up to a stamp that were not given yet."""
        if self._imu is None:
            return
        stamps = np.asarray(self._imu["stamp_ns"])
        end = int(np.searchsorted(stamps, stamp_ns, side="right"))
        if end > self._done:
            part = slice(self._done, end)
            self._done = end
            yield ImuBatch(
                stamps[part], self._imu["gyro_rad_s"][part], self._imu["accel_m_s2"][part]
            )
