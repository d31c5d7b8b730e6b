"""Whether several publishers share a topic.

Two of them that send the state of the same joints make a log that jumps to and fro. They are told apart by what their
messages have in common (channel, order of the joints, frame, quantities); if nothing differs, the jumps give them away.
"""

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices
from modrob_cli.io.joint_batch import Source
from modrob_cli.io.joint_series import JointTable

JUMP = 0.02
"""Smallest jump that counts, [rad] or [m]."""
RETURN = 0.1
"""Positions have come back if they differ by less than this share of the jump from those before it, in all joints."""
LEAST, SHARE = 5, 0.005
"""Number and share of messages from which on jumps mean another publisher; fewer are glitches of a sensor."""
EXPLAINED = 0.4
"""Share of all jumps that must be there-and-back (two jumps each, or one each where messages alternate); else the
positions are just noisy."""

OVERLAP = "two publishers send the same joints at the same time"
"""Why two channels contradict one another."""

_BLOCK = 100_000
"""Runs that are compared at once; bounds the memory."""


def jumps(q: Array, first: Indices, last: Indices) -> tuple[Indices, int]:
    """Runs of messages whose positions jump away from those of the runs before and after, which agree.

    Parameters
    ----------
    q : positions, shape (M, n)
    first, last : first and last message of each run, shape (R,)

    Returns
    -------
    found : first messages of such runs
    total : number of all jumps between neighbouring runs
    """
    found, total = [np.empty(0, dtype=np.intp)], 0
    for begin in range(0, len(first) - 2, _BLOCK):
        begins, ends = first[begin : begin + _BLOCK + 2], last[begin : begin + _BLOCK + 2]
        away, jumped = compare_runs(q[begins], q[ends])
        found.append(begins[1:-1][away])
        total += int(np.count_nonzero(jumped[:_BLOCK]))
    return np.concatenate(found), total


def compare_runs(first: Array, last: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which of R runs jump away from their neighbours, which agree; and between which neighbours there is a jump.

    Parameters
    ----------
    first, last : positions in the first and last message of each run, shape (R, n), R >= 2

    Returns
    -------
    away : shape (R - 2,), of all runs but the first and the last one
    jumped : shape (R - 1,)
    """
    steps = np.abs(first[1:] - last[:-1])
    if not np.any(steps > JUMP):  # as in most logs, and found out in a fraction of the time
        return np.zeros(len(steps) - 1, dtype=bool), np.zeros(len(steps), dtype=bool)
    # fmax passes over NaN: a joint without a position says nothing.
    step = np.fmax.reduce(steps, axis=1)
    across = np.fmax.reduce(np.abs(first[2:] - last[:-2]), axis=1)
    away = np.minimum(step[:-1], step[1:])
    return (away > JUMP) & (across < RETURN * away), step > JUMP


def too_many(found: int, total: int, messages: int) -> bool:
    """Whether so many jumps to and fro among all jumps and messages mean another publisher."""
    return found >= max(LEAST, SHARE * messages, EXPLAINED * total)


def conflict(table: JointTable) -> str:
    """Why the messages cannot come from one publisher; "" if they can.

    Messages are compared with their neighbours; where sources take turns, so are runs of messages of one source.
    """
    if _channels_that_overlap(table):
        return OVERLAP
    if not table.has.all():
        return ""
    q = table.values[0]
    single = np.arange(len(q), dtype=np.intp)
    starts = np.flatnonzero(np.diff(table.owner, prepend=-1))
    for first, last in ((single, single), (starts, np.append(starts[1:], len(q)) - 1)):
        found, total = jumps(q, first, last)
        if too_many(len(found), total, len(q)):
            k = int(found[0])
            return describe_jumps(table.names, q[k - 1 : k + 2], k, len(found), len(q))
    return ""


def describe_jumps(names: tuple[str, ...], q: Array, k: int, found: int, messages: int) -> str:
    """Describe the jumps by the first one, at message k; ``q`` (3, n) is before, at and after it."""
    joint = int(np.nanargmax(np.abs(q[1] - q[0])))
    values = " -> ".join(f"{value:.4g}" for value in q[:, joint])
    text = f"the positions jump to and fro at {found} of {messages} messages"
    return f"{text} (first at message {k + 1}, {names[joint]}: {values}): two publishers on one topic"


def _channels_that_overlap(table: JointTable) -> bool:
    """Whether two channels tell about the same joint over a common time."""
    channels = np.array([source.channel for source in table.sources])[table.owner]
    numbers = np.unique(channels)
    if len(numbers) < 2:
        return False
    rows = [np.flatnonzero(channels == number) for number in numbers]
    joints = [table.has[np.unique(table.owner[part])].any(axis=0) for part in rows]
    for a in range(len(numbers)):
        for b in range(a + 1, len(numbers)):
            apart = rows[a][-1] < rows[b][0] or rows[b][-1] < rows[a][0]
            if not apart and np.any(joints[a] & joints[b]):
                return True
    return False


def describe(numbers: dict[Source, int], counts: dict[Source, int]) -> str:
    """List publishers by number, with what tells them apart and how many messages they sent."""
    lines = []
    for source, count in list(counts.items())[:8]:
        parts = [f"channel {source.channel}"]
        if source.frame:
            parts.append(f"frame {source.frame!r}")
        parts += ["+".join(source.recorded) or "no values", f"joints {', '.join(source.names[:12])}"]
        lines.append(f"{numbers[source]} ({count} messages; {'; '.join(parts)})")
    more = f" and {len(counts) - 8} more" if len(counts) > 8 else ""
    return "; ".join(lines) + more
