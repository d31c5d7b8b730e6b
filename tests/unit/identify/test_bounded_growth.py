"""How much the rigid bodies' boxes would have to grow: against a robot whose masses are known to be wrong."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.identify.bounded_answers import Answers
from modrob_cli.identify.bounded_boxes import with_grown_boxes, with_grown_masses
from modrob_cli.identify.bounded_growth import box_growth, mass_growth
from modrob_cli.identify.bounded_ranges import MotionNoise, RecordedMotion, rigid_bodies_of
from modrob_cli.identify.bounded_samples import JointSamples
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, RigidBody
from modrob_cli.model.joint import Joint
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import from_xyz_rpy

VISCOUS, COULOMB = (3.0, 2.0), (1.0, 0.5)


def arm(masses: tuple[float, float] = (3.0, 2.0), spread: float = 0.0) -> Robot:
    """A vertical two-link arm; the masses may be uncertain by a share."""
    joints = (
        Joint("one", "revolute", from_xyz_rpy([0, 0, 0.3], [np.pi / 2, 0, 0])),
        Joint("two", "revolute", from_xyz_rpy([0.5, 0, 0], [0, 0, 0])),
    )
    bodies = []
    for k, mass in enumerate(masses):
        box = Uncertain(np.asarray(mass), Interval(mass * (1.0 - spread), mass * (1.0 + spread)))
        tensor = Uncertain.exact(np.array([0.01, 0, 0, 0.05, 0, 0.05]))
        body = RigidBody(f"body{k + 1}", box, Uncertain.exact(np.array([0.25, 0.0, 0.0])), tensor)
        bodies.append(PlacedBody(k + 1, np.eye(4), body))
    gravity = np.array([0.0, 0.0, -9.81])
    return Robot("arm", joints, tuple(bodies), np.eye(4), gravity, Interval(np.zeros(2)))


def recorded(true: Robot, count: int = 600) -> RecordedMotion:
    """A run of the true arm with constant friction and no noise."""
    t = np.linspace(0.0, 10.0, count)
    rate = np.array([1.1, 1.7])
    q = np.sin(t[:, None] * rate)
    dq, ddq = rate * np.cos(t[:, None] * rate), -(rate**2) * q
    tau = rnea(true, q, dq, ddq) + np.array(VISCOUS) * dq + np.array(COULOMB) * np.sign(dq)
    return RecordedMotion(np.zeros(count), t, q, dq, ddq, tau, gravity=True)


def samples_of(robot: Robot, motion: RecordedMotion) -> list[JointSamples]:
    rigid = motion.bounds(rigid_bodies_of(robot), MotionNoise.none(2))
    return [motion.of_joint(j, rigid, MotionNoise.none(2)) for j in range(2)]


def explained(robot: Robot, motion: RecordedMotion) -> Array:
    """Whether each sample of each joint lies inside the bounds with the true friction."""
    bounds = exact_bounds(robot, motion.q, motion.dq, motion.ddq)
    rest = motion.tau - np.array(VISCOUS) * motion.dq - np.array(COULOMB) * np.sign(motion.dq)
    # The torques were computed by another recursion, which rounds differently.
    return np.asarray((bounds.lower - 1e-9 <= rest) & (rest <= bounds.upper + 1e-9))


def test_the_body_whose_mass_is_wrong_needs_no_more_growth_than_its_error() -> None:
    robot, true = arm(), arm((3.0, 2.4))
    motion = recorded(true)
    target = np.full(2, 1e-9)
    found = mass_growth(robot, motion, MotionNoise.none(2), samples_of(robot, motion), [{}, {}], target)
    for j in range(2):
        # Body 2 is 20 % heavier. Friction and offset may take over a little of it.
        alone = found.one_body[j]["body2"]
        together = found.all_bodies[j]
        assert alone is not None
        assert together is not None
        assert together <= alone <= 0.2 + 1e-6
        assert alone > 0.1
    assert set(found.one_body[0]) == {"body1", "body2"}
    assert set(found.one_body[1]) == {"body2"}, "body 1 does not load joint 2"
    grown = with_grown_masses(robot, robot.bodies[1:], 0.2)
    assert np.all(explained(grown, motion))
    assert not np.all(explained(with_grown_masses(robot, robot.bodies[1:], 0.19), motion))


def test_growth_is_least() -> None:
    """A little less growth leaves more than the target with the best friction, by an independent evaluation."""
    robot, motion = arm(), recorded(arm((3.3, 2.0)))
    target = np.full(2, 0.05)
    found = mass_growth(robot, motion, MotionNoise.none(2), samples_of(robot, motion), [{}, {}], target)
    share = found.all_bodies[0]
    assert share is not None
    for factor, enough in ((1.001, True), (0.98, False)):
        wider = samples_of(with_grown_masses(robot, robot.bodies, factor * share), motion)[0]
        ends = Answers(wider, {}).one_value_each().ends
        assert bool(0.5 * (ends[7] - ends[6]) <= target[0] * 1.0001) == enough


def test_boxes_grow_by_a_common_factor() -> None:
    robot, true = arm(spread=0.05), arm((3.0 * 1.1, 2.0 * 1.1))
    motion = recorded(true)
    target = np.full(2, 1e-6)
    factor = box_growth(robot, motion, MotionNoise.none(2), samples_of(robot, motion), [{}, {}], target)
    assert factor is not None
    # Twice the box holds the true masses; the constant friction may take over a little.
    assert 1.3 < factor <= 2.0 * 1.01
    right = recorded(arm((3.1, 1.95)))
    assert box_growth(robot, right, MotionNoise.none(2), samples_of(robot, right), [{}, {}], target) == 1.0
    assert box_growth(arm(), motion, MotionNoise.none(2), samples_of(arm(), motion), [{}, {}], target) is None


def test_grown_boxes_stay_physical() -> None:
    body = replace(
        arm().bodies[0].body,
        mass=Uncertain(np.asarray(1.0), Interval(0.5, 2.0)),
        com=Uncertain(np.zeros(3), Interval(np.full(3, -0.1), np.full(3, 0.2))),
        inertia=Uncertain(np.full(6, 0.1), Interval(np.full(6, 0.05), np.full(6, 0.2))),
    )
    robot = replace(arm(), bodies=(PlacedBody(1, np.eye(4), body),))
    grown = with_grown_boxes(robot, 3.0).bodies[0].body
    assert grown.mass.interval.inf == 0.0
    assert grown.mass.interval.sup == pytest.approx(4.0)
    np.testing.assert_allclose(grown.com.interval.inf, -0.3)
    np.testing.assert_allclose(grown.com.interval.sup, 0.6)
    np.testing.assert_allclose(grown.inertia.interval.inf, [0.0, -0.05, -0.05, 0.0, -0.05, 0.0])
    same = with_grown_boxes(robot, 1.0).bodies[0].body
    assert np.all(same.com.interval.encloses(body.com.interval))
    np.testing.assert_allclose(same.com.interval.inf, body.com.interval.inf)


def test_a_mass_that_would_have_to_reach_zero_is_no_explanation() -> None:
    robot, motion = arm(), recorded(arm((30.0, 2.0)))
    found = mass_growth(robot, motion, MotionNoise.none(2), samples_of(robot, motion), [{}, {}], np.full(2, 1e-6))
    assert found.one_body[0]["body1"] is None
