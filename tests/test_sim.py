"""The simulator from Python: deterministic, exact where it says so, each fault switchable."""

from pathlib import Path

import numpy as np
import pytest
import sphereflow as sf

SMALL = sf.Camera.pinhole(131.25, 131.25, 79.5, 59.5, 160, 120)


def first(**options: object) -> sf.sim.SimulatedFrame:
    return next(sf.sim.Simulator(camera=SMALL, duration_s=0.1, **options).frames())


def test_sim_same_seed_gives_the_same_bits() -> None:
    a, b, other = first(seed=5), first(seed=5), first(seed=6)
    np.testing.assert_array_equal(a.depth_m, b.depth_m)
    np.testing.assert_array_equal(a.colour, b.colour)
    assert not np.array_equal(a.depth_m, other.depth_m, equal_nan=True)


def test_sim_without_noise_is_exact() -> None:
    frame = first(depth_noise="none", image_sigma_grey=0.0)
    np.testing.assert_array_equal(frame.depth_m, frame.exact_depth_m)
    z = frame.exact_range_m * sf.SphereGrid(SMALL).rays[..., 2]
    np.testing.assert_allclose(frame.exact_depth_m, z, rtol=1e-6)


def test_sim_kinect_noise_is_that_of_real_devices() -> None:
    frames = list(sf.sim.Simulator(camera=SMALL, duration_s=0.5).frames())
    errors = [1 / frame.depth_m - 1 / frame.exact_depth_m for frame in frames]
    both = np.stack(errors)
    spread = np.nanmedian(np.nanstd(both, axis=0))  # the distortion is the same in all frames
    assert 1.2e-3 < spread < 2.4e-3  # 1.8e-3 1/m, as measured on recordings
    assert 0.01 < np.isnan(both).mean() < 0.3


def test_sim_written_recording_reads_back(tmp_path: Path) -> None:
    room = sf.sim.Simulator(camera=SMALL, duration_s=0.2, mag=True)
    calls: list[tuple[int, int]] = []
    room.write(tmp_path / "room", progress=lambda done, total: calls.append((done, total)))
    recording = sf.io.open_recording(tmp_path / "room")
    assert calls[-1] == (6, 6)
    assert len(recording) == len(room) == 6
    assert recording.camera == room.camera
    np.testing.assert_array_equal(recording.truth.stamp_ns, room.truth.stamp_ns)
    np.testing.assert_array_equal(recording.truth.position_m, room.truth.position_m)
    np.testing.assert_array_equal(recording.imu["accel_m_s2"], room.imu["accel_m_s2"])
    np.testing.assert_array_equal(recording.mag["mag_ut"], room.mag["mag_ut"])
    np.testing.assert_array_equal(recording.frame(3).colour, list(room.frames())[3].colour)


def test_sim_rests_on_gravity_where_nothing_moves() -> None:
    imu = sf.sim.Simulator(camera=SMALL, motion="still", duration_s=1.0).imu
    force = imu["accel_m_s2"].mean(axis=0)
    assert abs(np.linalg.norm(force) - 9.81) < 0.2  # its biases are those of a telephone
    assert force[1] < -9.0  # y is down: the specific force points up


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"scene": "moon"}, "scene"),
        ({"motion": "dance"}, "motion"),
        ({"depth_noise": "loud"}, "depth_noise"),
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"duration_s": float("nan")}, "duration_s"),
        ({"image_sigma_grey": -1.0}, "sigma_grey"),
        ({"readout_s": 1.0}, "readout_s"),
    ],
)
def test_sim_bad_setting_is_named(options: dict[str, object], words: str) -> None:
    with pytest.raises(sf.ValueRangeError, match=words):
        sf.sim.Simulator(camera=SMALL, **options)
