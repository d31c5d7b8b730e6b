"""End stops: inelastic impacts, joints that stay there and leave again, starts beyond them."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.errors import UsageError
from modrob_cli.model.joint import Limits, Range
from modrob_cli.model.robot import Robot
from tests.unit.simulate.arms import GRAVITY, plant_of, run, shipped, slider, with_friction, without_friction


def with_limits(robot: Robot, limits: list[Range | None]) -> Robot:
    joints = tuple(replace(j, limits=Limits(position=limit)) for j, limit in zip(robot.joints, limits, strict=True))
    return replace(robot, joints=joints)


def inertia(robot: Robot, q: Array) -> Array:
    """M(q) with rotors by Pinocchio's crba."""
    model = build_model(robot)
    upper = np.triu(pin.crba(model, model.createData(), q))
    rotors = [float(j.drive.gear_ratio**2 * j.drive.rotor_inertia.nominal) for j in robot.joints]
    return np.asarray(upper + np.triu(upper, 1).T + np.diag(rotors))


def test_a_block_stops_at_its_end_stop_and_stays() -> None:
    plant = plant_of(slider(2.0, position=(-0.5, 0.3)))
    state = plant.start(np.zeros(1), np.array([1.3]))
    run(plant, state, np.zeros(1), 1.0, 1e-3)
    (hit,) = plant.hits
    assert hit.joint == 0
    assert hit.t == pytest.approx(0.3 / 1.3, abs=1e-12)
    assert hit.speed == pytest.approx(1.3, abs=1e-12)
    assert state.q[0] == 0.3
    assert state.dq[0] == 0.0
    assert state.lost == pytest.approx(0.5 * 2.0 * 1.3**2, rel=1e-12)


@pytest.mark.parametrize("coulomb", [0.0, 1.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_pushed_against_the_stop_and_off_it(coulomb: float, side: float) -> None:
    plant = plant_of(slider(2.0, coulomb=coulomb, position=(-0.3, 0.3)))
    state = plant.start(np.array([0.3 * side]), np.zeros(1))
    run(plant, state, np.array([50.0 * side]), 0.5, 1e-3)
    assert state.q[0] == 0.3 * side
    assert state.dq[0] == 0.0
    assert plant.hits == []  # it has not moved
    assert plant.accelerations(state, np.array([50.0 * side]))[0] == 0.0
    run(plant, state, np.array([-3.0 * side]), 0.6, 1e-3)
    expected = 0.3 - 0.5 * (3.0 - coulomb) / 2.0 * 0.1**2
    assert state.q[0] == pytest.approx(expected * side, abs=1e-12)


def test_friction_holds_a_joint_at_its_stop() -> None:
    # 3 N outward or up to 4 N inward: friction and stop hold it; 4.1 N inward: it leaves
    plant = plant_of(slider(2.0, coulomb=4.0, position=(-0.3, 0.3)))
    for tau, stays in ((3.0, True), (-3.999, True), (-4.1, False)):
        state = plant.start(np.array([0.3]), np.zeros(1))
        run(plant, state, np.array([tau]), 0.1, 1e-3)
        assert bool(state.q[0] == 0.3) is stays


@pytest.mark.parametrize("name", ["planar-2r", "lwa4p-6", "scara"])
def test_impulses_act_at_stopped_joints_only(name: str) -> None:
    robot = without_friction(shipped(name))
    rng = np.random.default_rng(4)
    n, impacts = robot.dof, 0
    for _ in range(10):
        q, dq = rng.uniform(-1.0, 1.0, n), rng.uniform(-1.0, 1.0, n)
        stopped = int(rng.integers(n))
        ahead = 1e-3 * float(rng.random())
        # the stop of one joint is just ahead of it
        limit = (-10.0, q[stopped] + ahead) if dq[stopped] > 0.0 else (q[stopped] - ahead, 10.0)
        plant = plant_of(with_limits(robot, [limit if i == stopped else None for i in range(n)]))
        state = plant.start(q, dq)
        h = 2e-3 / max(abs(dq[stopped]), 0.1)
        plant.advance(state, np.zeros(n), h)
        if not plant.hits:
            continue
        impacts += 1
        (hit,) = plant.hits
        free = plant_of(robot)
        before = run(free, free.start(q, dq), np.zeros(n), hit.t, hit.t)
        assert before.q[stopped] == pytest.approx(limit[1] if dq[stopped] > 0.0 else limit[0], abs=1e-10)
        after = plant_of(with_limits(robot, [limit if i == stopped else None for i in range(n)]))
        touching = after.start(q, dq)
        after.advance(touching, np.zeros(n), hit.t + 1e-11)
        M = inertia(robot, touching.q)
        impulse = M @ (touching.dq - before.dq)
        others = np.delete(impulse, stopped)
        # within the instant after the impact other torques act too
        assert abs(touching.dq[stopped]) < 1e-8
        assert impulse[stopped] * dq[stopped] < 0.0
        assert np.abs(others).max() < 1e-9 + 1e-8 * abs(impulse[stopped])
        kinetic = 0.5 * (before.dq @ M @ before.dq - touching.dq @ M @ touching.dq)
        assert kinetic > 0.0
        assert touching.lost == pytest.approx(kinetic, rel=1e-5)
    assert impacts >= 5


def test_no_joint_ever_passes_its_stops_and_the_energy_is_accounted_for() -> None:
    limits: list[Range | None] = [(-0.6, 0.5), (-0.4, 0.8), (-0.7, 0.3), None, (-0.5, 0.5), (-0.2, 0.2)]
    robot = with_limits(with_friction(without_friction(shipped("lwa4p-6")), 0.8, 0.5), limits)
    plant = plant_of(robot)
    low, high = np.array([limit or (-np.inf, np.inf) for limit in limits]).T
    rng = np.random.default_rng(8)
    state = plant.start(np.zeros(6), rng.uniform(-2.0, 2.0, 6))
    model = build_model(robot)
    data = model.createData()

    def energy() -> float:
        kinetic = 0.5 * state.dq @ inertia(robot, state.q) @ state.dq
        return float(kinetic + pin.computePotentialEnergy(model, data, state.q))

    start, error = energy(), 0.0
    for k in range(3000):
        if k % 200 == 0:
            tau = rng.uniform(-40.0, 40.0, 6) * np.array([1.0, 1.0, 1.0, 0.3, 0.3, 0.3])
        plant.advance(state, tau, 1e-3)
        assert ((low <= state.q) & (state.q <= high)).all()
        error = max(error, abs(energy() - start - state.work + state.lost))
    assert len(plant.hits) > 20
    assert state.lost > 1.0
    assert error < 1e-6 * state.lost  # fourth order in the step


def test_two_joints_at_their_stops_at_once() -> None:
    robot = with_limits(without_friction(shipped("planar-2r")), [(-0.2, 1.0), (-0.3, 1.0)])
    plant = plant_of(robot)
    state = plant.start(np.array([-0.2, -0.3]), np.array([-1.0, -2.0]))
    plant.advance(state, np.zeros(2), 1e-3)  # gravity pushes both down too
    assert np.array_equal(state.q, [-0.2, -0.3])
    assert np.array_equal(state.dq, [0.0, 0.0])
    M = inertia(robot, state.q)
    dq = np.array([-1.0, -2.0])
    assert state.lost == pytest.approx(0.5 * dq @ M @ dq, rel=1e-12)


def test_an_impact_kicks_a_joint_that_rests() -> None:
    # impulses are larger than any friction: a held joint is torn loose by the impact of its neighbour
    robot = with_limits(with_friction(shipped("planar-2r"), 0.0, 500.0), [(-2.0, 0.1), None])
    plant = plant_of(robot)
    state = plant.start(np.array([0.099, 0.4]), np.array([3.0, 0.0]))
    M = inertia(robot, np.array([0.1, 0.4]))
    plant.advance(state, np.zeros(2), 1e-3)
    assert plant.hits
    # M22 dq2+ = M21 dq1-: the momentum of joint 2 is kept; then friction slows it down for the rest of the step
    kick = M[1, 0] * 3.0 / M[1, 1]
    assert 0.5 * kick < state.dq[1] < kick


def test_rests_on_a_stop_under_its_weight() -> None:
    # the arm falls onto the stop of joint 1 and lies there
    robot = with_limits(with_friction(shipped("planar-2r"), 3.0, 0.0), [(-0.5, 1.0), (-0.5, 0.5)])
    plant = plant_of(robot)
    state = run(plant, plant.start(np.zeros(2), np.zeros(2)), np.zeros(2), 5.0, 1e-3)
    assert state.q.tolist() == [-0.5, -0.5]
    assert state.dq.tolist() == [0.0, 0.0]
    assert state.lost - state.work == pytest.approx(
        -GRAVITY * (10 * 0.5 * np.sin(-0.5) + 5 * (np.sin(-0.5) + 0.5 * np.sin(-1.0))), rel=1e-6
    )


def test_a_start_beyond_a_stop_is_refused() -> None:
    plant = plant_of(slider(2.0, position=(-0.3, 0.3)))
    with pytest.raises(
        UsageError, match=r"joint j would start at 0\.31, beyond its limits -0\.3 \.\. 0\.3; .*end_stops"
    ):
        plant.start(np.array([0.31]), np.zeros(1))
    # rounding is not
    assert plant.start(np.array([0.3 + 1e-10]), np.zeros(1)).q[0] == 0.3
    plant = plant_of(slider(2.0, position=(-0.3, 0.3)), end_stops=False)
    assert plant.start(np.array([0.31]), np.zeros(1)).q[0] == 0.31
