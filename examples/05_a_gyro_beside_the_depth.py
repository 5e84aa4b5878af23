"""Odometry step by step with a gyroscope, beside the engine, which also compares its keyframes.

The gyroscope tells the rotation where depth cannot, in front of a wall for example.
"""

import numpy as np
import sphereflow as sf

room = sf.sim.Simulator(motion="room_tour", duration_s=6.0, image_sigma_grey=0.0)
imu_ns, gyro_rad_s = room.imu["stamp_ns"], room.imu["gyro_rad_s"]
odometry = sf.odometry.DepthOdometry(room.camera)
engine = sf.Engine(room.camera)

before_ns = None
stamps_ns, measured = [], []
for frame in room.frames():
    engine.push(frame)
    rate = None
    if before_ns is not None:
        between = (imu_ns > before_ns) & (imu_ns <= frame.stamp_ns)
        # Camera and inertial sensor are turned alike here; else rotate by camera_from_imu. This
        # one has a bias: subtract it where you know it, or give a deviation that has room for it.
        rate = gyro_rad_s[between].mean(axis=0)
    result = odometry.push(frame.depth_m, frame.stamp_ns, gyro_rad_s=rate, gyro_std_rad_s=0.03)
    if result.has_pose:
        stamps_ns.append(result.stamp_ns)
        measured.append(np.r_[result.position_m, result.quat_xyzw])
    before_ns = frame.stamp_ns

poses = np.array(measured)
with_gyro = sf.Trajectory(np.array(stamps_ns), poses[:, :3], poses[:, 3:])
graph = engine.finish()
print(f"{graph['keyframes']} keyframes, {graph['edges']} edges, {graph['rejected']} rejected")
published, final = engine.trajectory("causal"), engine.trajectory("final")
for name, path in {"with gyro": with_gyro, "engine": published, "final": final}.items():
    rmse = sf.eval.ape(room.truth, path, align="se3").statistics.rmse
    print(f"{name:12s} {1000 * rmse:5.1f} mm over {len(path)} poses")
