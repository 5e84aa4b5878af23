"""What every test may use: the package (or its stand-in) and the folder of recordings."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
for folder in (HERE, HERE.parent / "tools"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

try:
    import sphereflow
except ModuleNotFoundError:  # not installed: the source tree
    sys.path.insert(0, str(HERE.parent / "python"))
    import sphereflow

import stand_in  # noqa: E402 - found by the path above

stand_in.install(sphereflow)


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of recorded data, or a skip that says why."""
    folder = os.environ.get("SPHEREFLOW_DATA")
    if not folder:
        pytest.skip("SPHEREFLOW_DATA is not set: no recorded data to test on")
    return Path(folder)


@pytest.fixture
def known_answers(monkeypatch: pytest.MonkeyPatch):
    """The pipeline around an odometry and a map that know the answer; returns the odometry."""
    import fakes

    import sphereflow.odometry
    import sphereflow.slam

    class Odometry(fakes.FakeOdometry):
        pass

    monkeypatch.setattr(sphereflow.odometry, "DepthOdometry", Odometry)
    monkeypatch.setattr(sphereflow.slam, "VoxelCloud", fakes.FakeCloud)
    return Odometry
