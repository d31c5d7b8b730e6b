"""Bounds over cells of time: no torque of any member at any time of a cell may be outside."""

from dataclasses import replace
from decimal import Decimal

import mpmath
import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import Ball
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import Curve, PiecewiseCurve, SineCurve
from modrob_cli.model.trajectory_pieces import rest_to_rest, sin2_profiles
from modrob_cli.scaling import cell_terms
from modrob_cli.scaling.cell_torques import CellTorques
from modrob_cli.scaling.certify import certify, first_cells
from modrob_cli.scaling.curve_cells import Cells, all_knots, cell_states
from modrob_cli.scaling.sampled import States, sampled_factors
from modrob_cli.scaling.scaled_torque import ScaledTorques
from tests.high_precision import nominal_parameters, rigid_torques
from tests.property.test_box_bounds import bare, member, random_arm, with_drives
from tests.scaling_cases import Case, random_case


def cells_of(trajectory: Trajectory, length: float) -> Cells:
    count = int(np.ceil(trajectory.duration / length))
    edges = np.union1d(all_knots(trajectory), np.linspace(0.0, trajectory.duration, count + 1))
    return Cells(edges[:-1], edges[1:])


def times_in(cells: Cells, rng: np.random.Generator) -> Array:
    """A time strictly within each cell, often next to an end."""
    share = rng.choice([1e-9, 1.0 - 1e-9, 0.5, float(rng.random())], size=cells.count)
    t = cells.start + share * (cells.end - cells.start)
    return np.clip(t, np.nextafter(cells.start, np.inf), np.nextafter(cells.end, -np.inf))


@pytest.mark.parametrize("length", [0.3, 0.03, 0.003])
@pytest.mark.parametrize("seed", [0, 3, 8, 11])
def test_exact_ranges_at_instants_are_inside(seed: int, length: float) -> None:
    case = random_case(seed)
    robot = with_drives(case.robot) if seed % 2 else case.robot
    rng = np.random.default_rng(seed)
    cells = cells_of(case.trajectory, length)
    torques = CellTorques(robot, case.trajectory, cells)
    for c in (0.05, 0.7, 2.5):
        lower, upper = torques.bounds(c)
        for _ in range(8):
            x = case.trajectory.sample(times_in(cells, rng), 2)
            exact = exact_bounds(robot, x[:, 0], c * x[:, 1], c * c * x[:, 2])
            slack = 1e-11 * (np.abs(lower).max() + np.abs(upper).max())  # the ranges have rounding margins of their own
            assert (upper + slack >= exact.upper.T).all()
            assert (lower - slack <= exact.lower.T).all()


def test_members_by_pinocchio_are_inside() -> None:
    """Rigid bodies alone, as Pinocchio sees them."""
    rng = np.random.default_rng(2)
    case = random_case(2)
    robot = bare(case.robot)
    cells = cells_of(case.trajectory, 0.05)
    lower, upper = CellTorques(robot, case.trajectory, cells).bounds(1.3)
    for _ in range(6):
        x = case.trajectory.sample(times_in(cells, rng), 2)
        tau = inverse_dynamics(member(robot, rng), x[:, 0], 1.3 * x[:, 1], 1.69 * x[:, 2]).T
        # Pinocchio's own rounding, some 1e-14 of torques below 1e3.
        assert ((tau >= lower - 1e-10) & (tau <= upper + 1e-10)).all()


def test_the_excess_is_of_second_order() -> None:
    """Ten times shorter cells: about a hundred times less between the bounds and the ranges at the ends."""
    robot = bare(random_arm(5))
    curves = tuple(SineCurve(1.0, 0.3 * k, np.ones(1), np.array([1.5 + k]), np.array([0.4 * k])) for k in range(4))
    trajectory = Trajectory("sines", curves)
    excess = []
    for length in (0.05, 0.005):
        cells = cells_of(trajectory, length)
        lower, upper = CellTorques(robot, trajectory, cells).bounds(1.0)
        found = [exact_bounds(robot, *np.moveaxis(trajectory.sample(t, 2), 1, 0)) for t in (cells.start, cells.end)]
        widest = np.maximum(found[0].upper, found[1].upper).T - np.minimum(found[0].lower, found[1].lower).T
        excess.append(float(np.median(upper - lower - widest)))
    assert excess[0] > 0.0
    assert 50.0 < excess[0] / excess[1] < 200.0


def test_rounding_against_60_digits() -> None:
    """Cells of a few units in the last place: what is left is rounding, of trajectory, kinematics and sums."""
    robot = bare(random_arm(7))
    exact_robot = member(robot, np.random.default_rng(1))
    curve = rest_to_rest(np.array([0.0, 1.0]), np.array([-1.2, 0.9]), 5)
    trajectory = Trajectory("polynomial", (curve,) * 4)
    outside = 0
    for t in np.random.default_rng(3).uniform(0.1, 0.9, 12):
        cells = Cells(np.array([t]), np.array([np.nextafter(t, 1.0)]))
        lower, upper = CellTorques(exact_robot, trajectory, cells).bounds(1.0)
        q, dq, ddq = (_polynomial(curve, t, k) for k in range(3))
        found = _torques(exact_robot, q, dq, ddq)
        for j in range(4):
            assert Decimal(float(lower[j, 0])) <= found[j][0]
            assert found[j][1] <= Decimal(float(upper[j, 0]))
            outside += upper[j, 0] - lower[j, 0] > 1e-8
    assert outside == 0  # of torques up to 1e3: the bounds are not just wide


def _polynomial(curve: PiecewiseCurve, t: float, order: int) -> mpmath.mpf:
    """Derivative of the one piece with 60 digits."""
    with mpmath.workdps(60):
        terms = [mpmath.mpf(float(a)) * mpmath.ff(k, order) * mpmath.mpf(t) ** (k - order)
                 for k, a in enumerate(curve.coefficients[0]) if k >= order]  # fmt: skip
        return mpmath.fsum(terms)


def _torques(robot: Robot, q: mpmath.mpf, dq: mpmath.mpf, ddq: mpmath.mpf) -> list[tuple[Decimal, Decimal]]:
    """Range of torques over the doubles next to the exact states, with 60 digits each."""
    states = [np.full(4, float(x)) for x in (q, dq, ddq)]
    parameters = nominal_parameters(robot)
    exact = rigid_torques(robot, states[0], states[1], states[2], parameters)
    # What the states' own rounding changes, from differences by 1e-7; the states are off by 1e-16.
    reach = [Decimal(0)] * 4
    for k, x in enumerate((q, dq, ddq)):
        moved = [state.copy() for state in states]
        moved[k] += 1e-7
        change = rigid_torques(robot, moved[0], moved[1], moved[2], parameters)
        off = abs(Decimal(mpmath.nstr(x, 50)) - Decimal(float(x)))
        reach = [r + abs(a - b) / Decimal("1e-7") * off * 2 for r, a, b in zip(reach, change, exact, strict=True)]
    return [(value - r, value + r) for value, r in zip(exact, reach, strict=True)]


def test_the_soundness_check_can_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without what is of second order the bounds are too narrow, and the tests above see it."""
    monkeypatch.setattr(cell_terms, "largest_torque", lambda body, y0, y, B: np.zeros_like(y0))
    case = random_case(3)
    robot = bare(case.robot)
    cells = cells_of(case.trajectory, 0.3)
    _, upper = CellTorques(robot, case.trajectory, cells).bounds(1.0)
    x = case.trajectory.sample(times_in(cells, np.random.default_rng(0)), 2)
    exact = exact_bounds(robot, x[:, 0], x[:, 1], x[:, 2])
    assert (upper + 1e-6 < exact.upper.T).any()


CURVES: dict[str, Curve] = {
    "polynomial": rest_to_rest(np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, -1.0]), 7),
    "sines": SineCurve(3.0, 0.4, np.array([0.5, -2.0]), np.array([3.0, 11.0]), np.array([0.2, 40.0])),
    "sin2": sin2_profiles(np.array([[0.0], [1.5], [1.0]]), [0.2, 0.0, 0.1], np.ones(1), 2.0 * np.ones(1))[1][0],
}


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("length", [0.5, 0.01, 1e-6])
def test_motions_are_within_their_enclosures(name: str, length: float) -> None:
    """Derivatives computed with 50 digits at times of each cell."""
    curve = CURVES[name]
    rng = np.random.default_rng(4)
    start = np.sort(rng.uniform(0.0, float(curve.knots[-1]), 12))
    knots = curve.knots
    end = np.minimum(start + length, knots[np.searchsorted(knots, start, "right")])
    cells = Cells(start, end)
    found = cell_states(Trajectory("one", (curve,)), cells)
    for k in range(cells.count):
        for t in (start[k], end[k], start[k] + 0.37 * (end[k] - start[k])):
            t = float(np.clip(t, np.nextafter(start[k], 9.0), np.nextafter(end[k], -9.0)))
            for order in range(4):
                assert _contains(found.whole[order, 0, k], _derivative(curve, t, order)), (k, t, order)
        middle = float(cells.middle[k])
        for order in range(4):
            assert _contains(found.middle[order, 0, k], _derivative(curve, middle, order))


def _contains(ball: Ball, value: mpmath.mpf) -> bool:
    with mpmath.workdps(50):
        return bool(abs(value - mpmath.mpf(float(ball.c))) <= mpmath.mpf(float(ball.reach)))


def _derivative(curve: Curve, t: float, order: int) -> mpmath.mpf:
    with mpmath.workdps(50):
        if isinstance(curve, SineCurve):
            out = mpmath.mpf(curve.offset if order == 0 else 0.0)
            for a, w, phi in zip(curve.amplitude, curve.frequency, curve.phase, strict=True):
                a, w, phi = (mpmath.mpf(float(x)) for x in (a, w, phi))
                out += a * w**order * mpmath.sin(w * mpmath.mpf(t) + phi + order * mpmath.pi / 2)
            return out
        assert isinstance(curve, PiecewiseCurve)
        piece = int(np.searchsorted(curve.knots, t, "right")) - 1
        begin, length = mpmath.mpf(float(curve.knots[piece])), mpmath.mpf(float(curve.knots[piece + 1]))
        length -= begin
        s = (mpmath.mpf(t) - begin) / length
        out = mpmath.mpf(0)
        for k, a in enumerate(curve.coefficients[piece]):
            if k >= order:
                out += mpmath.mpf(float(a)) * mpmath.ff(k, order) * s ** (k - order)
        b, w = mpmath.mpf(float(curve.ripple[piece])), 2 * mpmath.pi
        wave = b * (1 - mpmath.cos(w * s)) if order == 0 else -b * w**order * mpmath.cos(w * s + order * mpmath.pi / 2)
        return (out + wave) / length**order


def proven(case: Case, gap: float = 0.005) -> tuple[Case, float, float]:
    """A case with its factor at the samples and the proven one."""
    t = np.linspace(0.0, case.trajectory.duration, 2001)

    def make(q: Array, dq: Array, ddq: Array) -> ScaledTorques:
        return ScaledTorques(case.robot, q, dq, ddq)

    sampled = sampled_factors(make, States.of(case.trajectory, t), case.limits, [], (0.02, 4.0)).factor
    assert sampled is not None
    proof = certify(case.robot, case.trajectory, case.limits, (0.02, sampled), gap)
    assert proof.factor is not None
    return case, sampled, proof.factor


@pytest.mark.parametrize("seed", [1, 5])
def test_no_member_breaks_a_limit_at_a_proven_factor(seed: int) -> None:
    """Friction and disturbance included; 1000 members at 10,000 times were tried once, with the same result."""
    case, sampled, c = proven(random_case(seed))
    assert (1.0 - 0.005) * sampled <= c <= sampled
    rng = np.random.default_rng(seed)
    x = case.trajectory.sample(rng.uniform(0.0, case.trajectory.duration, 400), 2)
    q, dq, ddq = x[:, 0], c * x[:, 1], c * c * x[:, 2]
    for _ in range(25):
        one = member(case.robot, rng)
        tau = inverse_dynamics(bare(one), q, dq, ddq)
        friction = np.stack([_friction(one, j, dq[:, j], rng) for j in range(one.dof)], axis=1)
        assert ((tau + friction > case.limits[0] - 1e-10) & (tau + friction < case.limits[1] + 1e-10)).all()


def _friction(robot: Robot, j: int, dq: Array, rng: np.random.Generator) -> Array:
    """Viscous, Coulomb (any sign within the band), band and disturbance of a member."""
    f = robot.joints[j].friction
    sign = np.where(np.abs(dq) <= f.velocity_band, rng.uniform(-1, 1, len(dq)), np.sign(dq))
    rest = rng.uniform(-f.coulomb_band, f.coulomb_band) + rng.uniform(
        robot.disturbance.inf[j], robot.disturbance.sup[j]
    )
    return np.asarray(float(f.viscous.nominal) * dq + float(f.coulomb.nominal) * sign + rest)


def test_a_narrow_gap_is_kept() -> None:
    _, sampled, c = proven(random_case(1), gap=2e-5)
    assert c >= sampled * (1.0 - 2e-5)


def test_velocity_limits_are_proven_too() -> None:
    """One joint without any torque limit; its velocity limit decides, known in closed form."""
    robot = random_arm(1)
    limits = replace(robot.joints[0].limits, velocity=(-1.0, 1.0))
    joints = (replace(robot.joints[0], limits=limits, friction=Friction(), drive=Drive()), *robot.joints[1:])
    robot = replace(robot, joints=joints, disturbance=Interval(np.zeros(robot.dof)))
    trajectory = Trajectory("poly", (rest_to_rest(np.array([0.0, 2.0]), np.array([0.0, 1.0]), 5),) * 4)
    none = (np.full(4, -np.inf), np.full(4, np.inf))
    largest = 1.0 / (15.0 / 16.0)  # peak velocity 15/8 times distance over duration
    proof = certify(robot, trajectory, none, (0.02, largest), 0.001)
    assert proof.factor is not None
    assert largest * 0.999 <= proof.factor <= largest


def test_a_peak_between_samples_lowers_the_proven_factor() -> None:
    """Two samples see nothing of a motion in between; the proof does not trust them."""
    case = random_case(1)
    none, sampled, c = proven(case)
    proof = certify(case.robot, case.trajectory, case.limits, (0.02, 1.006 * sampled), 0.005)
    assert proof.factor is not None
    assert 0.99 * c <= proof.factor <= sampled * (1.0 + 1e-6)


def test_first_cells_end_where_pieces_do() -> None:
    trajectory = Trajectory("two", (CURVES["polynomial"], CURVES["polynomial"]))
    cells = first_cells(trajectory)
    assert np.isin(all_knots(trajectory), np.append(cells.start, cells.end[-1])).all()
