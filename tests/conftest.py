"""Shared fixtures: the folder of real recordings, where the environment names one."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def data() -> Path:
    folder = os.environ.get("SPHEREFLOW_DATA")
    if not folder:
        pytest.skip("SPHEREFLOW_DATA is not set: tests on recordings are skipped")
    path = Path(folder)
    if not path.is_dir():
        pytest.fail(f"SPHEREFLOW_DATA={folder} is not a folder")
    return path
