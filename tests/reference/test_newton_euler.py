"""Batch Newton-Euler torques of every shipped arm against Pinocchio (``MODROB_RNEA=100000`` for more states)."""

import os
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.errors import ShapeError
from modrob_cli.workflows.robots import load_robot

SHIPPED = sorted((Path(__file__).parents[2] / "assemblies").glob("*.yaml"))
STATES = int(os.environ.get("MODROB_RNEA", "500"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_torques_equal_pinocchio(path: Path) -> None:
    robot = load_robot(path).robot
    rng = np.random.default_rng(21)
    q, dq, ddq = rng.uniform(-1.0, 1.0, (3, STATES, robot.dof)) * np.array([6.0, 5.0, 20.0])[:, None, None]
    model = build_model(robot)
    data = model.createData()
    expected = np.array([pin.rnea(model, data, *state).copy() for state in zip(q, dq, ddq, strict=True)])
    error = np.abs(rnea(robot, q, dq, ddq) - expected).max(axis=1)
    # relative to the largest torque of each state; both sum some 1000 rounded terms
    assert np.all(error <= 1e-10 * np.maximum(np.abs(expected).max(axis=1), 1e-3))


def test_shapes_are_checked() -> None:
    robot = load_robot(SHIPPED[0]).robot
    good = np.zeros((4, robot.dof))
    with pytest.raises(ShapeError):
        rnea(robot, good[:, :1], good, good)
    with pytest.raises(ShapeError):
        rnea(robot, good, good[:2], good)
