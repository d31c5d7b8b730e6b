"""The true robot: a real member of the box, repeatable, set by hand only within it."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.errors import UsageError
from modrob_cli.interval import Interval
from modrob_cli.model.body import tensor
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Draw, Truth
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.simulate.truth import BODY_KEYS, TrueRobot, true_robot
from tests.unit.simulate.arms import body, shipped

ARMS = ("lwa4p-6-tol5", "planar-2r", "scara", "lwa4p-6-payload")


def draw(robot: Robot, how: Draw, seed: int = 0, **more: object) -> TrueRobot:
    return true_robot(robot, Truth(draw=how, **more), np.random.default_rng(seed))  # type: ignore[arg-type]


def parameters(robot: Robot) -> list[Uncertain]:
    """All uncertain parameters, in a fixed order."""
    bodies = [getattr(placed.body, key) for placed in robot.bodies for key in BODY_KEYS]
    joints = [part for j in robot.joints for part in (j.friction.viscous, j.friction.coulomb, j.drive.rotor_inertia)]
    return bodies + joints


def values(robot: Robot) -> Array:
    return np.concatenate([np.ravel(part.nominal) for part in parameters(robot)])


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("how", ["uniform", "vertices", "nominal"])
def test_draws_lie_in_the_box_and_are_numbers(name: str, how: Draw) -> None:
    robot = shipped(name)
    for seed in range(20):
        truth = draw(robot, how, seed)
        for part, true in zip(parameters(robot), parameters(truth.robot), strict=True):
            assert true.is_exact
            assert part.interval.contains(true.nominal).all()
        band = np.array([joint.friction.coulomb_band for joint in robot.joints])
        assert (truth.offset >= robot.disturbance.inf - band).all()
        assert (truth.offset <= robot.disturbance.sup + band).all()
        assert not truth.robot.disturbance.sup.any()


@pytest.mark.parametrize("name", ARMS)
def test_vertices_are_ends(name: str) -> None:
    robot = shipped(name)
    truth = draw(robot, "vertices")
    placed = [p for p in robot.bodies if p.body.name not in truth.nominal_bodies]
    wide = [p for p in parameters(replace(robot, bodies=tuple(placed))) if not p.is_exact]
    same = [p for p in truth.robot.bodies if p.body.name not in truth.nominal_bodies]
    drawn = parameters(replace(truth.robot, bodies=tuple(same)))
    all_parts = parameters(replace(robot, bodies=tuple(placed)))
    assert wide
    for part, true in zip(all_parts, drawn, strict=True):
        assert ((true.nominal == part.interval.inf) | (true.nominal == part.interval.sup)).all()


def test_draws_fill_their_intervals() -> None:
    robot = shipped("lwa4p-6-tol5")
    drawn = np.array([values(draw(robot, "uniform", seed).robot) for seed in range(200)])
    low = np.concatenate([np.ravel(part.interval.inf) for part in parameters(robot)])
    high = np.concatenate([np.ravel(part.interval.sup) for part in parameters(robot)])
    wide = high > low
    share = ((drawn - low)[:, wide] / (high - low)[wide]).T
    masses = share[np.isin(np.flatnonzero(wide), [0, 10, 20, 30])]
    # 200 uniform numbers: mean 1/2 within 5 standard deviations of 1 / sqrt(12 * 200)
    assert (np.abs(masses.mean(axis=1) - 0.5) < 5.0 / np.sqrt(12 * 200)).all()
    assert (masses.min(axis=1) < 0.1).all()
    assert (masses.max(axis=1) > 0.9).all()


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("how", ["uniform", "vertices"])
def test_drawn_bodies_are_real(name: str, how: Draw) -> None:
    # principal moments about the centre of mass fulfil the triangle inequality
    for seed in range(20):
        truth = draw(shipped(name), how, seed)
        for placed in truth.robot.bodies:
            b = placed.body
            m, c, I = float(b.mass.nominal), b.com.nominal, tensor(b.inertia.nominal)  # noqa: E741
            assert m >= 0.0
            if b.inertia_about == "frame":
                I = I - m * (c @ c * np.eye(3) - np.outer(c, c))  # noqa: E741
            moments = np.linalg.eigvalsh(I)
            assert moments[0] >= -1e-9 * moments[2]
            assert moments[0] + moments[1] >= moments[2] * (1.0 - 1e-9)


def test_seeds_repeat_and_differ() -> None:
    robot = shipped("lwa4p-6-tol5")
    first, again, other = (values(draw(robot, "uniform", seed).robot) for seed in (1, 1, 2))
    assert first.tobytes() == again.tobytes()
    assert not np.array_equal(first, other)


def test_setting_one_value_changes_no_other() -> None:
    robot = shipped("lwa4p-6-tol5")
    name, joint = robot.bodies[1].body.name, robot.joints[3].name
    mass = robot.bodies[1].body.mass.interval
    chosen = float(0.25 * mass.inf + 0.75 * mass.sup)
    viscous = float(robot.joints[3].friction.viscous.interval.sup)
    drawn = draw(robot, "uniform", 5)
    changed = draw(robot, "uniform", 5, bodies={name: {"mass": np.array(chosen)}}, joints={joint: {"viscous": viscous}})
    different = np.flatnonzero(values(drawn.robot) != values(changed.robot))
    assert len(different) == 2
    assert float(changed.robot.bodies[1].body.mass.nominal) == chosen
    assert float(changed.robot.joints[3].friction.viscous.nominal) == viscous


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            {"bodies": {"link2": {"mass": np.array(10.1)}}},
            r"body link2: mass: found 10\.1, the robot's file admits 5\.0 to 10\.0",
        ),
        ({"bodies": {"link3": {"mass": np.array(5.0)}}}, "found the body 'link3', the robot has .*link1, .*link2"),
        ({"bodies": {"link2": {"weight": np.array(5.0)}}}, "found weight, expected mass, com, inertia"),
        ({"bodies": {"link2": {"com": np.zeros(2)}}}, "com: found 2 values, expected 3"),
        ({"bodies": {"link2": {"mass": np.array(np.nan)}}}, "found nan"),
        ({"joints": {"q3": {"viscous": 0.0}}}, "found the joint 'q3', the robot has q1, q2"),
        ({"joints": {"q1": {"viscous": 0.1}}}, "joint q1: viscous: found 0.1"),
        ({"joints": {"q1": {"friction_offset": 0.1}}}, "friction_offset: found 0.1"),
        ({"joints": {"q1": {"damping": 0.1}}}, "found damping, expected viscous"),
    ],
)
def test_what_is_not_admissible_is_refused(more: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        draw(shipped("planar-2r"), "nominal", 0, **more)


def test_values_that_make_no_real_body_are_refused() -> None:
    robot = shipped("planar-2r")
    index = next(k for k, placed in enumerate(robot.bodies) if placed.body.name == "link2")
    hollow = replace(robot.bodies[index].body, inertia_about="frame")
    wide = Interval(np.zeros(6), np.array([5.0, 0.0, 0.0, 5.0, 0.0, 5.0]))
    hollow = replace(hollow, inertia=Uncertain(np.array([1.0, 0.0, 0.0, 2.5, 0.0, 2.5]), wide))
    bodies = list(robot.bodies)
    bodies[index] = replace(bodies[index], body=hollow)
    small = {"link2": {"inertia": np.array([1e-3, 0.0, 0.0, 1e-3, 0.0, 1e-3])}}  # less than m c^2 about the origin
    with pytest.raises(UsageError, match="body link2: mass, com and inertia together are not those of a real body"):
        draw(replace(robot, bodies=tuple(bodies)), "nominal", 0, bodies=small)


def test_a_box_without_real_bodies_keeps_its_nominal_values() -> None:
    robot = shipped("planar-2r")
    index = next(k for k, placed in enumerate(robot.bodies) if placed.body.name == "link2")
    # xx is so large that xx <= yy + zz holds at the nominal corner of the box only
    low = np.array([1.25 + 0.8333333333333334, 0, 0, 1.25, 0, 0.8333333333333334])
    high = np.array([50.0, 0, 0, 1.25, 0, 0.8333333333333334])
    hard = replace(robot.bodies[index].body, inertia=Uncertain(low, Interval(low, high)))
    bodies = list(robot.bodies)
    bodies[index] = replace(bodies[index], body=hard)
    truth = draw(replace(robot, bodies=tuple(bodies)), "uniform", 3)
    assert truth.nominal_bodies == ("link2",)
    assert float(truth.robot.bodies[index].body.mass.nominal) == float(hard.mass.nominal)


def test_payload_is_added_at_the_end_effector() -> None:
    robot = shipped("lwa4p-6")
    load = body(2.0, (0.0, 0.01, 0.1), 0.004)
    truth = true_robot(robot, Truth(), np.random.default_rng(0), load)
    plain, loaded = build_model(robot), build_model(truth.robot)
    assert sum(i.mass for i in loaded.inertias) == pytest.approx(sum(i.mass for i in plain.inertias) + 2.0)
    # weight of the payload at the tool: virtual work of lifting its centre of mass
    q, d = np.array([0.3, -0.6, 0.4, 0.2, 0.9, -0.5]), 1e-6
    import pinocchio as pin

    more = pin.rnea(loaded, loaded.createData(), q, np.zeros(6), np.zeros(6))
    more = more - pin.rnea(plain, plain.createData(), q, np.zeros(6), np.zeros(6))
    steps = np.concatenate([q + d * np.eye(6), q - d * np.eye(6)])
    heights = (robot.link_frames(steps)[:, -1] @ np.array([0.0, 0.01, 0.1, 1.0]))[:, 2]
    assert more == pytest.approx(2.0 * 9.81 * (heights[:6] - heights[6:]) / (2.0 * d), abs=1e-6)


def test_breakaway_is_a_multiple_of_the_true_coulomb_torque() -> None:
    robot = shipped("scara")
    truth = draw(robot, "uniform", 2, breakaway=1.4)
    coulomb = [float(joint.friction.coulomb.nominal) for joint in truth.robot.joints]
    assert truth.breakaway == pytest.approx(1.4 * np.array(coulomb), rel=1e-15)
