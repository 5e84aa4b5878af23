"""Shared fixtures: the folder of real recordings, where the environment names one."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent.parent / "tools"))


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
