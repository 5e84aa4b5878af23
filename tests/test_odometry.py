"""Velocity and odometry from Python: signs, statuses with reasons, named errors."""

import numpy as np
import pytest
import sphereflow as sf

CAMERA = sf.Camera.pinhole(262.5, 262.5, 159.5, 119.5, 320, 240)


def simulated(motion: str = "hand_held", **options: object) -> sf.sim.Simulator:
    return sf.sim.Simulator(motion=motion, camera=CAMERA, depth_noise="none", **options)


def test_estimate_velocity_on_exact_depth_finds_the_motion() -> None:
    """Thesis: section 6.2. Both velocities, in the body frame of the first image."""
    first, second = simulated("room_tour", duration_s=0.1).frames(0, 2)
    estimate = sf.odometry.estimate_velocity(
        CAMERA, first.depth_m, second.depth_m, (second.stamp_ns - first.stamp_ns) * 1e-9
    )
    assert estimate.status == "tracked"
    # The true twist of the pair lies between those at its ends.
    v = 0.5 * (first.linear_m_s + second.linear_m_s)
    w = 0.5 * (first.angular_rad_s + second.angular_rad_s)
    assert np.linalg.norm(estimate.linear_m_s - v) < 0.01
    assert np.linalg.norm(estimate.angular_rad_s - w) < 0.01
    assert np.linalg.norm(v) > 0.05
    eigenvalues = np.linalg.eigvalsh(estimate.covariance)
    assert (eigenvalues > 0).all()


def test_estimate_velocity_unknown_depth_is_lost_with_a_reason() -> None:
    nothing = np.full((240, 320), np.nan, np.float32)
    estimate = sf.odometry.estimate_velocity(CAMERA, nothing, nothing, 0.03)
    assert estimate.status == "lost"
    assert estimate.reason
    assert np.isnan(estimate.linear_m_s).all()


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"depth0_m": np.ones((2, 2), np.float32)}, sf.ShapeError, "depth0_m"),
        ({"depth1_m": np.ones((240, 320), np.uint16)}, sf.DtypeError, "depth1_m.*metres"),
        ({"dt_s": 0.0}, sf.ValueRangeError, "dt_s"),
        ({"method": "magic"}, sf.ValueRangeError, "method"),
        ({"along": "x"}, sf.ValueRangeError, "along"),
    ],
)
def test_estimate_velocity_bad_input_is_named(
    change: dict[str, object], error: type[Exception], words: str
) -> None:
    wall = np.ones((240, 320), np.float32)
    options: dict[str, object] = {"depth0_m": wall, "depth1_m": wall, "dt_s": 0.03}
    options.update(change)
    with pytest.raises(error, match=words):
        sf.odometry.estimate_velocity(CAMERA, **options)


def test_odometry_says_what_became_of_each_frame() -> None:
    odometry = sf.odometry.DepthOdometry(CAMERA)
    frames = list(simulated(duration_s=0.2).frames())
    statuses = [odometry.push(frames[0].depth_m, 0).status]
    statuses.append(odometry.push(frames[1].depth_m, 33_000_000).status)
    repeated = odometry.push(frames[1].depth_m, 66_000_000)
    backwards = odometry.push(frames[2].depth_m, 1)
    black = odometry.push(np.zeros((240, 320), np.float32), 99_000_000)
    missing = odometry.push(None, 133_000_000)
    assert statuses == ["started", "tracked"]
    assert (repeated.status, backwards.status) == ("skipped", "skipped")
    assert (black.status, missing.status) == ("lost", "lost")
    assert all(result.reason for result in (repeated, backwards, black, missing))
    assert repeated.has_pose
    assert not backwards.has_pose
    assert not black.has_pose
    assert np.isnan(black.linear_m_s).all()


def test_odometry_of_360_degrees_takes_ranges() -> None:
    camera = sf.Camera.equirectangular(256, 128)
    room = sf.sim.Simulator(
        scene="thesis_room",
        motion="sinusoids_411",
        camera=camera,
        depth_noise="none",
        duration_s=0.5,
    )
    odometry = sf.odometry.DepthOdometry(camera, along="ray")
    frames = list(room.frames())
    results = [odometry.push(frame.exact_range_m, frame.stamp_ns) for frame in frames]
    assert [result.status for result in results[1:]] == ["tracked"] * (len(frames) - 1)
    truth = np.linalg.inv(frames[0].world_from_camera) @ frames[-1].world_from_camera
    assert np.linalg.norm(results[-1].position_m - truth[:3, 3]) < 0.01


def test_cloud_keeps_one_point_a_voxel() -> None:
    cloud = sf.slam.VoxelCloud(0.05)
    wall = np.full((240, 320), 2.0, np.float32)
    cloud.add(wall, None, CAMERA, np.eye(4))
    count = len(cloud)
    cloud.add(wall, None, CAMERA, np.eye(4))
    xyz, rgb = cloud.points()
    assert len(cloud) == count == len(xyz) == len(rgb)
    np.testing.assert_allclose(xyz[:, 2], 2.0, atol=1e-6)
    with pytest.raises(sf.ValueRangeError, match="voxel_m"):
        sf.slam.VoxelCloud(0.0)


def test_range_flow_on_exact_depth_finds_the_motion() -> None:
    first, second = simulated("room_tour", duration_s=0.1).frames(0, 2)
    dt_s = (second.stamp_ns - first.stamp_ns) * 1e-9
    flow = sf.odometry.RangeFlow(CAMERA)
    assert flow.levels == [16, 8, 4]
    estimate = flow.estimate(first.depth_m, second.depth_m, dt_s)
    assert estimate.status == "tracked"
    v = 0.5 * (first.linear_m_s + second.linear_m_s)
    w = 0.5 * (first.angular_rad_s + second.angular_rad_s)
    assert np.linalg.norm(estimate.linear_m_s - v) < 0.01
    assert np.linalg.norm(estimate.angular_rad_s - w) < 0.01


def test_range_flow_bad_input_is_named() -> None:
    wall = np.ones((240, 320), np.float32)
    with pytest.raises(sf.ValueRangeError, match=r"levels.*coarse to fine"):
        sf.odometry.RangeFlow(CAMERA, levels=[4, 16])
    flow = sf.odometry.RangeFlow(CAMERA)
    with pytest.raises(sf.ValueRangeError, match="dt_s"):
        flow.estimate(wall, wall, 0.0)
    with pytest.raises(sf.ShapeError, match="depth1_m"):
        flow.estimate(wall, wall[:5], 0.03)
    with pytest.raises(sf.ShapeError, match="guess"):
        flow.estimate(wall, wall, 0.03, guess=np.eye(3))
