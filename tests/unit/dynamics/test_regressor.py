"""The torque regressor against Pinocchio's."""

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.assembly.synthesis import synthesize
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.dynamics.regressor import PARAMETERS, regressor
from modrob_cli.errors import ShapeError
from tests.random_chains import random_chain, reference_model


@pytest.mark.parametrize("seed", range(30))
def test_equals_pinocchio(seed: int) -> None:
    rng = np.random.default_rng(seed)
    assembly, raw = random_chain(rng, most_joints=8)
    robot = synthesize(assembly)
    model = reference_model(raw, assembly.gravity)[0]
    data = model.createData()
    q, dq, ddq = rng.uniform(-3.0, 3.0, (3, 4, robot.dof))
    Y = regressor(robot, q, dq, ddq)
    assert Y.shape == (4, robot.dof, len(PARAMETERS) * robot.dof)
    for k in range(4):
        expected = np.atleast_2d(pin.computeJointTorqueRegressor(model, data, q[k], dq[k], ddq[k]))  # (10,) for n = 1
        np.testing.assert_allclose(Y[k], expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())


def test_times_parameters_gives_torques() -> None:
    rng = np.random.default_rng(5)
    robot = synthesize(random_chain(rng, most_joints=8)[0])
    q, dq, ddq = rng.uniform(-3.0, 3.0, (3, 20, robot.dof))
    parameters = np.concatenate([inertia.toDynamicParameters() for inertia in build_model(robot).inertias[1:]])
    expected = rnea(robot, q, dq, ddq)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(regressor(robot, q, dq, ddq) @ parameters, expected, atol=1e-12 * scale)


def test_order_is_that_of_pinocchio() -> None:
    inertia = pin.Inertia(2.0, np.zeros(3), np.array([[1.0, 0.1, 0.2], [0.1, 1.5, 0.3], [0.2, 0.3, 1.2]]))
    named = dict(zip(PARAMETERS, inertia.toDynamicParameters(), strict=True))
    entries = {"I_xx": 1.0, "I_xy": 0.1, "I_yy": 1.5, "I_xz": 0.2, "I_yz": 0.3, "I_zz": 1.2}
    assert named == pytest.approx({"m": 2.0, "mc_x": 0.0, "mc_y": 0.0, "mc_z": 0.0, **entries})


def test_wrong_shape_is_refused() -> None:
    robot = synthesize(random_chain(np.random.default_rng(0), most_joints=3)[0])
    with pytest.raises(ShapeError):
        regressor(robot, np.zeros((2, robot.dof)), np.zeros((2, robot.dof)), np.zeros((3, robot.dof)))
