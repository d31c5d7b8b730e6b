"""Random module chains: the D-H view, and torques of the robot rebuilt from it, against the raw module data.

The reference is a Pinocchio model assembled straight from the modules' own transforms and bodies
(tests/random_chains.py), which shares no code with the synthesis.
"""

import os
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.arrays import Array
from modrob_cli.assembly.common_normal import ANGLE_TOLERANCE
from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.link_parameters import LinkParameters, link_parameters
from modrob_cli.assembly.synthesis import synthesize
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.model.body import RigidBody
from modrob_cli.model.dh import DhTable
from modrob_cli.model.module import Actuation, Assembly, ConnectionData, JointUnit, Module, ModuleUse, RigidPart
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.schema import RobotDocument
from modrob_cli.schema.from_model import pose_data
from tests.random_chains import random_chain, reference_model

CHAINS = int(os.environ.get("MODROB_CHAINS", "2000"))
TOLERANCE = 1e-9
"""Asked for; products of some 60 transforms of lengths up to 10 m lose about 1e-14, D-H of axes at an angle e
loses 1e-16 / e more (angles below 1e-6 do not come up by chance in this many chains)."""


def robot_from_dh(robot: Robot, table: DhTable, links: LinkParameters) -> Robot:
    """The robot as a person would type it in from the printed tables: D-H rows and link parameters."""
    entries = ("xx", "xy", "xz", "yy", "yz", "zz")
    rows = [
        {"a": float(table.a[i]), "alpha": float(table.alpha[i]), "d": float(table.d[i]), "theta": float(table.theta[i])}
        for i in range(robot.dof)
    ]
    return RobotDocument.model_validate(
        {
            "modrob": "robot/1",
            "name": "typed",
            "gravity": robot.gravity.tolist(),
            "base_transform": pose_data(table.base_transform),
            "joints": [
                {"name": joint.name, "type": joint.type, "dh": row}
                for joint, row in zip(robot.joints, rows, strict=True)
            ],
            "bodies": [
                {
                    "link": i + 1,
                    "mass": float(links.mass[i]),
                    "com": links.com[i].tolist(),
                    "inertia": dict(zip(entries, links.inertia_com[i].tolist(), strict=True)),
                }
                for i in range(robot.dof)
            ],
            "tool_transform": pose_data(table.tool_transform),
        }
    ).to_model()


def torques(model: Any, state: Array) -> Array:
    return np.asarray(pin.rnea(model, model.createData(), *state))


def test_dh_view_and_torques_equal_the_module_data() -> None:
    rng = np.random.default_rng(20150601)
    worst_pose = worst_torque = 0.0
    for _ in range(CHAINS):
        assembly, raw = random_chain(rng)
        robot = synthesize(assembly)
        table = dh_table(robot)
        model, tool = reference_model(raw, assembly.gravity)
        state = rng.uniform(-3.0, 3.0, (3, robot.dof))
        data = model.createData()
        pin.forwardKinematics(model, data, state[0])
        expected_pose = (data.oMi[robot.dof] * tool).homogeneous
        worst_pose = max(worst_pose, float(np.abs(table.tool_pose(state[0]) - expected_pose).max()))
        typed = robot_from_dh(robot, table, link_parameters(robot, table.frames))
        expected = torques(model, state)
        scale = max(1.0, float(np.abs(expected).max()))
        for candidate in (robot, typed):
            error = float(np.abs(torques(build_model(candidate), state) - expected).max())
            worst_torque = max(worst_torque, error / scale)
    assert worst_pose < TOLERANCE
    assert worst_torque < TOLERANCE


@pytest.mark.parametrize("near", [0.0, np.pi])
@pytest.mark.parametrize(
    "angle", [1e-2, 1e-4, 1e-6, 1e-7, 1.001 * ANGLE_TOLERANCE, 0.999 * ANGLE_TOLERANCE, 1e-10, 1e-13]
)
def test_accuracy_of_the_dh_view_for_nearly_parallel_axes(angle: float, near: float) -> None:
    """D-H loses rounding times length / angle above the tolerance, and the angle itself below it.

    Two links of 0.5 m with a twist of almost 0 or pi between their axes, and 1 m of arm behind them.
    """
    rng = np.random.default_rng(3)
    worst = 0.0
    for _ in range(50):
        twist = near + angle * rng.choice([-1.0, 1.0])
        data = ConnectionData(0.5, twist, rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), *rng.uniform(-3.0, 3.0, 2))
        massless = RigidBody("-", Uncertain.exact(0.0), Uncertain.exact(np.zeros(3)), Uncertain.exact(np.zeros(6)))
        still = RigidPart(np.eye(4), massless)
        joint = ModuleUse(Module("J", "joint", units=(JointUnit(still, Actuation("revolute"), still),)))
        link = ModuleUse(Module("L", "link", outputs={"out": RigidPart(data.transform(), massless)}), "out")
        reach = RigidPart(ConnectionData(1.0, 0.7, 0.3, 0.1, 0.2, 0.4).transform(), massless)
        end = ModuleUse(Module("E", "link", outputs={"out": reach}), "out")
        robot = synthesize(Assembly("near", (joint, link, joint, link, joint, end), np.eye(4), np.zeros(3)))
        table = dh_table(robot)
        q = rng.uniform(-3.0, 3.0, 3)
        worst = max(worst, float(np.abs(table.tool_pose(q) - robot.link_frames(q)[-1]).max()))
    if angle <= ANGLE_TOLERANCE:
        assert worst <= 1e-14 + 6.0 * angle  # two joints lose the angle each, over 3 m of arm
    else:
        # 1 m / angle is the size of p and n; a handful of roundings of 2^-53 each in table and evaluation
        assert worst <= 1e-14 + 20.0 * 2.0**-53 / angle
