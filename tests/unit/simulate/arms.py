"""Arms whose motion is known in closed form, and shipped arms in the states that the tests need."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, RigidBody
from modrob_cli.model.joint import Drive, Friction, Joint, JointType, Limits, Range
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Contact, Truth
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.simulate.plant import Plant
from modrob_cli.simulate.steps import State
from modrob_cli.simulate.truth import TrueRobot, true_robot
from modrob_cli.workflows.robots import load_robot

ROOT = Path(__file__).parents[3]
GRAVITY = 9.81


def shipped(name: str) -> Robot:
    return load_robot(ROOT / "assemblies" / f"{name}.yaml").robot


def body(mass: float, com: tuple[float, float, float], inertia: float) -> RigidBody:
    """A body with the same moment of inertia about all axes through its centre of mass."""
    tensor = np.array([inertia, 0.0, 0.0, inertia, 0.0, inertia])
    return RigidBody("body", Uncertain.exact(mass), Uncertain.exact(np.array(com)), Uncertain.exact(tensor))


def one_joint(
    kind: JointType,
    placement: Array,
    mass: float,
    coulomb: float = 0.0,
    viscous: float = 0.0,
    position: Range | None = None,
    com: tuple[float, float, float] = (0.0, 0.0, 0.0),
    inertia: float = 0.01,
) -> Robot:
    friction = Friction(Uncertain.exact(viscous), Uncertain.exact(coulomb))
    joint = Joint("j", kind, placement, friction=friction, limits=Limits(position=position))
    carried = PlacedBody(1, np.eye(4), body(mass, com, inertia))
    return Robot("one", (joint,), (carried,), np.eye(4), np.array([0.0, 0.0, -GRAVITY]), Interval(np.zeros(1)))


def slider(
    mass: float, slope: float = 0.0, coulomb: float = 0.0, viscous: float = 0.0, position: Range | None = None
) -> Robot:
    """A block that slides along x, downhill for positive slope [rad]."""
    c, s = np.cos(slope), np.sin(slope)
    placement = np.eye(4)
    placement[:3, :3] = [[-s, 0.0, c], [0.0, 1.0, 0.0], [-c, 0.0, -s]]  # level exactly if the slope is 0
    return one_joint("prismatic", placement, mass, coulomb, viscous, position)


def without_friction(robot: Robot) -> Robot:
    """The robot without friction, disturbance and limits; the rotors stay."""
    joints = tuple(replace(joint, friction=Friction(), limits=Limits()) for joint in robot.joints)
    return replace(robot, joints=joints, disturbance=Interval(np.zeros(robot.dof)))


def with_friction(robot: Robot, viscous: float, coulomb: float) -> Robot:
    friction = Friction(Uncertain.exact(viscous), Uncertain.exact(coulomb))
    return replace(robot, joints=tuple(replace(joint, friction=friction) for joint in robot.joints))


def with_rotors(robot: Robot, inertia: float) -> Robot:
    drive = Drive(Uncertain.exact(inertia))
    return replace(robot, joints=tuple(replace(joint, drive=drive) for joint in robot.joints))


def nominal(robot: Robot, breakaway: float = 1.0) -> TrueRobot:
    return true_robot(robot, Truth(breakaway=breakaway), np.random.default_rng(0))


def plant_of(robot: Robot, contacts: tuple[Contact, ...] = (), end_stops: bool = True, breakaway: float = 1.0) -> Plant:
    return Plant(nominal(robot, breakaway), contacts, end_stops)


def run(plant: Plant, state: State, tau: Array, until: float, h: float) -> State:
    """Advance in equal steps of about h seconds."""
    steps = round((until - state.t) / h)
    h = (until - state.t) / steps
    for _ in range(steps):
        plant.advance(state, tau, h)
    return state
