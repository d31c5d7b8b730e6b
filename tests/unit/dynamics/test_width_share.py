"""Shares of the width against brute force: exact bounds of robots in which one parameter alone has a width."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ddq_bounds import ddq_bounds
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.width_share import acceleration_widths, parameter_widths, ranked
from modrob_cli.errors import ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.body import INERTIA_ENTRIES, InertiaPoint, PlacedBody, RigidBody
from modrob_cli.model.joint import Drive, Friction, Joint, JointType
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import rotation, translation
from modrob_cli.workflows.robots import load_robot

ROOT = Path(__file__).parents[3]


def spread(rng: np.random.Generator, nominal: Array, width: float) -> Uncertain:
    """Nominal values off the middle of their intervals."""
    nominal = np.asarray(nominal)
    low, high = rng.uniform(0.1, 1.0, size=(2, *nominal.shape)) * width
    return Uncertain(nominal, Interval(nominal - low, nominal + high))


def some_robot(seed: int, kinds: str = "RPR") -> Robot:
    """A chain in which everything is uncertain; one body about its centre of mass, one about its frame per link."""
    rng = np.random.default_rng(seed)
    joints, bodies = [], []
    for i, kind in enumerate(kinds):
        place = rotation("x", rng.uniform(-3, 3)) @ translation("z", 0.3) @ rotation("y", rng.uniform(-3, 3))
        viscous, coulomb = spread(rng, np.array(3.0), 0.5), spread(rng, np.array(2.0), 0.4)
        friction = Friction(viscous, coulomb, coulomb_band=0.2, velocity_band=0.05)
        drive = Drive(spread(rng, np.array(1e-3), 1e-4), gear_ratio=50.0)
        type_: JointType = "revolute" if kind == "R" else "prismatic"
        joints.append(Joint(f"j{i + 1}", type_, place, 0.0, friction, drive))
        for about in get_args(InertiaPoint):
            com = spread(rng, rng.uniform(-0.3, 0.3, size=3), 0.1)
            inertia = spread(rng, rng.uniform(0.0, 0.02, size=6), 0.01)
            body = RigidBody(f"b{i}.{about}", spread(rng, np.array(2.0), 0.3), com, inertia, about)
            bodies.append(PlacedBody(i + 1, rotation("y", rng.uniform(-3, 3)) @ translation("x", 0.2), body))
    disturbance = Interval(np.full(len(kinds), -0.3), np.full(len(kinds), 0.4))
    gravity = np.array([1.0, -2.0, -9.0])
    return Robot("some", tuple(joints), tuple(bodies), np.eye(4), gravity, disturbance)


def states(seed: int, dof: int, count: int = 40) -> list[Array]:
    rng = np.random.default_rng(seed)
    q, dq, ddq = (rng.normal(size=(count, dof)) for _ in range(3))
    dq[:8] = rng.uniform(0.001, 0.04, size=(8, dof))  # within the velocity band, not zero
    return [q, dq, ddq]


def exact(value: Uncertain) -> Uncertain:
    return Uncertain.exact(value.nominal)


def collapsed(robot: Robot) -> Robot:
    """The robot without any width."""
    joints = []
    for joint in robot.joints:
        friction = Friction(exact(joint.friction.viscous), exact(joint.friction.coulomb))
        joints.append(
            replace(
                joint, friction=friction, drive=replace(joint.drive, rotor_inertia=exact(joint.drive.rotor_inertia))
            )
        )
    bodies = [
        replace(p, body=replace(p.body, mass=exact(p.body.mass), com=exact(p.body.com), inertia=exact(p.body.inertia)))
        for p in robot.bodies
    ]
    zero = Interval(np.zeros(robot.dof))
    return replace(robot, joints=tuple(joints), bodies=tuple(bodies), disturbance=zero)


def only(value: Uncertain, k: int) -> Uncertain:
    """Element k of a vector keeps its interval."""
    inf, sup = value.nominal.copy(), value.nominal.copy()
    inf[k], sup[k] = value.interval.inf[k], value.interval.sup[k]
    return Uncertain(value.nominal, Interval(inf, sup))


def one_at_a_time(robot: Robot) -> Iterator[tuple[str, Robot]]:
    """Every parameter's name, and the robot in which it alone has a width."""
    bare = collapsed(robot)
    for n, placed in enumerate(robot.bodies):
        body, point = placed.body, bare.bodies[n].body
        variants = [("mass", replace(point, mass=body.mass))]
        variants += [(f"com {'xyz'[k]}", replace(point, com=only(body.com, k))) for k in range(3)]
        variants += [
            (f"inertia {name}", replace(point, inertia=only(body.inertia, k))) for k, name in enumerate(INERTIA_ENTRIES)
        ]
        for quantity, variant in variants:
            bodies = list(bare.bodies)
            bodies[n] = replace(bodies[n], body=variant)
            yield f"{body.name} {quantity}", replace(bare, bodies=tuple(bodies))
    for n, joint in enumerate(robot.joints):
        point_joint = bare.joints[n]
        free, rotor = joint.friction, replace(point_joint.drive, rotor_inertia=joint.drive.rotor_inertia)
        drives = [
            ("viscous friction", replace(point_joint, friction=replace(point_joint.friction, viscous=free.viscous))),
            ("Coulomb friction", replace(point_joint, friction=replace(point_joint.friction, coulomb=free.coulomb))),
            ("friction sign near standstill",
             replace(point_joint, friction=replace(point_joint.friction, velocity_band=free.velocity_band))),
            ("friction band",
             replace(point_joint, friction=replace(point_joint.friction, coulomb_band=free.coulomb_band))),
            ("rotor inertia", replace(point_joint, drive=rotor)),
        ]  # fmt: skip
        for quantity, variant_joint in drives:
            joints = list(bare.joints)
            joints[n] = variant_joint
            yield f"{joint.name} {quantity}", replace(bare, joints=tuple(joints))
        ends = np.zeros((2, robot.dof))
        ends[:, n] = robot.disturbance.inf[n], robot.disturbance.sup[n]
        yield f"{joint.name} disturbance", replace(bare, disturbance=Interval(*ends))


def mean_width(robot: Robot, motion: list[Array]) -> Array:
    bounds = exact_bounds(robot, *motion)
    return np.asarray((bounds.upper - bounds.lower).mean(axis=0))


@pytest.mark.parametrize("kinds", ["RPR", "P", "RRRR"])
def test_widths_are_those_of_robots_with_one_uncertain_parameter(kinds: str) -> None:
    robot = some_robot(5, kinds)
    motion = states(6, robot.dof)
    widths = parameter_widths(robot, *motion)
    names = set()
    for name, variant in one_at_a_time(robot):
        names.add(name)
        expected = mean_width(variant, motion)
        got = np.array([joint.get(name, 0.0) for joint in widths])
        # exact_bounds adds its rounding margin, below 1e-10 N m for these sizes
        np.testing.assert_allclose(got, expected, rtol=1e-10, atol=1e-10, err_msg=name)
    assert {name for joint in widths for name in joint} <= names


@pytest.mark.parametrize("name", ["lwa4p-table34", "lwa4p-6-tol5", "lwa4p-6-payload", "scara"])
def test_shipped_arms(name: str) -> None:
    robot = load_robot(ROOT / "assemblies" / f"{name}.yaml").robot
    motion = states(7, robot.dof)
    widths = parameter_widths(robot, *motion)
    for parameter, variant in one_at_a_time(robot):
        got = np.array([joint.get(parameter, 0.0) for joint in widths])
        np.testing.assert_allclose(got, mean_width(variant, motion), rtol=1e-9, atol=1e-8, err_msg=parameter)


def test_standstill() -> None:
    """At rest the sign of friction is unknown, with a velocity band or without."""
    robot = some_robot(8, "R")
    q = np.array([[0.3]])
    bare = collapsed(robot)
    widths = parameter_widths(bare, q, 0.0 * q, 0.0 * q)
    assert widths == [{"j1 friction sign near standstill": 4.0}]
    assert mean_width(bare, [q, 0.0 * q, 0.0 * q]) == pytest.approx(4.0)
    assert "j1 Coulomb friction" not in parameter_widths(robot, q, 0.0 * q, 0.0 * q)[0]


def test_acceleration_tolerance_alone() -> None:
    robot = some_robot(9)
    motion = states(10, robot.dof)
    motion[1][np.abs(motion[1]) < 0.05] = 0.5
    tolerance = np.array([0.3, 0.0, 0.7])
    widths = acceleration_widths(robot, motion[0], tolerance)
    bare = collapsed(robot)
    for k in (0, 2):
        alone = np.zeros(3)
        alone[k] = tolerance[k]
        bounds = ddq_bounds(bare, motion[0], motion[1], motion[2], alone)
        got = [joint[f"j{k + 1} acceleration tolerance"] for joint in widths]
        np.testing.assert_allclose(got, (bounds.upper - bounds.lower).mean(axis=0), rtol=1e-9, atol=1e-9)
    assert all(len(joint) == 2 for joint in widths)


def test_ranking() -> None:
    shares = ranked({"a": 1.0, "b": 3.0, "noise": 1e-16, "none": 0.0})
    assert [(s.parameter, s.width, s.share) for s in shares] == [("b", 3.0, 0.75), ("a", 1.0, 0.25)]
    assert ranked({}) == []
    assert ranked({"none": 0.0}) == []


def test_bodies_of_one_name_are_told_apart() -> None:
    robot = some_robot(11, "RR")
    bodies = tuple(replace(p, body=replace(p.body, name="arm")) for p in robot.bodies)
    widths = parameter_widths(replace(robot, bodies=bodies), *states(12, 2))
    assert {"arm (body 3) mass", "arm (body 4) mass"} <= set(widths[1])
    assert len(widths[0]) == 6 + 4 * 10


def test_no_samples() -> None:
    with pytest.raises(ShapeError, match="at least one sample"):
        parameter_widths(some_robot(13), *(np.empty((0, 3)) for _ in range(3)))
