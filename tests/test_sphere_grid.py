"""The sphere grid from Python: shapes, NaN, and the identities a user would try first."""

import numpy as np
import pytest
import sphereflow as sf

P = np.array([0.3, -0.5, 0.8])


def test_sphere_grid_of_360_degrees_covers_the_sphere() -> None:
    """Thesis: section 1.2. The solid angles of all pixels add up to the whole sphere."""
    grid = sf.SphereGrid(sf.Camera.equirectangular(128, 64))
    assert abs(np.sum(grid.solid_angle) - 4 * np.pi) < 1e-6


def test_sphere_grid_operators_know_the_linear_fields() -> None:
    """Thesis: eq. (A.4), eq. (A.7)."""
    grid = sf.SphereGrid(sf.Camera.pinhole(131.25, 131.25, 79.5, 59.5, 160, 120))
    rays, field = grid.rays, grid.rays @ P
    inner = (slice(2, -2), slice(2, -2))
    tolerance = 1e-3  # second order: pixels of 8 mrad
    np.testing.assert_allclose(grid.laplacian(field)[inner], -2 * field[inner], atol=tolerance)
    gradient = grid.gradient(field)
    np.testing.assert_allclose(
        gradient[inner], (P - field[..., None] * rays)[inner], atol=tolerance
    )
    turning = grid.divergence(np.cross(rays, P))
    np.testing.assert_allclose(turning[inner], 0, atol=tolerance)


def test_sphere_grid_unknown_pixel_stays_local() -> None:
    grid = sf.SphereGrid(sf.Camera.pinhole(100, 100, 15.5, 15.5, 32, 32))
    field = grid.rays @ P
    field[16, 16] = np.nan
    unknown = np.isnan(grid.laplacian(field))
    assert unknown[16, 16]
    assert unknown.sum() <= 49


def test_sphere_grid_field_of_wrong_shape_names_it() -> None:
    grid = sf.SphereGrid(sf.Camera.equirectangular(16, 8))
    with pytest.raises(sf.ShapeError, match=r"f: expected shape \(8, 16\), found \(16, 8\)"):
        grid.laplacian(np.zeros((16, 8)))
    with pytest.raises(sf.ShapeError, match="u"):
        grid.divergence(np.zeros((8, 16)))
