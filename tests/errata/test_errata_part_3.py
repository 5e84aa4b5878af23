"""Chapters 8 to 10: printed forms refuted, corrected ones held by numbers."""

import numpy as np
import pytest
from calculus import (
    Floats,
    conjugate,
    generator,
    hat,
    matrix,
    product,
    pure,
    turn,
    turned,
)
from scipy.linalg import expm

Q = turn(np.array([0.4, -0.3, 0.8]))
V, W = np.array([0.4, -0.2, 0.3]), np.array([0.1, 0.25, -0.2])
GRAVITY = np.array([0, 9.81, 0])  # y down
STEP = 1e-6
POINTS = np.array([[0.3, -0.2, 2.0], [-0.6, 0.4, 3.0], [0.5, 0.6, 1.5], [-0.2, -0.5, 2.5]])


def difference(f, dt: float = STEP):
    return (f(dt) - f(-dt)) / (2 * dt)


# Chapter 8

FIRST_FROM_SECOND = matrix(turn(np.array([0.1, -0.2, 0.05])))
CENTRE = np.array([0.3, -0.1, 0.2])  # of the second camera in the first frame
SECOND = (POINTS - CENTRE) @ FIRST_FROM_SECOND  # the points from the second camera
R, T = FIRST_FROM_SECOND.T, -FIRST_FROM_SECOND.T @ CENTRE  # X2 = R X1 + T, as in (1.7)


def test_essential_matrix_with_the_translation_of_the_extrinsic_matrix_is_t_cross_r():
    # Section 8.2: E = R [T]x is right for T = the second centre in the first frame, not for (1.7)'s
    # T.
    def residual(e: Floats) -> float:
        return float(np.max(np.abs(np.sum(SECOND * (POINTS @ e.T), axis=1))))

    assert residual(hat(T) @ R) < 1e-14
    assert residual(R @ hat(T)) > 1e-2
    assert residual(R @ hat(CENTRE)) < 1e-14


def test_homography_has_an_outer_product():
    # Section 8.2: H = R + T n^T / d for a plane n . X = d of the first frame; printed R + T . n /
    # d.
    normal, distance = np.array([0.1, -0.2, 0.97]), 2.0
    normal /= np.linalg.norm(normal)
    plane = POINTS * (distance / (POINTS @ normal))[:, None]
    seen = plane @ R.T + T
    outer = plane @ (R + np.outer(T, normal) / distance).T
    scalar = plane @ (R + (T @ normal) / distance).T
    assert np.allclose(np.cross(outer, seen), 0, atol=1e-13)
    assert np.max(np.abs(np.cross(scalar, seen))) > 0.1
    with_centre = plane @ (R - R @ np.outer(CENTRE, normal) / distance).T
    assert np.allclose(with_centre, seen, atol=1e-13)


def test_two_translations_stand_under_one_name():
    # Section 8.2: E as printed needs the centre, H the T of (1.7).
    assert np.allclose(T, -R @ CENTRE)
    assert not np.allclose(T, CENTRE, atol=0.1)


def extrinsic(dt: float) -> Floats:
    """camera_from_world after dt of body rates W, V from the attitude Q at the origin."""
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = matrix(Q)
    return np.linalg.inv(world_from_camera @ expm(generator(np.concatenate([W, V])) * dt))


def test_predicted_pose_moves_by_minus_the_body_velocities():
    # Section 8.3: K_pred = exp(sum alpha G dt) K holds with alpha = -(omega, v) of the body.
    dt, twist = 0.033, np.concatenate([W, V])
    assert np.allclose(expm(generator(-twist) * dt) @ extrinsic(0), extrinsic(dt), atol=1e-14)
    assert not np.allclose(expm(generator(twist) * dt) @ extrinsic(0), extrinsic(dt), atol=1e-2)


CAMERA = np.array([[525.0, 0, 319.5, 0], [0, 525, 239.5, 0], [0, 0, 1, 0]])


def pixel(k: Floats, point: Floats) -> Floats:
    h = CAMERA @ k @ np.append(point, 1)
    return h[:2] / h[2]


def test_derivative_of_a_pixel_divides_by_depth():
    # Thesis: eq. (8.1): column i of the row of point j, no sums, with the derivative of the
    # division.
    for point in POINTS:
        h = CAMERA @ np.append(point, 1)
        division = np.array([[1, 0, -h[0] / h[2]], [0, 1, -h[1] / h[2]]]) / h[2]
        for axis in np.eye(6):
            seen = difference(
                lambda a, axis=axis, point=point: pixel(expm(generator(axis * a)), point)
            )
            column = CAMERA @ generator(axis) @ np.append(point, 1)
            assert np.allclose(division @ column, seen, atol=1e-5)
            if np.linalg.norm(seen) > 1:
                assert np.linalg.norm(column[:2] - seen) > 0.1 * np.linalg.norm(seen)
                only_divided = column[:2] / h[2]
                if axis[2] == 0 and axis[3] == 0 and axis[4] == 0:
                    assert np.linalg.norm(only_divided - seen) > 0.02 * np.linalg.norm(seen)


def test_norm_of_homogeneous_vectors_depends_on_their_scale():
    # Sections 8.3 and 8.4.2, C(K) and (8.2): differences are those of pixels, after the division.
    seen = np.array([320.0, 240, 1])
    found = CAMERA @ np.append(POINTS[0], 1)
    assert np.linalg.norm(found - seen) != pytest.approx(np.linalg.norm(2 * found - seen))
    assert np.allclose(found[:2] / found[2], (2 * found)[:2] / (2 * found)[2])


def test_normal_equations_of_the_blocks_need_measurement_less_model():
    # Section 8.4.2: eps = f - m above and J^T eps without a minus below are not together right.
    rng = np.random.default_rng(3)
    jacobian, truth = rng.normal(size=(12, 5)), rng.normal(size=5)
    measured = jacobian @ truth
    start = truth + 0.1
    eps = jacobian @ start - measured
    step = np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ eps)
    assert np.allclose(start - step, truth)
    assert np.linalg.norm(start + step - truth) == pytest.approx(2 * np.linalg.norm(start - truth))
    # and with eps = m - f the printed Schur lines are right
    k, x = jacobian[:, :3], jacobian[:, 3:]
    whole = np.linalg.solve(jacobian.T @ jacobian, -jacobian.T @ eps)
    inner = np.linalg.inv(x.T @ x)
    poses = np.linalg.solve(
        k.T @ k - k.T @ x @ inner @ x.T @ k, k.T @ -eps - k.T @ x @ inner @ x.T @ -eps
    )
    assert np.allclose(poses, whole[:3])
    assert np.allclose(inner @ (x.T @ -eps - x.T @ k @ poses), whole[3:])


def test_schur_complement_costs_the_square_of_the_views_of_each_point():
    # Chapter 8 prints O(m^3 + m n), section 9.3.1 O(m^3 + m^2 n): where all see all, each of n
    # points fills m^2 blocks of the reduced matrix.
    def blocks(views: list[int]) -> int:
        return sum(k * k for k in views)

    m, n = 20, 500
    assert blocks([m] * n) == m * m * n
    assert blocks([m] * n) > 10 * m * n
    assert blocks([3] * n) == 9 * n  # sparse: neither formula


# Chapter 9


def test_two_depths_are_averaged_by_their_covariance():
    # Section 9.3.1, case 1: "the mean of both positions"; sigma_Z = 1.6e-3 Z^2.
    rng = np.random.default_rng(4)
    sigma = 1.6e-3 * np.array([1.0, 4.0]) ** 2
    draws = rng.normal(size=(20000, 2)) * sigma
    weights = sigma**-2 / np.sum(sigma**-2)
    mean, weighted = np.std(draws.mean(axis=1)), np.std(draws @ weights)
    assert mean == pytest.approx(12.8e-3, rel=0.03)
    assert weighted == pytest.approx(1.6e-3, rel=0.03)


def test_field_on_the_other_side_is_opposite_only_without_dip():
    # Section 9.4: after a half turn about the vertical the body's field turns by 180 deg - 2 dip.
    dip = np.radians(65)
    field = np.array([np.cos(dip), np.sin(dip), 0])
    turned_round = field * np.array([-1, 1, -1])
    angle = np.degrees(np.arccos(field @ turned_round))
    assert angle == pytest.approx(180 - 2 * 65)
    assert np.linalg.norm(field - turned_round) == pytest.approx(2 * np.cos(dip))
    assert np.linalg.norm(field + turned_round) > 1.5  # far from opposite


def test_three_points_with_depth_give_the_pose():
    # Section 9.5.1: "at least five matches"; with depth three points off a line do (four without).
    a, b = POINTS[:3], SECOND[:3]
    u, _, vt = np.linalg.svd((b - b.mean(0)).T @ (a - a.mean(0)))
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    assert np.allclose(rotation, R, atol=1e-12)
    assert np.allclose(b.mean(0) - rotation @ a.mean(0), T, atol=1e-12)


def test_drift_about_the_vertical_is_yaw():
    # Section 9.5.1 says pitch; in the angles of C.1.3 the rotation about y, the vertical, is psi =
    # yaw.
    heading = matrix(turn(np.array([0, 0.3, 0])))
    assert np.allclose(heading @ [0, 1, 0], [0, 1, 0])
    pitch = matrix(turn(np.array([0.3, 0, 0])))
    assert not np.allclose(pitch @ [0, 1, 0], [0, 1, 0], atol=0.1)


def observer_rate(q: Floats, seen: Floats, gain: float) -> Floats:
    """(9.2) as printed."""
    xi = product(conjugate(q), seen) - np.array([1.0, 0, 0, 0])
    return product(q, pure(W)) / 2 + gain * product(q, xi)


def test_attitude_error_decays_at_the_gain_not_at_half_of_it():
    # Thesis: eq. (9.4) and the line after it: -K xi.
    gain, small = 2.0, pure(np.array([1e-4, -2e-4, 1e-4]))
    seen = product(Q, np.array([1.0, 0, 0, 0]) + small)
    seen_rate = product(seen, pure(W)) / 2
    rate = observer_rate(Q, seen, gain)
    xi_rate = product(conjugate(rate), seen) + product(conjugate(Q), seen_rate)
    world = product(product(Q, small), conjugate(Q))
    zeta = product(product(Q, xi_rate), conjugate(Q)) + pure(turned(Q, np.cross(W, small[1:])))
    assert np.allclose(zeta[1:], -gain * world[1:], atol=1e-6)
    assert not np.allclose(zeta[1:], -gain / 2 * world[1:], atol=5e-5)


def test_norm_of_the_printed_attitude_observer_is_unstable():
    # Thesis: eq. (9.2): with q* for q^-1, |q|' = K |q| (|q| - 1) where the attitude is right.
    ends = {}
    for start in (0.999, 1.001):
        q = start * Q
        for _ in range(4000):
            seen = Q
            xi = product(conjugate(q), seen) - np.array([1.0, 0, 0, 0])
            q = q + 1e-3 * 2.0 * product(q, xi)
            if np.linalg.norm(q) > 10:
                break
        ends[start] = np.linalg.norm(q)
    assert ends[0.999] < 0.3
    assert ends[1.001] > 1.5
    # the vector part, as a rotation, keeps the norm and does not mind the sign of q_V
    q = product(Q, turn(np.array([0.2, 0, 0])))
    for sign in (1, -1) * 3000:
        e = product(conjugate(q), sign * Q)
        q = product(q, turn(2 * 2.0 * np.sign(e[0]) * e[1:] * 1e-3))
    assert abs(np.linalg.norm(q) - 1) < 1e-12
    assert abs(q @ Q) > 1 - 1e-9


def test_rate_of_the_attitude_jumps_where_the_visual_attitude_does():
    # Section 9.6.1: "continuous and differentiable by construction": the rate jumps by K times
    # twice the angle's half, whatever the filter did before.
    before = observer_rate(Q, Q, 2.0)
    after = observer_rate(Q, product(Q, turn(np.array([0.02, 0, 0]))), 2.0)
    assert np.linalg.norm(after - before) == pytest.approx(2.0 * 0.01, rel=1e-3)


ATTITUDE_ERROR = turn(np.array([0.03, -0.02, 0.04]))
GAIN = {"v": 1.5, "vx": 2.0, "x": 0.8}


def position_rates(
    v_hat: Floats, x_hat: Floats, q_hat: Floats, gravity_sign: float = 1.0
) -> tuple[Floats, Floats]:
    """Rates of (9.5) for a body at X = 0 that moves by V, gravity corrected unless said."""
    a = np.array([0.3, 0.1, -0.2])  # acceleration of the body, its own frame
    force = a - turned(conjugate(Q), GRAVITY)
    dv = np.cross(v_hat, W) + force + gravity_sign * turned(conjugate(q_hat), GRAVITY)
    dv = dv + GAIN["v"] * (V - v_hat) + GAIN["vx"] * turned(conjugate(q_hat), -x_hat)
    return dv - (np.cross(V, W) + a), turned(q_hat, v_hat) + GAIN["x"] * (-x_hat)


def test_gravity_is_added_in_the_position_observer():
    # Thesis: eq. (9.5), eq. (C.5), section C.2: with y down, A = (0, 9.81, 0) is gravity itself and
    # the acceleration of the body is a + q* A q; printed with a minus: 2 g off.
    right, _ = position_rates(V, np.zeros(3), Q)
    printed, _ = position_rates(V, np.zeros(3), Q, -1.0)
    assert np.allclose(right, 0, atol=1e-14)
    assert np.linalg.norm(printed) == pytest.approx(2 * 9.81)


def test_velocity_in_the_world_is_q_v_q_star():
    # Thesis: eq. (9.6). Printed with the estimate q^, but its rate is written for the true
    # attitude: q (omega x v^ + dv^) q*.
    v_hat = V + np.array([0.1, 0, -0.1])
    rate = np.array([0.2, -0.1, 0.3])

    def world(dt: float) -> Floats:
        return turned(product(Q, turn(W * dt)), v_hat + rate * dt)

    def printed(dt: float) -> Floats:
        attitude = product(product(Q, ATTITUDE_ERROR), turn(W * dt))
        return turned(attitude, v_hat + rate * dt)

    right = turned(Q, np.cross(W, v_hat) + rate)
    assert np.allclose(difference(world), right, atol=1e-8)
    assert np.linalg.norm(difference(printed) - right) > 5e-3


def world_rate(theta: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Rates of V~ and X~ (world), the errors themselves, with q^ = (1 + xi)^-1 q for small xi."""
    xi = theta / 2
    q_hat = product(conjugate(turn(theta)), Q)  # q q^* = turn(theta) = 1 + xi
    v_hat, x_hat = V + np.array([0.1, -0.05, 0.02]), np.array([0.02, 0.01, -0.03])
    dv, dx = position_rates(v_hat, x_hat, q_hat)
    v_error = v_hat - V
    rate = turned(Q, np.cross(W, v_error) + dv)
    return rate, dx - turned(Q, V), xi, np.concatenate([turned(Q, v_error), x_hat])


def test_error_of_position_is_drawn_back_by_its_own_gain():
    # Thesis: eq. (9.8): + k_X (X_m - X^), printed with a minus.
    _, rate, _, errors = world_rate(np.zeros(3))
    assert np.allclose(rate, errors[:3] - GAIN["x"] * errors[3:], atol=1e-14)
    assert not np.allclose(rate, errors[:3] + GAIN["x"] * errors[3:], atol=1e-3)


def test_tilt_enters_the_velocity_by_minus_twice_gravity_times_xi():
    # Thesis: eq. (9.7), eq. (9.9): with + q* G q for - q* A q the term is -2 G x xi (printed + 2 A
    # x xi).
    theta = 1e-5 * np.array([1.0, -2, 3])
    tilted, _, xi, errors = world_rate(theta)
    level, _, _, _ = world_rate(np.zeros(3))
    own = 2 * GAIN["vx"] * np.cross(errors[3:], xi)
    assert np.allclose(tilted - level, -2 * np.cross(GRAVITY, xi) + own, atol=1e-8)
    assert not np.allclose(tilted - level, 2 * np.cross(GRAVITY, xi) + own, atol=1e-5)


# Chapter 10 and Conclusion

LENGTHS = {  # Table 10.1: real, mapped, stated margin, metres
    "B1": (5.92, 5.94, 0.02),
    "B2": (5.91, 5.90, 0.01),
    "B3": (6.45, 6.42, 0.10),
    "M1": (2.41, 2.39, 0.05),
    "M2": (4.21, 4.12, 0.15),
    "F": (1.31, 1.28, 0.03),
    "HF": (2.44, 2.39, 0.06),
}


def test_three_of_seven_lengths_are_off_by_two_percent():
    # Thesis: Table 10.1. Section 10.3 and Figure 10.13 say that the errors do not exceed 1 %.
    errors = {name: (found - real) / real for name, (real, found, _) in LENGTHS.items()}
    over = {name for name, error in errors.items() if abs(error) > 0.01}
    assert over == {"M2", "F", "HF"}
    assert all(0.019 < abs(errors[name]) < 0.024 for name in over)
    assert all(abs(found - real) <= margin + 1e-9 for real, found, margin in LENGTHS.values())
