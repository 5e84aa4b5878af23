"""What one range image lets see of the motion, from Python."""

import numpy as np
import pytest
import sphereflow as sf

CAMERA = sf.Camera.pinhole(290.0, 290.0, 159.5, 119.5, 320, 240)


def test_information_of_a_wall_ahead_names_the_three_motions_that_slide_it() -> None:
    """Thesis: Theorem 3, for a camera with a limited view."""
    found = sf.odometry.information(CAMERA, np.full((240, 320), 2.0, np.float32))
    assert found.score < 1e-3
    assert found.mean_range_m == pytest.approx(2.15, abs=0.1)  # along the rays
    names = found.unseen_names()
    assert sorted(name.split()[0] for name in names) == ["rotation", "translation", "translation"]
    assert "rotation about (0.00, 0.00, 1.00) through the camera" in names
    unseen = found.unseen()
    assert unseen.shape == (3, 6)
    # None of them turns the wall or moves it along its normal.
    assert np.abs(unseen[:, [0, 1, 5]]).max() < 1e-3


def test_information_of_a_whole_box_hides_nothing() -> None:
    """Thesis: Theorem 3."""
    camera = sf.Camera.equirectangular(320, 160)
    rays = sf.SphereGrid(camera).rays
    range_m = (np.array([1.5, 2.25, 2.0]) / np.abs(rays)).min(axis=-1).astype(np.float32)
    found = sf.odometry.information(camera, range_m, along="ray")
    assert found.unseen().shape == (0, 6)
    assert found.unseen_names() == []
    assert found.score > 0.3
    # Matrix, spectrum and directions say the same.
    scale = np.diag([1 / found.mean_range_m] * 3 + [1.0] * 3)
    scaled = scale @ found.matrix @ scale
    rebuilt = found.directions.T @ np.diag(found.eigenvalues) @ found.directions
    assert np.allclose(rebuilt, scaled, atol=1e-12)
    assert (np.diff(found.eigenvalues) >= 0).all()


def test_information_of_nothing_known_hides_everything() -> None:
    found = sf.odometry.information(CAMERA, np.full((240, 320), np.nan, np.float32))
    assert (found.score, found.domains, len(found.unseen())) == (0.0, 0, 6)
    assert np.isnan(found.mean_range_m)


@pytest.mark.parametrize(
    ("depth", "options", "error", "words"),
    [
        (np.ones((2, 2), np.float32), {}, sf.ShapeError, "depth_m"),
        (np.ones((240, 320), np.uint16), {}, sf.DtypeError, "depth_m"),
        (np.ones((240, 320), np.float32), {"along": "z"}, sf.ValueRangeError, "along"),
    ],
)
def test_information_bad_input_is_named(
    depth: np.ndarray, options: dict[str, str], error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words):
        sf.odometry.information(CAMERA, depth, **options)


def test_information_limit_that_is_no_share_is_named() -> None:
    found = sf.odometry.information(CAMERA, np.full((240, 320), 2.0, np.float32))
    with pytest.raises(sf.ValueRangeError, match="limit"):
        found.unseen(2.0)
