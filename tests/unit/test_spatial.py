"""Rotations and transforms against Pinocchio, mpmath and plain sums over point masses."""

import math

import mpmath
import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.arrays import Array
from modrob_cli.spatial import (
    from_xyz_rpy,
    invert,
    parallel_axis,
    rotation,
    skew,
    to_xyz_rpy,
    translation,
)

ANGLES = [0.0, 1e-300, 1e-9, 0.3, math.pi / 2, math.pi, -math.pi, 3.0, 1e6, -1e15]


def random_poses(n: int) -> Array:
    rng = np.random.default_rng(11)
    return from_xyz_rpy(rng.normal(size=(n, 3)), rng.uniform(-math.pi, math.pi, (n, 3)))


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_elementary_rotations(axis: str) -> None:
    found = rotation(axis, ANGLES)
    unit = np.eye(3)["xyz".index(axis)]
    for T, angle in zip(found, ANGLES, strict=True):
        assert np.array_equal(T[3], [0, 0, 0, 1])
        assert np.array_equal(T[:3, 3], [0, 0, 0])
        # both are sums of correctly rounded sines and cosines, to a few units in the last place
        assert np.allclose(T[:3, :3], pin.AngleAxis(angle, unit).toRotationMatrix(), atol=4e-16, rtol=0)
        with mpmath.workdps(60):
            exact = [float(mpmath.cos(angle)), float(mpmath.sin(angle))]
        j = ("xyz".index(axis) + 1) % 3
        k = (j + 1) % 3
        # NumPy's sine and cosine are within a few units in the last place for all arguments, huge ones included
        assert np.allclose([T[j, j], T[k, j]], exact, rtol=1e-15, atol=0)


def test_elementary_translations() -> None:
    T = translation("y", [[1.0, -2.0, 0.5]])
    assert T.shape == (1, 3, 4, 4)
    assert np.array_equal(T[0, 1] @ [1, 1, 1, 1], [1, -1, 1, 1])


def test_roll_pitch_yaw_as_in_urdf() -> None:
    rng = np.random.default_rng(12)
    rpy = rng.uniform(-math.pi, math.pi, (200, 3))
    found = from_xyz_rpy(np.ones(3), rpy)
    expected = np.array([pin.rpy.rpyToMatrix(*angles) for angles in rpy])
    assert np.allclose(found[:, :3, :3], expected, atol=1e-15, rtol=0)  # products of a few numbers below one
    assert np.array_equal(found[:, :3, 3], np.ones((200, 3)))


@pytest.mark.parametrize("margin", [1.0, 1e-3, 1e-6, 1e-8, 1e-10, 1e-16, 0.0])
def test_round_trip_up_to_gimbal_lock(margin: float) -> None:
    rng = np.random.default_rng(13)
    rpy = rng.uniform(-math.pi, math.pi, (100, 3))
    rpy[:, 1] = rng.choice([-1.0, 1.0], 100) * (math.pi / 2 - margin)
    detour = from_xyz_rpy(np.zeros(3), rng.uniform(-math.pi, math.pi, (100, 3)))
    poses = from_xyz_rpy(rng.normal(size=(100, 3)), rpy) @ detour @ invert(detour)  # rounding noise in every entry
    # not the angles but the transform has to come back, also where the angles are ill-conditioned: the noise of a few
    # 1e-16 stays
    assert np.allclose(from_xyz_rpy(*to_xyz_rpy(poses)), poses, atol=3e-15, rtol=0)


def test_inverse_against_a_general_one() -> None:
    poses = random_poses(200)
    assert np.allclose(invert(poses), np.linalg.inv(poses), atol=1e-14, rtol=0)  # condition numbers below 20
    assert invert(poses.reshape(20, 10, 4, 4)).shape == (20, 10, 4, 4)


def test_skew_is_the_cross_product() -> None:
    v, w = np.random.default_rng(14).normal(size=(2, 50, 3))
    assert np.allclose(np.einsum("nij,nj->ni", skew(v), w), np.cross(v, w), atol=1e-15, rtol=0)
    assert np.allclose(skew(v)[0], pin.skew(v[0]), atol=0, rtol=0)


def test_parallel_axis_is_the_inertia_of_a_point() -> None:
    rng = np.random.default_rng(15)
    for c in rng.normal(size=(50, 3)):
        # I_ij = sum over the point of (r^2 delta_ij - r_i r_j), here by the kinetic energy: w' I w = |w x c|^2
        for w in rng.normal(size=(5, 3)):
            assert w @ parallel_axis(c) @ w == pytest.approx(np.sum(np.cross(w, c) ** 2), rel=1e-13, abs=1e-14)
    assert parallel_axis(rng.normal(size=(2, 3, 3))).shape == (2, 3, 3, 3)
