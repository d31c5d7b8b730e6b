"""What is known of a batch while it runs: counts, speed, the worst log."""

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from modrob_cli.batch.jobs import Outcome

Measure = Callable[[dict[str, Any]], tuple[float, str]]
"""How bad the record of a log is (more is worse), and in words, such as ``(0.31, "NRMSE 0.310 in J3")``."""

_LOOK_BACK = 200
"""The speed is that of so many last logs: few enough to follow changes, enough to be steady."""
_LONGEST, _WIDTH = 400, 48


@dataclass(frozen=True)
class LogRow:
    """One log as people see it.

    Attributes
    ----------
    badness : more is worse; NaN counts as worst, 0 for a log that failed
    text : its result in words, or why there is none; one printable line
    """

    name: str
    badness: float
    text: str
    failed: bool
    kept: bool
    seconds: float


class Tally:
    """Counts outcomes as they come.

    Parameters
    ----------
    total : number of logs
    measure : what counts in a record
    clock : seconds, monotonic
    """

    def __init__(self, total: int, measure: Measure, clock: Callable[[], float] = time.monotonic) -> None:
        self.total = total
        self.rows: dict[str, LogRow] = {}
        self.failed = self.kept = self.repeated = 0
        self.worst: LogRow | None = None
        self._measure = measure
        self._clock = clock
        self.start = clock()
        self._ends = deque([self.start], maxlen=_LOOK_BACK)

    def add(self, outcome: "Outcome") -> LogRow | None:
        """Count an outcome; None if the log was counted before (and was only drawn now, unless that failed)."""
        name, before = outcome.job.name, self.rows.get(outcome.job.name)
        if before is not None:
            self.repeated += 1
            if outcome.failure is None or before.failed:
                return None
            self.kept -= before.kept
        row = self.rows[name] = _row(outcome, self._measure)
        self.failed += row.failed
        self.kept += row.kept
        if before is not None:
            return row
        if not row.failed and (self.worst is None or _rank(row) > _rank(self.worst)):
            self.worst = row
        self._ends.append(self._clock())
        return row

    @property
    def done(self) -> int:
        """Number of logs that came, failed ones too."""
        return len(self.rows)

    @property
    def seconds(self) -> float:
        """Time since the start, [s]."""
        return self._clock() - self.start

    @property
    def busy(self) -> float:
        """Time from the start to the last outcome, [s]."""
        return self._ends[-1] - self.start

    @property
    def speed(self) -> float | None:
        """Logs per second of late; None before the first has come."""
        spent = self._ends[-1] - self._ends[0]
        return (len(self._ends) - 1) / spent if spent > 0.0 else None

    @property
    def left(self) -> float | None:
        """Time until all have come, [s], if it goes on like this; None if nothing tells."""
        speed = self.speed
        if speed is None:
            return None
        return max((self.total - self.done) / speed - (self._clock() - self._ends[-1]), 0.0)


def _row(outcome: "Outcome", measure: Measure) -> LogRow:
    name = shown(outcome.job.name)
    if outcome.record is None:
        reason = outcome.failure.reason if outcome.failure else "no result"
        return LogRow(name, 0.0, _reason(reason, outcome.job.label), True, False, outcome.seconds)
    badness, text = measure(outcome.record)
    return LogRow(name, badness, shown(text), False, outcome.kept, outcome.seconds)


def _reason(reason: str, source: str) -> str:
    """The first of its lines, with the log's name in it."""
    first, *more = reason.strip().split("\n")
    named = first if source in first or shown(source) in first else f"{source}: {first}"
    return shown(named) + (f" (and {len(more)} more faults)" if more else "")


def shown(text: str) -> str:
    """A text on one line of bearable length that no terminal takes for commands."""
    from modrob_cli.errors import printable

    text = printable(text)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 2]}.."


def counts(tally: Tally) -> list[str]:
    """How many failed, were kept, and which is the worst."""
    found = [f"{number} {what}" for number, what in ((tally.failed, "failed"), (tally.kept, "kept")) if number]
    if tally.worst is not None:
        found.append(f"worst so far {short_name(tally.worst.name)}: {tally.worst.text}")
    return found


def worst_first(rows: Sequence[LogRow]) -> list[LogRow]:
    """Rows of the logs that did not fail, the worst first, then by name."""
    return sorted((row for row in rows if not row.failed), key=lambda row: (-_rank(row), row.name))


def _rank(row: LogRow) -> float:
    return math.inf if math.isnan(row.badness) else row.badness


def duration(seconds: float) -> str:
    """Time as people read it: 0.42 s, 12 s, 3:07, 1:02:03."""
    if seconds < 60.0:
        return f"{seconds:.2g} s" if seconds < 9.95 else f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def per_second(speed: float | None) -> str:
    """Speed as people read it: 23.4 logs/s, or logs/min if there is less than one in a second."""
    if speed is None:
        return "- logs/s"
    return f"{speed:.3g} logs/s" if speed >= 1.0 else f"{60.0 * speed:.3g} logs/min"


def short_name(name: str) -> str:
    """A name that leaves room for other columns; the ends of names tell logs apart."""
    return name if len(name) <= _WIDTH else f"{name[:12]}..{name[14 - _WIDTH :]}"
