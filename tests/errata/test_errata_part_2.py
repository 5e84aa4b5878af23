"""Chapters 5 to 7: each printed form is refuted and each corrected one held by numbers."""

import numpy as np
import pytest
from calculus import (
    Floats,
    divergence,
    gradient,
    matrix,
    ray_of,
    room_brightness,
    room_range,
    slopes,
    sphere,
    turn,
)

CENTRE = np.array([0.3, -0.2, 0.4])
POSE = matrix(turn(np.array([0.2, -0.4, 0.3])))
V, W = np.array([0.4, -0.2, 0.3]), np.array([0.1, 0.25, -0.2])
V_ERROR, W_ERROR = np.array([0.3, 0.1, -0.2]), np.array([-0.05, 0.1, 0.2])
RAYS = [ray_of(np.array(z)) for z in ([0.3, -0.2], [-0.45, 0.3], [1.0, 0.35], [-0.25, -1.3])]


def range_at(ray: Floats) -> float:
    return room_range(CENTRE, POSE, ray)


def brightness(ray: Floats) -> float:
    return room_brightness(CENTRE, POSE, ray)


def flow(ray: Floats, w: Floats, v: Floats) -> Floats:
    return np.cross(ray, w + np.cross(ray, v) / range_at(ray))


def estimate(ray: Floats) -> float:
    """Some estimate of the range: wrong, smooth."""
    return range_at(ray) + 0.1 * ray[0] * ray[1] + 0.05 * ray[2]


# Chapter 5


def test_second_term_of_the_integral_of_theorem_3_has_the_linear_velocity():
    # Section 5.2.2: multiplied out, (5.6) times D^n (eta . omega_b) has eta x (eta x v_b).
    n = 3
    for ray in RAYS:
        d, slope = range_at(ray), gradient(range_at, ray)
        whole = (slope @ flow(ray, W, V) + ray @ V) * d**n * (ray @ W)
        grads = [gradient(lambda r, k=k: range_at(r) ** k, ray) for k in (n + 1, n)]
        first = grads[0] @ np.cross(ray, W) * (ray @ W) / (n + 1)
        last = d**n * (ray @ V) * (ray @ W)
        second = {
            "corrected": grads[1] @ np.cross(ray, np.cross(ray, V)) * (ray @ W) / n,
            "printed": grads[1] @ np.cross(ray, np.cross(ray, W)) * (ray @ W) / n,
        }
        assert abs(first + second["corrected"] + last - whole) < 1e-6 * (1 + abs(whole))
        assert abs(first + second["printed"] + last - whole) > 1e-3


def test_double_product_with_the_axis_turns_the_ray_round():
    # Section 5.2.2, step 5: for eta orthogonal to w, (eta x w) x w = -eta.
    axis = np.array([0.0, 0, 1])
    ray = np.array([0.6, 0.8, 0])
    assert np.allclose(np.cross(np.cross(ray, axis), axis), -ray)
    assert not np.allclose(np.cross(np.cross(ray, axis), axis), ray)


def test_errors_of_the_fields_are_driven_by_the_errors_of_the_biases():
    # Thesis: eq. (5.19), eq. (5.20). Printed with the estimates of the biases on the right, and
    # with the gradient of the estimate in the term of v.
    w_bias, v_bias = np.array([0.05, 0, 0]), np.array([0.5, 0, 0])
    w_hat, v_hat = w_bias + W_ERROR, v_bias + V_ERROR
    for ray in RAYS:
        d, hat = range_at(ray), estimate(ray)
        g_true, g_hat = gradient(range_at, ray), gradient(estimate, ray)
        k = 2.0
        seen = flow(ray, W + w_bias - w_hat, V + v_bias - v_hat)
        rate_hat = -g_hat @ seen - (V + v_bias - v_hat) @ ray + k * (d - hat)
        rate_true = -g_true @ flow(ray, W, V) - V @ ray
        left = rate_hat - rate_true + (g_hat - g_true) @ np.cross(ray, W)
        away = np.cross(ray, np.cross(ray, V)) / d

        def right(w: Floats, v: Floats, slope: Floats) -> float:
            return g_hat @ flow(ray, w, v) + ray @ v - slope @ away - k * (hat - d)  # noqa: B023

        assert abs(left - right(W_ERROR, V_ERROR, g_hat - g_true)) < 1e-8
        assert abs(left - right(w_hat, v_hat, g_hat - g_true)) > 1e-3
        assert abs(left - right(W_ERROR, V_ERROR, g_hat)) > 1e-3


def test_rate_of_the_dissipation_has_the_sign_of_the_source():
    # Thesis: eq. (5.32): the source of the range's error is + eta . v_b~, and the biases are
    # errors.
    ray, d = RAYS[0], range_at(RAYS[0])
    g_hat, g_true = gradient(estimate, ray), gradient(range_at, ray)
    rates = []
    for v_error in (np.zeros(3), V_ERROR):
        seen = flow(ray, W, V - v_error)
        rates.append(-g_hat @ seen - (V - v_error) @ ray + g_true @ flow(ray, W, V) + V @ ray)
    source = rates[1] - rates[0] - g_hat @ np.cross(ray, np.cross(ray, V_ERROR)) / d
    assert abs(source - ray @ V_ERROR) < 1e-8
    assert abs(source + ray @ V_ERROR) > 0.1


def bumps(ray: Floats) -> float:
    """A window with soft borders: 1 near the axis, 0 behind."""
    return float(
        np.clip((ray[2] - 0.2) / 0.6, 0, 1) ** 2 * (3 - 2 * np.clip((ray[2] - 0.2) / 0.6, 0, 1))
    )


def test_source_of_the_linear_bias_on_a_cap_has_the_window_in_it():
    # Thesis: eq. (5.33). The window Lambda = phi D makes the source of the range's error phi eta .
    # v~; a bias rate with eta instead of phi eta leaves (1 - phi) eta . v~ in the derivative of V.
    rays, weights = sphere(40)
    phi = np.array([bumps(r) for r in rays])
    error = phi * 0.1 * rays[:, 0]
    # The terms with gradients cancel in both forms; these are the sources alone.
    growth = weights @ (error * phi * (rays @ V_ERROR))  # of half the square of Lambda~
    corrected = -(weights * error * phi) @ rays  # of v~ / k_v, lambda = 1
    printed = -(weights * error) @ rays
    assert abs(growth + corrected @ V_ERROR) < 1e-12
    assert abs(growth + printed @ V_ERROR) > 1e-3
    # and the source is phi eta . v itself: the rate of phi D at a fixed ray, less its transport.
    ray = RAYS[2]  # where the window is 0.9
    window = lambda r: bumps(r) * range_at(r)  # noqa: E731
    rate = bumps(ray) * (-gradient(range_at, ray) @ flow(ray, W, V) - V @ ray)
    moved = -gradient(window, ray) @ flow(ray, W, V)
    moved += range_at(ray) * gradient(bumps, ray) @ flow(ray, W, V)
    assert abs(rate - moved + bumps(ray) * ray @ V) < 1e-6
    assert abs(rate - moved + ray @ V) > 1e-3


def test_terms_of_proposition_6_are_tangent_only_with_the_bracket_over_both():
    # Section 5.5.2, b1 and b2: eta x (w~ + eta x v~ / D), not eta x w~ + eta x v~ / D.
    for ray in RAYS:
        slope, d = gradient(brightness, ray), range_at(ray)
        right = slope @ np.cross(ray, W_ERROR + np.cross(ray, V_ERROR) / d)
        printed = slope @ (np.cross(ray, W_ERROR) + np.cross(ray, V_ERROR) / d)
        driven = slope @ flow(ray, W + W_ERROR, V + V_ERROR) - slope @ flow(ray, W, V)
        assert abs(right - driven) < 1e-8
        assert abs(printed - driven) > 1e-3


def bias_rates(metre: float) -> tuple[float, float]:
    """Rates of (5.16) at one instant in units of `1 / metre` metres, gains in corrected units."""
    rays, weights = sphere(24)
    k_w, k_v, weight = 1e-5, 1e-2 * metre**2, 5000.0 / metre**2
    linear = angular = np.zeros(3)
    for ray, dw in zip(rays, weights, strict=True):
        slope = gradient(lambda r: metre * estimate(r), ray)
        miss = metre * (estimate(ray) - range_at(ray))
        angular = angular - k_w * dw * weight * miss * np.cross(slope, ray)
        turned = np.cross(ray, np.cross(ray, slope)) / (metre * range_at(ray))
        linear = linear - k_v * dw * weight * miss * (ray + turned)
    return float(np.linalg.norm(angular)), float(np.linalg.norm(linear)) / metre


def test_gains_of_the_simulation_have_other_units_than_printed():
    # Section 5.4.3: lambda_D is 5000 m^-2 (printed m^2) and k_omega rad^2 s^-2 (printed rad m
    # s^-2): only so is the observer the same in centimetres.
    assert bias_rates(1.0) == pytest.approx(bias_rates(100.0), rel=1e-6)


# Chapter 6


def contour(
    side: str, z: tuple[float, float], other: float, w: float | None
) -> tuple[Floats, Floats]:
    """Integrals of (eta x n) dl and n dl over one side of a rectangle, n outward, by mid-points."""

    def ray(p: Floats) -> Floats:
        if w is None:
            return ray_of(p)
        r = np.linalg.norm(p)
        return ray_of(p * np.tan(r * w) / (2 * r * np.tan(w / 2)))

    count, total = 400, np.zeros((2, 3))
    step = (z[1] - z[0]) / count
    for i in range(count):
        along = z[0] + (i + 0.5) * step
        p = np.array([along, other]) if side in ("top", "bottom") else np.array([other, along])
        axis = 0 if side in ("top", "bottom") else 1
        e = slopes(lambda s, p=p, axis=axis: ray(p + s[0] * np.eye(2)[axis]), np.zeros(1))[0]
        normal = np.cross(e, ray(p)) / np.linalg.norm(e)
        out = slopes(lambda s, p=p, axis=axis: ray(p + s[0] * np.eye(2)[1 - axis]), np.zeros(1))[0]
        sign = np.sign(normal @ out) * (1 if side in ("bottom", "right") else -1)
        total += (
            np.stack([np.cross(ray(p), sign * normal), sign * normal]) * np.linalg.norm(e) * step
        )
    return total[0], total[1]


def test_sides_of_a_pinhole_rectangle_are_run_by_positive_lengths():
    # Section 6.2, rows 3 and 4 of the table: their intervals are written from high to low; with
    # dz < 0 both columns would point inwards and the closed contour of n would not be -2 int eta.
    low, high = -0.2, 0.3
    z2 = 0.35  # the bottom of the image: y is down, the larger z2
    along = np.linspace(low, high, 2001)
    middle = (along[1:] + along[:-1]) / 2

    def printed(dz: float) -> Floats:
        scale = dz / (1 + middle**2 + z2**2)
        return np.stack([0 * middle, np.ones_like(middle), np.full_like(middle, -z2)]) @ scale

    truth = contour("bottom", (low, high), z2, None)[1]
    step = (high - low) / 2000
    assert np.allclose(printed(step), truth, atol=1e-7)
    assert not np.allclose(printed(-step), truth, atol=1e-2)


def test_left_side_with_distortion_is_that_of_its_own_border():
    # Section 6.3, row of the lower z1: its entries have the lower z1 itself; the second component
    # of eta x n is printed with the square of the upper one, the first and n with a bare z1.
    low, w, z = -0.35, 0.9, (-0.2, 0.3)
    upper = 0.5

    def entry(border: float) -> float:
        along = np.linspace(*z, 4001)
        middle = (along[1:] + along[:-1]) / 2
        r = np.hypot(low, middle)
        c, s = np.cos(w / 2), np.sin(w / 2)
        cr, sr = np.cos(r * w), np.sin(r * w)
        mix = 4 * s**2 * cr**2 + c**2 * sr**2
        second = -(border**2 * sr * mix + 4 * w * r * middle**2 * s**2 * cr)
        return float(np.sum(c / (r**3 * mix**1.5) * second) * (z[1] - z[0]) / 4000)

    truth = contour("left", z, low, w)[0][1]
    assert abs(entry(low) - truth) < 1e-6
    assert abs(entry(upper) - truth) > 1e-2


def test_angular_rates_cannot_agree_within_the_bias_that_they_differ_by():
    # Section 6.4: "does not exceed 1e-3 rad/s", the gyros being biased; section 7.7 gives their
    # bias in the same sequence.
    bias = np.array([1.04, -0.21, -0.43]) * 1e-3
    assert np.max(np.abs(bias)) > 1e-3
    assert np.linalg.norm(bias) > 1e-3


# Chapter 7

GRAVITY, FIELD = np.array([0, 9.81, 0]), np.array([0.3, 0.8, 0.52])
GAINS = {"v": 2.0, "g1": 0.5, "g2": 1.0, "w1": 0.7, "w2": 0.3, "a": 0.2}
STATE = {
    "v": np.array([0.1, -0.2, 0.15]),
    "g": np.array([0.3, -0.1, 0.2]),
    "w": np.array([0.02, 0.05, -0.03]),
    "a": np.array([0.1, 0.2, -0.1]),
}
LAMBDA = {"v": 1.0, "g": 1.0 / 0.5, "w": 1.0 / 0.3, "a": 1.0 / 0.2}
NONE = dict.fromkeys("awxvb", np.zeros(3))  # noises of a_m, omega_m, omega_bm, v_m, b_m


def rates(errors: dict[str, Floats], noise: dict[str, Floats] = NONE) -> dict[str, Floats]:
    """Rates of the errors of (7.4), from the observer itself."""
    w_bias, a_bias, a = (
        np.array([0.01, -0.02, 0.01]),
        np.array([0.1, 0, -0.1]),
        np.array([0.5, -9, 1]),
    )
    g, b, k = GRAVITY, FIELD, GAINS
    v_m, w_m = V + noise["v"], W + w_bias + noise["w"]
    a_m, w_bm, b_m = a + a_bias + noise["a"], w_bias + noise["x"], b + noise["b"]
    v_hat, g_hat = V + errors["v"], g + errors["g"]
    w_hat, a_hat = w_bias + errors["w"], a_bias + errors["a"]
    dv = np.cross(v_hat, w_m - w_hat) + g_hat + a_m - a_hat - k["v"] * (v_hat - v_m)
    dg = np.cross(g_hat, w_m - w_bm) - k["g1"] * (v_hat - v_m)
    dg = dg - k["g2"] * (g_hat @ b_m - g @ b) * b_m
    dw = -k["w1"] * (w_hat - w_bm) + k["w2"] * np.cross(v_hat - v_m, v_hat)
    return {
        "v": dv - (np.cross(V, W) + g + a),
        "g": dg - np.cross(g, W),
        "w": dw,
        "a": k["a"] * (v_hat - v_m),
    }


def test_errors_of_the_imu_observer_are_coupled_by_the_estimated_velocity():
    # Thesis: eq. (7.5): -v^ x w~ and k_w2 v~ x v^, printed with v~ twice (the latter then is zero).
    found, e, v_hat = rates(STATE), STATE, V + STATE["v"]
    dv = np.cross(e["v"], W) + e["g"] - e["a"] - GAINS["v"] * e["v"]
    assert np.allclose(found["v"], dv - np.cross(v_hat, e["w"]), atol=1e-13)
    assert not np.allclose(found["v"], dv - np.cross(e["v"], e["w"]), atol=1e-3)
    dw = -GAINS["w1"] * e["w"]
    assert np.allclose(found["w"], dw + GAINS["w2"] * np.cross(e["v"], v_hat), atol=1e-13)
    assert not np.allclose(found["w"], dw, atol=1e-3)


def test_remainder_of_the_periodic_system_has_the_estimated_velocity_too():
    # Thesis: eq. (7.8), from (7.5) less (7.6): -v^ x w~ and k_w2 v~ x v^; both fade as v~ and w~
    # do.
    found, e, v_hat = rates(STATE), STATE, V + STATE["v"]
    periodic = np.cross(e["v"], W) + e["g"] - e["a"] - GAINS["v"] * e["v"]
    assert np.allclose(found["v"] - periodic, -np.cross(v_hat, e["w"]), atol=1e-13)
    assert not np.allclose(found["v"] - periodic, -np.cross(e["v"], e["w"]), atol=1e-3)


def lyapunov_rate() -> float:
    return float(sum(2 * LAMBDA[name] * STATE[name] @ rate for name, rate in rates(STATE).items()))


def test_lyapunov_function_of_the_imu_observer_falls_twice_as_fast_as_printed():
    # Section 7.3: V is printed without halves; every term of its derivative doubles.
    e = STATE
    lost = GAINS["v"] * e["v"] @ e["v"] * LAMBDA["v"] + GAINS["w1"] * e["w"] @ e["w"] * LAMBDA["w"]
    lost += GAINS["g2"] * (e["g"] @ FIELD) ** 2 * LAMBDA["g"]
    assert lyapunov_rate() == pytest.approx(-2 * lost, rel=1e-12)
    assert abs(lyapunov_rate() + lost) > 0.5 * lost


def test_coupling_of_velocity_and_gyro_bias_is_a_triple_product(monkeypatch):
    # Section 7.3: printed as v~ . w~; what is left when lambda_w k_w2 differs from lambda_v is
    # 2 (lambda_w k_w2 - lambda_v) w~ . (v~ x v).
    before = lyapunov_rate()
    monkeypatch.setitem(GAINS, "w2", 0.3 + 0.1)
    change = lyapunov_rate() - before
    triple = STATE["w"] @ np.cross(STATE["v"], V)
    assert change == pytest.approx(2 * LAMBDA["w"] * 0.1 * triple, rel=1e-9)
    assert abs(change - 2 * LAMBDA["w"] * 0.1 * STATE["v"] @ STATE["w"]) > abs(change) / 2


def test_noise_of_the_field_meets_the_whole_gravity():
    # Thesis: eq. (7.17), eq. (7.18): -k_g2 (g^ . xi_b)(b + xi_b), printed with the error of g: 9.81
    # against the error's tenths.
    noise = NONE | {"b": np.array([0.01, -0.02, 0.015])}
    change = rates(STATE, noise)["g"] - rates(STATE)["g"]
    xi, k = noise["b"], GAINS["g2"]
    shared = -k * (STATE["g"] @ FIELD) * xi
    corrected = shared - k * ((GRAVITY + STATE["g"]) @ xi) * (FIELD + xi)
    printed = shared - k * (STATE["g"] @ xi) * (FIELD + xi)
    assert np.allclose(change, corrected, atol=1e-13)
    assert np.linalg.norm(change - printed) > 0.9 * np.linalg.norm(change)


def test_proposition_8_needs_the_observability_that_its_proof_uses():
    # Proposition 8 asks for bounded velocities and a periodic rate; a body that does not turn is
    # both, and an error along delta a = delta g orthogonal to the field never moves.
    along = np.cross(FIELD, [1.0, 0, 0])
    still = {"v": np.zeros(3), "w": np.zeros(3), "g": along, "a": along}
    found = rates(still)
    # With omega = 0 the turn of g~ is nought; what the observer does about it is nought as well.
    assert np.allclose(found["v"], 0, atol=1e-14)
    assert np.allclose(found["w"], 0)
    assert np.allclose(found["a"], 0)
    assert np.allclose(found["g"] - np.cross(along, W), 0, atol=1e-14)


def test_field_is_no_part_of_the_state_that_tends_to_zero():
    # Section 7.5, step 4: X contains b, whose norm is constant; the errors alone tend to zero, and
    # with b in X the matrix of (7.6), (7.14) would not be one: the term k_g2 (g~ . b) b is cubic.
    b, dt = FIELD.copy(), 1e-3
    for _ in range(1000):
        b = matrix(turn(-W * dt)) @ b
    assert np.linalg.norm(b) == pytest.approx(np.linalg.norm(FIELD))
    assert divergence(lambda r: np.cross(r, W), RAYS[0]) == pytest.approx(0, abs=1e-8)


def test_product_of_field_and_gravity_is_that_of_the_world():
    # Section 7.1: g = q* G q with G = gravity itself gives b . g = G . B; with (C.5)'s g = -q* A q
    # the printed A . B has the other sign.
    q_world = matrix(turn(np.array([0.4, -0.3, 0.8])))
    field = np.array([10.0, 40, -20])
    b = q_world.T @ field
    assert (q_world.T @ GRAVITY) @ b == pytest.approx(GRAVITY @ field)
    assert (-q_world.T @ GRAVITY) @ b == pytest.approx(-(GRAVITY @ field))
