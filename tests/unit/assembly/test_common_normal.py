import math

import mpmath
import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.assembly.common_normal import ANGLE_TOLERANCE, LENGTH_TOLERANCE, CommonNormal, decompose
from modrob_cli.spatial import rotation, translation


def random_transform(rng: np.random.Generator) -> Array:
    """A rigid transform with a uniformly random rotation, from a random unit quaternion."""
    w, x, y, z = (lambda v: v / np.linalg.norm(v))(rng.standard_normal(4))
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = rng.uniform(-1, 1, 3)
    return T


def tilted(rng: np.random.Generator, angle: float, offset: Array) -> Array:
    """A transform whose z axis is at this angle to the first one's."""
    first, last = rotation("z", rng.uniform(-3, 3)), rotation("z", rng.uniform(-3, 3))
    T = np.asarray(first @ rotation("x", angle) @ last)
    T[:3, 3] = offset
    return T


def exact_transform(d: CommonNormal) -> Array:
    """The product of [D] (2.3)-(2.5) in 50 digits, from matrices written out here."""

    def rz(q: float) -> mpmath.matrix:
        c, s = mpmath.cos(q), mpmath.sin(q)
        return mpmath.matrix([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])

    def rx(q: float) -> mpmath.matrix:
        c, s = mpmath.cos(q), mpmath.sin(q)
        return mpmath.matrix([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])

    def shift(x: float, z: float) -> mpmath.matrix:
        return mpmath.matrix([[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, z], [0, 0, 0, 1]])

    with mpmath.workdps(50):
        T = shift(0, -d.p) * rz(d.phi) * shift(d.a, 0) * rx(d.alpha) * shift(0, d.n) * rz(d.psi)
        return np.array(T.tolist(), dtype=float)


def test_random_transforms_are_reproduced() -> None:
    rng = np.random.default_rng(1)
    for _ in range(2000):
        T = random_transform(rng)
        d = decompose(T)
        assert d.case == "skew"
        assert abs(d.psi) <= math.pi / 2 + 1e-9
        # random axes come as near as 1e-2 to parallel here; the error grows as 1e-16 / angle
        np.testing.assert_allclose(exact_transform(d), T, atol=1e-12)
        np.testing.assert_allclose(d.transform(), T, atol=1e-12)


@pytest.mark.parametrize("base", [0.0, math.pi])
@pytest.mark.parametrize("angle", [1e-2, 1e-4, 1e-6, 1.01e-8])
def test_nearly_parallel_axes_lose_the_stated_accuracy_only(base: float, angle: float) -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        T = tilted(rng, base + angle, rng.uniform(-1, 1, 3))
        d = decompose(T)
        assert d.case == "skew"
        error = np.abs(d.transform() - T)
        assert error[:3, :3].max() < 1e-15  # a few roundings of numbers below 1
        # the docstring's 1.4e-16 / angle with a margin; a sine that does not fit the rounded alpha gives 2.2e-16
        assert error[:3, 3].max() < 1.8e-16 / angle


@pytest.mark.parametrize("base", [0.0, math.pi])
@pytest.mark.parametrize("angle", [0.99e-8, 1e-10, 0.0])
def test_axes_within_the_tolerance_are_parallel(base: float, angle: float) -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        T = tilted(rng, base + angle, rng.uniform(-1, 1, 3))
        d = decompose(T)
        assert (d.case, d.n, d.p, d.alpha) == ("parallel", 0.0, -T[2, 3], base)
        error = np.abs(d.transform() - T)
        assert error[:3, :3].max() <= angle + 1e-15
        assert error[:3, 3].max() < 1e-15


@pytest.mark.parametrize("base", [0.0, math.pi])
def test_overlapping_axes_and_the_edge_of_the_length(base: float) -> None:
    rng = np.random.default_rng(4)
    for distance, case in ((0.0, "overlapping"), (0.99 * LENGTH_TOLERANCE, "overlapping"), (1.01e-10, "parallel")):
        way = rng.uniform(-3, 3)
        T = tilted(rng, base, np.array([distance * math.cos(way), distance * math.sin(way), 0.7]))
        d = decompose(T)
        assert d.case == case
        assert (d.p, d.n) == (-0.7, 0.0)
        if case == "overlapping":
            assert (d.psi, d.a) == (0.0, 0.0)
        np.testing.assert_allclose(d.transform(), T, atol=max(distance, 1e-15))


def test_small_distance_with_tilt_and_long_axis_keeps_its_rotation() -> None:
    # |u_z| tilt is ten times the distance: V = R'^T U with u_z in it would be turned by a radian
    rng = np.random.default_rng(5)
    T = tilted(rng, 0.9 * ANGLE_TOLERANCE, np.array([1e-9, 0.0, 1.0]))
    np.testing.assert_allclose(decompose(T).transform(), T, atol=2 * ANGLE_TOLERANCE)


def test_sense_of_the_common_normal() -> None:
    # [D] Table 3.4: alpha_3 = -pi/2 and alpha_4 = +pi/2, theta = q for both, from the modules of the 6-axis arm
    distal = translation("z", 0.1013) @ rotation("x", -math.pi / 2) @ translation("z", 0.1013)
    third = decompose(distal)
    L2 = rotation("z", -math.pi) @ translation("z", 0.1999) @ rotation("x", -math.pi / 2)
    fourth = decompose(L2 @ translation("z", -0.0748) @ rotation("z", -math.pi))
    np.testing.assert_allclose([third.alpha, third.phi, third.psi], [-math.pi / 2, 0, 0], atol=1e-15)
    np.testing.assert_allclose([fourth.alpha, fourth.phi, fourth.psi], [math.pi / 2, 0, 0], atol=1e-15)
    np.testing.assert_allclose([fourth.p, fourth.n], [-0.1999, -0.0748], atol=1e-15)


def test_sense_at_right_angles_is_steady() -> None:
    # V_x = 0 but for rounding: the sense is decided by V_y > 0, whatever the sign of the rounding error
    for wobble in (-1e-12, 0.0, 1e-12):
        for turn in (math.pi / 2, -math.pi / 2):
            d = decompose(rotation("x", 1.0) @ rotation("z", turn + wobble))
            assert -d.psi == pytest.approx(math.pi / 2, abs=1e-11)  # phi_i


def test_rotation_that_is_orthonormal_to_rounding_only() -> None:
    rng = np.random.default_rng(6)
    for _ in range(200):
        T = random_transform(rng)
        T[:3, :3] += rng.uniform(-2e-16, 2e-16, (3, 3))
        np.testing.assert_allclose(decompose(T).transform(), T, atol=1e-12)
