"""Errors over several runs, by hand."""

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.identify.prediction import prediction_errors
from modrob_cli.identify.prediction_pooled import PooledError, error_sums, errors_of
from modrob_cli.identify.run import Run
from modrob_cli.identify.signals import prepare
from modrob_cli.model.log import JointLog


def make_run(name: str, torque: Array) -> Run:
    t = np.arange(len(torque)) / 100.0
    log = JointLog(name, ("j",), t, np.sin(t)[:, None], None, torque[:, None])
    signals = prepare(log, 5.0)
    small = np.full(1, 1e-3)
    return Run(name, signals, log.effort, np.zeros_like(log.effort), signals.used, small, small, small)


def pooled_errors(runs: list[Run], predicted: list[Array]) -> list[PooledError] | None:
    return errors_of([error_sums([run], torque)[0] for run, torque in zip(runs, predicted, strict=True)])


def test_two_runs_count_by_their_samples() -> None:
    runs = [make_run("a", np.full(300, 4.0)), make_run("b", np.full(1000, 2.0))]
    predicted = [np.full((300, 1), 3.0), np.full((1000, 1), 2.0)]
    predicted[1][500] = 0.5
    (found,) = pooled_errors(runs, predicted) or []
    counts = [int(run.used.sum()) for run in runs]
    squares = counts[0] * 1.0 + 1.5**2
    assert found.samples == sum(counts)
    assert found.error.rmse == pytest.approx(np.sqrt(squares / sum(counts)))
    assert found.error.nrmse == pytest.approx(np.sqrt(squares / (counts[0] * 16.0 + counts[1] * 4.0)))
    assert (found.worst_log, found.error.worst_time, found.error.max_error) == ("b", 5.0, 1.5)


def test_one_run_as_alone() -> None:
    rng = np.random.default_rng(1)
    run = make_run("a", rng.normal(size=500))
    predicted = rng.normal(size=(500, 1))
    (found,) = pooled_errors([run], [predicted]) or []
    (alone,) = prediction_errors(run.signals, run.tau, predicted)
    for key in ("rmse", "nrmse", "nrmse_low_passed", "max_error", "worst_time"):
        assert getattr(found.error, key) == pytest.approx(getattr(alone, key), rel=1e-12)


def test_parts_of_a_run_make_up_the_whole() -> None:
    rng = np.random.default_rng(2)
    run = make_run("a", rng.normal(size=800))
    predicted = rng.normal(size=(800, 1))
    parts = error_sums([run.between(0.0, 3.0), run.between(3.0, np.inf)], predicted)
    (found,), (whole,) = errors_of(parts) or [], pooled_errors([run], [predicted]) or []
    assert found.samples == whole.samples
    for key in ("rmse", "nrmse", "nrmse_low_passed", "max_error", "worst_time"):
        assert getattr(found.error, key) == pytest.approx(getattr(whole.error, key), rel=1e-12)


def test_nothing_to_compare_with() -> None:
    run = make_run("a", np.ones(300))
    assert pooled_errors([run.between(0.0, 0.0)], [run.tau]) is None
    silent = make_run("b", np.zeros(300))
    (found,) = pooled_errors([silent], [silent.tau]) or []
    assert (found.error.nrmse, found.error.nrmse_low_passed) == (None, None)
