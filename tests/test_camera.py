"""The Python face of the camera models: shapes, NaN where not visible, named errors."""

import numpy as np
import pytest
import sphereflow as sf

WIDTH, HEIGHT = 640, 480
CAMERAS = {
    "pinhole": sf.Camera.pinhole(525.0, 520.0, 319.5, 239.5, WIDTH, HEIGHT),
    "opencv": sf.Camera.opencv(
        517.3,
        516.5,
        318.6,
        255.3,
        WIDTH,
        HEIGHT,
        k1=0.2624,
        k2=-0.9531,
        p1=-0.0054,
        p2=0.0026,
        k3=1.1633,
    ),
    "fov": sf.Camera.fov(320.0, 320.0, 319.5, 239.5, 0.93, WIDTH, HEIGHT),
    "kannala_brandt": sf.Camera.kannala_brandt(
        250.0, 250.0, 319.5, 239.5, 0.01, -0.005, 0.002, -0.0005, WIDTH, HEIGHT
    ),
    "unified": sf.Camera.unified(300.0, 300.0, 319.5, 239.5, 0.6, WIDTH, HEIGHT),
    "double_sphere": sf.Camera.double_sphere(300.0, 300.0, 319.5, 239.5, -0.2, 0.55, WIDTH, HEIGHT),
    "equirectangular": sf.Camera.equirectangular(1024, 512),
}
ROUND_TRIP_PX = 1e-9  # the figure promised for every model over its valid domain


@pytest.mark.parametrize("name", CAMERAS)
def test_camera_round_trip_over_the_image_is_exact(name: str) -> None:
    camera = CAMERAS[name]
    u, v = np.meshgrid(np.linspace(0, camera.width - 1, 61), np.linspace(0, camera.height - 1, 47))
    pixels = np.stack([u.ravel(), v.ravel()], axis=1)
    rays = camera.unproject(pixels)
    known = np.isfinite(rays).all(axis=1)
    assert known.mean() > 0.7
    np.testing.assert_allclose(np.linalg.norm(rays[known], axis=1), 1.0, atol=1e-14)
    again = camera.project(2.5 * rays[known])
    assert np.abs(again - pixels[known]).max() < ROUND_TRIP_PX


def test_camera_project_behind_or_outside_is_nan() -> None:
    camera = CAMERAS["pinhole"]
    points = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [5.0, 0.0, 1.0], [np.nan, 0.0, 1.0]]
    pixels = camera.project(points)
    np.testing.assert_array_equal(np.isfinite(pixels).all(axis=1), [True, False, False, False])
    np.testing.assert_array_equal(pixels[0], [319.5, 239.5])


def test_camera_nan_intrinsic_is_named() -> None:
    with pytest.raises(sf.ValueRangeError, match="fx"):
        sf.Camera.pinhole(float("nan"), 525.0, 319.5, 239.5, WIDTH, HEIGHT)
    with pytest.raises(ValueError, match="k1"):
        sf.Camera.kannala_brandt(1.0, 1.0, 0.0, 0.0, float("nan"), 0, 0, 0, WIDTH, HEIGHT)


def test_camera_wrong_shape_names_argument_and_both_shapes() -> None:
    with pytest.raises(
        sf.ShapeError, match=r"points_in_camera: expected shape \(N, 3\), found \(4, 2\)"
    ):
        CAMERAS["pinhole"].project(np.zeros((4, 2)))
    with pytest.raises(sf.DtypeError, match="pixels"):
        CAMERAS["pinhole"].unproject(np.array([["a", "b"]]))


def test_camera_parameters_are_named() -> None:
    camera = CAMERAS["opencv"]
    assert camera.model == "opencv"
    assert camera.parameters["k2"] == -0.9531
    assert sf.Camera.from_parameters("opencv", camera.parameters, WIDTH, HEIGHT) == camera
