"""Shared fixtures: the folder of real recordings, where the environment names one."""

import os
import sys
from pathlib import Path
from typing import ClassVar

import pytest

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent.parent / "tools")]


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of recorded data, or a skip that says why."""
    folder = os.environ.get("SPHEREFLOW_DATA")
    if not folder:
        pytest.skip("SPHEREFLOW_DATA is not set: no recorded data to test on")
    path = Path(folder)
    if not path.is_dir():
        pytest.fail(f"SPHEREFLOW_DATA={folder} is not a folder")
    return path


@pytest.fixture
def known_answers(monkeypatch: pytest.MonkeyPatch):
    """The pipeline around an odometry and a map that know the answer; returns the odometry."""
    import fakes
    import sphereflow.odometry
    import sphereflow.slam

    class Odometry(fakes.FakeOdometry):
        made: ClassVar[list[fakes.FakeOdometry]] = []

    monkeypatch.setattr(sphereflow.odometry, "DepthOdometry", Odometry)
    monkeypatch.setattr(sphereflow.slam, "VoxelCloud", fakes.FakeCloud)
    return Odometry
