"""Writing identified values back into a robot."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from modrob_cli.dynamics.drive_torque import drive_boxes
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.identify.updated_robot import motor_side, with_friction
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction, Joint, Limits
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain


def robot(gear_ratio: float = 50.0) -> Robot:
    drive = Drive(Uncertain.exact(1e-4), gear_ratio, torque_constant=0.04)
    joint = Joint("one", "revolute", np.eye(4), drive=drive, limits=Limits(torque=(-5.0, 5.0)))
    return Robot("arm", (joint,), (), np.eye(4), np.zeros(3), Interval(np.zeros(1)))


def test_only_what_was_identified_changes() -> None:
    before = robot()
    friction = Friction(Uncertain.exact(2.0), Uncertain.exact(1.0), 0.1, 0.02)
    rotor = Uncertain(np.asarray(2e-4), Interval(1e-4, 3e-4))
    after = with_friction(before, [friction], [rotor], Interval([-1.0], [2.0]))
    joint = after.joints[0]
    assert joint.friction is friction
    assert joint.drive.rotor_inertia is rotor
    assert (joint.drive.gear_ratio, joint.drive.torque_constant) == (50.0, 0.04)
    assert joint.limits == before.joints[0].limits
    assert (after.disturbance.inf[0], after.disturbance.sup[0]) == (-1.0, 2.0)
    kept = with_friction(before, [friction])
    assert kept.joints[0].drive.rotor_inertia is before.joints[0].drive.rotor_inertia
    assert kept.disturbance is before.disturbance
    with pytest.raises(ShapeError, match="for 1 joints"):
        with_friction(before, [friction, friction])


@given(st.floats(0.0, 1e3), st.floats(0.0, 1e3), st.floats(0.1, 1e3), st.booleans())
def test_what_the_joint_feels_of_the_rotor_holds_what_was_identified(
    low: float, width: float, gear_ratio: float, turned: bool
) -> None:
    ratio = -gear_ratio if turned else gear_ratio
    armature = Uncertain(np.asarray(low), Interval(low, low + width))
    rotor = motor_side(armature, robot(ratio).joints[0].drive)
    felt = drive_boxes(with_friction(robot(ratio), [Friction()], [rotor]))[0].armature
    assert felt[0] <= low
    assert felt[1] >= low + width
    assert rotor.interval.inf >= 0.0
    assert float(rotor.nominal) * ratio**2 == pytest.approx(low, rel=1e-12, abs=1e-300)


def test_a_gear_ratio_of_zero_gives_no_rotor() -> None:
    with pytest.raises(NumericalError, match="gear ratio of 0"):
        motor_side(Uncertain.exact(1.0), Drive(gear_ratio=0.0))
