"""Signals, prediction errors and the meaning of effort against closed forms."""

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, ShapeError, UsageError
from modrob_cli.identify.effort import effort_factors
from modrob_cli.identify.prediction import prediction_errors
from modrob_cli.identify.signals import low_pass, prepare
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Joint
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot

RATE, DURATION = 250.0, 12.0


def sines(t: Array) -> tuple[Array, Array, Array]:
    """Motion of two joints in closed form: below 1 Hz, both directions."""
    w = 2 * np.pi * np.array([0.3, 0.7])
    phase = t[:, None] * w
    return np.sin(phase), w * np.cos(phase), -(w**2) * np.sin(phase)


def make_log(t: Array, q: Array, dq: Array | None = None, effort: Array | None = None) -> JointLog:
    names = tuple(f"j{k}" for k in range(q.shape[1]))
    return JointLog("log", names, t, q, dq, np.zeros_like(q) if effort is None else effort)


def even_times() -> Array:
    return np.arange(int(RATE * DURATION)) / RATE


@pytest.mark.parametrize("recorded", [True, False])
@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_derivatives_of_sines(recorded: bool, jitter: float) -> None:
    t = even_times()
    t = np.concatenate([[0.0], t[1:] + np.random.default_rng(1).uniform(-jitter, jitter, len(t) - 1) / RATE])
    q, dq, _ = sines(t)
    signals = prepare(make_log(t, q, dq if recorded else None, effort=t[:, None] * [1.0, 2.0]))
    exact = sines(signals.t)
    assert signals.resampled == (jitter > 0)
    assert signals.cutoff == 10.0
    np.testing.assert_array_equal(signals.moving, [True, True])
    # At 0.7 Hz the filter takes (0.7/10)^8 = 6e-10 of the amplitude; what an end of the log leaves after two periods of
    # the cut-off is below 5e-3 of the second derivative, and far less of the others.
    for mine, true in zip((signals.q, signals.dq, signals.ddq), exact, strict=True):
        np.testing.assert_allclose(mine[signals.used], true[signals.used], rtol=0, atol=5e-3 * np.abs(true).max())
    np.testing.assert_allclose(signals.effort, signals.t[:, None] * [1.0, 2.0], rtol=0, atol=1e-9)


def test_filter_has_no_phase_and_half_the_amplitude_at_the_cut_off() -> None:
    t = even_times()
    x = np.sin(2 * np.pi * 5.0 * t)[:, None]
    middle = slice(750, -750)
    np.testing.assert_allclose(low_pass(x, RATE, 5.0)[middle], 0.5 * x[middle], rtol=0, atol=1e-6)


def test_ends_and_gaps_are_not_used() -> None:
    t = even_times()
    keep = (t < 4.0) | (t > 4.6)
    t = t[keep]
    q, dq, _ = sines(t)
    signals = prepare(make_log(t, q, dq), cutoff=5.0)
    assert signals.resampled
    assert signals.gap == pytest.approx(0.608, abs=1e-6)
    inside = (signals.t > 3.6) & (signals.t < 5.0)
    assert not signals.used[inside].any()
    assert not signals.used[signals.t < 0.399].any()
    assert signals.used[(signals.t > 0.41) & (signals.t < 3.59)].all()


def test_lost_messages_are_no_gap() -> None:
    t = np.delete(even_times(), np.random.default_rng(2).integers(100, 2900, size=200))
    signals = prepare(make_log(t, sines(t)[0]))
    assert np.count_nonzero(~signals.used) == pytest.approx(2 * 0.2 * RATE, abs=3)


def test_cut_off_and_length_are_checked() -> None:
    t = even_times()
    log = make_log(t, sines(t)[0])
    for cutoff in (0.0, 125.0, float("nan")):
        with pytest.raises(UsageError, match="less than half the sampling rate"):
            prepare(log, cutoff)
    with pytest.raises(NumericalError, match="lasts"):
        prepare(make_log(t[:120], sines(t[:120])[0]))
    slow = t[::25]
    assert prepare(make_log(slow, sines(slow)[0])).cutoff == pytest.approx(2.5)


def test_log_refuses_times_that_do_not_increase() -> None:
    with pytest.raises(ShapeError):
        make_log(np.array([0.0, 1.0, 1.0]), np.zeros((3, 1)))
    with pytest.raises(ShapeError):
        make_log(np.arange(3.0), np.zeros((4, 1)))


def test_prediction_errors_by_hand() -> None:
    t = even_times()
    signals = prepare(make_log(t, sines(t)[0]))
    recorded = np.stack([np.full_like(t, 4.0), np.zeros_like(t)], axis=1)
    predicted = np.stack([np.full_like(t, 3.0), np.zeros_like(t)], axis=1)
    predicted[1500, 0] = 1.5
    predicted[0, 0] = 99.0  # before the first used sample
    first, second = prediction_errors(signals, recorded, predicted)
    count = np.count_nonzero(signals.used)
    rmse = np.sqrt(((count - 1) * 1.0 + 2.5**2) / count)
    assert first.rmse == pytest.approx(rmse)
    assert first.nrmse == pytest.approx(rmse / 4.0)
    assert first.max_error == pytest.approx(2.5)
    assert first.worst_time == pytest.approx(1500 / RATE)
    assert second.nrmse is None
    assert second.rmse == 0.0


def drive_robot(*drives: Drive) -> Robot:
    joints = tuple(Joint(f"j{k}", "revolute", np.eye(4), drive=drive) for k, drive in enumerate(drives))
    return Robot("arm", joints, (), np.eye(4), np.zeros(3), Interval(np.zeros(len(joints))))


def test_effort_factors() -> None:
    arm = drive_robot(Drive(gear_ratio=100.0, torque_constant=0.05), Drive(gear_ratio=-48.0, torque_constant=0.1))
    np.testing.assert_allclose(effort_factors(arm, "torque"), [1, 1])
    np.testing.assert_allclose(effort_factors(arm, "motor-torque"), [100, -48])
    np.testing.assert_allclose(effort_factors(arm, "current"), [5, -4.8])


def test_missing_constants_name_the_joints() -> None:
    with pytest.raises(UsageError, match=r"torque_constant.*lacks for: j1;"):
        effort_factors(drive_robot(Drive(gear_ratio=2.0, torque_constant=1.0), Drive(gear_ratio=2.0)), "current")
    with pytest.raises(UsageError, match=r"gear_ratio.*\(j0, j1\)"):
        effort_factors(drive_robot(Drive(), Drive()), "motor-torque")
