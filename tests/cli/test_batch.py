"""Many logs in one call, as a user runs it: which ones, bad ones among them, stopped and resumed, a full disk."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest

from tests.cli.test_validate import URDF, modrob, record

MODROB = Path(sys.executable).with_name("modrob")
OPTIONS = ("--effort", "torque", "--details", "0")
LOGS = 14


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot and a folder with logs, one of them longer than the others."""
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "two.urdf").write_text(URDF)
    logs = folder / "logs"
    (logs / "deeper").mkdir(parents=True)
    content = record(logs / "run_1.mcap", samples=600).read_bytes()
    for k in range(2, LOGS):
        # The same recording under other names: what is tested here is not what is in it.
        (logs / f"run_{k}.mcap").write_bytes(content)
    (logs / "deeper" / "run_3.mcap").write_bytes(content)
    record(logs / "run_9.mcap", samples=900)
    return folder


@pytest.fixture(scope="module")
def expected(fleet: Path) -> dict[str, bytes]:
    """What an undisturbed run gives."""
    code, said = finish(start(fleet, "whole", "-j", "1"))
    assert code == 0, said
    return visible(fleet / "whole")


def start(fleet: Path, out: str, *extra: str, **kwargs: Any) -> "subprocess.Popen[str]":
    command = [str(MODROB), "validate", "two.urdf", "logs", *OPTIONS, "-o", out, *extra]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=fleet, stdout=pipe, stderr=pipe, text=True, start_new_session=True, **kwargs)


def finish(process: "subprocess.Popen[str]") -> tuple[int, str]:
    """Exit code, and what was said."""
    _, said = process.communicate(timeout=120)
    return process.returncode, said


def visible(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".modrob")}


def wait_for_records(folder: Path, count: int) -> None:
    """Until so many logs are done."""
    end = time.monotonic() + 60.0
    while len(list(folder.glob("run_*.validate.json"))) < count:
        assert time.monotonic() < end, "no results"
        time.sleep(0.005)


def test_a_folder_holds_the_logs_and_the_tables_agree(fleet: Path, expected: dict[str, bytes]) -> None:
    summary = json.loads(expected["two.validate.summary.json"])
    names = [log["log"] for log in summary["logs"]]
    assert sorted(names) == sorted(str(path.relative_to(fleet)) for path in fleet.glob("logs/**/*.mcap"))
    table = pyarrow.parquet.read_table(fleet / "whole" / "two.validate.logs.parquet").to_pylist()
    assert len(table) == 2 * LOGS
    assert expected["two.validate.logs.csv"].count(b"\n") == 2 * LOGS + 1
    by_log = {(row["log"], row["joint"]): row["nrmse"] for row in table}
    for log in summary["logs"]:
        for joint in log["joints"]:
            assert by_log[log["log"], joint["name"]] == joint["nrmse"]
    page = expected["two.validate.html"].decode()
    assert "run_13" in page


def test_the_number_of_processes_changes_no_byte(fleet: Path, expected: dict[str, bytes]) -> None:
    assert finish(start(fleet, "two-jobs", "-j", "2"))[0] == 0
    assert visible(fleet / "two-jobs") == expected


@pytest.mark.parametrize(("number", "jobs"), [(signal.SIGKILL, "2"), (signal.SIGTERM, "1")])
def test_a_run_that_is_stopped_goes_on_with_resume(
    fleet: Path, expected: dict[str, bytes], number: signal.Signals, jobs: str
) -> None:
    out = f"stopped-{number.name}"
    process = start(fleet, out, "-j", jobs)
    wait_for_records(fleet / out, 2)
    os.kill(process.pid, number)
    code, said = finish(process)
    found = visible(fleet / out)
    if "two.validate.html" not in found:  # else its last moment came before the signal
        assert code == (-number if number == signal.SIGKILL else 128 + number)
        assert number == signal.SIGKILL or "--resume goes on from there" in said
    assert {name: content for name, content in expected.items() if name in found} == found
    code, said = finish(start(fleet, out))
    assert code == 6
    assert "pass --resume to go on where a run has stopped" in said
    assert finish(start(fleet, out, "--resume", "-j", "1"))[0] == 0
    assert visible(fleet / out) == expected
    assert not list((fleet / out).glob(".modrob*"))


def test_resume_keeps_what_is_done(fleet: Path, expected: dict[str, bytes]) -> None:
    before = {path.name: path.stat().st_mtime_ns for path in (fleet / "whole").glob("run_*")}
    code, said = finish(start(fleet, "whole", "--resume"))
    assert code == 0
    assert f"{LOGS} kept" in said
    assert {path.name: path.stat().st_mtime_ns for path in (fleet / "whole").glob("run_*")} == before
    assert visible(fleet / "whole") == expected


def test_a_full_disk_is_said_and_what_is_done_stays(fleet: Path, expected: dict[str, bytes]) -> None:
    """The limit of the size of a file stands for a full disk: the same error comes from the same calls."""
    largest = len(expected["run_9.validate.csv"])

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest - 1, largest - 1))

    code, said = finish(start(fleet, "full", "-j", "1", preexec_fn=limit))
    assert code == 2
    assert "full: File too large: " in said
    assert "logs are done, their results are in" in said
    assert "Traceback" not in said
    found = visible(fleet / "full")
    assert "run_8.validate.json" in found
    assert not any(name.startswith("run_9") for name in found)
    assert {name: content for name, content in expected.items() if name in found} == found


def test_a_second_run_in_the_folder_is_refused(fleet: Path) -> None:
    process = start(fleet, "shared", "-j", "1")
    end = time.monotonic() + 60.0
    # The folder for temporary files is made under the lock; the lock's file is there a moment before it is locked.
    while not (fleet / "shared" / ".modrob-validate").exists():
        assert time.monotonic() < end, "no run"
        time.sleep(0.002)
    os.kill(process.pid, signal.SIGSTOP)
    try:
        code, said = finish(start(fleet, "shared", "--overwrite"))
        assert code == 2
        assert f"in use by another run (modrob validate, process {process.pid} on " in said
    finally:
        os.kill(process.pid, signal.SIGCONT)
    assert finish(process)[0] == 0


def test_bad_logs_among_good_ones(fleet: Path, tmp_path: Path) -> None:
    good = (fleet / "logs" / "run_1.mcap").read_bytes()
    bad = {
        "empty.mcap": b"",
        "text.mcap": b"not a log\n" * 20,
        "head.mcap": good[:30],
        "zeros.mcap": good[:8] + bytes(len(good) - 8),
        "short.mcap": record(tmp_path / "short.mcap", samples=60).read_bytes(),
        "other.mcap": record(tmp_path / "other.mcap", names=("x", "y"), samples=200).read_bytes(),
    }
    for name, content in bad.items():
        (tmp_path / name).write_bytes(content)
    pattern = str(fleet / "logs" / "run_*.mcap")
    logs = (pattern, *(tmp_path / name for name in bad), tmp_path / "gone.mcap")
    done = modrob(fleet / "two.urdf", *logs, *OPTIONS, "-o", tmp_path / "out", "--json")
    assert done.exit_code == 3, done.output
    result = json.loads(done.stdout)
    assert len(result["logs"]) == LOGS - 1
    codes = {Path(entry["log"]).name: entry["code"] for entry in result["skipped"]}
    assert codes == {**dict.fromkeys([*bad, "gone.mcap"], 3), "short.mcap": 5}
    for entry in result["skipped"]:
        assert entry["log"] in entry["reason"] or "short" in entry["reason"]
    assert "Traceback" not in done.output
    with_verdict = modrob(
        fleet / "two.urdf", pattern, tmp_path / "short.mcap", *OPTIONS, "--max-nrmse", 9, "-o", tmp_path / "verdict"
    )
    assert with_verdict.exit_code == 4, "a log that could not be judged has not passed"
    first = modrob(fleet / "two.urdf", *logs[1:], pattern, *OPTIONS, "--fail-fast", "-o", tmp_path / "first")
    assert first.exit_code == 3
    assert not list((tmp_path / "first").glob("*"))
