"""Equations that the code uses without a line of their own, held by numbers as printed."""

import numpy as np
import pytest
import sphereflow as sf
from calculus import (
    Floats,
    conjugate,
    divergence,
    gradient,
    hat,
    matrix,
    moved,
    product,
    ray_of,
    room_brightness,
    room_range,
    sphere,
    tangents,
    turn,
    turned,
)
from scipy.integrate import solve_ivp
from scipy.linalg import expm

CENTRE, Q = np.array([0.3, -0.2, 0.4]), turn(np.array([0.2, -0.4, 0.3]))
V, W, P = np.array([0.4, -0.2, 0.3]), np.array([0.1, 0.25, -0.2]), np.array([0.7, -0.3, 1.1])
RAY = ray_of(np.array([0.3, -0.2]))
H = 1e-5


def range_at(ray: Floats) -> float:
    return room_range(CENTRE, matrix(Q), ray)


def test_pinhole_projects_as_the_homogeneous_matrix_does():
    # Thesis: eq. (1.1), eq. (1.2)
    camera = sf.Camera.pinhole(1.0, 1.0, 0.0, 0.0, 640, 480)
    homogeneous = np.hstack([np.eye(3), np.zeros((3, 1))]) @ np.array([0.3, -0.2, 2.0, 1.0])
    seen = camera.project(np.array([[0.3, -0.2, 2.0]]))[0]
    assert np.allclose(seen, homogeneous[:2] / homogeneous[2])
    assert np.allclose(seen, [0.15, -0.1])


def seen_from(dt: float, point: Floats) -> tuple[Floats, float]:
    """Ray and range of a point of the wall after dt."""
    centre, q = CENTRE + turned(Q, V * dt), product(Q, turn(W * dt))
    inside = turned(conjugate(q), point - centre)
    return inside / np.linalg.norm(inside), float(np.linalg.norm(inside))


def test_ray_and_range_of_a_point_of_the_wall_move_as_printed():
    # Thesis: eq. (1.9), eq. (1.10), eq. (1.14), eq. (1.15): the map from wall to ray and back, and
    # its rate.
    point = CENTRE + range_at(RAY) * turned(Q, RAY)
    ray, distance = seen_from(0, point)
    assert np.allclose(ray, RAY)
    (before, near), (after, far) = seen_from(-H, point), seen_from(H, point)
    assert np.allclose((after - before) / (2 * H), np.cross(RAY, W + np.cross(RAY, V) / distance))
    assert (far - near) / (2 * H) == pytest.approx(-V @ RAY, abs=1e-8)


def test_brightness_of_a_point_of_the_wall_does_not_change():
    # Thesis: eq. (1.11), eq. (1.12), eq. (2.1): what the image constraint says of a Lambertian
    # scene.
    point = CENTRE + range_at(RAY) * turned(Q, RAY)
    values = []
    for dt in (-0.01, 0, 0.01):
        centre, q = CENTRE + turned(Q, V * dt), product(Q, turn(W * dt))
        values.append(room_brightness(centre, matrix(q), seen_from(dt, point)[0]))
    assert np.ptp(values) < 1e-12


def test_range_of_a_moving_camera_stays_above_the_distance_of_its_domain():
    # Thesis: eq. (5.4): D >= D_* for centres that stay inside the room.
    rng = np.random.default_rng(0)
    for _ in range(200):
        centre = rng.uniform(-0.5, 0.5, size=3)
        ray = rng.normal(size=3)
        assert room_range(centre, np.eye(3), ray / np.linalg.norm(ray)) > 1.6 - np.sqrt(0.75)


MIDDLE = np.array([0.4, 0, 0.2])


def of_revolution(ray: Floats, middle: Floats = MIDDLE) -> float:
    """Range of a spheroid about an axis along y through `middle`, camera at the origin."""
    axes = np.array([1.5, 2.0, 1.5])
    direction, start = ray / axes, -middle / axes
    a, b, c = direction @ direction, direction @ start, start @ start - 1
    return float((-b + np.sqrt(b * b - a * c)) / a)


def test_scene_with_a_rotation_axis_has_a_stationary_motion_about_it():
    # Thesis: eq. (5.5), eq. (5.6), eq. (5.13), eq. (5.30), eq. (5.31), Theorem 3: turning about the
    # axis.
    w_b = np.array([0, 0.3, 0])
    v_b = np.cross(w_b, -MIDDLE)  # of the camera on its circle about the axis
    length = np.linalg.norm(v_b) / np.linalg.norm(w_b)
    u = np.cross(v_b, w_b) / np.linalg.norm(np.cross(v_b, w_b))  # v_b = omega_b x l u
    assert np.allclose(v_b, np.cross(w_b, length * u))
    for z in ([0.3, -0.2], [-0.8, 0.5], [1.5, -1.0]):
        ray = ray_of(np.array(z))
        d, slope = of_revolution(ray), gradient(of_revolution, ray)
        assert abs(slope @ np.cross(ray, w_b + np.cross(ray, v_b) / d) + ray @ v_b) < 1e-8
        w, v = w_b / np.linalg.norm(w_b), v_b / np.linalg.norm(v_b)
        assert abs(slope @ np.cross(d * ray + length * u, w) + length * d * ray @ v) < 1e-8
        other = np.array([0.3, 0, 0])
        assert abs(slope @ np.cross(ray, other + np.cross(ray, v_b) / d) + ray @ v_b) > 1e-4


def test_turn_about_an_axis_through_the_camera_is_stationary():
    # Thesis: eq. (5.7)
    for z in ([0.3, -0.2], [-0.8, 0.5], [1.5, -1.0]):
        ray = ray_of(np.array(z))
        slope = gradient(lambda r: of_revolution(r, 0 * MIDDLE), ray)
        assert abs(slope @ np.cross(ray, [0, 0.3, 0])) < 1e-8
        assert abs(slope @ np.cross(ray, [0.3, 0, 0])) > 1e-3


def test_stationary_motion_has_its_velocities_at_right_angles():
    # Thesis: eq. (5.8), eq. (5.12): for any closed scene the integral is (v . omega) / 3
    # of D^3.
    rays, weights = sphere(28)
    total, cubes = 0.0, 0.0
    for ray, dw in zip(rays, weights, strict=True):
        d, slope = range_at(ray), gradient(range_at, ray)
        rate = slope @ np.cross(ray, W + np.cross(ray, V) / d) + ray @ V
        total += dw * rate * d**3 * (ray @ W)
        cubes += dw * d**3
    assert total == pytest.approx(V @ W / 3 * cubes, rel=1e-3)


def test_calculus_of_the_sphere_is_that_of_appendix_a():
    # Thesis: eq. (5.9), eq. (5.10), eq. (5.11), eq. (A.1), eq. (A.2), eq. (A.3), eq. (A.4), eq.
    # (A.7)
    up = lambda r: r @ P  # noqa: E731
    slope = gradient(up, RAY)
    assert np.allclose(slope, -np.cross(RAY, np.cross(RAY, P)), atol=1e-9)
    for e in tangents(RAY):
        change = (up(moved(RAY, H * e)) - up(moved(RAY, -H * e))) / (2 * H)
        assert abs(slope @ e - change) < 1e-9
        assert abs(slope @ e - e @ P) < 1e-9
    laplacian = divergence(lambda r: -np.cross(r, np.cross(r, P)), RAY)
    assert laplacian == pytest.approx(-2 * RAY @ P, abs=1e-8)
    assert divergence(lambda r: np.cross(r, P), RAY) == pytest.approx(0, abs=1e-8)


def test_area_of_a_patch_that_flows_grows_with_the_divergence():
    # Thesis: eq. (A.5), eq. (A.6), eq. (A.8), eq. (A.9): the area between two neighbours along a
    # flow.
    first, second = 1e-4 * tangents(RAY)
    for field, growth in (
        (lambda r: -np.cross(r, np.cross(r, P)), -2 * RAY @ P),
        (lambda r: np.cross(r, P), 0.0),
    ):

        def area(h: float, field=field) -> float:
            corners = [r + h * field(r) for r in (RAY, moved(RAY, first), moved(RAY, second))]
            return float(np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ corners[0])

        rate = (area(H) - area(-H)) / (2 * H) / area(0)
        assert rate == pytest.approx(growth, abs=2e-3)
    jacobi = np.cross(first, np.cross(second, P)) + np.cross(second, np.cross(P, first))
    assert np.allclose(jacobi + np.cross(P, np.cross(first, second)), 0, atol=1e-20)


def test_lyapunov_function_of_the_images_falls_as_printed():
    # Thesis: eq. (5.17), eq. (5.21), eq. (5.22), eq. (5.23), Proposition 1: by (5.16) itself.
    rays, weights = sphere(28)
    v_error, w_error = np.array([0.3, 0.1, -0.2]), np.array([-0.05, 0.1, 0.2])
    k_d, k_w, k_v, weight = 3.0, 0.1, 0.4, 2.0

    def wrong(ray: Floats) -> float:
        return 0.1 * ray[0] * ray[1] + 0.05 * ray[2]

    def hat_of(ray: Floats) -> float:
        return range_at(ray) + wrong(ray)

    def away(ray: Floats) -> Floats:
        return np.cross(ray, np.cross(ray, V)) / range_at(ray)

    fields, dw_hat, dv_hat, corrected, largest = 0.0, np.zeros(3), np.zeros(3), 0.0, 0.0
    for ray, dw in zip(rays, weights, strict=True):
        d, miss = range_at(ray), wrong(ray)
        slope, slope_hat = gradient(range_at, ray), gradient(hat_of, ray)
        seen = np.cross(ray, W - w_error + np.cross(ray, V - v_error) / d)
        rate = -slope_hat @ seen - (V - v_error) @ ray - k_d * miss
        rate += slope @ np.cross(ray, W + np.cross(ray, V) / d) + V @ ray
        fields += dw * weight * miss * rate
        dw_hat = dw_hat - k_w * dw * weight * miss * np.cross(slope_hat, ray)
        turned_slope = np.cross(ray, np.cross(ray, slope_hat)) / d
        dv_hat = dv_hat - k_v * dw * weight * miss * (ray + turned_slope)
        spread = divergence(away, ray)
        largest = max(largest, abs(spread))
        formula = (2 * ray @ V - slope @ np.cross(ray, np.cross(ray, V)) / d) / d
        assert abs(spread - formula) < 1e-6  # the L of Proposition 1
        corrected -= dw * weight * (k_d - spread / 2) * miss**2
    found = fields + w_error @ dw_hat / k_w + v_error @ dv_hat / k_v
    assert found == pytest.approx(corrected, rel=1e-3)
    assert k_d > largest / 2
    assert found < 0


def test_estimate_along_a_characteristic_is_the_printed_integral():
    # Thesis: eq. (5.39), eq. (5.41), eq. (5.42), eq. (5.48), eq. (5.49), eq. (5.50): a decaying
    # memory of what was seen along the way of a ray.
    k, end = 2.0, 0.8

    def field(_, ray):
        return np.cross(ray, W + np.cross(ray, V) / range_at(ray))

    path = solve_ivp(field, (0, end), RAY, rtol=1e-10, atol=1e-12, dense_output=True).sol

    def source(t):
        return k * range_at(path(t) / np.linalg.norm(path(t))) - V @ path(t)

    found = solve_ivp(lambda t, d: source(t) - k * d, (0, end), [1.0], rtol=1e-10, atol=1e-12).y[
        0, -1
    ]
    t, dt = np.linspace(0, end, 4001), end / 4000
    values = np.array([source(x) for x in t]) * np.exp(k * (t - end))
    integral = np.exp(-k * end) + dt * (values.sum() - (values[0] + values[-1]) / 2)
    assert found == pytest.approx(integral, rel=1e-6)
    assert abs(np.linalg.norm(path(end)) - 1) < 1e-8


# Chapter 7: a periodic motion, and the errors of (7.4) about it

GAINS = {"v": 2.0, "g1": 1.0, "g2": 1.0, "w1": 1.0, "w2": 0.5, "a": 0.3}
PERIOD = 4.0
GRAVITY = np.array([0, 9.81, 0])


def motion(t: float) -> tuple[Floats, Floats, Floats]:
    """Velocity, rate and unit field of a body that swings about three axes."""
    angle = 2 * np.pi * t / PERIOD
    rate = np.array([0.9 * np.cos(angle), 0.7 * np.sin(angle), 0.5 * np.cos(2 * angle)])
    speed = np.array([0.3 * np.sin(angle), 0.2 * np.cos(angle), 0.2 * np.sin(2 * angle)])
    field = np.array([0.5 * np.sin(angle), 0.8, 0.5 * np.cos(angle)])
    return speed, rate, field / np.linalg.norm(field)


def periodic_matrix(t: float) -> Floats:
    """A_infinity of (7.14) for (v~, g~, omega_b~, a_b~), v and b being given functions of time."""
    v, w, b = motion(t)
    out, k, one = np.zeros((12, 12)), GAINS, np.eye(3)
    out[:3] = np.hstack([-hat(w) - k["v"] * one, one, -hat(v), -one])
    out[3:6, :6] = np.hstack([-k["g1"] * one, -hat(w) - k["g2"] * np.outer(b, b)])
    out[6:9, :9] = np.hstack([-k["w2"] * hat(v), 0 * one, -k["w1"] * one])
    out[9:, :3] = k["a"] * one
    return out


def error_rates(t: float, x: Floats, noise: dict[str, Floats] | None = None) -> Floats:
    """Rates of the errors, from (7.4) and (7.1) themselves."""
    v, w, b = motion(t)
    k, xi = GAINS, dict.fromkeys("awxvb", np.zeros(3)) | (noise or {})
    dv, dg, dw, da = x.reshape(4, 3)
    v_miss, g_hat = dv - xi["v"], GRAVITY + dg
    return np.concatenate(
        [
            np.cross(v + dv, w + xi["w"] - dw)
            - np.cross(v, w)
            + dg
            + xi["a"]
            - da
            - k["v"] * v_miss,
            np.cross(g_hat, w + xi["w"] - xi["x"])
            - np.cross(GRAVITY, w)
            - k["g1"] * v_miss
            - k["g2"] * (g_hat @ (b + xi["b"]) - GRAVITY @ b) * (b + xi["b"]),
            -k["w1"] * (dw - xi["x"]) + k["w2"] * np.cross(v_miss, v + dv),
            k["a"] * v_miss,
        ]
    )


X = np.array([0.1, -0.2, 0.15, 0.3, -0.1, 0.2, 0.02, 0.05, -0.03, 0.1, 0.2, -0.1])


def test_errors_are_a_periodic_linear_system_and_a_square():
    # Thesis: eq. (7.6), eq. (7.7), eq. (7.14), eq. (7.15): the rest is - v~ x omega_b~ alone.
    for t in (0.3, 1.7):
        rest = error_rates(t, X) - periodic_matrix(t) @ X
        assert np.allclose(rest[:3], -np.cross(X[:3], X[6:9]), atol=1e-14)
        assert np.allclose(rest[3:], 0, atol=1e-13)
    assert np.allclose(periodic_matrix(0.4), periodic_matrix(0.4 + PERIOD))
    # (7.6) is it less its terms of v and of the product with the field, which (7.8) holds.
    v, w, b = motion(0.3)
    short = periodic_matrix(0.3)
    short[:3, 6:9] += hat(v)
    short[6:9, :3] += GAINS["w2"] * hat(v)
    short[3:6, 3:6] += GAINS["g2"] * np.outer(b, b)
    assert np.allclose(short[3:6, 3:6], -hat(w))


def resolvent(start: float, end: float) -> Floats:
    """Of the periodic system."""
    solution = solve_ivp(
        lambda t, r: (periodic_matrix(t) @ r.reshape(12, 12)).ravel(),
        (start, end),
        np.eye(12).ravel(),
        rtol=1e-9,
        atol=1e-11,
    )
    return solution.y[:, -1].reshape(12, 12)


def test_resolvent_of_a_period_contracts():
    # Thesis: eq. (7.9), eq. (7.10), eq. (7.11), eq. (7.12), eq. (7.13), Proposition 9: all
    # multipliers of one period are inside the unit circle, hence the exponential rate.
    one = resolvent(0, PERIOD)
    assert np.allclose(one, resolvent(PERIOD, 2 * PERIOD), atol=1e-6)
    assert np.allclose(resolvent(1.0, PERIOD) @ resolvent(0, 1.0), one, atol=1e-6)
    assert np.max(np.abs(np.linalg.eigvals(one))) < 1
    # Only errors with v~ = omega_b~ = 0, g~ . b = 0 and a_b~ = g~ would stay; no turn about one
    # axis.
    assert np.linalg.matrix_rank(np.stack([motion(t)[1] for t in (0, 1, 2)]), tol=1e-6) > 1


def test_noise_enters_by_a_constant_and_a_linear_part():
    # Thesis: eq. (7.16), eq. (7.17), eq. (7.18), eq. (7.19), as corrected in the errata.
    rng = np.random.default_rng(5)
    noise = {name: 0.01 * rng.normal(size=3) for name in "awxvb"}
    t = 0.6
    v, _, b = motion(t)
    k, dv, dg = GAINS, X[:3], X[3:6]
    g_hat = GRAVITY + dg
    f1 = np.concatenate(
        [
            np.cross(v, noise["w"]) + noise["a"] + k["v"] * noise["v"],
            np.cross(GRAVITY, noise["w"] - noise["x"])
            + k["g1"] * noise["v"]
            - k["g2"] * (dg @ b) * noise["b"]
            - k["g2"] * (g_hat @ noise["b"]) * (b + noise["b"]),
            k["w1"] * noise["x"] - k["w2"] * np.cross(noise["v"], v),
            -k["a"] * noise["v"],
        ]
    )
    f2 = np.concatenate(
        [
            np.cross(dv, noise["w"]),
            np.cross(dg, noise["w"] - noise["x"]),
            -k["w2"] * np.cross(noise["v"], dv),
            np.zeros(3),
        ]
    )
    assert np.allclose(error_rates(t, X, noise) - error_rates(t, X), f1 + f2, atol=1e-13)


def test_error_under_noise_is_bounded_by_its_size():
    # Thesis: eq. (7.20), eq. (7.21), eq. (7.22), Proposition 10: half the noise, half the error.
    ends = {}
    for size in (0.0, 0.005, 0.01):

        def rates(t, x, size=size):
            swing = size * np.sin(7 * t)
            noise = {name: swing * np.array([1.0, -1, 0.5]) for name in "awxvb"}
            return error_rates(t, x, noise)

        path = solve_ivp(rates, (0, 160), 0.05 * X, rtol=1e-8, atol=1e-10, max_step=0.1)
        ends[size] = np.max(np.linalg.norm(path.y[:, path.t > 120], axis=0))
    assert ends[0.0] < 1e-3
    assert ends[0.005] > ends[0.0]
    assert ends[0.01] / ends[0.005] == pytest.approx(2, rel=0.1)


def test_change_of_a_transform_acts_on_the_left():
    # Thesis: eq. (B.1), eq. (B.2)
    change, point = hat(0.3 * P), np.array([0.2, 0.5, -0.1])
    a = matrix(Q)
    series = sum(
        np.linalg.matrix_power(change, m) / np.prod(np.arange(1.0, m + 1)) for m in range(1, 20)
    )
    assert np.allclose(expm(change) @ (a @ point), (expm(change) @ a) @ point)
    assert np.allclose((expm(change) - np.eye(3)) @ a, series @ a)
