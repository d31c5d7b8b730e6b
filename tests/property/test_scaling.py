"""Safe factors at samples: against a fine scan with the exact torque ranges, which know nothing of factors."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.model.joint import Friction
from modrob_cli.scaling.feasible import free_factors, limit_rows
from modrob_cli.scaling.sampled import States, gaps, sampled_factors
from modrob_cli.scaling.scaled_torque import ScaledTorques
from tests.property.test_box_bounds import around
from tests.scaling_cases import Case, random_case

SPAN = (0.02, 4.0)
CASES = 15
"""In the suite; 200 and more were run with the same result."""
NEAR = 1e-6
"""Accuracy of factors that is asked for, relative."""
ROUNDING = 1e-9
"""Ranges at instants have rounding margins of their own, some 1e-11 of the torque: closer to a limit is undecided."""


def excess(case: Case, states: States, c: Array) -> Array:
    """How far the worst torque is beyond its limit at each factor, shape (C,); the scan."""
    count = len(states.t)
    q = np.tile(states.q, (len(c), 1))
    dq, ddq = (np.concatenate([factor**k * part for factor in c]) for k, part in ((1, states.dq), (2, states.ddq)))
    found = exact_bounds(case.robot, q, dq, ddq)
    worst = np.maximum(found.upper - case.limits[1], case.limits[0] - found.lower).max(axis=1)
    return np.asarray(worst.reshape(len(c), count).max(axis=1))


def states_of(case: Case) -> States:
    return States.of(case.trajectory, np.linspace(0.0, case.trajectory.duration, 25))


def free_of(case: Case, states: States) -> list[tuple[float, float]]:
    torques = ScaledTorques(case.robot, states.q, states.dq, states.ddq)
    return free_factors(torques, limit_rows(torques, *case.limits), *SPAN)


@pytest.mark.parametrize("seed", range(CASES))
def test_safe_factors_are_those_of_a_fine_scan(seed: int) -> None:
    case = random_case(seed)
    assert_like_a_scan(case, states_of(case))


@pytest.mark.parametrize("seed", [0, 1, 2, 7])
def test_gaps_are_those_of_a_fine_scan(seed: int) -> None:
    """Joints with strong viscous friction brake: friction asks for torque, inertia gives it back at larger factors."""
    case = random_case(seed)
    rng = np.random.default_rng(seed)
    friction = Friction(around(40.0, 0.1), around(1.0, 0.2))
    robot = replace(case.robot, joints=tuple(replace(joint, friction=friction) for joint in case.robot.joints))
    dq = rng.uniform(0.5, 1.0, (4, robot.dof))
    states = States(np.arange(4.0), rng.normal(size=(4, robot.dof)), dq, -rng.uniform(20.0, 60.0) * dq)
    scan = Case(robot, case.trajectory, (np.full(robot.dof, -1e9), np.zeros(robot.dof)))
    c = np.linspace(*SPAN, 100)
    uppers = np.stack([_uppers(scan, states, float(factor)) for factor in c])
    high = np.where(uppers.argmax(axis=0) > 0, uppers[0] + 0.6 * (uppers.max(axis=0) - uppers[0]), 1e9)
    free = assert_like_a_scan(replace(scan, limits=(scan.limits[0], high)), states)
    assert gaps(free, SPAN[0])


def _uppers(case: Case, states: States, c: float) -> Array:
    return np.asarray(exact_bounds(case.robot, states.q, c * states.dq, c * c * states.ddq).upper.max(axis=0))


def assert_like_a_scan(case: Case, states: States) -> list[tuple[float, float]]:
    """Compare with the scan, everywhere and next to each edge; return the safe factors."""
    free = free_of(case, states)
    c = np.linspace(*SPAN, 250)
    edges = np.array([edge for part in free for edge in part])
    inside = np.zeros(len(c), dtype=bool)
    for low, high in free:
        inside |= (c >= low) & (c <= high)
    clear = np.abs(c[:, None] - edges).min(axis=1, initial=np.inf) > NEAR * c
    found = excess(case, states, c)
    assert (found[clear & inside] <= ROUNDING).all()
    assert (found[clear & ~inside] > -ROUNDING).all()
    # Just within and just beyond each edge that is not an end of the range.
    ends = [(edge, sign) for low, high in free for edge, sign in ((low, -1.0), (high, 1.0)) if edge not in SPAN]
    if ends:
        edge, sign = np.array(ends).T
        assert (excess(case, states, edge) <= ROUNDING).all()
        assert (excess(case, states, edge * (1.0 + sign * NEAR)) > 0.0).all()
    return free


def test_limits_below_the_static_torque_leave_nothing() -> None:
    case = random_case(0)
    tight = Case(case.robot, case.trajectory, (0.3 * case.limits[0], 0.3 * case.limits[1]))
    states = states_of(tight)
    assert free_of(tight, states) == []
    assert (excess(tight, states, np.linspace(*SPAN, 100)) > 0.0).all()


def test_the_velocity_band_opens_factors_above_it() -> None:
    """Where dry friction is only known to help once the joint moves, the smallest safe factor itself is safe."""
    case = random_case(101)
    states = states_of(case)
    ((low, high),) = free_of(case, states)
    found = excess(case, states, np.array([low * (1.0 - 1e-9), low, high]))
    assert found[0] > 0.1
    assert (found[1:] <= ROUNDING).all()


def test_pieces_of_a_motion_give_the_same_as_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(6):
        case = random_case(seed)
        states = states_of(case)

        def make(q: Array, dq: Array, ddq: Array, case: Case = case) -> ScaledTorques:
            return ScaledTorques(case.robot, q, dq, ddq)

        whole = sampled_factors(make, states, case.limits, [], SPAN)
        monkeypatch.setattr(States, "pieces", lambda self: _pieces(self, 7))
        pieces = sampled_factors(make, states, case.limits, [], SPAN)
        monkeypatch.undo()
        # Both are exact to the tolerance of the search, 1e-9.
        assert np.allclose(whole.free, pieces.free, rtol=1e-8, atol=0.0)


def _pieces(states: States, size: int) -> list[States]:
    parts = (slice(k, k + size) for k in range(0, len(states.t), size))
    return [States(states.t[p], states.q[p], states.dq[p], states.ddq[p]) for p in parts]
