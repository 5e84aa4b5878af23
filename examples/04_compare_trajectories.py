"""Absolute and relative pose error by the field's definitions (those of evo)."""

import numpy as np
import sphereflow as sf

rng = np.random.default_rng(0)
room = sf.sim.Simulator(duration_s=5.0, depth_noise="none")
truth = room.truth
noisy = sf.Trajectory(
    truth.stamp_ns,
    truth.position_m + rng.normal(scale=0.01, size=truth.position_m.shape),
    truth.quat_xyzw,
)

ape = sf.eval.ape(truth, noisy, align="se3")
rpe = sf.eval.rpe(truth, noisy, delta=1.0, delta_unit="s")
print(f"absolute: {ape.statistics.rmse:.4f} m over {len(ape.error)} poses")
print(f"relative: {rpe.statistics.rmse:.4f} m a second")
