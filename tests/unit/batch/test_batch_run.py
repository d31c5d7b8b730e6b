"""Runs over many logs: nothing is lost, nothing is half-written, one bad log stays alone."""

import json
from pathlib import Path

import pytest

from modrob_cli.batch.jobs import BatchOptions, LogJob, Outcome
from modrob_cli.batch.runner import BatchRun
from modrob_cli.batch.settle_all import failures_as_error, settle_all
from modrob_cli.errors import FailedLogsError, OutputError, OutputExistsError, UsageError
from tests.batch_tasks import UpperCase

ONE = BatchOptions(processes=1)


def texts(folder: Path, *contents: str) -> list[LogJob]:
    folder.mkdir(exist_ok=True)
    jobs = []
    for k, content in enumerate(contents):
        path = folder / f"log{k}.txt"
        path.write_text(content)
        jobs.append(LogJob(path.stem, str(path)))
    return jobs


def run_all(jobs: list[LogJob], out: Path, options: BatchOptions = ONE, task: UpperCase | None = None) -> list[Outcome]:
    with BatchRun(task or UpperCase(), out, options) as run:
        return settle_all(run, jobs, lambda record: float(record["length"]))


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("processes", [1, 2])
def test_each_log_has_its_files_and_a_failure_stays_alone(tmp_path: Path, processes: int) -> None:
    jobs = texts(tmp_path / "in", "aa", "unreadable", "b", "singular", "bug", "c")
    found = run_all(jobs, tmp_path / "out", BatchOptions(processes))
    assert [outcome.job for outcome in found] == jobs
    reasons = {outcome.job.name: outcome.failure for outcome in found if outcome.failure is not None}
    assert {name: failure.code for name, failure in reasons.items()} == {"log1": 3, "log3": 5, "log4": 1}
    assert reasons["log1"].reason == f"{jobs[1].source}: found nonsense"
    assert "internal error, ZeroDivisionError: by zero (batch_tasks.py:" in reasons["log4"].reason
    names = {f"log{k}.upper.{kind}" for k in (0, 2, 5) for kind in ("txt", "json", "page.txt")}
    assert set(contents(tmp_path / "out")) == names
    assert (tmp_path / "out" / "log0.upper.txt").read_text() == "AA"
    assert failures_as_error(found).exit_code == 1


def test_a_process_that_dies_takes_one_log_with_it(tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", *["a"] * 3, "die", *["b"] * 4)
    found = run_all(jobs, tmp_path / "out", BatchOptions(2))
    assert [outcome.job for outcome in found] == jobs
    failed = [outcome for outcome in found if outcome.failure is not None]
    assert [outcome.job.name for outcome in failed] == ["log3"]
    assert failed[0].failure is not None
    assert "signal 9" in failed[0].failure.reason
    assert not list((tmp_path / "out").glob(".modrob*"))


def test_the_number_of_processes_does_not_change_a_byte(tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", *(f"text {k}" for k in range(7)))
    for processes in (1, 2, 3):
        run_all(jobs, tmp_path / str(processes), BatchOptions(processes))
    assert contents(tmp_path / "1") == contents(tmp_path / "2") == contents(tmp_path / "3")


def test_a_full_disk_ends_the_run_and_keeps_what_is_there(tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", "a", "b", "full", "c")
    with pytest.raises(OutputError, match="No space left"):
        run_all(jobs, tmp_path / "out")
    assert sorted(contents(tmp_path / "out")) == [
        f"log{k}.upper.{x}" for k in (0, 1) for x in ("json", "page.txt", "txt")
    ]
    with pytest.raises(OutputError, match="No space left"):
        run_all(jobs, tmp_path / "many", BatchOptions(2))


def test_resume_keeps_what_is_whole_and_redoes_what_is_stale(tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", "a", "b", "c", "d", "e")
    out, resume = tmp_path / "out", BatchOptions(1, resume=True)
    first = run_all(jobs, out)
    with pytest.raises(OutputExistsError, match="--resume"), BatchRun(UpperCase(), out, ONE) as run:
        run.claim(jobs, [])
    before = contents(out)
    Path(jobs[1].source).write_text("changed")  # the log
    (out / "log2.upper.txt").write_text("torn")  # a result
    (out / "log3.upper.json").unlink()  # the record, as if stopped just before it
    (out / "log4.upper.json").write_text(before["log4.upper.json"].decode()[:40])
    again = run_all(jobs, out, resume)
    assert [outcome.kept for outcome in again] == [True, False, False, False, False]
    assert again[0].record == first[0].record
    after = contents(out)
    assert after.pop("log1.upper.txt") == b"CHANGED"
    same = {name for name in after if not name.startswith("log1")}
    assert {name: after[name] for name in same} == {name: before[name] for name in same}
    assert all(outcome.kept for outcome in run_all(jobs, out, resume))
    assert not any(outcome.kept for outcome in run_all(jobs, out, resume, UpperCase({"other": 1})))


def test_a_record_cannot_point_outside_its_folder(tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", "a")
    run_all(jobs, tmp_path / "out")
    record = json.loads((tmp_path / "out" / "log0.upper.json").read_text())
    digest = record["provenance"]["outputs"]["log0.upper.txt"]
    (tmp_path / "elsewhere.txt").write_bytes((tmp_path / "out" / "log0.upper.txt").read_bytes())
    record["provenance"]["outputs"] = {"../elsewhere.txt": digest}
    (tmp_path / "out" / "log0.upper.json").write_text(json.dumps(record))
    (again,) = run_all(jobs, tmp_path / "out", BatchOptions(1, resume=True))
    assert not again.kept


def test_only_the_worst_logs_are_drawn(tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", "a", "bbb", "cc", "dddd")
    found = run_all(jobs, tmp_path / "out", BatchOptions(1, details=2))
    drawn = sorted(path.name for path in (tmp_path / "out").glob("*.page.txt"))
    assert drawn == ["log1.upper.page.txt", "log3.upper.page.txt"]
    assert [outcome.done["provenance"]["detailed"] for outcome in found] == [False, True, False, True]
    again = run_all(jobs, tmp_path / "out", BatchOptions(1, resume=True, details=2))
    assert all(outcome.kept for outcome in again)
    run_all(jobs, tmp_path / "out", BatchOptions(1, resume=True, details=3))
    assert (tmp_path / "out" / "log2.upper.page.txt").exists(), "what was only judged before is drawn now"


def test_fail_fast_stops_at_the_first(tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", "a", "unreadable", "b")
    with pytest.raises(FailedLogsError, match="log1.txt: found nonsense") as caught:
        run_all(jobs, tmp_path / "out", BatchOptions(1, fail_fast=True))
    assert caught.value.exit_code == 3
    assert not (tmp_path / "out" / "log2.upper.json").exists()
    assert (tmp_path / "out" / "log0.upper.json").exists()


def test_nothing_is_left_where_every_log_fails(tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", "unreadable", "singular")
    with pytest.raises(FailedLogsError, match="no convergence") as caught:
        run_all(jobs, tmp_path / "deep" / "out")
    assert caught.value.exit_code == 3
    assert not (tmp_path / "deep").exists()


def test_two_runs_do_not_share_a_folder(tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", "a")
    with BatchRun(UpperCase(), tmp_path / "out", ONE) as run:
        with pytest.raises(UsageError, match=r"in use by another run \(modrob upper, process \d+ on "):
            run_all(jobs, tmp_path / "out")
        assert settle_all(run, jobs, lambda record: 0.0)[0].record is not None
        run_all(jobs, tmp_path / "out", task=UpperCase(command="other"))
    assert not list((tmp_path / "out").glob(".modrob*"))


def test_what_a_killed_run_left_is_removed(tmp_path: Path) -> None:
    jobs = texts(tmp_path / "in", "a")
    staging = tmp_path / "out" / ".modrob-upper"
    staging.mkdir(parents=True)
    (staging / ".modrob-xyz.json").write_text("half")
    with BatchRun(UpperCase(), tmp_path / "out", ONE) as run:
        assert list(staging.iterdir()) == [], "a full disk gets its room back before the work"
        run.settle(jobs, False)
    assert not staging.exists()
