"""Nominal drive torque: by hand, and always between the bounds."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.dynamics.drive_torque import DriveBox, drive_nominal
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction, Joint
from modrob_cli.model.uncertain import Uncertain


def around(value: float, share: float) -> Uncertain:
    return Uncertain(np.asarray(value), Interval(value * (1.0 - share), value * (1.0 + share)))


JOINT = Joint(
    "j", "revolute", np.eye(4), friction=Friction(around(2.0, 0.1), around(5.0, 0.2), 0.0, 0.1),
    drive=Drive(around(0.01, 0.1), gear_ratio=10.0),
)  # fmt: skip


def test_the_sign_rises_through_the_velocity_band() -> None:
    dq, ddq = np.array([-1.0, -0.1, -0.05, 0.0, 0.02, 0.1, 3.0]), np.array([0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 0.0])
    sign = np.array([-1.0, -1.0, -0.5, 0.0, 0.2, 1.0, 1.0])
    np.testing.assert_allclose(drive_nominal(JOINT, dq, ddq), 2.0 * dq + 5.0 * sign + ddq, rtol=1e-12)
    sharp = replace(JOINT, friction=replace(JOINT.friction, velocity_band=0.0))
    np.testing.assert_allclose(drive_nominal(sharp, dq, ddq), 2.0 * dq + 5.0 * np.sign(dq) + ddq, rtol=1e-12)


@pytest.mark.parametrize(("low", "high", "constant"), [(-1.0, 3.0, 0.0), (0.5, 0.9, 0.5), (-4.0, -2.0, -2.0)])
def test_the_nominal_torque_lies_between_the_bounds(low: float, high: float, constant: float) -> None:
    rng = np.random.default_rng(1)
    dq, ddq = rng.normal(size=500) * 0.2, rng.normal(size=500)
    disturbance = Interval(low, high)
    nominal = drive_nominal(JOINT, dq, ddq, disturbance)
    np.testing.assert_allclose(nominal - drive_nominal(JOINT, dq, ddq), constant, rtol=0, atol=1e-12)
    lower, upper = DriveBox.of(JOINT, disturbance).torque_range(dq, ddq)
    assert np.all((lower <= nominal + 1e-12) & (nominal <= upper + 1e-12))
