"""What a picture of a log needs, kept while it is judged."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.collision.thinned import Thinned
from modrob_cli.identify.effort import effort_factors
from modrob_cli.plot.collision import CollisionPicture
from modrob_cli.workflows.collision_judge import JudgedRun, JudgedStretch
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_result import effort_unit
from modrob_cli.workflows.collision_stream import RunStream

MOST_BLOCKS = 20_000
"""A longer log is drawn by the extremes of so many runs of samples, several for each pixel."""
MOST_OUTSIDE = 4_000
"""Samples outside the band of each joint that are drawn one by one."""


class Drawing:
    """Collects the curves of one log, in bounded memory."""

    def __init__(self, stream: RunStream, options: CollisionOptions) -> None:
        self._options = options
        self._size = -(-stream.survey.samples // MOST_BLOCKS)
        self._factors = effort_factors(stream.about.robot, options.effort)
        self._parts: list[tuple[Array, ...]] = []
        self._outside = [Thinned(MOST_OUTSIDE) for _ in self._factors]

    def add(self, judged: JudgedStretch) -> None:
        """Take the next stretch."""
        band, other = judged.band, judged.other
        t, measured, lower, upper = band.t, band.measured / self._factors, band.lower, band.upper
        ends = [lower / self._factors, upper / self._factors]
        ends += [] if other is None else [other.lower / self._factors, other.upper / self._factors]
        for j, outside in enumerate(self._outside):
            beyond = judged.excess[:, j] != 0.0
            if beyond.any():
                outside.add(np.stack([t[beyond], measured[beyond, j]], axis=1))
        if self._size == 1:
            self._parts.append((t, measured, *ends))
            return
        starts = np.arange(0, len(t), self._size)
        low, high = (end.reduceat(measured, starts, axis=0) for end in (np.minimum, np.maximum))
        extremes = [(np.maximum if k % 2 else np.minimum).reduceat(end, starts, axis=0) for k, end in enumerate(ends)]
        # Two points for each run: its lowest measurement at its start, its highest in its middle.
        middles = np.minimum(starts + self._size // 2, len(t) - 1)
        times = np.stack([t[starts], t[middles]], axis=1).ravel()
        both = np.stack([low, high], axis=1).reshape(-1, low.shape[1])
        self._parts.append((times, both, *(np.repeat(end, 2, axis=0) for end in extremes)))

    def picture(self, judged: JudgedRun) -> CollisionPicture:
        """Bands over time in the unit of the log."""
        about, robot, options = judged.about, judged.about.robot, self._options
        t, measured, lower, upper, *wider = (np.concatenate(parts) for parts in zip(*self._parts, strict=True))
        names = ("exact band", "IANEA band")
        legends = ("measured, filtered", *(names if options.method == "exact" else names[::-1]))
        events = judged.methods[0].events if judged.methods else []
        nothing = np.zeros((0, 2))
        return CollisionPicture(
            f"{robot.name}: {about.name}",
            f"filter {options.filter}; acceleration {about.source}",
            t,
            None if about.tau is None else measured,
            lower,
            upper,
            (wider[0], wider[1]) if wider else None,
            robot.joint_names,
            tuple(effort_unit(robot, j, options) for j in range(robot.dof)),
            legends,
            [(event.start, event.end, event.joint) for event in events],
            [(contact.start, contact.end) for contact in about.contacts or ()],
            [outside.rows if outside.count else nothing for outside in self._outside],
        )
