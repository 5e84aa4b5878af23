"""Six lines on your own arrays: depth images in, poses out.

The arrays here come from the simulator; yours may come from anywhere.
"""

import sphereflow as sf

# Your frames: (stamp in integer nanoseconds, depth in metres as float32 (480, 640), NaN unknown).
room = sf.sim.demo(seed=1)
frames = ((frame.stamp_ns, frame.depth_m) for frame in room.frames(0, 30))

camera = sf.Camera.pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)
odometry = sf.odometry.DepthOdometry(camera)
for stamp_ns, depth_m in frames:
    result = odometry.push(depth_m, stamp_ns)
    print(result.status, result.reason or "", result.position_m.round(4))

print("moved", result.position_m.round(3), "m in the frame of the first camera")
