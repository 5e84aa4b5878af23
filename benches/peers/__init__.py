"""Other people's odometry, a point-wise peer and ours, on the same frames in one run.

    python -m benches.peers --help        # from the root of the repository

One concept a file: `table` lists the rows, `ours`, `opencv_rows` and `open3d_rows` wrap what runs,
`pairs` and `recordings` are the two parts, `worker` runs one row in a process of its own.
"""
