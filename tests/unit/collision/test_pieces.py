"""Algorithms that take a run piece by piece, against brute force and whole-signal formulas, cut at random places."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, lfilter, lfilter_zi

from modrob_cli.arrays import Array
from modrob_cli.collision.acceleration import VelocityKnowledge, estimation_windows, measured_acceleration
from modrob_cli.collision.events import Band, Contact, EventFinder, Rules, Scorer
from modrob_cli.collision.filters import BoundsRun, FilterRun, SignalFilter
from modrob_cli.collision.observer import MomentumTerms, ObserverRun
from modrob_cli.collision.sensitivity import LinkPoint, point_jacobian
from modrob_cli.collision.tables import MOST_POSES, STEADY, TableRun
from modrob_cli.collision.thinned import Thinned
from modrob_cli.errors import ShapeError
from modrob_cli.model.motion import MotionPiece
from modrob_cli.workflows.bounds_method import Tolerances, shares
from modrob_cli.workflows.collision_picks import MOST_SHARE, ClosestRun, Picks, WidthsRun
from modrob_cli.workflows.collision_shares import width_shares
from modrob_cli.workflows.robots import load_robot

ROOT = Path(__file__).parents[3]
RATE = 500.0


def cuts(rng: np.random.Generator, samples: int, pieces: int) -> Iterator[slice]:
    """Slices of random lengths, some of one sample."""
    edges = np.unique([0, 1, samples, *rng.integers(1, samples, pieces)])
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        yield slice(first, last)


def brute_events(t: Array, excess: Array, rules: Rules) -> list[tuple[float, float, int, str, float, float]]:
    """Sample by sample: an event goes on while the next sample outside is a neighbour or near enough."""
    found = []
    for joint in range(excess.shape[1]):
        for side, sign in (("lower", -1.0), ("upper", 1.0)):
            runs: list[list[int]] = []
            for k in np.flatnonzero(sign * excess[:, joint] > 0.0).tolist():
                if runs and (k == runs[-1][-1] + 1 or t[k] - t[runs[-1][-1]] <= rules.merge):
                    runs[-1].append(k)
                else:
                    runs.append([k])
            for run in runs:
                if t[run[-1]] - t[run[0]] >= rules.shortest:
                    peak = max(run, key=lambda k: (abs(excess[k, joint]), -k))
                    ends = (float(t[run[0]]), float(t[run[-1]]))
                    found.append((*ends, joint, side, float(abs(excess[peak, joint])), float(t[peak])))
    return sorted(found, key=lambda event: (event[0], event[2], event[3]))


@pytest.mark.parametrize("rules", [Rules(0.0, 0.0), Rules(0.05, 0.0), Rules(0.03, 0.02), Rules(0.2, 0.3)])
def test_events_do_not_depend_on_the_cuts(rules: Rules) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        t = np.cumsum(rng.uniform(0.002, 0.03, 400))
        excess = np.where(rng.random((400, 2)) < 0.3, rng.normal(size=(400, 2)).round(1), 0.0)
        finder = EventFinder(rules)
        for part in cuts(rng, 400, 12):
            finder.add(t[part], excess[part])
        assert [(e.start, e.end, e.joint, e.side, e.peak, e.peak_time) for e in finder.events] == brute_events(
            t, excess, rules
        )


def test_scores_do_not_depend_on_the_cuts() -> None:
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.002, 0.03, 600))
    excess = np.where(rng.random((600, 2)) < 0.1, 1.0, 0.0)
    contacts = [Contact("a", 1.0, 1.5), Contact("b", 1.6, 2.0), Contact("c", 99.0, 100.0)]
    scorer, finder = Scorer(contacts, 0.3), EventFinder(Rules())
    for part in cuts(rng, 600, 12):
        scorer.add(t[part], excess[part])
        finder.add(t[part], excess[part])
    free = ~((t >= 1.0) & (t < 1.8)) & ~((t >= 1.6) & (t < 2.3))
    found = scorer.score(finder.events)
    assert found.false_samples == pytest.approx(np.mean(excess[free].any(axis=1)), rel=1e-14)
    inside = [e for e in finder.events if 1.0 <= e.start < 2.3]
    assert found.false_alarms == len(finder.events) - len(inside)
    assert found.delays[2] is None


@pytest.mark.parametrize("wanted", [SignalFilter("first-order", 2, 10.0), SignalFilter("butterworth", 3, 20.0)])
def test_filters_carry_on(wanted: SignalFilter) -> None:
    """Signals against SciPy's direct form, half-widths against a convolution with the past written out."""
    rng = np.random.default_rng(3)
    running = wanted.at(RATE)
    lower = np.cumsum(rng.normal(size=(1500, 2)), axis=0)
    upper = lower + rng.uniform(0.0, 3.0, (1500, 2))
    signal, ends = FilterRun(running), BoundsRun(running)
    filtered, low, high = [], [], []
    for part in cuts(rng, 1500, 20):
        filtered.append(signal.apply(upper[part]))
        one, other = ends.bounds(lower[part], upper[part])
        low.append(one)
        high.append(other)
    if wanted.kind == "butterworth":
        b, a = butter(3, 20.0, fs=RATE)
    else:
        pole = np.exp(-2.0 * np.pi * 10.0 / RATE)
        b, a = np.array([(1.0 - pole) ** 2]), np.convolve([1.0, -pole], [1.0, -pole])
    wanted_signal = [lfilter(b, a, x, zi=lfilter_zi(b, a) * x[0])[0] for x in upper.T]
    # Direct forms of third order round a little worse than sections; values are below 100.
    assert np.allclose(np.concatenate(filtered), np.stack(wanted_signal, axis=1), atol=1e-9)
    size, half = np.abs(running.response), 0.5 * (upper - lower)
    held = np.concatenate([np.broadcast_to(half[0], (len(size) - 1, 2)), half])
    wide = np.stack([np.convolve(x, size, mode="valid") for x in held.T], axis=1)
    # The rest of the response and the allowance for rounding come on top: 1e-9 of values below 100.
    assert np.allclose(0.5 * (np.concatenate(high) - np.concatenate(low)), wide, atol=2e-7)
    assert (0.5 * (np.concatenate(high) - np.concatenate(low)) >= wide - 1e-12).all()


def test_the_observer_carries_on() -> None:
    """Against the system of equations of its trapezoidal steps, solved at once."""
    rng = np.random.default_rng(4)
    t = np.cumsum(rng.uniform(0.001, 0.003, 300))
    p, drift, gain = rng.normal(size=(300, 2)), rng.normal(size=(300, 2)), 20.0
    observer, parts = ObserverRun(gain), []
    for part in cuts(rng, 300, 10):
        parts.append(observer.add(MomentumTerms(t[part], p[part], drift[part])))
    # r_k - r_{k-1} = K (p_k - p_{k-1}) - K h / 2 (drift_k + drift_{k-1} + r_k + r_{k-1}), r_0 = 0
    half = 0.5 * gain * np.diff(t)
    A = np.diag(np.concatenate([[1.0], 1.0 + half])) - np.diag(1.0 - half, -1)
    b = np.zeros_like(p)
    b[1:] = gain * np.diff(p, axis=0) - half[:, None] * (drift[1:] + drift[:-1])
    assert np.allclose(np.concatenate(parts), np.linalg.solve(A, b), rtol=1e-11, atol=1e-11)


def test_measured_accelerations_of_a_piece_are_those_of_the_whole() -> None:
    """A piece needs a window and a sample before it, and a sample behind."""
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.uniform(0.001, 0.0012, 400))
    dq = np.cumsum(rng.normal(size=(400, 2)), axis=0) * 0.01
    known = VelocityKnowledge(np.array([1e-3, 1e-4]), np.array([50.0, 80.0]), np.array([2.0, 3.0]), np.array([0.02, 0]))
    step = float(np.median(np.diff(t)))
    ddq, tolerance, longest = measured_acceleration(t, dq, known)
    assert longest == estimation_windows(known, step).max() == 8
    early, end = 150 - longest - 1, 251
    part = measured_acceleration(t[early:end], dq[early:end], known, step)
    assert np.array_equal(part[0][longest + 1 : -1], ddq[150:250])
    assert np.array_equal(part[1][longest + 1 : -1], tolerance[150:250])
    assert tolerance[150:250].std() > 0.0


def test_thinned_samples_do_not_depend_on_the_cuts() -> None:
    rng = np.random.default_rng(6)
    x = rng.normal(size=(1000, 3))
    thinned = Thinned(100)
    for part in cuts(rng, 1000, 30):
        thinned.add(x[part])
    assert thinned.count == 1000
    assert np.array_equal(thinned.rows, x[::16])  # the smallest power of two that leaves 100 or fewer


def test_threshold_tables_do_not_depend_on_the_cuts() -> None:
    """Largest half-widths by brute force over both phases, the wrench by pseudo-inverses one by one."""
    rng = np.random.default_rng(7)
    robot = load_robot(ROOT / "assemblies" / "lwa4p-6-payload.yaml").robot
    N, reach = 2 * MOST_POSES + 700, 5
    q = rng.uniform(-1.0, 1.0, (N, 6))
    ddq = np.where(rng.random((N, 1)) < 0.03, rng.normal(size=(N, 6)), 0.0)
    lower, upper = -rng.uniform(1.0, 2.0, (N, 6)), rng.uniform(1.0, 2.0, (N, 6))
    band = Band(np.arange(float(N)), upper, lower, upper, np.zeros((N, 6)))
    run = TableRun(robot, np.abs(ddq).max(axis=0), reach)
    for part in cuts(rng, N, 20):
        run.add(
            q[part], ddq[part], Band(*(getattr(band, k)[part] for k in ("t", "measured", "lower", "upper", "middle")))
        )
    moving = (np.abs(ddq) > STEADY * np.abs(ddq).max(axis=0)).any(axis=1)
    steady = np.array([not moving[max(k - reach, 0) : k + 1].any() for k in range(N)])
    half = np.maximum(upper, -lower)
    found = run.table()
    for phase, mask in ((found.acceleration, ~steady), (found.nominal, steady)):
        assert phase.samples == mask.sum()
        assert np.array_equal(phase.torque, half[mask].max(axis=0))
        every = 1
        while -(-int(mask.sum()) // every) > MOST_POSES:
            every *= 2
        places, most = np.flatnonzero(mask)[::every], np.zeros(6)
        frames = robot.link_frames(q[places])
        J = point_jacobian(robot, q[places], LinkPoint("tool", 7, np.zeros(3)))
        for k, place in enumerate(places[:50].tolist()):
            full = np.concatenate([J[k], frames[k, :6, :3, 2].T])
            most = np.maximum(most, np.abs(np.linalg.pinv(full.T)) @ half[place])
        assert (phase.force >= most * (1.0 - 1e-9)).all()
    assert found.nominal.samples > MOST_POSES


def test_what_is_picked_of_a_run() -> None:
    rng = np.random.default_rng(8)
    t, x = np.arange(1000.0), rng.normal(size=(1000, 2))
    picks = Picks(1000, 7)
    for part in cuts(rng, 1000, 30):
        picks.add(t[part], x[part])
    wanted = [0, 166, 333, 499, 666, 832, 999]
    assert picks.arrays()[0].tolist() == wanted
    assert np.array_equal(picks.arrays()[1], x[wanted])


def test_widths_and_nearness() -> None:
    """Where nothing counts, nothing is taken; a band without width is used up by anything."""
    rng = np.random.default_rng(9)
    t: Array = np.arange(500.0)
    lower, upper = rng.uniform(-2.0, -1.0, (500, 2)), rng.uniform(1.0, 3.0, (500, 2))
    measured, used = rng.uniform(-1.0, 1.0, (500, 2)), rng.random(500) < 0.7
    measured[77, 1], used[77] = 4.0, True
    widths, closest = WidthsRun(), ClosestRun(2)
    for part in cuts(rng, 500, 9):
        widths.add((upper - lower)[part], 2.0 * (upper - lower)[part], used[part])
        closest.add(Band(t[part], measured[part], lower[part], upper[part], measured[part]), used[part])
    found = widths.result()
    assert np.array_equal(found.least, (upper - lower)[used].min(axis=0))
    assert np.array_equal(found.median, np.median((upper - lower)[used], axis=0))
    assert np.array_equal(found.most, (upper - lower)[used].max(axis=0))
    assert found.other_ratio is not None
    assert np.allclose(found.other_ratio, 2.0, rtol=1e-15)
    share = np.abs(2.0 * measured - lower - upper) / (upper - lower)
    assert np.allclose(closest.result.share, share[used].max(axis=0), rtol=1e-14)
    assert closest.result.time[1] == 77.0
    bare = ClosestRun(1)
    flat = np.zeros((2, 1))
    bare.add(Band(t[:2], np.array([[0.0], [1e-3]]), flat, flat, flat), np.array([True, True]))
    assert (bare.result.share[0], bare.result.time[0]) == (MOST_SHARE, 1.0)


def test_shares_of_the_width_are_those_of_exact_ranges() -> None:
    """Slopes times noise against ranges over boxes: second order, so within a thousandth of the largest share."""
    rng = np.random.default_rng(10)
    robot = load_robot(ROOT / "assemblies" / "lwa4p-table34-friction.yaml").robot
    states = [rng.uniform(-1.0, 1.0, (40, 6)) for _ in range(3)]
    motion = MotionPiece(np.arange(40.0), *states)
    tolerances = Tolerances(np.full(6, 1e-3), np.full(6, 5e-3), np.full(6, 0.5))
    noise = np.array([0.0, 1.0, 0.0, 0.0, 0.2, 0.0])
    found = width_shares(robot, motion, tolerances, noise)
    for j, (ours, theirs) in enumerate(zip(found, shares(robot, motion, tolerances), strict=True)):
        widths = {share.parameter: share.width for share in ours}
        assert widths.pop(f"{robot.joint_names[j]} effort noise", 0.0) == 2.0 * noise[j]
        wanted = {share.parameter: share.width for share in theirs}
        assert set(widths) == set(wanted)
        most = max(wanted.values())
        assert all(abs(widths[name] - wanted[name]) <= 1e-3 * most for name in wanted)
        assert sum(share.share for share in ours) == pytest.approx(1.0)


def test_bounds_of_other_shapes_are_refused() -> None:
    with pytest.raises(ShapeError):
        BoundsRun(SignalFilter().at(RATE)).bounds(np.zeros((3, 2)), np.zeros((2, 2)))
