"""The same work on a Dask cluster, with a worker that is lost."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from modrob_cli.batch.jobs import BatchOptions
from modrob_cli.errors import UsageError
from tests.batch_tasks import UpperCase
from tests.unit.batch.test_batch_run import contents, run_all, texts

if TYPE_CHECKING:
    from distributed import LocalCluster

pytest.importorskip("distributed", reason="the extra modrob[dask] is not installed")
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")


@pytest.fixture(scope="module")
def cluster() -> "Iterator[LocalCluster]":
    """Two workers that may die."""
    settings = {"distributed.worker.memory.terminate": False, "distributed.scheduler.allowed-failures": 1}
    import dask
    from distributed import LocalCluster

    with (
        dask.config.set(settings),
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as made,
    ):
        yield made


def test_results_are_those_of_a_local_run(cluster: "LocalCluster", tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", *(f"text {k}" for k in range(8)), "unreadable", "bug")
    dask = BatchOptions(dask=cluster.scheduler_address)
    here, there = run_all(jobs, tmp_path / "here"), run_all(jobs, tmp_path / "there", dask)
    assert contents(tmp_path / "there") == contents(tmp_path / "here")
    assert [outcome.failure for outcome in there] == [outcome.failure for outcome in here]
    Path(jobs[0].source).write_text("changed")
    again = run_all(jobs, tmp_path / "there", BatchOptions(dask=cluster.scheduler_address, resume=True))
    assert [outcome.kept for outcome in again] == [False, *[True] * 7, False, False]


def test_a_lost_worker_loses_nothing(cluster: "LocalCluster", tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", *(f"text {k}" for k in range(20)))
    victim = next(iter(cluster.workers.values())).pid
    killed: list[int] = []

    def listener(outcome: object) -> None:
        if not killed:
            os.kill(victim, signal.SIGKILL)
            killed.append(victim)

    from modrob_cli.batch.runner import BatchRun
    from modrob_cli.batch.settle_all import settle_all

    slow = UpperCase(seconds=0.05)
    with BatchRun(slow, tmp_path / "there", BatchOptions(dask=cluster.scheduler_address)) as run:
        found = settle_all(run, jobs, lambda record: float(record["length"]), listener)
    assert killed
    assert all(outcome.record is not None for outcome in found)
    run_all(jobs, tmp_path / "here", task=slow)
    assert contents(tmp_path / "there") == contents(tmp_path / "here")


def test_a_log_that_kills_workers_is_given_up(cluster: "LocalCluster", tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", "a", "die", "b")
    found = run_all(jobs, tmp_path / "out", BatchOptions(dask=cluster.scheduler_address))
    assert [outcome.job.name for outcome in found if outcome.record is None] == ["log1"]
    assert found[1].failure is not None
    assert "lost on the cluster, KilledWorker" in found[1].failure.reason


def test_no_scheduler_is_an_error_that_names_the_fix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("modrob_cli.batch.cluster.PATIENCE", 1)
    with pytest.raises(UsageError, match="found no scheduler there"):
        run_all(texts(tmp_path / "in", "a"), tmp_path / "out", BatchOptions(dask="tcp://127.0.0.1:9"))


def test_workers_without_modrob_are_named(
    cluster: "LocalCluster", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails() -> str:
        raise ModuleNotFoundError("No module named 'modrob_cli'")

    monkeypatch.setattr("modrob_cli.batch.cluster.installed_version", fails)
    with pytest.raises(UsageError, match=r"cannot be used on the workers \(No module named 'modrob_cli'\)"):
        run_all(texts(tmp_path / "in", "a"), tmp_path / "out", BatchOptions(dask=cluster.scheduler_address))
    monkeypatch.setattr("modrob_cli.batch.cluster.installed_version", lambda: "0.0.1")
    with pytest.raises(UsageError, match=r"has modrob 0\.0\.1, here it is"):
        run_all(texts(tmp_path / "in", "a"), tmp_path / "out", BatchOptions(dask=cluster.scheduler_address))
