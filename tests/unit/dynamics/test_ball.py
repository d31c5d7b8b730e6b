"""Ball arithmetic encloses exact results (rational arithmetic, 50 digits) and is tight."""

from fractions import Fraction

import mpmath
import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import Ball, apply, cos_sin, cross, dot, turn_back
from modrob_cli.spatial import rotation


def exact(x: Array) -> list[Fraction]:
    return [Fraction(float(value)) for value in np.ravel(x)]


def random_ball(rng: np.random.Generator, count: int) -> tuple[Ball, Array]:
    """Vectors (3, count) of very different sizes, a third of them points, and members near their ends."""
    c = rng.normal(size=(3, count)) * 10.0 ** rng.integers(-8, 9, (3, count))
    r = np.abs(c) * rng.choice([0.0, 1e-9, 2.0], (3, count))
    share = rng.choice([-1.0, 1.0], (3, count)) * (1.0 - 1e-15)
    return Ball(c, r), c + share * r


def assert_holds(ball: Ball, values: list[Fraction]) -> None:
    """Every exact value is within the reach of its ball."""
    for c, r, value in zip(exact(ball.c), exact(ball.reach), values, strict=True):
        assert abs(value - c) <= r


def test_sums_products_and_vectors_hold_the_exact_members() -> None:
    rng = np.random.default_rng(1)
    a, x = random_ball(rng, 400)
    b, y = random_ball(rng, 400)
    fx, fy = np.array(exact(x)).reshape(3, -1), np.array(exact(y)).reshape(3, -1)
    assert_holds(a + b, list((fx + fy).ravel()))
    assert_holds(a - b, list((fx - fy).ravel()))
    assert_holds(a * b, list((fx * fy).ravel()))
    assert_holds(dot(a, b), list((fx * fy).sum(axis=0)))
    assert_holds(cross(a, b), list(np.cross(fx, fy, axis=0).ravel()))
    R = rotation("x", 0.3)[:3, :3] @ rotation("z", np.pi / 2)[:3, :3]
    assert_holds(apply(R, a), list((np.array(exact(R)).reshape(3, 3) @ fx).ravel()))


def test_points_need_their_rounding_room() -> None:
    """A product of two points is rounded, so a radius of zero would be wrong: the check above can fail."""
    a, b = Ball.exact([0.1]), Ball.exact([0.1])
    assert Fraction(0.1) ** 2 != exact((a * b).c)[0]
    assert (a * b).reach[0] < 1e-15


def test_cosine_and_sine_are_the_ranges() -> None:
    """Against 50 digits at ends, extrema and inner points; and no wider than the range by more than rounding."""
    rng = np.random.default_rng(2)
    centre = np.concatenate([rng.uniform(-7, 7, 150), rng.integers(-8, 9, 50) * np.pi / 2, rng.uniform(-1e6, 1e6, 50)])
    radius = rng.choice([0.0, 1e-12, 1e-3, 0.3, 1.0, 2.0, 3.0, np.pi, 5.0], centre.size) * rng.uniform(0.5, 1, 250)
    found = cos_sin(Ball(centre, radius))
    with mpmath.workdps(50):
        for k, (c, r) in enumerate(zip(centre, radius, strict=True)):
            low, high = mpmath.mpf(c) - mpmath.mpf(r), mpmath.mpf(c) + mpmath.mpf(r)
            points = [low, high] + [low + (high - low) * s / 20 for s in range(20)]
            first = int(mpmath.ceil(low / (mpmath.pi / 2)))
            points += [p for p in ((first + i) * mpmath.pi / 2 for i in range(8)) if p <= high]
            for ball, wave in zip(found, (mpmath.cos, mpmath.sin), strict=True):
                values = [wave(p) for p in points]
                lower, upper = mpmath.mpf(ball.c[k]) - ball.reach[k], mpmath.mpf(ball.c[k]) + ball.reach[k]
                assert lower <= min(values)
                assert max(values) <= upper
                # 64 units of 1.1e-16, and 2^-36 of the radius that Ball.reach adds
                assert min(values) - lower < 1e-14 + 4e-11 * r
                assert upper - max(values) < 1e-14 + 4e-11 * r


def test_turn_back_holds_turned_members() -> None:
    rng = np.random.default_rng(3)
    a, x = random_ball(rng, 500)
    angle, width = rng.uniform(-4, 4, 500), rng.choice([0.0, 0.1, 2.0], 500)
    q = angle + rng.uniform(-1, 1, 500) * width
    ball = turn_back(*cos_sin(Ball(angle, width)), a)
    turned = np.stack([np.cos(q) * x[0] + np.sin(q) * x[1], np.cos(q) * x[1] - np.sin(q) * x[0], x[2]])
    room = ball.reach + 1e-15 * np.abs(x).sum(axis=0)  # the members here are rounded too
    assert np.all(np.abs(turned - ball.c) <= room)


def test_what_two_enclosures_share() -> None:
    a, b = Ball(np.array([0.0, 1.0]), np.array([2.0, 1.0])), Ball(np.array([3.0, 1.0]), np.array([2.0, 0.0]))
    both = a.both(b)
    np.testing.assert_allclose(both.c, [1.5, 1.0], rtol=1e-10)
    np.testing.assert_allclose(both.reach, [0.5, 0.0], atol=1e-10)


def test_sign_only_where_all_members_agree() -> None:
    ball = Ball(np.array([1.0, 1.0, -1.0, 0.0, 1e-300]), np.array([0.5, 1.0, 0.9, 0.0, 0.0]))
    # The last is positive, but not above what underflow may have lost.
    np.testing.assert_array_equal(ball.sign, [1.0, 0.0, -1.0, 0.0, 0.0])
