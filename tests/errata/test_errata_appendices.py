"""The appendices: printed forms refuted, corrected ones held by numbers."""

import numpy as np
import pytest
from calculus import Floats, conjugate, generator, hat, matrix, product, pure, tangents, turn
from scipy.linalg import expm

Q = turn(np.array([0.4, -0.3, 0.8]))
V, W = np.array([0.4, -0.2, 0.3]), np.array([0.1, 0.25, -0.2])


def difference(f, dt: float = 1e-6):
    return (f(dt) - f(-dt)) / (2 * dt)


def extrinsic(dt: float) -> Floats:
    """camera_from_world after dt of body rates W, V from the attitude Q at the origin."""
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = matrix(Q)
    return np.linalg.inv(world_from_camera @ expm(generator(np.concatenate([W, V])) * dt))


def test_length_in_a_manifold_is_the_root_of_the_form():
    # Section A.1: the form sum g du du is the square of dl.
    z, dz = np.array([0.3, -0.2]), np.array([1e-4, 2e-4])
    ray = lambda p: np.append(p, 1) / np.sqrt(1 + p @ p)  # noqa: E731
    h = 1e-6
    frame = np.stack([(ray(z + h * e) - ray(z - h * e)) / (2 * h) for e in np.eye(2)])
    form = dz @ (frame @ frame.T) @ dz
    length = np.arccos(ray(z + dz / 2) @ ray(z - dz / 2))
    assert np.sqrt(form) == pytest.approx(length, rel=1e-3)
    assert form < length / 100


def test_point_of_the_world_turns_against_the_body():
    # Thesis: eq. (C.2). For the body's rate omega: x_c' = x_c x omega, R' = -Omega R.
    point = np.array([0.3, -0.5, 0.8])

    def seen(dt: float) -> Floats:
        return matrix(product(Q, turn(W * dt))).T @ point

    rate = difference(seen)
    assert np.allclose(rate, np.cross(seen(0), W), atol=1e-9)
    assert not np.allclose(rate, np.cross(W, seen(0)), atol=0.05)
    turning = difference(lambda dt: matrix(product(Q, turn(W * dt))).T)
    assert np.allclose(turning, -hat(W) @ matrix(Q).T, atol=1e-9)


def test_cross_product_of_quaternions_has_the_other_sign():
    # Section C.1.2: p x q = (p q - q p) / 2; the printed (p q* - q p*) / 2 is its opposite.
    p, q = pure(np.array([0.1, 0.5, -0.3])), pure(np.array([0.7, -0.2, 0.4]))
    printed = (product(p, conjugate(q)) - product(q, conjugate(p))) / 2
    assert np.allclose(printed[1:], -np.cross(p[1:], q[1:]))
    assert np.allclose(((product(p, q) - product(q, p)) / 2)[1:], np.cross(p[1:], q[1:]))


def test_printed_rotation_matrix_is_that_of_q_x_q_star():
    # Section C.1.2 says x -> q* x q.
    a, b, c, d = Q
    printed = np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    )
    assert np.allclose(printed, matrix(Q), atol=1e-14)
    assert not np.allclose(printed, matrix(conjugate(Q)), atol=0.1)


def euler(yaw: float, pitch: float, roll: float) -> tuple[Floats, Floats, Floats]:
    """The printed R_psi, R_theta, R_phi of C.1.3."""

    def cs(angle: float) -> tuple[float, float]:
        return np.cos(angle), np.sin(angle)

    (c, s), (cp, sp), (cr, sr) = cs(yaw), cs(pitch), cs(roll)
    return (
        np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]),
        np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]]),
        np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]]),
    )


@pytest.mark.parametrize("axis", [1, 2], ids=["pitch", "roll"])
def test_rotations_of_pitch_and_roll_are_transposed(axis):
    # Section C.1.3: R maps world to camera, so each factor is the transpose of the turn about its
    # axis; the printed R_psi is, the printed R_theta and R_phi are the turns themselves.
    angles = np.zeros(3)
    angles[axis] = 0.3
    about = {1: [0.3, 0, 0], 2: [0, 0, 0.3]}[axis]
    assert np.allclose(euler(*angles)[axis], matrix(turn(np.array(about))))
    assert np.allclose(euler(0.3, 0, 0)[0], matrix(turn(np.array([0, 0.3, 0]))).T)


def test_printed_order_with_the_transposes_is_the_attitude_of_the_sequence():
    # Section C.1.3: yaw about y, then pitch about the new x, then roll about the new z.
    yaw, pitch, roll = 0.5, -0.3, 0.2
    q = product(
        product(turn(np.array([0, yaw, 0])), turn(np.array([pitch, 0, 0]))),
        turn(np.array([0, 0, roll])),
    )
    r_psi, r_theta, r_phi = euler(yaw, pitch, roll)
    assert np.allclose(r_phi.T @ r_theta.T @ r_psi, matrix(q).T)
    assert not np.allclose(r_phi @ r_theta @ r_psi, matrix(q).T, atol=0.1)


def test_changes_of_an_extrinsic_matrix_are_minus_the_twist_of_the_body():
    # Thesis: eq. (C.6), eq. (C.7): Omega, V act on K from the left: they are -dt times the body's.
    dt, point = 0.01, np.array([0.3, -0.2, 2.0, 1.0])
    step = -np.concatenate([W, V]) * dt
    assert np.allclose(expm(generator(step)) @ extrinsic(0) @ point, extrinsic(dt) @ point)
    assert np.allclose(expm(generator(step)) @ extrinsic(0), extrinsic(dt))


def test_tangent_plane_of_the_tests_is_one():
    # What the other tests lean on.
    ray = np.array([0.6, 0, 0.8])
    assert np.allclose(tangents(ray) @ ray, 0)
    assert np.allclose(tangents(ray) @ tangents(ray).T, np.eye(2))
