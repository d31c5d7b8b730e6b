"""Progress of a batch: one bar on a terminal, lines elsewhere, and the summary at the end."""

import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

from modrob_cli.cli.batch_tally import LogRow, Measure, Tally, counts, duration, per_second, short_name, worst_first
from modrob_cli.cli.quiet import QuietStream

if TYPE_CHECKING:
    from modrob_cli.batch.jobs import Outcome

FEW = 20
"""Up to so many logs get a line each."""
_FAILURES = 50
"""Above the bar so many failures are shown as they come."""
_STEPS, _PAUSE, _GROWTH = 10, 10.0, 0.05
"""Without a terminal there is a line at every tenth of the logs, and after 10 s, later after a twentieth of the time
that has passed, so that a night's work fits on a few pages."""
_SHOWN = 10


class BatchListener:
    """Takes outcomes as they come and shows them; holds what the summary needs.

    Attributes
    ----------
    tally : rows and counts
    """

    def __init__(self, tally: Tally, show: Callable[[LogRow], None]) -> None:
        self.tally = tally
        self._show = show

    def __call__(self, outcome: "Outcome") -> None:
        """Count and show one outcome."""
        row = self.tally.add(outcome)
        if row is not None:
            self._show(row)

    def say_summary(self) -> None:
        """Print the summary of what came so far."""
        say_summary(list(self.tally.rows.values()), self.tally.busy)


@contextmanager
def batch_progress(
    command: str,
    total: int,
    measure: Measure,
    stream: TextIO | None = None,
    live: bool | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> Iterator[BatchListener]:
    """Show progress while logs are worked on.

    Parameters
    ----------
    total : number of logs
    measure : how bad a record is, and in words
    stream : where to; stderr if left out
    live : draw a bar; if left out, where the stream is a terminal
    """
    quiet = QuietStream(sys.stderr if stream is None else stream)
    tally = Tally(total, measure, clock)
    if live is None:
        live = quiet.isatty() and os.environ.get("TERM") != "dumb"
    if not live:
        yield BatchListener(tally, _Lines(tally, quiet).show)
        return
    from modrob_cli.cli.batch_bar import BatchBar

    with BatchBar(command, tally, quiet) as bar:
        yield BatchListener(tally, lambda row: _above(bar.say, tally, row))


def _above(say: Callable[[str], None], tally: Tally, row: LogRow) -> None:
    """What stays above the bar: every log if they are few, else those that failed."""
    if 1 < tally.total <= FEW:
        say(_line(tally, row))
    elif row.failed and tally.failed <= _FAILURES and tally.total > 1:
        say(_line(tally, row))
        if tally.failed == _FAILURES:
            say(f"{_FAILURES} logs failed; the next ones are only counted")


class _Lines:
    """Plain lines for records of CI and files."""

    def __init__(self, tally: Tally, stream: QuietStream) -> None:
        self._tally = tally
        self._stream = stream
        self._tenths = 0
        self._last = 0.0

    def show(self, row: LogRow) -> None:
        tally = self._tally
        if tally.total <= 1:
            return
        if row.failed or tally.total <= FEW:
            self._say(_line(tally, row))
        if tally.total > FEW and self._is_due():
            self._say(self._state())

    def _is_due(self) -> bool:
        tenths = _STEPS * self._tally.done // self._tally.total
        now = self._tally.seconds
        due = tenths > self._tenths or now - self._last >= max(_PAUSE, _GROWTH * now)
        if due:
            self._tenths, self._last = tenths, now
        return due

    def _state(self) -> str:
        tally = self._tally
        parts = [f"{tally.done}/{tally.total} logs", per_second(tally.speed), f"{duration(tally.seconds)} passed"]
        if tally.left is not None and tally.done < tally.total:
            parts.append(f"{duration(tally.left)} left")
        return ", ".join(parts + counts(tally))

    def _say(self, line: str) -> None:
        self._stream.write(line + "\n")
        self._stream.flush()


def _line(tally: Tally, row: LogRow) -> str:
    count = f"{tally.done:>{len(str(tally.total))}}/{tally.total}"
    if row.failed:
        return f"{count}  failed: {row.text}"
    return f"{count}  {row.name}: {row.text} ({'kept' if row.kept else duration(row.seconds)})"


def say_summary(rows: Sequence[LogRow], seconds: float) -> None:
    """Print the worst logs, counts and speed; nothing for a single log.

    What failed was said when it did, and is the error that the command ends with.

    Parameters
    ----------
    seconds : that all took
    """
    from modrob_cli.cli.console import say, table

    if len(rows) < 2:
        return
    ranked = worst_first(rows)
    if ranked:
        cells: list[tuple[Any, ...]] = [(short_name(row.name), row.text, _time(row)) for row in ranked[:_SHOWN]]
        say(table(("log, worst first", "result", "time"), cells))
        if len(ranked) > _SHOWN:
            say(f"  and {len(ranked) - _SHOWN} more")
    kept = sum(row.kept for row in rows)
    parts = [f"{len(ranked) - kept} done"]
    parts += [f"{kept} kept from the run before"] if kept else []
    parts += [f"{len(rows) - len(ranked)} failed"] if len(rows) > len(ranked) else []
    speed = len(rows) / seconds if seconds > 0.0 else None
    say(f"{len(rows)} logs in {duration(seconds)}, {per_second(speed)}: {', '.join(parts)}")


def _time(row: LogRow) -> str:
    return "kept" if row.kept else duration(row.seconds)
