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
    """The pipeline around an engine that knows the answer; returns the engine's class."""
    import fakes
    import sphereflow.pipeline

    class Engine(fakes.FakeEngine):
        made: ClassVar[list[fakes.FakeEngine]] = []

    monkeypatch.setattr(sphereflow.pipeline, "Engine", Engine)
    return Engine
