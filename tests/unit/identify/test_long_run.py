"""A long log made ready piece by piece against the same log made ready as a whole."""

import tracemalloc
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, UsageError
from modrob_cli.identify.long_run import LongRun, prepare_long_run
from modrob_cli.identify.long_signals import Sizes
from modrob_cli.identify.long_spectrum import LongSpectrum
from modrob_cli.identify.long_steps import step_statistics
from modrob_cli.identify.run import Run, prepare_run
from modrob_cli.identify.signal_cutoff import choose_cutoff, welch_spectrum
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.robots import load_robot
from tests.identify_samples import URDF
from tests.shared_data import shared

SIZES = Sizes(stretch=700, segment=10**9, sample=10**9)
"""Small pieces; spectrum and limits as for a log in memory, so that all numbers have to agree."""


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """An arm of three joints."""
    path = tmp_path / "three.urdf"
    path.write_text(URDF)
    return load_robot(path).robot


@dataclass(frozen=True)
class Stored:
    """A log in memory that hands out pieces."""

    log: JointLog

    @property
    def name(self) -> str:
        return self.log.name

    @property
    def count(self) -> int:
        return len(self.log.t)

    @property
    def duration(self) -> float:
        return float(self.log.t[-1])

    @property
    def has_velocity(self) -> bool:
        return self.log.dq is not None

    def piece(self, first: int, last: int) -> JointLog:
        span = slice(max(first, 0), max(last, 0))
        dq = None if self.log.dq is None else self.log.dq[span]
        return replace(self.log, t=self.log.t[span], q=self.log.q[span], dq=dq, effort=self.log.effort[span])

    def times(self, first: int, last: int) -> Array:
        return self.log.t[max(first, 0) : max(last, 0)]

    def find(self, t: float) -> int:
        return int(np.searchsorted(self.log.t, t))


def motion_log(rng: np.random.Generator, count: int, rate: float = 250.0) -> JointLog:
    """Sines with noise; three joints, the last of which stands still."""
    t = np.arange(count) / rate
    phase = rng.uniform(0.0, 6.0, 3)
    angle = 2.0 * np.pi * np.array([0.4, 1.1, 0.7]) * t[:, None] + phase
    size = np.array([1.0, 0.3, 0.0])
    q = size * np.sin(angle) + rng.normal(0.0, 1e-5, (count, 3))
    dq = size * 2.0 * np.pi * np.array([0.4, 1.1, 0.7]) * np.cos(angle) + rng.normal(0.0, 1e-3, (count, 3))
    return JointLog("log", ("a", "b", "c"), t, q, dq, rng.normal(size=(count, 3)))


def jittered(rng: np.random.Generator, log: JointLog) -> JointLog:
    """Times that are whole nanoseconds off by up to a fifth of a step."""
    t = log.t + np.round(rng.uniform(0.0, 0.2, len(log.t)) * (log.t[1] - log.t[0]), 9)
    return replace(log, t=t - t[0])


def with_gaps(rng: np.random.Generator, log: JointLog) -> JointLog:
    """Two stretches missing, one of them longer than several pieces."""
    kept = np.ones(len(log.t), dtype=bool)
    kept[1500:1530] = False
    kept[3000:9000] = False
    dq = None if log.dq is None else log.dq[kept]
    return replace(log, t=log.t[kept], q=log.q[kept], dq=dq, effort=log.effort[kept])


def with_glitches(rng: np.random.Generator, log: JointLog) -> JointLog:
    """Single wild samples, also beside the ends of pieces, and a few in a row, which stay."""
    q, dq = log.q.copy(), np.array(log.dq)
    for k in (3, 699, 700, 701, 1400, 2105, len(q) - 4, *rng.integers(5, len(q) - 5, 20)):
        q[k, rng.integers(3)] += rng.uniform(1.0, 3.0)
    dq[2800, 1] += 30.0
    dq[4203:4206, 0] -= 20.0
    return replace(log, q=q, dq=dq)


def without_velocities(rng: np.random.Generator, log: JointLog) -> JointLog:
    """Positions and efforts only."""
    return replace(log, dq=None)


CHANGES = [jittered, with_gaps, with_glitches, without_velocities]


def whole_of(robot: Robot, long: LongRun) -> tuple[Run, int]:
    """All pieces as one run, and how many pieces there were."""
    runs = [long.run(robot, piece, rigid=True) for piece in long.pieces()]

    def joined(key: str, of_signals: bool = False) -> Array:
        return np.concatenate([getattr(run.signals if of_signals else run, key) for run in runs])

    used = np.concatenate([run.used for run in runs])
    signals = replace(
        runs[0].signals, t=joined("t"), q=joined("q"), dq=joined("dq"), ddq=joined("ddq"),
        effort=joined("effort", of_signals=True), used=used,
    )  # fmt: skip
    tau, tau_rigid = joined("tau"), joined("tau_rigid")
    return replace(runs[0], signals=signals, tau=tau, tau_rigid=tau_rigid, used=used), len(runs)


def compare(robot: Robot, log: JointLog, cutoff: float | None, sizes: Sizes = SIZES) -> None:
    """Both ways, all numbers to rounding."""
    whole = prepare_run(robot, log, "torque", choose_cutoff(log).cutoff if cutoff is None else cutoff)
    long = prepare_long_run(robot, Stored(log), "torque", cutoff, sizes)
    pieces, count = whole_of(robot, long)
    assert count >= 2
    assert long.motion.cutoff == pytest.approx(whole.signals.cutoff, rel=1e-12)
    assert (long.known.rate, long.known.resampled) == (whole.signals.rate, whole.signals.resampled)
    assert long.known.gap == whole.signals.gap
    for key in ("noise_dq", "noise_ddq", "standstill"):
        np.testing.assert_allclose(getattr(long, key), getattr(whole, key), rtol=1e-9, err_msg=key)
    np.testing.assert_array_equal(long.moving, whole.signals.moving)
    # Pieces that lie in gaps as a whole are left out; nothing in them counts.
    kept = np.isin(np.round(whole.t * 1e7), np.round(pieces.t * 1e7))
    assert len(pieces.t) == kept.sum()
    assert not whole.used[~kept].any()
    np.testing.assert_array_equal(pieces.used, whole.used[kept])
    counted = whole.used[kept]
    # A second derivative of positions has rounding errors of some 1e-16 over the square of the step, whichever way it
    # is computed; a first one has less. Torques inherit that, times inertias of up to about 10 kg m^2.
    rounding = 50.0 * np.finfo(float).eps * np.abs(whole.q).max() * whole.signals.rate**2
    slack = {"ddq": rounding, "tau_rigid": 10.0 * rounding}
    for key in ("t", "q", "dq", "ddq", "tau", "tau_rigid"):
        found, expected = getattr(pieces, key)[counted], getattr(whole, key)[kept][counted]
        atol = 1e-9 * np.abs(expected).max() + slack.get(key, 0.0)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=atol, err_msg=key)


@pytest.mark.parametrize("seed", range(16))
def test_pieces_are_the_whole(robot: Robot, seed: int) -> None:
    """Every combination of uneven times, gaps, glitches and missing velocities."""
    rng = np.random.default_rng(seed)
    log = motion_log(rng, 12_000)
    for k, change in enumerate(CHANGES):
        if seed >> k & 1:
            log = change(rng, log)
    compare(robot, log, None if seed % 3 else 20.0)


@pytest.mark.parametrize("cutoff", [0.8, 5.0, 60.0, 120.0])
def test_any_cut_off(robot: Robot, cutoff: float) -> None:
    """From one whose filter remembers longer than a piece lasts to one close to half the sampling rate."""
    rng = np.random.default_rng(1)
    compare(robot, motion_log(rng, 12_000), cutoff)


@pytest.mark.parametrize(
    ("model", "recording"),
    [("ur10/model.urdf", "ur10/ur10_exciting_trajectory.mcap"), ("staubli_tx40/model.urdf", "staubli_tx40/ident.mcap")],
)
def test_recordings(model: str, recording: str) -> None:
    robot = load_robot(shared(model)).robot
    log = read_joint_log(shared(recording), robot.joint_names)
    compare(robot, log, None)
    compare(robot, replace(log, dq=None), None)


def test_a_gap_of_years_costs_nothing(robot: Robot) -> None:
    """A clock that is set at night: millions of millions of steps in which there is nothing."""
    rng = np.random.default_rng(3)
    log = motion_log(rng, 4000)
    late = np.where(np.arange(4000) < 2000, log.t, log.t + 3e7)
    long = prepare_long_run(robot, Stored(replace(log, t=late)), "torque", 10.0, SIZES)
    pieces = list(long.pieces())
    assert len(pieces) < 20
    used = sum(int(piece.used.sum()) for piece in pieces)
    assert used == pytest.approx(4000 - 4 * 50, abs=8)  # two periods of 10 Hz at each of four ends, 250 Hz


def test_too_short(robot: Robot) -> None:
    rng = np.random.default_rng(3)
    for count in (2, 4, 49, 60):
        with pytest.raises(NumericalError, match="use a longer log"):
            prepare_long_run(robot, Stored(motion_log(rng, count)), "torque", None, SIZES)
    with pytest.raises(UsageError, match="--cutoff"):
        prepare_long_run(robot, Stored(motion_log(rng, 2000)), "torque", 125.0, SIZES)


@pytest.mark.parametrize("count", [2, 3, 1000, 1001])
@pytest.mark.parametrize("most_bins", [3, 50, 10**6])
def test_median_step_is_exact(count: int, most_bins: int) -> None:
    """Against numpy, whatever the bins; ties, jitter, one step that is long."""
    rng = np.random.default_rng(count)
    for steps in (rng.integers(900_000, 1_100_000, count), rng.integers(999, 1002, count), np.full(count, 1_000_000)):
        steps[-1] *= 50
        stamps = np.cumsum(steps)
        t = (stamps - stamps[0]) / 1e9
        log = JointLog("log", ("a",), t, t[:, None], None, t[:, None])
        found = step_statistics(Stored(log), piece=64, most_bins=most_bins)
        assert found.median == np.median(np.diff(t))
        assert (found.shortest, found.longest) == (np.diff(t).min(), np.diff(t).max())


def test_spectrum_by_pieces() -> None:
    """Against scipy on the whole, for pieces of any length."""
    rng = np.random.default_rng(0)
    x = rng.normal(size=(5000, 2))
    for length in (64, 333, 1111):
        spectrum = LongSpectrum(100.0, length, 2)
        first = 0
        while first < len(x):
            last = first + int(rng.integers(1, 900))
            spectrum.add(x[first:last])
            first = last
        frequency, density = welch_spectrum(x, 100.0, length)
        np.testing.assert_allclose(spectrum.density()[0], frequency, rtol=1e-14)
        # Near frequency zero, where the straight line was taken out, next to nothing is left but rounding.
        np.testing.assert_allclose(spectrum.density()[1], density, rtol=1e-10, atol=1e-13 * density.max())


def test_memory_does_not_grow_with_the_log(robot: Robot) -> None:
    """Sixteen times the samples take a tenth more memory at most, on top of the log itself, in all passes."""
    rng = np.random.default_rng(3)
    sizes, peaks = Sizes(stretch=500, segment=512, sample=512, bins=500), []
    for count in (4000, 4000, 64_000):  # the first time for imports and caches
        stored = Stored(with_glitches(rng, jittered(rng, motion_log(rng, count))))
        tracemalloc.start()
        try:
            long = prepare_long_run(robot, stored, "torque", 20.0, sizes)
            for piece in long.pieces():
                long.run(robot, piece, rigid=True)
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    assert peaks[2] < 1.1 * peaks[1], peaks
