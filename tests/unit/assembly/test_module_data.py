import math

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.assembly.module_data import connection_data, unit_data
from modrob_cli.model.body import RigidBody
from modrob_cli.model.joint import JointType
from modrob_cli.model.module import Actuation, ConnectionData, JointUnit, RigidPart
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import from_xyz_rpy, rotation, translation

BODY = RigidBody("none", Uncertain.exact(0.0), Uncertain.exact(np.zeros(3)), Uncertain.exact(np.zeros(6)))


def random_pose(rng: np.random.Generator) -> Array:
    """Random poses, a third of them with (anti)parallel axes."""
    roll, pitch = [(0.0, 0.0), (math.pi, 0.0), tuple(rng.uniform(-1.5, 1.5, 2))][rng.integers(3)]
    return from_xyz_rpy(rng.uniform(-1, 1, 3), [roll, pitch, rng.uniform(-3, 3)])


def test_connection_data_reproduce_the_transform() -> None:
    rng = np.random.default_rng(1)
    for _ in range(500):
        T = random_pose(rng)
        np.testing.assert_allclose(connection_data(T).transform(), T, atol=1e-12)


def test_connection_data_of_the_published_link() -> None:
    # L1 of the LWA 4P: a = 0.35, alpha = pi, delta_in = pi/2, delta_out = -pi/2
    data = connection_data(ConnectionData(0.35, math.pi, 0.0, 0.0, math.pi / 2, -math.pi / 2).transform())
    got = [data.a, data.alpha, data.p, data.n, data.delta_in, data.delta_out]
    np.testing.assert_allclose(got, [0.35, math.pi, 0, 0, math.pi / 2, -math.pi / 2], atol=1e-15)


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_unit_data_move_like_the_poses(kind: JointType) -> None:
    rng = np.random.default_rng(2)
    for _ in range(300):
        offset = rng.uniform(-3, 3)
        proximal, distal = random_pose(rng), random_pose(rng)
        unit = JointUnit(RigidPart(proximal, BODY), Actuation(kind, offset), RigidPart(distal, BODY))
        first, last, delta = unit_data(unit)
        assert first.delta_out == last.delta_in == 0.0
        for q in rng.uniform(-2, 2, 3):
            motion = rotation("z", q) if kind == "revolute" else translation("z", q)
            plain = proximal @ motion @ rotation("z", offset) @ distal
            by_data = first.transform() @ motion @ rotation("z", delta) @ last.transform()
            np.testing.assert_allclose(by_data, plain, atol=1e-12)
