"""From the messages of a topic to samples: times that increase, every joint in every sample."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.joint_batch import NO_STAMP
from modrob_cli.io.joint_series import JointTable
from modrob_cli.model.log import TimeSource

SORTED_STEP = 100_000_000
"""Stamps that go back by this [ns] at most are sorted: messages overtook one another on their way."""
LONGEST_GAP = 3
"""Between two messages about a joint values are interpolated if they are this many usual steps apart at most."""

Mask = NDArray[np.bool_]


@dataclass
class Samples:
    """Samples in the order of their times.

    Attributes
    ----------
    stamps : strictly increasing, shape (N,), [ns]
    values : positions, velocities, efforts, shape (3, N, n); NaN where there is none
    repeated : messages (or parts of them) that were left out because their time had come before
    notes : what was done, in words
    """

    stamps: Stamps
    values: Array
    repeated: int = 0
    notes: list[str] = field(default_factory=list)


def times_of(table: JointTable, time: TimeSource) -> Stamps:
    """Times of the messages that count, shape (M,), [ns]; some may be :data:`NO_STAMP`.

    Raises
    ------
    ValueError
        If header stamps are wanted and not there.
    """
    if time == "log":
        return table.log_times
    known = table.stamps[table.stamps != NO_STAMP]
    check_header_times(len(table.stamps), len(known), bool(known.any()))
    return table.stamps


def check_header_times(messages: int, known: int, nonzero: bool) -> None:
    """Refuse header stamps most of which are missing, or that are all zero.

    Raises
    ------
    ValueError
        If so.
    """
    if 2 * known < messages:
        found = f"{messages - known} of {messages} messages have no time stamp"
        raise ValueError(f"{found}; take the times of the recorder: --time log")
    if not nonzero:
        raise ValueError("all header stamps are 0; take the times of the recorder: --time log")


def put_in_order(table: JointTable, time: TimeSource) -> tuple[JointTable, Stamps, list[str]]:
    """Leave out messages with impossible times, and sort those that came a little late.

    Raises
    ------
    ValueError
        If times go back by more than :data:`SORTED_STEP`, or header stamps are not there.
    """
    times, notes = times_of(table, time), []
    known = np.flatnonzero(times != NO_STAMP)
    kept = known[~stray(times[known])]
    if len(kept) < len(times):
        notes.append(left_out(len(times) - len(kept)))
        table, times = table.pick(kept), times[kept]
    late = np.maximum.accumulate(times) - times
    worst = int(late.max(initial=0))
    if worst > SORTED_STEP:
        k = int(np.argmax(late > SORTED_STEP))
        raise ValueError(goes_back(int(late[k]), k, time))
    if worst:
        order = np.argsort(times, kind="stable")
        table, times = table.pick(order), times[order]
        notes.append(was_sorted(int(np.count_nonzero(late)), worst))
    return table, times, notes


def left_out(count: int) -> str:
    """A note on messages with impossible times."""
    return f"{count} messages have no time or one far from their neighbours' and were left out"


def was_sorted(count: int, worst: int) -> str:
    """A note on messages that came late, by ``worst`` [ns] at most."""
    return f"sorted by time: {count} messages came after a later one, by {worst / 1e9:.3g} s at most"


def goes_back(late: int, k: int, time: TimeSource) -> str:
    """What is wrong with message k, which is ``late`` [ns]."""
    advice = ", or take the times of the recorder: --time log" if time == "header" else ""
    return (
        f"time goes back by {late / 1e9:.6g} s after message {k}: a clock that was set, a recording that was "
        f"started again, or two publishers; cut the file there{advice}"
    )


def stray(times: Stamps) -> Mask:
    """Single messages whose times are far from those before and after, which are in order: damaged stamps."""
    out = np.zeros(len(times), dtype=bool)
    if len(times) < 3:
        return out
    before, now, after = times[:-2], times[1:-1], times[2:]
    out[1:-1] = (before <= after) & ((now > after + SORTED_STEP) | (now < before - SORTED_STEP))
    out[0] = times[0] > times[1] + SORTED_STEP and times[1] <= times[2]
    out[-1] = times[-1] < times[-2] - SORTED_STEP and times[-3] <= times[-2]
    return out


def assemble(table: JointTable, times: Stamps) -> Samples:
    """Samples with all joints, from messages in the order of their times (M,).

    Raises
    ------
    ValueError
        If no sample has all joints.
    """
    if table.has.all():
        first = np.append(True, np.diff(times) > 0)
        kept = np.flatnonzero(first)
        values = table.values if first.all() else table.values[:, kept]
        return Samples(times[kept], values, len(times) - len(kept))
    merged, has = _merge(table, times)
    whole = np.flatnonzero(has.all(axis=1))
    slowest = int(np.argmin(has.sum(axis=0)))
    if 2 * len(whole) > np.count_nonzero(has[:, slowest]):
        left = len(merged.stamps) - len(whole)
        note = f"joints are spread over several messages; {left} times at which some were missing were left out"
        notes = [note] if left else []
        return Samples(merged.stamps[whole], merged.values[:, whole], merged.repeated, notes)
    return _interpolate(table.names, merged, has, np.flatnonzero(has[:, slowest]))


def _merge(table: JointTable, times: Stamps) -> tuple[Samples, Mask]:
    """Put messages of one time together; and which joints each time has, shape (U, n)."""
    unique, inverse = np.unique(times, return_inverse=True)
    n = len(table.names)
    values = np.full((3, len(unique), n), np.nan)
    has = np.zeros((len(unique), n), dtype=bool)
    repeated = 0
    message_has = table.has[table.owner]
    for j in range(n):
        rows = np.flatnonzero(message_has[:, j])
        at, first = np.unique(inverse[rows], return_index=True)
        values[:, at, j] = table.values[:, rows[first], j]
        has[at, j] = True
        repeated = max(repeated, len(rows) - len(at))
    return Samples(unique, values, repeated), has


def _interpolate(names: tuple[str, ...], merged: Samples, has: Mask, base: Indices) -> Samples:
    """Values at the times ``base`` of the joints with the fewest messages; straight lines between messages."""
    times = merged.stamps[base]
    values = merged.values[:, base].copy()
    good = np.ones(len(base), dtype=bool)
    farthest = 0
    for j in range(len(names)):
        if has[base, j].all():
            continue
        rows = np.flatnonzero(has[:, j])
        known, found = merged.stamps[rows], merged.values[:, rows, j]
        after = np.clip(np.searchsorted(known, times), 1, max(len(known) - 1, 1))
        if len(known) < 2:
            raise ValueError(f"found {len(known)} message about {names[j]}")
        before = after - 1
        gap = known[after] - known[before]
        inside = (times >= known[before]) & (times <= known[after])
        good &= inside & (gap <= LONGEST_GAP * np.median(np.diff(known)))
        share = (times - known[before]) / gap
        values[:, :, j] = found[:, before] * (1.0 - share) + found[:, after] * share
        near = np.minimum(np.abs(times - known[before]), np.abs(times - known[after]))
        farthest = max(farthest, int(near[good].max(initial=0)))
    if not good.any():
        raise ValueError("no two messages about the different joints are near each other in time")
    slowest = ", ".join(names[j] for j in np.flatnonzero(has[base].all(axis=0))[:6])
    note = (
        "joints are spread over messages of different times: interpolated along straight lines to the times of "
        f"{slowest}, {farthest / 1e9:.3g} s from the nearest message at most; {len(base) - int(good.sum())} times were "
        "left out"
    )
    return Samples(times[good], values[:, good], merged.repeated, [note])
