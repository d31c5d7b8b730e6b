"""The linear programmes of bounded-error identification against independent formulations of the same questions."""

from itertools import combinations, product

import numpy as np
import pytest
from scipy.optimize import linprog

from modrob_cli.arrays import Array
from modrob_cli.dynamics.drive_torque import DriveBox
from modrob_cli.identify.bounded_answers import PARSIMONY, Answers
from modrob_cli.identify.bounded_programme import Programme, form
from modrob_cli.identify.bounded_samples import COULOMB, DISTURBANCE, JointSamples
from tests.joint_samples import random_samples, random_truth


def drive_band(samples: JointSamples, ends: Array) -> tuple[Array, Array]:
    """The band as the torque bounds compute it, at every corner of the noise of dq and ddq."""
    v, c, a, d = [(float(low), float(high)) for low, high in np.reshape(ends, (4, 2))]
    box = DriveBox(v, c, a, d, samples.velocity_band)
    found = [
        box.torque_range(samples.dq + s * samples.dq_noise, samples.ddq + r * samples.ddq_noise)
        for s, r in product((-1.0, 1.0), repeat=2)
    ]
    return np.min([low for low, _ in found], axis=0), np.max([high for _, high in found], axis=0)


@pytest.mark.parametrize("noise", [(0.0, 0.0), (0.03, 0.2)])
def test_the_band_is_that_of_the_torque_bounds_and_its_rows_are_the_same(noise: tuple[float, float]) -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        made = random_samples(rng, random_truth(rng), 200)
        samples = JointSamples(**{**vars(made), "dq_noise": noise[0], "ddq_noise": noise[1]})
        ends = np.sort(rng.uniform(0.0, 5.0, (4, 2)), axis=1)
        ends[3] -= 2.5
        ends[rng.integers(3)] = 0.0
        found = samples.edges(ends.ravel())
        rows = samples.rows(np.arange(200))
        for edge, expected, matrix in zip(found, drive_band(samples, ends), rows, strict=True):
            # A handful of sums and products of numbers up to 100.
            np.testing.assert_allclose(edge, expected, rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(edge, matrix @ ends.ravel(), rtol=0.0, atol=1e-12)
        width = float(np.mean(found[1] - found[0]))
        assert samples.width_weights() @ ends.ravel() == pytest.approx(width, rel=1e-12)


def least_largest_error(columns: Array, target: Array) -> float:
    """Least largest |target - columns @ x| over all x, by trying every way in which it can be attained.

    The optimum with p unknowns is attained at p + 1 samples with errors of one size and given signs.
    """
    count, unknowns = columns.shape
    best = np.inf
    for chosen in combinations(range(count), unknowns + 1):
        rows = list(chosen)
        for signs in product((-1.0, 1.0), repeat=unknowns):
            system = np.column_stack([columns[rows], [1.0, *signs]])
            if abs(np.linalg.det(system)) < 1e-9:
                continue
            x = np.linalg.solve(system, target[rows])
            reach = abs(x[-1])
            if reach < best and np.all(np.abs(target - columns @ x[:-1]) <= reach + 1e-10):
                best = reach
    return float(best)


def test_one_value_each_has_the_least_largest_error() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        dq = rng.uniform(-2.0, 2.0, 9)
        # Large viscous friction keeps the optimum away from zero, so that the signs of the parameters do not matter.
        tau = 8.0 * dq + 0.4 + rng.uniform(-1.0, 1.0, 9)
        zero = np.zeros(9)
        samples = JointSamples(dq=dq, ddq=zero, tau=tau, low=zero, high=zero, velocity_band=0.0)
        answer = Answers(samples, {1: (0.0, 0.0), 2: (0.0, 0.0)}).one_value_each()
        expected = least_largest_error(np.column_stack([dq, np.ones(9)]), tau)
        # The solver's tolerance is 1e-9 of the largest torque, about 16.
        assert 0.5 * (answer.ends[7] - answer.ends[6]) == pytest.approx(expected, abs=1e-7)


def test_least_width_by_brute_force_over_a_grid() -> None:
    """Coulomb friction and disturbance only: every pair of ends on a grid, the disturbance closed by definition."""
    rng = np.random.default_rng(3)
    grid = np.linspace(0.0, 3.0, 121)
    for _ in range(5):
        dq, zero = rng.uniform(-1.0, 1.0, 40), np.zeros(40)
        tau = rng.uniform(1.0, 2.0, 40) * np.sign(dq) + rng.uniform(-0.2, 0.2, 40)
        samples = JointSamples(dq=dq, ddq=zero, tau=tau, low=zero, high=zero, velocity_band=0.3)
        answer = Answers(samples, {0: (0.0, 0.0), 2: (0.0, 0.0)}).least_width({COULOMB, DISTURBANCE})
        best = np.inf
        for low, high in product(grid, grid):
            if low <= high:
                lower, upper = samples.edges(np.array([0, 0, low, high, 0, 0, 0, 0], dtype=float))
                reach = float(np.max(tau - upper) - np.min(tau - lower))
                best = min(best, float(np.mean(upper - lower)) + max(reach, 0.0))
        width = samples.mean_width(answer.ends)
        # Parsimony may cost 0.1 % of a width; the grid is coarse by 0.025 at either end, each counted up to twice.
        assert best - 0.1 <= width <= best * (1.0 + PARSIMONY) + 1e-9


def test_adding_violated_samples_one_after_the_other_gives_the_answer_over_all() -> None:
    rng = np.random.default_rng(4)
    for trial in range(20):
        samples = random_samples(rng, random_truth(rng), 500, rigid_width=0.3 * (trial % 3))
        layout = form({}, frozenset(range(4)))
        cost = samples.width_weights() @ layout.matrix
        answer = Programme(samples).solve(layout, cost)
        lower, upper = samples.rows(np.arange(500))
        A = np.concatenate([lower @ layout.matrix, -upper @ layout.matrix, layout.order])
        b = np.concatenate([samples.most_lower(), -samples.least_upper(), layout.room])
        bounds = [(low if np.isfinite(low) else None, None) for low in layout.lower]
        expected = linprog(cost, A_ub=A, b_ub=b, bounds=bounds, method="highs")
        assert answer is not None
        # Both solvers stop at constraint errors of 1e-7 at most.
        assert answer.cost == pytest.approx(expected.fun, rel=1e-6, abs=1e-6)


def test_active_samples_decide_and_no_others() -> None:
    rng = np.random.default_rng(5)
    samples = random_samples(rng, random_truth(rng), 400)
    everything = frozenset(range(4))
    answer = Answers(samples, {}).least_width(everything)
    active = np.array([item.index for item in answer.active])
    # No more samples than unknowns can hold the ends in place.
    assert 1 <= len(active) <= 8
    alone = samples.picked(np.unique(active))
    again = Programme(alone).solve(form({}, everything), _cost(samples) @ form({}, everything).matrix)
    assert again is not None
    assert again.cost == pytest.approx(answer.cost, rel=1e-6)
    without = samples.picked(np.setdiff1d(np.arange(400), active[:1]))
    fewer = Programme(without).solve(form({}, everything), _cost(samples) @ form({}, everything).matrix)
    assert fewer is not None
    assert fewer.cost < answer.cost


def _cost(samples: JointSamples) -> Array:
    cost = samples.width_weights()
    effect = samples.mean_effects()
    for k in range(DISTURBANCE):
        cost[2 * k : 2 * k + 2] += PARSIMONY * effect[k] * np.array([-1.0, 1.0])
    return cost


def test_consistent_ends_are_those_of_the_programme_over_all_samples() -> None:
    rng = np.random.default_rng(6)
    for trial in range(10):
        truth = random_truth(rng)
        samples = random_samples(rng, truth, 300, rigid_width=0.2 * (trial % 2))
        found = Answers(samples, {}).consistent(truth.noise * 1.01)
        assert found is not None
        sign_up = np.where(samples.dq >= -samples.velocity_band, 1.0, -1.0)
        sign_down = np.where(samples.dq <= samples.velocity_band, -1.0, 1.0)
        rest = (samples.ddq, np.ones(300))
        A = np.concatenate(
            [-np.column_stack([samples.dq, sign_up, *rest]), np.column_stack([samples.dq, sign_down, *rest])]
        )
        reach = truth.noise * 1.01
        b = np.concatenate([samples.high - samples.tau + reach, samples.tau - samples.low + reach])
        for k in range(4):
            for side, sign in enumerate((1.0, -1.0)):
                box = [(0.0, None)] * 3 + [(None, None)]
                expected = linprog(sign * np.eye(4)[k], A_ub=A, b_ub=b, bounds=box, method="highs")
                # HiGHS's default tolerance is 1e-7 of the torques, about 30, magnified by how flat the set is.
                assert found[0][k, side] == pytest.approx(sign * expected.fun, rel=1e-5, abs=1e-4)
