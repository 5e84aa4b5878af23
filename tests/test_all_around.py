"""A 360-degree camera takes the same way as any other: simulated, written, read, tracked."""

from pathlib import Path

import numpy as np
import pytest
import sphereflow as sf


@pytest.fixture(scope="module")
def room() -> sf.sim.Simulator:
    return sf.sim.Simulator(
        camera=sf.Camera.equirectangular(384, 192),
        motion="hand_held",
        depth_noise="independent",
        duration_s=1.0,
    )


def test_all_around_recording_reads_back_ranges(room: sf.sim.Simulator, tmp_path: Path) -> None:
    room.write(tmp_path / "room")
    recording = sf.io.open_recording(tmp_path / "room")
    simulated, read = next(room.frames()), recording.frame(0)
    assert simulated.depth_m is None
    assert read.depth_m is None
    half_a_count = 0.5 / recording.depth_scale + 1e-6
    np.testing.assert_allclose(read.range_m, simulated.range_m, atol=half_a_count)


def test_all_around_run_follows_the_camera(room: sf.sim.Simulator, tmp_path: Path) -> None:
    result = sf.run(room, tmp_path / "result", pictures=False)
    assert result.coverage == 1.0
    assert result.ape is not None
    assert result.ape.statistics.rmse < 0.02
    assert (tmp_path / "result" / "map.ply").stat().st_size > 100_000


def test_all_around_kinect_noise_is_refused() -> None:
    with pytest.raises(sf.ValueRangeError, match=r"360|panorama|camera"):
        sf.sim.Simulator(camera=sf.Camera.equirectangular(64, 32), depth_noise="kinect")
