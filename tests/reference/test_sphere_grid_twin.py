"""The compiled sphere grid against its slow twin, on the same input."""

import sys
from pathlib import Path

import numpy as np
import pytest
import sphereflow as sf

sys.path.insert(0, str(Path(__file__).parent))
import sphere_grid as twin

ROUNDING = 1e-9  # the same sums in another order; divergence divides by pixels of 1e-3 sr
CAMERAS = {
    "pinhole": sf.Camera.pinhole(30.0, 28.0, 15.5, 11.5, 32, 24),
    "opencv": sf.Camera.opencv(30.0, 30.0, 15.5, 11.5, 32, 24, k1=0.1, k2=-0.05, p1=0.002),
    "fish-eye": sf.Camera.kannala_brandt(12.0, 12.0, 15.5, 11.5, 0.02, -0.01, 0, 0, 32, 24),
}


@pytest.mark.parametrize("name", CAMERAS)
def test_sphere_grid_equals_its_twin(name: str) -> None:
    """Thesis: section 6.1. Contour integrals over pixels, one by one."""
    camera = CAMERAS[name]
    grid = sf.SphereGrid(camera)
    np.testing.assert_allclose(grid.solid_angle, twin.solid_angle(camera), rtol=ROUNDING)
    rng = np.random.default_rng(7)
    field = np.cross(grid.rays, rng.normal(size=grid.rays.shape))
    inner = (slice(1, -1), slice(1, -1))
    np.testing.assert_allclose(
        grid.divergence(field)[inner],
        twin.divergence_inside(camera, field)[inner],
        rtol=ROUNDING,
        atol=ROUNDING,
    )
