"""Chapters 1 to 4: each printed form is refuted and each corrected one held by numbers."""

import numpy as np
import pytest
from calculus import (
    divergence,
    flow_parts,
    gradient,
    matrix,
    ray_of,
    room_range,
    slopes,
    sphere,
    tangents,
    turn,
)

CENTRE = np.array([0.3, -0.2, 0.4])
TURN = turn(np.array([0.2, -0.4, 0.3]))
V, W = np.array([0.4, -0.2, 0.3]), np.array([0.1, 0.25, -0.2])
PIXELS = np.array([[0.3, -0.2], [-0.45, 0.3], [0.1, 0.35], [-0.25, -0.3]])
EXACT = 1e-8  # differences with a step of 1e-5 of smooth functions of order 1


def range_rate(z: np.ndarray) -> float:
    """Exact rate of the range at a fixed pixel of a camera that moves by V, W."""
    h = 1e-4
    places = []
    for dt in (-2 * h, -h, h, 2 * h):
        start = matrix(TURN)
        # The body turns by W dt and the centre moves by V, both to second order at the middle.
        pose = start @ matrix(turn(W * dt))
        centre = CENTRE + start @ (V * dt + np.cross(W, V) * dt**2 / 2)
        places.append(room_range(centre, pose, ray_of(z)))
    return (places[0] - 8 * places[1] + 8 * places[2] - places[3]) / (12 * h)


def range_here(z: np.ndarray) -> float:
    return room_range(CENTRE, matrix(TURN), ray_of(z))


def test_field_of_view_is_twice_the_arc_tangent_not_a_reciprocal():
    # Section 1.1.1: 640 pixels at 50 degrees.
    alpha = 320 / np.tan(np.radians(25))
    assert np.degrees(2 * np.arctan(640 / (2 * alpha))) == pytest.approx(50)
    assert abs(np.degrees(2 / np.tan(640 / (2 * alpha))) - 50) > 100


def test_rotation_of_the_extrinsic_matrix_is_the_transpose_of_that_of_q():
    # Thesis: eq. (1.7). With (1.8) a static point has X' = -v - omega x X only by the transpose.
    point, h = np.array([1.0, 0.7, 1.9]), 1e-6

    def seen(dt: float, transposed: bool) -> np.ndarray:
        pose = matrix(TURN) @ matrix(turn(W * dt))
        rotation = pose.T if transposed else pose
        return rotation @ (point - CENTRE - matrix(TURN) @ V * dt)

    rate = {t: (seen(h, t) - seen(-h, t)) / (2 * h) for t in (True, False)}
    for transposed, right in ((True, True), (False, False)):
        expected = -V - np.cross(W, seen(0, transposed))
        assert np.allclose(rate[transposed], expected, atol=1e-8) == right


def test_range_rate_in_pinhole_coordinates_needs_the_norm_of_the_ray():
    # Thesis: eq. (1.23).
    printed, corrected = [], []
    for z in PIXELS:
        f, g = flow_parts(z, V, W)
        transport = -slopes(range_here, z) @ (f + g / range_here(z))
        towards, n = z @ V[:2] + V[2], np.sqrt(1 + z @ z)
        printed.append(range_rate(z) - (transport - towards))
        corrected.append(range_rate(z) - (transport - towards / n))
    assert np.max(np.abs(corrected)) < 1e-7
    assert np.max(np.abs(printed)) > 0.01


def test_last_terms_of_the_observers_in_pinhole_coordinates_need_it_too():
    # Thesis: eq. (3.4), eq. (3.8). At the true range both corrections vanish, and what is left is
    # (1.23).
    for z in PIXELS:
        f, g = flow_parts(z, V, W)
        d = range_here(z)
        flow = f + g / d
        observer = -slopes(range_here, z) @ flow + 500 * g @ (d * f + g - d * flow)
        towards, n = z @ V[:2] + V[2], np.sqrt(1 + z @ z)
        assert abs(observer - towards / n - range_rate(z)) < 1e-6
        assert abs(observer - towards - range_rate(z)) > 1e-3


def test_product_of_tangent_fields_is_not_that_of_their_pinhole_coordinates():
    # Thesis: eq. (3.4). g . w of (3.3) is the product in R^3 of the two tangent vectors.
    rng = np.random.default_rng(0)
    for z in PIXELS:
        a, b = rng.normal(size=(2, 2))
        frame = np.stack([slopes(lambda p, i=i: ray_of(p)[i], z) for i in range(3)])
        truth = (frame @ a) @ (frame @ b)
        n2 = 1 + z @ z
        corrected = a @ b / n2 - (z @ a) * (z @ b) / n2**2
        assert abs(corrected - truth) < EXACT
        assert abs(a @ b - truth) > 1e-3


def test_pixels_of_the_cameras_of_chapter_4_are_not_square():
    # Thesis: eq. (2.4) assumes squares; 640 x 480 at 50 x 40 degrees has not.
    width = 2 * np.tan(np.radians(25)) / 640
    height = 2 * np.tan(np.radians(20)) / 480
    assert height / width == pytest.approx(1.04, abs=0.005)


def test_squared_gradient_has_squares_of_slopes():
    # Section 2.2.1: printed with slopes of the square; the sum is n^2 (|slopes|^2 + (z .
    # slopes)^2).
    for z in PIXELS:
        s, n2 = slopes(range_here, z), 1 + z @ z
        truth = np.sum(gradient(lambda r: room_range(CENTRE, matrix(TURN), r), ray_of(z)) ** 2)
        assert abs(n2 * (s @ s + (z @ s) ** 2) - truth) < 1e-7
        of_square = slopes(lambda p: range_here(p) ** 2, z)
        assert abs(n2 * (of_square.sum() + (z @ s) ** 2) - truth) > 1e-3


def test_total_variation_in_pinhole_coordinates_has_weights_that_the_algorithm_drops():
    # Thesis: eq. (2.17). dsigma = n^-3 dz and |grad| = n sqrt(|slopes|^2 + (z . slopes)^2).
    for z in PIXELS:
        frame = np.stack([slopes(lambda p, i=i: ray_of(p)[i], z) for i in range(3)])
        n = np.sqrt(1 + z @ z)
        area = np.linalg.norm(np.cross(frame[:, 0], frame[:, 1]))
        assert abs(area - n**-3) < EXACT
        s = slopes(range_here, z)
        weighted = n**-2 * np.sqrt(s @ s + (z @ s) ** 2)
        truth = area * np.linalg.norm(
            gradient(lambda r: room_range(CENTRE, matrix(TURN), r), ray_of(z))
        )
        assert abs(weighted - truth) < 1e-7
        assert abs(np.linalg.norm(s) - truth) > 1e-3


class TotalVariation:
    """TV plus alpha^2 |F + Gamma G| on a small grid, by the algorithm of section 2.2.2."""

    def __init__(self) -> None:
        rng = np.random.default_rng(1)
        self.inverse = np.where(np.arange(24)[:, None] < 12, 0.4, 0.8) * np.ones((24, 24))
        self.slope = rng.normal(size=(24, 24))
        self.rate = -self.inverse * self.slope + 0.02 * rng.normal(size=(24, 24))
        self.alpha2 = 2.0

    @staticmethod
    def grad(x: np.ndarray) -> np.ndarray:
        out = np.zeros((2, *x.shape))
        out[0, :-1], out[1, :, :-1] = np.diff(x, axis=0), np.diff(x, axis=1)
        return out

    @staticmethod
    def div(p: np.ndarray) -> np.ndarray:
        first, second = np.zeros_like(p[0]), np.zeros_like(p[1])
        first[:-1], second[:, :-1] = p[0, :-1], p[1, :, :-1]
        return np.diff(first, axis=0, prepend=0) + np.diff(second, axis=1, prepend=0)

    def energy(self, x: np.ndarray) -> float:
        tv = np.sqrt(np.sum(self.grad(x) ** 2, axis=0)).sum()
        return float(tv + self.alpha2 * np.abs(self.rate + x * self.slope).sum())

    def run(self, steps: int, tau: float, beta2: float = 5.0, printed: bool = False) -> np.ndarray:
        x = np.zeros_like(self.rate)
        split, ahead, p = x.copy(), x.copy(), np.zeros((2, *x.shape))
        limit = self.alpha2 / (2 * beta2)
        for _ in range(steps):
            p = p + 2 * beta2 * tau * self.grad(ahead)
            p = p / np.maximum(1, np.sqrt(np.sum(p**2, axis=0)))
            x = (x if printed else split) + self.div(p) / (2 * beta2)
            rho = self.rate + x * self.slope
            change = -np.clip(rho, -limit * self.slope**2, limit * self.slope**2) / self.slope
            before, split = split, (split if printed else x) + change
            ahead = 2 * split - before
        return split


def test_steps_3_and_4_of_the_depth_algorithm_start_from_the_other_variable():
    # Section 2.2.2. Stationarity of (2.18) and (2.20): Gamma from Lambda, Lambda from Gamma.
    problem = TotalVariation()
    truth = problem.energy(problem.inverse)
    corrected = [problem.energy(problem.run(steps, 0.125)) for steps in (400, 2000)]
    printed = [problem.energy(problem.run(steps, 0.125, printed=True)) for steps in (400, 2000)]
    assert corrected[1] <= corrected[0] < truth
    assert printed[0] > 2 * truth
    assert printed[1] > printed[0]


def test_step_of_the_depth_algorithm_is_at_most_an_eighth():
    # Section 2.2.2: steps 1 / (2 beta^2) and 2 beta^2 tau need tau |grad|^2 <= 1, and |grad|^2 ->
    # 8.
    problem = TotalVariation()
    eighth = problem.energy(problem.run(3000, 0.125))
    quarter = problem.energy(problem.run(3000, 0.25))
    assert quarter > eighth * 1.2
    checks = (-1.0) ** np.add.outer(np.arange(24), np.arange(24))
    assert np.sum(problem.grad(checks) ** 2) / np.sum(checks**2) > 7.5


def test_beta_of_the_depth_algorithm_is_a_step_not_a_weight():
    # Section 2.2.2, and step 5 is the extrapolation of that scheme, no low-pass filter.
    problem = TotalVariation()
    ends = [problem.energy(problem.run(6000, 0.125, beta2)) for beta2 in (2.0, 5.0, 20.0)]
    assert max(ends) / min(ends) - 1 < 1e-3


def test_split_functional_needs_a_large_beta():
    # Section 2.1.4, on a constant: min over y, a of |a - d| + beta^2 (y - a)^2 + |y| (one pixel
    # whose neighbour is held at zero); for beta -> infinity that is |y| + |y - d|, not so for a
    # small beta.
    y = np.linspace(-2, 3, 2001)[:, None]
    a = np.linspace(-2, 3, 2001)[None]
    exact = np.min(0.5 * np.abs(y) + np.abs(y - 1.0))
    split = {
        beta2: np.min(0.5 * np.abs(y) + np.abs(a - 1.0) + beta2 * (y - a) ** 2)
        for beta2 in (0.05, 500.0)
    }
    assert abs(split[500.0] - exact) < 1e-3
    assert abs(split[0.05] - exact) > 0.4


def growth_of_l2(width: float) -> tuple[float, float]:
    """Rate of half the L2 norm of a bump at the focus of expansion, and its excitation term.

    A sphere of range 1 about the camera, v along z, k = 0.5: f = 0, g = eta x (eta x v)."""
    rays, weights = sphere(160)
    v, k = np.array([0, 0, 1.0]), 0.5
    g = np.cross(rays, np.cross(rays, v))
    bump = np.exp((rays @ v - 1) / width**2)
    slope = (v - (rays @ v)[:, None] * rays) * (bump / width**2)[:, None]
    rate = -np.sum(slope * g, axis=1) - k * np.sum(g**2, axis=1) * bump
    return float(weights @ (bump * rate)), float(-k * weights @ (np.sum(g**2, axis=1) * bump**2))


def test_l2_norm_of_an_error_at_the_focus_of_expansion_grows():
    # Thesis: Remark 2, eq. (3.9), eq. (3.10). The determinant of (3.10) has a rate of its own:
    # + half the divergence of the flow, positive there.
    rate, printed = growth_of_l2(0.1)
    assert printed < 0
    assert rate > 10 * abs(printed)
    focus = np.array([0, 0, 1.0])
    flow = divergence(lambda r: np.cross(r, np.cross(r, focus)), focus)
    assert flow == pytest.approx(2, abs=1e-6)


def test_error_at_the_focus_of_expansion_does_not_fall():
    # Thesis: Theorem 1, (1): non-increasing, not decreasing: there g = 0 and (3.6) is zero.
    focus = V / np.linalg.norm(V)
    g = np.cross(focus, np.cross(focus, V))
    assert np.linalg.norm(g) < 1e-15
    away = focus + 0.3 * tangents(focus)[0]
    away /= np.linalg.norm(away)
    assert np.linalg.norm(np.cross(away, np.cross(away, V))) > 0.05


def test_excitation_over_a_fixed_time_cannot_exceed_every_line():
    # Theorem 1, last step of the proof: the integral must be to t; to T it is a constant.
    t = np.linspace(0, 50, 5001)
    excitation = np.cumsum(np.full_like(t, 0.1)) * (t[1] - t[0])
    share, start = 0.09, 1.0
    later = t >= start
    assert np.all(excitation[later] >= share * t[later])
    assert not np.all(excitation[t <= start][-1] >= share * t[later])


def test_norm_of_order_p_is_homogeneous_only_with_its_root():
    # Proof of Theorem 1: |E|_p is printed as the integral of |E|^p itself.
    rays, weights = sphere()
    error, p = 1 + rays[:, 0] * rays[:, 1], 3.0
    assert weights @ np.abs(2 * error) ** p == pytest.approx(8 * (weights @ np.abs(error) ** p))
    root = [(weights @ np.abs(c * error) ** p) ** (1 / p) for c in (1, 2)]
    assert root[1] == pytest.approx(2 * root[0])


def test_rate_of_the_depth_observer_is_that_of_the_farthest_wall():
    # Thesis: Theorem 2. Along characteristics E' = -k E / D: the bound holds with D_M alone.
    ranges, k, t = np.array([1.2, 2.0, 4.5]), 2.0, 1.5
    worst = np.max(np.exp(-k * t / ranges))
    assert worst <= np.exp(-k * t / ranges.max()) * (1 + 1e-12)
    assert worst > np.exp(-k * t / ranges.min()) * 2


def test_room_of_the_simulations_is_not_differentiable():
    # Section 4.1.1 against (H1): the gradient of the range jumps where two walls meet.
    half = np.array([1.5, 2.0, 2.25])

    def box(ray: np.ndarray) -> float:
        return float(np.min(half / np.abs(ray)))

    edge = half * np.array([1, 0.1, 1.0])
    edge /= np.linalg.norm(edge)
    aside = np.array([edge[2], 0, -edge[0]]) / np.hypot(edge[0], edge[2])
    left, right = (gradient(box, edge + side * 1e-3 * aside, 1e-5) for side in (-1, 1))
    assert np.linalg.norm(left - right) > 1


def test_divergence_in_the_balance_is_plus_twice_the_product():
    # Section 6.1, citing (A.4), and the display after it. Thesis: eq. (A.4), eq. (6.1).
    rng = np.random.default_rng(2)
    for _ in range(5):
        ray, p = rng.normal(size=3), rng.normal(size=3)
        ray /= np.linalg.norm(ray)
        found = divergence(lambda r, p=p: np.cross(r, np.cross(r, p)), ray)
        assert abs(found - 2 * ray @ p) < EXACT


def test_term_of_the_velocity_in_the_balance_is_subtracted():
    # Section 6.1: grad D^2 . (eta x (eta x v)) = div(D^2 eta x (eta x v)) - 2 D^2 eta . v.
    pose = matrix(TURN)

    def square(ray: np.ndarray) -> float:
        return room_range(CENTRE, pose, ray) ** 2

    for z in PIXELS:
        ray = ray_of(z)
        left = gradient(square, ray) @ np.cross(ray, np.cross(ray, V))
        field = divergence(lambda r: square(r) * np.cross(r, np.cross(r, V)), ray)
        assert abs(left - (field - 2 * square(ray) * ray @ V)) < 1e-6
        assert abs(left - (field + 2 * square(ray) * ray @ V)) > 0.1
