"""Samples put in the order of their times piece by piece, by the rules of :mod:`modrob_cli.io.joint_assembly`."""

import numpy as np

from modrob_cli.io.joint_assembly import SORTED_STEP, check_header_times, goes_back, left_out, stray, was_sorted
from modrob_cli.io.joint_batch import NO_STAMP
from modrob_cli.io.long_store import Rows, row_type
from modrob_cli.model.log import TimeSource


class StrayFilter:
    """Leaves out single messages whose times are far from those around them.

    Attributes
    ----------
    left : messages that were left out
    """

    def __init__(self, n: int) -> None:
        self.left = 0
        self._held: Rows = np.empty(0, dtype=row_type(n))
        self._decided = 0  # of those held, from the first on

    def add(self, rows: Rows, last: bool) -> Rows:
        """Take rows in the order of the file; returns those that are known to be good."""
        held = np.concatenate([self._held, rows])
        if len(held) < 3 and not last:
            self._held = held
            return held[:0]
        end = len(held) if last else len(held) - 1
        decided = slice(self._decided, end)
        bad = stray(held["time"])[decided]
        self.left += int(np.count_nonzero(bad))
        self._held = held[max(end - 2, 0) :]
        self._decided = min(end, 2)
        return held[decided][~bad] if bad.any() else held[decided]


class TimeOrder:
    """Sorts rows that came a little late, and leaves out those whose time was there already.

    A row is given out once no later one can come before it: :data:`SORTED_STEP` after its time.

    Attributes
    ----------
    fault : why the rows cannot be put in order; "" if they can
    repeated : rows that were left out because their time was there already
    """

    def __init__(self, n: int, time: TimeSource) -> None:
        self.time = time
        self.fault = ""
        self.repeated = 0
        self._messages = self._known = 0
        self._nonzero = False
        self._strays = StrayFilter(n)
        self._ordered = self._late = self._worst = 0
        self._newest = self._given = NO_STAMP
        self._pending: Rows = np.empty(0, dtype=row_type(n))

    def add(self, rows: Rows, last: bool = False) -> Rows:
        """Take rows in the order of the file; returns the next ones in the order of time, none after a fault."""
        self._messages += len(rows)
        known = rows["time"] != NO_STAMP
        if not known.all():
            rows = rows[known]
        self._known += len(rows)
        self._nonzero |= bool(rows["time"].any())
        rows = self._strays.add(rows, last)
        self._look_back(rows)
        if self.fault:
            return rows[:0]
        return self._sort(rows, last)

    def _look_back(self, rows: Rows) -> None:
        """Find out how late rows are."""
        times = rows["time"]
        if not len(times):
            return
        newest = np.maximum(np.maximum.accumulate(times), self._newest)
        late = newest - times
        worst = int(late.max())
        if worst > SORTED_STEP and not self.fault:
            k = int(np.argmax(late > SORTED_STEP))
            self.fault = goes_back(int(late[k]), self._ordered + k, self.time)
        self._ordered += len(times)
        self._late += int(np.count_nonzero(late))
        self._worst = max(self._worst, worst)
        self._newest = int(newest[-1])

    def _sort(self, rows: Rows, last: bool) -> Rows:
        pending = np.concatenate([self._pending, rows])
        if not len(pending):
            return pending
        if np.any(np.diff(pending["time"]) < 0):
            pending = pending[np.argsort(pending["time"], kind="stable")]
        new = pending["time"] > np.append(self._given, pending["time"][:-1])
        if not new.all():
            self.repeated += int(np.count_nonzero(~new))
            pending = pending[new]
        count = len(pending) if last else int(np.searchsorted(pending["time"], self._newest - SORTED_STEP, "right"))
        if count:
            self._given = int(pending["time"][count - 1])
        # A copy, so that what is given out is not kept with the rest.
        self._pending = pending[count:].copy()
        return pending[:count]

    def notes(self) -> list[str]:
        """What was done, for people.

        Raises
        ------
        ValueError
            If there are no times, or they go back.
        """
        if self.time == "header":
            check_header_times(self._messages, self._known, self._nonzero)
        if self.fault:
            raise ValueError(self.fault)
        left = self._messages - self._known + self._strays.left
        out = [left_out(left)] if left else []
        return [*out, was_sorted(self._late, self._worst)] if self._worst else out
