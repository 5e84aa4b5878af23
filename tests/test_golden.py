"""The simulated tour's poses stay as they are committed, with any number of threads."""

import os
import subprocess
import sys
from pathlib import Path

import golden
import numpy as np
import pytest
import sphereflow as sf

POSITION_M = 1e-4
"""Other processors round otherwise: far below the millimetres of any real change."""

ANGLE_RAD = np.deg2rad(0.01)


@pytest.fixture(scope="module")
def tour():
    return golden.tour()


@pytest.mark.parametrize("kind", golden.KINDS)
def test_tour_has_its_golden_poses(tour, kind):
    expected = sf.Trajectory.read(golden.FOLDER / f"tour_{kind}.tum")
    found = tour[kind]
    assert np.array_equal(found.stamp_ns, expected.stamp_ns)
    apart_m = np.linalg.norm(np.subtract(found.position_m, expected.position_m), axis=1)
    dots = np.abs(np.sum(np.asarray(found.quat_xyzw) * np.asarray(expected.quat_xyzw), axis=1))
    turned_rad = 2 * np.arccos(np.minimum(dots, 1.0))
    assert apart_m.max() < POSITION_M
    assert turned_rad.max() < ANGLE_RAD


def test_tour_is_bit_identical_with_one_two_and_four_threads(tmp_path):
    files = {}
    for threads in (1, 2, 4):
        folder = tmp_path / str(threads)
        subprocess.run(
            [sys.executable, str(Path(golden.__file__)), str(folder)],
            env=os.environ | {"RAYON_NUM_THREADS": str(threads)},
            check=True,
            timeout=300,
        )
        files[threads] = [(folder / f"tour_{kind}.tum").read_bytes() for kind in golden.KINDS]
    assert files[1] == files[2] == files[4]
