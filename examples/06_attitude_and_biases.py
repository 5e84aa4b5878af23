"""Attitude from gyro, accelerometer and magnetometer, sample by sample and at once.

The sensors here are simulated at rest and in a slow turn, with a gyro that lies by half a degree a
second; yours may come from anywhere. Bad samples give a status with a reason, never a wrong answer.
"""

import numpy as np
from sphereflow.attitude import AttitudeFilter
from sphereflow.observers import calibrate_imu_still

rng = np.random.default_rng(0)
rate_hz, bias = 200.0, np.radians([0.5, -0.3, 0.2])
t = np.arange(0, 40, 1 / rate_hz)
turn = np.where((t > 10) & (t < 20), np.radians(9.0), 0.0)  # a quarter turn about the vertical
heading = np.cumsum(turn) / rate_hz

gyro = np.stack([0 * t, 0 * t, turn], 1) + bias + rng.normal(scale=2e-3, size=(len(t), 3))
accel = np.array([0.0, 0.0, 9.81]) + rng.normal(scale=0.03, size=(len(t), 3))
field = np.stack([20 * np.sin(heading), 20 * np.cos(heading), np.full_like(t, -43.0)], 1)
stamp_ns = np.round(t * 1e9).astype(np.int64)

run = AttitudeFilter().run(gyro, accel, field, stamp_ns)
x, y, z, w = run.quat_xyzw[-1]
print(f"turned by {np.degrees(2 * np.arctan2(z, w)):.1f} deg (90), status {run.status[-1]}")
print("bias found:", np.degrees(run.gyro_bias[-1]).round(2), "deg/s of", np.degrees(bias).round(2))

filter = AttitudeFilter(method="invariant")
for i in range(1000):
    state = filter.step(gyro[i], accel[i], field[i], dt_s=1 / rate_hz)
state = filter.step([np.nan, 0, 0], accel[0], dt_s=1 / rate_hz)
print("a broken sample:", state.status, "-", state.reason)

still = calibrate_imu_still(gyro[:2000], accel[:2000], stamp_ns[:2000])
print("at rest:", np.degrees(still["gyro_bias_rad_s"]).round(2), "deg/s,", still["status"])
