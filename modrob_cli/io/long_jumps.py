"""Whether several publishers share a topic, found piece by piece; see :mod:`modrob_cli.io.joint_publishers`."""

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.io.joint_publishers import OVERLAP, compare_runs, describe_jumps, too_many


class JumpCounter:
    """Jumps between neighbouring runs of messages, of which the last two are remembered; n joints.

    Attributes
    ----------
    found, total : jumps to and fro, and all jumps
    example : number of the first message of the first run that jumps to and fro, and positions before, at and after it
    """

    def __init__(self, n: int) -> None:
        self.found = self.total = 0
        self.example: tuple[int, Array] | None = None
        self._runs = np.empty((3, 0, n))
        self._starts = np.empty(0, dtype=np.intp)

    def add(self, starts: Indices, first: Array, second: Array, last: Array) -> None:
        """Take the next runs.

        Parameters
        ----------
        starts : numbers of their first messages, shape (R,)
        first, last : positions in their first and last message, shape (R, n)
        second : positions in the message behind the first one, even if that is of the next run
        """
        known = self._runs.shape[1]
        runs = np.concatenate([self._runs, np.stack([first, second, last])], axis=1)
        starts = np.concatenate([self._starts, starts])
        if runs.shape[1] >= 2:
            away, jumped = compare_runs(runs[0], runs[2])
            self.total += int(np.count_nonzero(jumped[max(known - 1, 0) :]))
            self.found += int(np.count_nonzero(away))
            if self.example is None and away.any():
                k = int(np.argmax(away)) + 1
                self.example = int(starts[k]), np.stack([runs[2, k - 1], runs[0, k], runs[1, k]])
        self._runs, self._starts = runs[:, -2:], starts[-2:]


class PublisherCheck:
    """Positions in the order of the file, compared with their neighbours; and when each channel spoke.

    Attributes
    ----------
    messages : that were compared
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self.messages = 0
        self._single, self._taken_turns = JumpCounter(len(names)), JumpCounter(len(names))
        self._q = np.empty((0, len(names)))  # the run that has not ended, and the last message
        self._owner = np.empty(0, dtype=np.intp)
        self._run = np.empty((3, len(names)))  # first, second and last message of the run that has not ended
        self._run_start = -1
        self._spans: dict[int, tuple[int, int]] = {}

    def add(self, q: Array, owner: Indices, channels: Indices) -> None:
        """Take the next messages: positions (N, n), number of the source (N,), channel of each source (S,)."""
        first = self.messages - len(self._q)
        q, owner = np.concatenate([self._q, q]), np.concatenate([self._owner, owner])
        spoken = channels[owner]
        for channel in np.unique(spoken).tolist():
            at = first + np.flatnonzero(spoken == channel)
            self._spans[channel] = self._spans.get(channel, (int(at[0]), 0))[0], int(at[-1])
        self.messages = first + len(q)
        if len(q) < 2:
            self._q, self._owner = q, owner
            return
        # The last message waits for the one behind it.
        self._single.add(np.arange(first, self.messages - 1), q[:-1], q[1:], q[:-1])
        self._add_runs(first, q, owner)
        self._q, self._owner = q[-1:], owner[-1:]

    def _add_runs(self, first: int, q: Array, owner: Indices) -> None:
        """Take the runs that end in these messages, the first of which was the last one before."""
        ends = np.flatnonzero(np.diff(owner))  # last messages of runs
        if self._run_start in (-1, first):
            self._run_start, self._run[0], self._run[1] = first, q[0], q[1]
        if not len(ends):
            return
        starts = np.append(0, ends[:-1] + 1)
        opening, second, numbers = q[starts], q[starts + 1], first + starts
        opening[0], second[0], numbers[0] = self._run[0], self._run[1], self._run_start
        self._taken_turns.add(numbers, opening, second, q[ends])
        after = int(ends[-1]) + 1
        self._run_start, self._run[0] = first + after, q[after]
        self._run[1] = q[min(after + 1, len(q) - 1)]  # if there is none yet, it comes with the next messages

    def conflict(self) -> str:
        """Why the messages cannot come from one publisher; "" if they can."""
        spans = sorted(self._spans.values())
        if any(after[0] <= before[1] for before, after in zip(spans[:-1], spans[1:], strict=True)):
            return OVERLAP
        if len(self._q):
            last = np.array([self.messages - 1])
            self._single.add(last, self._q, self._q, self._q)
            start, opening, second = self._run_start, self._run[:1], self._run[1:2]
            if start >= 0:
                self._taken_turns.add(np.array([start]), opening, second, self._q)
            self._q = self._q[:0]
        for jumps in (self._single, self._taken_turns):
            if jumps.example is not None and too_many(jumps.found, jumps.total, self.messages):
                k, around = jumps.example
                return describe_jumps(self.names, around, k, jumps.found, self.messages)
        return ""
