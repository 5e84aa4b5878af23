"""Bad input of dense depth, item by item: a status, or an error that names it; the state stays."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sphereflow as sf
from scipy.ndimage import map_coordinates

WIDTH, HEIGHT = 160, 120
SIZE = (HEIGHT, WIDTH)
CAMERA = sf.Camera.pinhole(171.6, 164.9, 79.5, 59.5, WIDTH, HEIGHT)
RATE_HZ = 60.0

# Relative error of a range that is carried along: read between pixels again and again.
CARRIED = 0.02

BLACK, SATURATED = np.zeros(SIZE), np.full(SIZE, 256.0)
UNKNOWN = np.full(SIZE, np.nan)
ZERO, TURN = np.zeros(3), np.array([0.0, 0.3, 0.0])


def frames(count: int) -> list[sf.sim.SimulatedFrame]:
    simulator = sf.sim.Simulator(
        scene="thesis_room",
        motion="sinusoids_411",
        camera=CAMERA,
        rate_hz=RATE_HZ,
        depth_noise="none",
    )
    return list(simulator.frames(0, count))


FRAMES = frames(40)


def image(index: int) -> np.ndarray:
    return np.array(FRAMES[index].exact_grey)


def motion(index: int, **changed: Any) -> dict[str, Any]:
    """The velocities between an image and the next."""
    before, after = FRAMES[index], FRAMES[index + 1]
    known = {
        "v_m_s": 0.5 * (before.linear_m_s + after.linear_m_s),
        "omega_rad_s": 0.5 * (before.angular_rad_s + after.angular_rad_s),
        "dt_s": 1 / RATE_HZ,
    }
    return known | changed


def at(index: int) -> dict[str, Any]:
    frame = FRAMES[index]
    return {"world_from_camera": frame.world_from_camera, "stamp_ns": frame.stamp_ns}


def settled_filter(count: int = 30) -> tuple[sf.depth.DepthFilter, sf.depth.DepthResult]:
    depth_filter = sf.depth.DepthFilter(CAMERA, binning=1)
    for index in range(count):
        result = depth_filter.step(image(index), **at(index))
    assert result.status == "updated"
    return depth_filter, result


def apart(first: sf.depth.DepthResult, second: sf.depth.DepthResult) -> float:
    """Median relative difference of two ranges."""
    return float(np.median(np.abs(second.range_m / first.range_m - 1)))


def known_everywhere(result: sf.depth.DepthResult) -> bool:
    deviation = np.ones(SIZE) if result.std_m is None else result.std_m
    return all(np.isfinite(x).all() and (x > 0).all() for x in (result.range_m, deviation))


def uncertainty(result: sf.depth.DepthResult) -> float:
    assert result.std_m is not None
    return float(np.median(result.std_m / result.range_m))


# DepthFilter


def turned(angle_rad: float) -> tuple[np.ndarray, np.ndarray]:
    """The pose of image 29 turned about its y axis, and what is seen from there."""
    pose = np.eye(4)
    pose[0, 0] = pose[2, 2] = np.cos(angle_rad)
    pose[0, 2], pose[2, 0] = np.sin(angle_rad), -np.sin(angle_rad)
    ray = sf.SphereGrid(CAMERA).rays @ pose[:3, :3].T
    columns = 171.6 * ray[..., 0] / ray[..., 2] + 79.5
    rows = 164.9 * ray[..., 1] / ray[..., 2] + 59.5
    seen = map_coordinates(image(29), [rows, columns], order=3, mode="nearest")
    return FRAMES[29].world_from_camera @ pose, seen


@pytest.mark.parametrize(
    ("angle_rad", "words"), [(0.0, "stands still"), (0.006, "only turns")], ids=["zero", "turn"]
)
def test_depth_filter_without_translation_keeps_its_state_and_trusts_it_less(
    angle_rad: float, words: str
) -> None:
    """Thesis: section 2.2: without linear motion depth is not observable."""
    depth_filter, _ = settled_filter()
    still = []
    for count in range(1, 107):
        pose, seen = turned(angle_rad * np.sin(0.4 * count))
        stamp_ns = FRAMES[29].stamp_ns + count * 10**7
        result = depth_filter.step(seen, world_from_camera=pose, stamp_ns=stamp_ns)
        assert known_everywhere(result)
        # Image 28 is the last from elsewhere; it is 64 images back at the 63rd.
        if count > 63:
            assert result.status == "unobservable"
            assert result.reason is not None
            assert words in result.reason
            still.append(result)
    assert apart(still[0], still[-1]) < CARRIED
    # Variances grow as the information fades, by a third of a percent an image.
    grown = 0.997 ** (-0.5 * (len(still) - 1))
    assert uncertainty(still[-1]) > 0.98 * grown * uncertainty(still[0])


def holed() -> np.ndarray:
    spoilt = image(30)
    spoilt[40:60, 40:90] = np.nan
    spoilt[80, 30] = np.inf
    return spoilt


@pytest.mark.parametrize(
    ("spoilt", "words"),
    [(BLACK, "texture"), (SATURATED, "texture"), (UNKNOWN, "known")],
    ids=["black", "saturated", "unknown"],
)
def test_depth_filter_of_an_image_that_shows_nothing_carries_its_state_along(
    spoilt: np.ndarray, words: str
) -> None:
    depth_filter, before = settled_filter()
    result = depth_filter.step(spoilt, **at(30))
    assert result.status == "unusable"
    assert result.reason is not None
    assert words in result.reason
    assert known_everywhere(result)
    assert uncertainty(result) > uncertainty(before)
    truth = FRAMES[30].exact_range_m
    assert np.median(np.abs(result.range_m / truth - 1)) < CARRIED
    assert depth_filter.step(image(31), **at(31)).status == "updated"


def test_depth_filter_of_an_image_with_unknown_pixels_stays_known_there() -> None:
    depth_filter, _ = settled_filter()
    result = depth_filter.step(holed(), **at(30))
    assert result.status == "updated"
    assert known_everywhere(result)
    off = np.abs(result.range_m / FRAMES[30].exact_range_m - 1)
    assert np.median(off[40:60, 40:90]) < CARRIED


def test_depth_filter_of_a_gap_carries_its_state_across() -> None:
    """Images are missing: the pose of the next one says how far the camera has gone."""
    depth_filter, _ = settled_filter(20)
    result = depth_filter.step(image(38), **at(38))
    assert result.status == "updated"
    assert known_everywhere(result)
    assert np.median(np.abs(result.range_m / FRAMES[38].exact_range_m - 1)) < CARRIED


def test_depth_filter_of_a_pose_far_away_is_known_everywhere() -> None:
    depth_filter, _ = settled_filter(10)
    far = np.eye(4)
    far[:3, 3] = 1e30
    stamp_ns = FRAMES[10].stamp_ns
    assert known_everywhere(depth_filter.step(image(10), world_from_camera=far, stamp_ns=stamp_ns))
    assert known_everywhere(depth_filter.step(image(11), **at(11)))


def scaled() -> np.ndarray:
    pose = np.eye(4)
    pose[0, 0] = 2.0
    return pose


def broken(value: float) -> np.ndarray:
    pose = np.eye(4)
    pose[1, 3] = value
    return pose


STAMP = FRAMES[30].stamp_ns

REFUSED_BY_THE_FILTER: list[tuple[str, np.ndarray, dict[str, Any], type[sf.SphereflowError]]] = [
    ("image", image(30)[1:], at(30), sf.ShapeError),
    ("image", image(30)[None], at(30), sf.ShapeError),
    ("image", np.pad(image(30), 2), at(30), sf.ShapeError),
    (
        "world_from_camera",
        image(30),
        at(30) | {"world_from_camera": broken(np.nan)},
        sf.ValueRangeError,
    ),
    (
        "world_from_camera",
        image(30),
        at(30) | {"world_from_camera": broken(np.inf)},
        sf.ValueRangeError,
    ),
    ("world_from_camera", image(30), at(30) | {"world_from_camera": scaled()}, sf.ValueRangeError),
    ("world_from_camera", image(30), at(30) | {"world_from_camera": np.eye(3)}, sf.ShapeError),
    ("position_sigma_m", image(30), at(30) | {"position_sigma_m": -1.0}, sf.ValueRangeError),
    ("rotation_sigma_rad", image(30), at(30) | {"rotation_sigma_rad": np.nan}, sf.ValueRangeError),
    ("v_sigma_m_s", image(30), motion(30, v_sigma_m_s=-1.0), sf.ValueRangeError),
    ("omega_sigma_rad_s", image(30), motion(30, omega_sigma_rad_s=np.inf), sf.ValueRangeError),
    ("step", image(30), at(30) | motion(30), sf.ValueRangeError),
    ("step", image(30), {"stamp_ns": STAMP}, sf.ValueRangeError),
]


@pytest.mark.parametrize(("name", "picture", "arguments", "error"), REFUSED_BY_THE_FILTER)
def test_depth_filter_of_an_impossible_argument_names_it_and_is_as_before(
    name: str, picture: np.ndarray, arguments: dict[str, Any], error: type[sf.SphereflowError]
) -> None:
    depth_filter, _ = settled_filter(12)
    twin, _ = settled_filter(12)
    with pytest.raises(error, match=f"^{name}:"):
        depth_filter.step(picture, **arguments)
    after, expected = (each.step(image(12), **at(12)) for each in (depth_filter, twin))
    np.testing.assert_array_equal(after.range_m, expected.range_m)
    np.testing.assert_array_equal(after.std_m, expected.std_m)


@pytest.mark.parametrize("back_ns", [0, 1, 10**9], ids=["repeated", "just before", "long before"])
def test_depth_filter_of_stamps_out_of_order_skips_them(back_ns: int) -> None:
    depth_filter, before = settled_filter(12)
    twin, _ = settled_filter(12)
    stamp_ns = FRAMES[11].stamp_ns - back_ns
    result = depth_filter.step(image(20), **(at(20) | {"stamp_ns": stamp_ns}))
    assert (result.status, result.reason) == ("skipped", "the stamp does not increase")
    np.testing.assert_array_equal(result.range_m, before.range_m)
    np.testing.assert_array_equal(
        depth_filter.step(image(12), **at(12)).range_m, twin.step(image(12), **at(12)).range_m
    )


# observers


def exact_flow(index: int) -> np.ndarray:
    return np.array(sf.flow.tv_l1(image(index), image(index + 1)))


Observer = sf.depth.FlowObserver | sf.depth.DepthObserver
OBSERVERS: list[Callable[..., Observer]] = [sf.depth.FlowObserver, sf.depth.DepthObserver]


def measurement(observer: Observer, index: int) -> np.ndarray:
    if isinstance(observer, sf.depth.FlowObserver):
        return exact_flow(index)
    return np.array(1 / FRAMES[index].exact_range_m)


def settled_observer(make: Callable[..., Observer]) -> tuple[Observer, sf.depth.DepthResult]:
    observer = make(CAMERA)
    for index in range(5):
        result = observer.step(measurement(observer, index), **motion(index))
    assert result.status == "updated"
    return observer, result


@pytest.mark.parametrize(
    ("omega_rad_s", "words"), [(ZERO, "stands still"), (TURN, "only turns")], ids=["zero", "turn"]
)
@pytest.mark.parametrize("make", OBSERVERS)
def test_observer_without_translation_and_measurement_keeps_its_state(
    make: Callable[..., Observer], omega_rad_s: np.ndarray, words: str
) -> None:
    """Thesis: section 2.2. Whatever flow an image in error shows, it is not the range's."""
    observer, before = settled_observer(make)
    nothing = np.full((*SIZE, 2), 3.0) if isinstance(observer, sf.depth.FlowObserver) else UNKNOWN
    for sign in (1, -1):
        arguments = motion(5, v_m_s=ZERO, omega_rad_s=sign * omega_rad_s)
        result = observer.step(nothing, **arguments)
        assert result.status == "unobservable"
        assert result.reason is not None
        assert words in result.reason
        assert known_everywhere(result)
    assert apart(before, result) < CARRIED


NOTHING_MEASURED = [
    (sf.depth.FlowObserver, np.full((*SIZE, 2), np.nan), "known"),
    (sf.depth.FlowObserver, np.full((*SIZE, 2), np.inf), "known"),
    (sf.depth.FlowObserver, sf.flow.tv_l1(BLACK, BLACK), "known"),
    (sf.depth.FlowObserver, sf.flow.tv_l1(image(5), SATURATED), "known"),
    (sf.depth.DepthObserver, UNKNOWN, "known"),
    (sf.depth.DepthObserver, np.full(SIZE, np.inf), "known"),
    (sf.depth.DepthObserver, -np.ones(SIZE), "known"),
]


@pytest.mark.parametrize(("make", "nothing", "words"), NOTHING_MEASURED)
def test_observer_without_a_measurement_carries_its_state_along(
    make: Callable[..., Observer], nothing: np.ndarray, words: str
) -> None:
    observer, before = settled_observer(make)
    result = observer.step(nothing, **motion(5))
    assert result.status == "unusable"
    assert result.reason is not None
    assert words in result.reason
    assert known_everywhere(result)
    assert apart(before, result) < CARRIED


def test_flow_observer_of_a_flow_against_the_motion_says_that_it_does_not_fit() -> None:
    observer = sf.depth.FlowObserver(CAMERA)
    flow = np.zeros((*SIZE, 2))
    flow[..., 0] = 2.0  # with the camera, where what stands moves against it
    result = observer.step(flow, **motion(0, v_m_s=[0.4, 0, 0], omega_rad_s=ZERO))
    assert result.status == "unusable"
    assert result.reason is not None
    assert "fit the motion" in result.reason
    assert np.abs(result.range_m - 1).max() < CARRIED


@pytest.mark.parametrize("make", OBSERVERS)
def test_observer_of_partly_unknown_measurements_is_known_everywhere(
    make: Callable[..., Observer],
) -> None:
    observer, _ = settled_observer(make)
    measured = measurement(observer, 5)
    measured[30:70, 50:90] = np.nan
    result = observer.step(measured, **motion(5))
    assert result.status == "updated"
    assert known_everywhere(result)


@pytest.mark.parametrize("make", OBSERVERS)
def test_observer_of_a_gap_or_a_motion_without_measure_is_known_everywhere(
    make: Callable[..., Observer],
) -> None:
    observer, _ = settled_observer(make)
    measured = measurement(observer, 5)
    assert known_everywhere(observer.step(measured, **motion(5, dt_s=10.0)))
    assert known_everywhere(observer.step(measured, **motion(5, v_m_s=[1e200, 0, 0])))


BAD_MOTIONS: list[tuple[str, dict[str, Any], type[sf.SphereflowError]]] = [
    ("v_m_s", {"v_m_s": [np.nan, 0, 0]}, sf.ValueRangeError),
    ("v_m_s", {"v_m_s": [0, 0]}, sf.ShapeError),
    ("omega_rad_s", {"omega_rad_s": [0, np.inf, 0]}, sf.ValueRangeError),
    ("dt_s", {"dt_s": 0.0}, sf.ValueRangeError),
    ("dt_s", {"dt_s": -0.1}, sf.ValueRangeError),
    ("dt_s", {"dt_s": np.nan}, sf.ValueRangeError),
]


@pytest.mark.parametrize(("name", "changed", "error"), BAD_MOTIONS)
def test_impossible_motion_is_named_everywhere_and_changes_nothing(
    name: str, changed: dict[str, Any], error: type[sf.SphereflowError]
) -> None:
    bad, match = motion(5, **changed), f"^{name}:"
    for make in OBSERVERS:
        observer, _ = settled_observer(make)
        twin, _ = settled_observer(make)
        measured = measurement(observer, 5)
        with pytest.raises(error, match=match):
            observer.step(measured, **bad)
        after, expected = (each.step(measured, **motion(5)) for each in (observer, twin))
        np.testing.assert_array_equal(after.range_m, expected.range_m)
    depth_filter = sf.depth.DepthFilter(CAMERA)
    for call in (
        lambda: depth_filter.step(image(5), **bad),
        lambda: sf.depth.sobolev_depth(CAMERA, image(5), image(6), **bad),
        lambda: sf.depth.tv_l1_depth(CAMERA, image(5), image(6), **bad),
    ):
        with pytest.raises(error, match=match):
            call()


@pytest.mark.parametrize("make", OBSERVERS)
def test_observer_of_another_size_names_it(make: Callable[..., Observer]) -> None:
    observer, _ = settled_observer(make)
    name = "flow" if make is sf.depth.FlowObserver else "inv_range"
    with pytest.raises(sf.ShapeError, match=f"^{name}:"):
        observer.step(measurement(observer, 5)[:, 1:], **motion(5))
    for setting in ("gain", "initial_range_m"):
        with pytest.raises(sf.ValueRangeError, match=f"^{setting}:"):
            make(CAMERA, **{setting: np.nan})


# pairs of images

FLOWS: list[Callable[..., Any]] = [sf.flow.horn_schunck, sf.flow.tv_l1]
DEPTHS: list[Callable[..., Any]] = [sf.depth.sobolev_depth, sf.depth.tv_l1_depth]
BLANKS = {"black": BLACK, "saturated": SATURATED, "unknown": UNKNOWN}


@pytest.mark.parametrize("blank", BLANKS.values(), ids=BLANKS)
def test_pair_with_a_blank_image_says_nothing(blank: np.ndarray) -> None:
    for pair in ((image(0), blank), (blank, image(0)), (blank, blank)):
        for flow in FLOWS:
            assert np.isnan(flow(*pair)).all()
        for depth in DEPTHS:
            found = depth(CAMERA, *pair, **motion(0))
            assert np.isnan(found.inv_range).all()
            assert np.isnan(found.energy)


@pytest.mark.parametrize("omega_rad_s", [ZERO, TURN], ids=["zero", "turn"])
@pytest.mark.parametrize("depth", DEPTHS)
def test_pair_without_translation_has_no_depth(
    depth: Callable[..., Any], omega_rad_s: np.ndarray
) -> None:
    """Thesis: section 2.2."""
    still = motion(0, v_m_s=ZERO, omega_rad_s=omega_rad_s)
    assert np.isnan(depth(CAMERA, image(0), image(1), **still).inv_range).all()


@pytest.mark.parametrize("flow", FLOWS)
def test_flow_of_unknown_pixels_is_that_of_the_neighbours(flow: Callable[..., Any]) -> None:
    whole = flow(image(0), image(1))
    spoilt = image(1)
    spoilt[40:50, 60:70] = np.nan
    spoilt[90, 20] = np.inf
    found = flow(image(0), spoilt)
    assert np.isfinite(found).all()
    away = np.ones(SIZE, bool)
    away[20:70, 40:90] = False
    away[70:110, 0:40] = False
    # Beyond the reach of what was left out nothing changes, pixels.
    assert np.abs(found - whole)[away].max() < 0.05
    start = np.full((*SIZE, 2), np.nan)
    np.testing.assert_array_equal(flow(image(0), image(1), start=start), whole)


@pytest.mark.parametrize("depth", DEPTHS)
def test_depth_of_unknown_pixels_is_that_of_the_neighbours(depth: Callable[..., Any]) -> None:
    spoilt = image(1)
    spoilt[40:50, 60:70] = np.nan
    assert np.isfinite(depth(CAMERA, image(0), spoilt, **motion(0)).inv_range).all()


def test_pair_of_other_sizes_is_named() -> None:
    for flow in FLOWS:
        with pytest.raises(sf.ShapeError, match=r"^image1:"):
            flow(image(0), image(1)[1:])
        with pytest.raises(sf.ShapeError, match=r"^start:"):
            flow(image(0), image(1), start=np.zeros((5, 5, 2)))
    for depth in DEPTHS:
        with pytest.raises(sf.ShapeError, match=r"^image0:"):
            depth(CAMERA, image(0)[1:], image(1)[1:], **motion(0))
        with pytest.raises(sf.ShapeError, match=r"^image1:"):
            depth(CAMERA, image(0), image(1)[1:], **motion(0))
        with pytest.raises(sf.ShapeError, match=r"^start:"):
            depth(CAMERA, image(0), image(1), start=np.zeros((5, 5)), **motion(0))


def test_impossible_weights_are_named_as_in_python() -> None:
    pair = (image(0), image(1))
    for value in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(sf.ValueRangeError, match=r"^weight:"):
            sf.flow.tv_l1(*pair, weight=value)
        with pytest.raises(sf.ValueRangeError, match=r"^alpha:"):
            sf.flow.horn_schunck(*pair, alpha=value)
        with pytest.raises(sf.ValueRangeError, match=r"^weight:"):
            sf.depth.tv_l1_depth(CAMERA, *pair, weight=value, **motion(0))
        with pytest.raises(sf.ValueRangeError, match=r"^alpha_m_s:"):
            sf.depth.sobolev_depth(CAMERA, *pair, alpha_m_s=value, **motion(0))
