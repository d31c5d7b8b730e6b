"""Dry friction: joints that rest stay where they are, to the last bit, and slide as the closed forms say."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics
from modrob_cli.model.joint import Joint
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Contact
from modrob_cli.model.uncertain import Uncertain
from tests.unit.simulate.arms import GRAVITY, plant_of, run, shipped, slider, with_friction


def with_coulomb(robot: Robot, coulomb: Array) -> Robot:
    def changed(joint: Joint, value: float) -> Joint:
        return replace(joint, friction=replace(joint.friction, coulomb=Uncertain.exact(value), coulomb_band=0.0))

    return replace(robot, joints=tuple(changed(*pair) for pair in zip(robot.joints, coulomb.tolist(), strict=True)))


def weight(robot: Robot, q: Array) -> Array:
    """Torque that carries the arm at rest, shape (n,)."""
    return inverse_dynamics(robot, q, np.zeros_like(q), np.zeros_like(q))


@pytest.mark.parametrize("name", ["planar-2r", "scara", "lwa4p-6", "lwa4p-8"])
def test_an_arm_below_its_breakaway_torque_rests_exactly(name: str) -> None:
    robot = shipped(name)
    rng = np.random.default_rng(1)
    q = rng.uniform(0.01, 0.15, robot.dof)
    tau = rng.uniform(-1.0, 1.0, robot.dof)
    needed = np.abs(weight(robot, q) - tau)
    robot = with_coulomb(robot, needed * (1.0 + 1e-9) + 1e-9)
    plant = plant_of(robot)
    state = plant.start(q, np.zeros(robot.dof))
    for _ in range(3000):
        plant.advance(state, tau, 1e-3)
    assert state.q.tobytes() == q.tobytes()
    assert not state.dq.any()
    assert not plant.accelerations(state, tau).any()
    assert state.work == 0.0


@pytest.mark.parametrize("joint", range(6))
def test_a_joint_just_above_its_breakaway_torque_moves(joint: int) -> None:
    robot = shipped("lwa4p-6")
    q = np.array([0.3, 0.8, -0.4, 0.2, 0.7, 0.1])
    tau = 1.0 + np.arange(6.0)
    needed = tau - weight(robot, q)
    coulomb = np.abs(needed) * 1.01
    coulomb[joint] = abs(needed[joint]) * (1.0 - 1e-6)
    plant = plant_of(with_coulomb(robot, coulomb))
    state = plant.start(q, np.zeros(6))
    assert np.flatnonzero(plant.accelerations(state, tau)).tolist() == [joint]
    assert np.sign(plant.accelerations(state, tau)[joint]) == np.sign(needed[joint])
    run(plant, state, tau, 0.05, 1e-3)
    assert np.sign(state.q - q)[joint] == np.sign(needed[joint])
    assert np.array_equal(np.delete(state.q, joint), np.delete(q, joint))


def test_a_joint_rests_exactly_while_others_move() -> None:
    # joint 2 has friction enough for anything, joint 1 swings
    robot = with_coulomb(shipped("planar-2r"), np.array([0.0, 1e4]))
    plant = plant_of(robot)
    state = plant.start(np.array([0.1, 0.7]), np.array([1.0, 0.0]))
    run(plant, state, np.zeros(2), 3.0, 1e-3)
    assert state.q[1] == 0.7
    assert state.dq[1] == 0.0
    # joint 1 alone is then a physical pendulum of both links: compare with its equation
    l1, c1, c2, m1, m2, own = 1.0, 0.5, 0.5, 10.0, 5.0, 10.0 / 12.0
    M = 2.0 * own + m1 * c1**2 + m2 * (l1**2 + c2**2 + 2.0 * l1 * c2 * np.cos(0.7))

    def rates(t: float, x: Array) -> list[float]:
        torque = (m1 * c1 + m2 * l1) * np.cos(x[0]) + m2 * c2 * np.cos(x[0] + 0.7)
        return [x[1], -torque * GRAVITY / M]

    x = solve_ivp(rates, (0.0, 3.0), [0.1, 1.0], "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    assert state.q[0] == pytest.approx(x[0], abs=1e-7)


@pytest.mark.parametrize("h", [1e-3, 0.7e-3, 0.05])
def test_a_block_stops_on_a_slope_where_and_when_it_must(h: float) -> None:
    # m a = m g sin(s) - Fc: uphill friction wins; with constant deceleration Runge-Kutta is exact, so h does not matter
    mass, slope, coulomb, v = 2.0, 0.3, 9.0, 1.5
    plant = plant_of(slider(mass, slope, coulomb))
    state = plant.start(np.zeros(1), np.array([v]))
    a = GRAVITY * np.sin(slope) - coulomb / mass
    stop = -v / a
    assert 0.3 < stop < 2.0
    times, speeds = [0.0], [v]
    while state.t < 5.0 - 0.5 * h:
        plant.advance(state, np.zeros(1), h)
        times.append(state.t)
        speeds.append(state.dq[0])
    expected = np.maximum(v + a * np.array(times), 0.0)
    assert np.abs(speeds - expected).max() < 1e-10  # rounding of thousands of steps
    assert state.q[0] == pytest.approx(0.5 * v * stop, abs=1e-12)
    assert state.dq[0] == 0.0
    # work of friction equals the energy that went
    drop = mass * GRAVITY * np.sin(slope) * state.q[0]
    assert state.work == pytest.approx(-(0.5 * mass * v**2 + drop), rel=1e-12)


def test_breakaway_above_coulomb() -> None:
    # held up to 1.5 Fc, slides with Fc: a = (tau - Fc) / m at once
    mass, coulomb = 2.0, 4.0
    for tau, moves in ((5.99, False), (6.01, True), (-5.99, False), (-6.01, True)):
        plant = plant_of(slider(mass, 0.0, coulomb), breakaway=1.5)
        state = plant.start(np.zeros(1), np.zeros(1))
        run(plant, state, np.array([tau]), 0.5, 1e-3)
        a = (abs(tau) - coulomb) / mass * np.sign(tau) if moves else 0.0
        assert state.q[0] == pytest.approx(0.5 * a * 0.25, abs=1e-12)


def stick_slip(mass: float, coulomb: float, breakaway: float, size: float, w: float, end: float) -> tuple[float, int]:
    """Position of a block under the force size * sin(w t) at the end, and how often it stopped; event by event."""
    t, x, stops = 0.0, 0.0, 0

    def force(t: float) -> float:
        return float(size * np.sin(w * t))

    while t < end:
        # at rest: the next time at which the force exceeds the breakaway force
        grid = np.linspace(t, t + 2.0 * np.pi / w, 20001)
        above = np.abs(size * np.sin(w * grid)) > breakaway
        first = int(np.argmax(above))
        if not above.any() or grid[first] >= end:
            break
        if first:
            t = brentq(lambda s: abs(force(s)) - breakaway, grid[first - 1], grid[first], xtol=1e-15)
        sign = np.sign(force(t + 1e-12))

        def still(s: float, y: Array, sign: float = sign) -> float:
            return float(y[1] * sign)

        still.terminal, still.direction = True, -1.0  # type: ignore[attr-defined]
        # start a moment later with the motion of the first instant, so that the event is not seen at the start
        moment = 1e-7
        a0, jerk = (force(t) - sign * coulomb) / mass, size * w * np.cos(w * t) / mass
        y = [x + a0 * moment**2 / 2 + jerk * moment**3 / 6, a0 * moment + jerk * moment**2 / 2]
        rates = lambda s, y, sign=sign: [y[1], (force(s) - sign * coulomb) / mass]  # noqa: E731
        part = solve_ivp(rates, (t + moment, end), y, "DOP853", rtol=1e-12, atol=1e-15, events=still)
        t, x = float(part.t[-1]), float(part.y[0, -1])
        stops += int(part.status == 1)
        if part.status == 1 and abs(force(t)) > breakaway:
            raise AssertionError("this reference is for motions that stick after each stop")
    return x, stops


@pytest.mark.parametrize(("breakaway", "order", "factor"), [(1.0, 2, 1.0), (1.3, 1, 0.3)])
def test_stick_slip_against_events(breakaway: float, order: int, factor: float) -> None:
    # The force is held over each step (midpoint value: second order). A joint lets go at the beginning of a step, so
    # that the start is up to a step late: with breakaway = Coulomb the force that is missed grows from zero, which
    # costs second order; above it the acceleration jumps, which costs first order. The travel is about 0.05 m.
    mass, coulomb, size, w, end = 1.7, 4.0, 5.6, 5.0, 6.0
    x, stops = stick_slip(mass, coulomb, breakaway * coulomb, size, w, end)
    assert stops == 9
    for h in (4e-3, 2e-3, 1e-3, 5e-4):
        plant = plant_of(slider(mass, 0.0, coulomb), breakaway=breakaway)
        state = plant.start(np.zeros(1), np.zeros(1))
        for k in range(round(end / h)):
            plant.advance(state, np.array([size * np.sin(w * (k + 0.5) * h)]), h)
        assert abs(state.q[0] - x) < factor * h**order


def test_friction_does_not_chatter_at_rest() -> None:
    # a torque that turns around while the joints rest, within the friction: nothing moves
    robot = with_friction(shipped("lwa4p-6"), 10.0, 60.0)
    plant = plant_of(robot)
    q = np.array([0.1, 0.3, -0.2, 0.1, 0.2, 0.0])
    state = plant.start(q, np.zeros(6))
    rng = np.random.default_rng(5)
    for _ in range(500):
        plant.advance(state, rng.uniform(-8.0, 8.0, 6), 1e-3)
    assert np.array_equal(state.q, q)


def test_a_contact_tears_a_joint_loose_and_it_comes_to_rest_again() -> None:
    push = Contact("push", 1, np.zeros(3), np.array([6.0, 0.0, 0.0]), 0.10025, 0.2)
    plant = plant_of(slider(2.0, 0.0, 4.0), (push,))
    state = plant.start(np.zeros(1), np.zeros(1))
    run(plant, state, np.zeros(1), 1.0, 1e-3)
    # accelerates with (6 - 4) / 2 for 0.2 s, then stops with -4 / 2
    v = 1.0 * 0.2
    assert state.q[0] == pytest.approx(0.5 * v * 0.2 + 0.5 * v**2 / 2.0, abs=1e-12)
    assert state.dq[0] == 0.0
