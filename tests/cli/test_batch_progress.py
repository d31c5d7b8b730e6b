"""What people see of a batch: on a terminal, in the records of CI, and when nobody listens any more."""

import io
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from modrob_cli.batch.jobs import Failure, LogJob, Outcome
from modrob_cli.cli.batch_progress import batch_progress, say_summary
from modrob_cli.cli.batch_tally import LogRow, Tally, duration, per_second, worst_first

HOSTILE = "a\nb\r[red]%s{0}\x1b[2J\u202e:smile:"
HOSTILE_SHOWN = r"a\nb\r[red]%s{0}\x1b[2J\u202e:smile:"


class Clock:
    """Time that passes when it is told to."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def good(name: str, nrmse: float = 0.1, kept: bool = False) -> Outcome:
    return Outcome(LogJob(name, f"runs/{name}.mcap"), {"nrmse": nrmse}, None, kept, 0.25)


def bad(name: str, reason: str) -> Outcome:
    return Outcome(LogJob(name, f"runs/{name}.mcap"), None, Failure(reason, 3), False, 0.1)


def measure(record: dict[str, Any]) -> tuple[float, str]:
    return record["nrmse"], f"NRMSE {record['nrmse']:.3f}"


def lines_of(outcomes: list[Outcome], total: int, step: float = 0.0) -> list[str]:
    """What is printed without a terminal if an outcome comes every ``step`` seconds."""
    stream, clock = io.StringIO(), Clock()
    with batch_progress("validate", total, measure, stream, live=False, clock=clock) as listener:
        for outcome in outcomes:
            clock.now += step
            listener(outcome)
    return stream.getvalue().splitlines()


def bar_of(outcomes: list[Outcome], total: int, step: float = 0.5, columns: int = 110) -> str:
    """Everything that a terminal gets."""
    stream, clock = io.StringIO(), Clock()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", str(columns))
        patch.setenv("TERM", "xterm-256color")
        with batch_progress("validate", total, measure, stream, live=True, clock=clock) as listener:
            for outcome in outcomes:
                clock.now += step
                listener(outcome)
    return stream.getvalue()


def plain(text: str) -> str:
    """Text without the terminal's commands."""
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)


def test_few_logs_get_a_line_each() -> None:
    outcomes = [good("a", 0.25), bad("b", "runs/b.mcap: found no MCAP file"), good("c", 0.5, kept=True)]
    assert lines_of(outcomes, 3) == [
        "1/3  a: NRMSE 0.250 (0.25 s)",
        "2/3  failed: runs/b.mcap: found no MCAP file",
        "3/3  c: NRMSE 0.500 (kept)",
    ]


def test_one_log_needs_no_progress() -> None:
    assert lines_of([bad("a", "is broken")], 1) == []


def test_many_logs_get_a_line_at_every_tenth() -> None:
    lines = lines_of([good(f"r{k}", 0.001 * k) for k in range(1000)], 1000, step=0.001)
    assert [line.split(",")[0] for line in lines] == [f"{100 * k}/1000 logs" for k in range(1, 11)]
    assert lines[4] == "500/1000 logs, 1e+03 logs/s, 0.5 s passed, 0.5 s left, worst so far r499: NRMSE 0.499"
    assert lines[9].startswith("1000/1000 logs, 1e+03 logs/s, 1 s passed, worst")


def test_slow_work_gets_a_line_now_and_then() -> None:
    day = lines_of([good(f"r{k}") for k in range(8640)], 8640, step=10.0)
    # Every 10 s of the first 200 s, then at a growth of 5 %: 20 + log(86400 / 200) / log(1.05) lines, and the tenths.
    assert 100 < len(day) < 20 + 125 + 10
    few = lines_of([good(f"r{k}") for k in range(21)], 21, step=60.0)
    assert len(few) == 21


def test_failures_are_said_at_once_and_name_their_log() -> None:
    outcomes = [good("a"), bad("b", "too short: 3 samples"), bad("c", "runs/c.mcap: first\nsecond\nthird"), good("d")]
    lines = lines_of(outcomes, 100)
    assert lines[0] == "  2/100  failed: runs/b.mcap: too short: 3 samples"
    assert lines[1] == "  3/100  failed: runs/c.mcap: first (and 2 more faults)"


def test_time_left_counts_on() -> None:
    clock = Clock()
    tally = Tally(10, measure, clock)
    assert tally.speed is None
    assert tally.left is None
    for k in range(4):
        clock.now += 2.0
        tally.add(good(f"r{k}"))
    assert tally.speed == 0.5
    assert tally.left == 12.0
    clock.now += 1.0
    assert tally.left == 11.0
    clock.now += 100.0
    assert tally.left == 0.0


def test_speed_is_that_of_late() -> None:
    """After a quick start over kept logs the time left must be that of work."""
    clock = Clock()
    tally = Tally(3000, measure, clock)
    for k in range(2000):
        clock.now += 0.001 if k < 1000 else 1.0
        tally.add(good(f"r{k}", kept=k < 1000))
    assert tally.speed == pytest.approx(1.0)
    assert tally.left == pytest.approx(1000.0)


def test_a_log_that_comes_again_is_not_counted_again() -> None:
    tally = Tally(2, measure)
    assert tally.add(good("a", 0.1, kept=True)) is not None
    assert tally.add(good("a", 0.1)) is None
    assert (tally.done, tally.repeated, tally.failed, tally.kept) == (1, 1, 0, 1)
    again = tally.add(bad("a", "the drawing failed"))
    assert again is not None
    assert again.failed
    assert (tally.done, tally.repeated, tally.failed, tally.kept) == (1, 2, 1, 0)
    assert tally.rows["a"] is again


def test_worst_logs_come_first_and_nan_before_all() -> None:
    rows = [
        LogRow(name, value, "", failed, False, 0.0)
        for name, value, failed in [
            ("b", 0.5, False),
            ("a", 0.5, False),
            ("c", float("nan"), False),
            ("d", 0.0, True),
            ("e", 2.0, False),
        ]
    ]
    assert [row.name for row in worst_first(rows)] == ["c", "e", "a", "b"]


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0 s"),
        (0.042, "0.042 s"),
        (9.94, "9.9 s"),
        (9.96, "10 s"),
        (59.4, "59 s"),
        (60.0, "1:00"),
        (187.0, "3:07"),
    ],
)
def test_durations(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_long_durations_and_speeds() -> None:
    assert duration(3599.7) == "1:00:00"
    assert duration(3723.0) == "1:02:03"
    assert [per_second(speed) for speed in (None, 23.456, 0.25)] == ["- logs/s", "23.5 logs/s", "15 logs/min"]


def test_the_bar_shows_counts_speed_time_and_the_worst() -> None:
    outcomes = [good(f"r{k}", 0.01 * (k % 7)) for k in range(30)] + [good("odd", 0.9), good("old", 0.2, kept=True)]
    text = plain(bar_of([*outcomes, bad("broken", "runs/broken.mcap: no log")], 100))
    last = text[text.rindex("validate") :]
    assert "33/100" in last
    assert "2 logs/s" in last
    assert "16 s" in last  # 33 outcomes at 0.5 s
    assert "34 s left" in last
    assert "1 failed, 1 kept, worst so far odd: NRMSE 0.900" in last
    assert text.count("33/100  failed: runs/broken.mcap: no log") == 1
    assert "r5:" not in text  # no line for each of many logs


def test_few_logs_stay_above_the_bar() -> None:
    text = plain(bar_of([good("a"), good("b", kept=True)], 2))
    assert "1/2  a: NRMSE 0.100 (0.25 s)" in text
    assert "2/2  b: NRMSE 0.100 (kept)" in text


def test_the_bar_goes_away_and_gives_the_cursor_back() -> None:
    text = bar_of([good("a"), good("b")], 2)
    assert text.index("\x1b[?25l") < text.rindex("\x1b[?25h")
    assert text.rstrip().endswith("\x1b[2K")


def test_the_bar_goes_away_after_an_interruption() -> None:
    stream = io.StringIO()
    with pytest.raises(KeyboardInterrupt), batch_progress("validate", 5, measure, stream, live=True):
        raise KeyboardInterrupt
    assert "\x1b[?25h" in stream.getvalue()


def test_a_flood_of_failures_does_not_fill_the_screen() -> None:
    text = plain(bar_of([bad(f"r{k}", "broken") for k in range(300)], 300, step=0.001))
    assert text.count("failed: runs/") == 50
    assert "50 logs failed; the next ones are only counted" in text
    assert "300 failed" in text


@pytest.mark.parametrize("columns", [20, 40, 80])
def test_a_narrow_terminal_gets_two_lines_too(columns: int) -> None:
    text = bar_of([good(f"a-rather-long-name-of-a-log-{k}") for k in range(40)], 100, columns=columns)
    *_, last = (plain(frame) for frame in text.split("\x1b[2K") if plain(frame).strip())
    lines = last.strip().splitlines()
    assert len(lines) == 2
    assert max(len(line) for line in lines) <= columns


@pytest.mark.parametrize("live", [True, False])
@pytest.mark.parametrize("total", [3, 100])
def test_hostile_names_do_no_harm(live: bool, total: int) -> None:
    outcomes = [good(HOSTILE, 0.3), bad(f"{HOSTILE}-2", f"{HOSTILE}\nmore"), good("x" * 5000, 0.2)]
    text = bar_of(outcomes, total, columns=5000) if live else "\n".join(lines_of(outcomes, total, step=20.0))
    assert f"failed: runs/{HOSTILE_SHOWN}-2.mcap: a (and 2 more faults)" in plain(text)
    assert f"{HOSTILE_SHOWN}: NRMSE 0.300" in plain(text)
    assert "\x1b[2J" not in text
    assert "\u202e" not in text
    assert "x" * 500 not in text


def test_summary(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [LogRow(f"r{k}", 0.01 * k, f"NRMSE {0.01 * k:.3f}", False, k < 5, 0.5) for k in range(15)]
    rows += [LogRow(f"bad{k}", 0.0, f"runs/bad{k}.mcap: broken", True, False, 0.1) for k in range(12)]
    say_summary(rows, 9.0)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].split() == ["log,", "worst", "first", "result", "time"]
    assert [line.split()[0] for line in lines[1:11]] == [f"r{k}" for k in range(14, 4, -1)]
    assert lines[1].split() == ["r14", "NRMSE", "0.140", "0.5", "s"]
    assert lines[11] == "  and 5 more"
    assert lines[12:] == ["27 logs in 9 s, 3 logs/s: 10 done, 5 kept from the run before, 12 failed"]


def test_summary_of_one_log_is_left_to_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    say_summary([LogRow("a", 0.1, "NRMSE 0.1", False, False, 1.0)], 1.0)
    assert capsys.readouterr().err == ""


def test_names_in_the_summary_keep_their_ends(capsys: pytest.CaptureFixture[str]) -> None:
    names = ["recording-of-the-arm-" + "0" * 60 + f"-{k}" for k in (1, 2)]
    say_summary([LogRow(name, 0.1, "NRMSE 0.1", False, False, 1.0) for name in names], 1.0)
    lines = capsys.readouterr().err.splitlines()
    assert lines[1].split()[0].startswith("recording-of..")
    assert lines[1].split()[0].endswith("-1")
    assert len(lines[1].split()[0]) == 48


DEAF = """
import os, sys, time
from modrob_cli.batch.jobs import Failure, LogJob, Outcome
from modrob_cli.cli.batch_progress import batch_progress
import typer
with batch_progress("validate", 100, lambda record: (1.0, "x" * 300), live={live}) as listener:
    for k in range(100):
        listener(Outcome(LogJob(str(k), str(k)), {{}} if k % 2 else None, None if k % 2 else Failure("bad", 3)))
        time.sleep(0.005)
listener.say_summary()
typer.echo("as at the boundary of errors", err=True)
print(listener.tally.done)
sys.exit(3)
"""


def run_deaf(code: str, end: str) -> "subprocess.CompletedProcess[bytes]":
    """Run with a stderr that nobody reads (modrob ... 2>&1 | head), on a full disk, or shut."""
    if end == "full" and not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    reader, writer = os.pipe()
    os.close(reader)
    full = os.open("/dev/full" if end == "full" else os.devnull, os.O_WRONLY)
    try:
        return subprocess.run(
            [sys.executable, "-c", code],
            stdout=subprocess.PIPE,
            stderr=writer if end == "pipe" else full,
            preexec_fn=(lambda: os.close(2)) if end == "shut" else None,
            timeout=60,
        )
    finally:
        os.close(writer)
        os.close(full)


@pytest.mark.parametrize("live", [True, False])
@pytest.mark.parametrize("end", ["pipe", "full", "shut"])
def test_work_goes_on_when_nobody_listens(live: bool, end: str) -> None:
    done = run_deaf(DEAF.format(live=live), end)
    assert done.stdout == b"100\n"
    assert done.returncode == 3


def test_lines_for_people_that_nobody_reads_do_no_harm() -> None:
    code = "from modrob_cli.cli.console import say\nsay('a')\nsay('b')\nprint('done')\nraise SystemExit(4)"
    done = run_deaf(code, "pipe")
    assert (done.stdout, done.returncode) == (b"done\n", 4)


def test_showing_costs_next_to_nothing() -> None:
    """Logs are judged in some 16 ms; a listener that takes more than a tenth of that would be felt."""
    import time

    outcomes = [good(f"r{k}", 0.001 * k) for k in range(2000)]
    start = time.perf_counter()
    bar_of(outcomes, 2000, step=0.001)
    assert (time.perf_counter() - start) / len(outcomes) < 1.6e-3


def test_the_speed_of_the_summary_is_that_of_the_logs(capsys: pytest.CaptureFixture[str]) -> None:
    """Time for the report about all logs does not make the logs look slow."""
    clock = Clock()
    with batch_progress("validate", 4, measure, io.StringIO(), live=False, clock=clock) as listener:
        for k in range(4):
            clock.now += 0.5
            listener(good(f"r{k}"))
        clock.now += 60.0
    listener.say_summary()
    assert capsys.readouterr().err.splitlines()[-1] == "4 logs in 2 s, 2 logs/s: 4 done"
