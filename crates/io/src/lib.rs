//! Files: data sets, trajectories, calibration, images and point clouds. No devices.
