"""Runs that are looked at stretch by stretch, so that memory does not grow with their length."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.workflows.collision_runs import CollisionRun

STRETCH = 32_768
"""Samples that are judged at once: a hundred bytes each in a few dozen arrays."""

Stretches = Callable[[], Iterator[CollisionRun]]
"""Makes the stretches of a run in their order, each time from the start; all but the last are of whole cells (see
:func:`modrob_cli.collision.bands.state_widths`)."""


@dataclass(frozen=True)
class Survey:
    """What has to be known of a whole run before its first stretch is judged; n joints.

    Attributes
    ----------
    samples, used : number of samples, and of those that count
    start, end : times of the first and last sample, [s]
    most_ddq : largest abs(ddq), shape (n,)
    least_rad, most_rad, mean_rad : of the half-width of ddq over the samples, shape (n,)
    """

    samples: int
    used: int
    start: float
    end: float
    most_ddq: Array
    least_rad: Array
    most_rad: Array
    mean_rad: Array


@dataclass(frozen=True)
class RunStream:
    """One log or planned motion.

    Attributes
    ----------
    about : its first stretch; whatever is not a series of samples counts for all of it
    """

    about: CollisionRun
    survey: Survey
    make: Stretches

    def stretches(self) -> Iterator[CollisionRun]:
        """The stretches in their order, from the start."""
        for run in self.make():
            yield replace(run, motion=replace(run.motion, least=self.survey.least_rad))


def stream_of(run: CollisionRun, stretch: int = STRETCH) -> RunStream:
    """A run that is in memory."""
    run = replace(run, motion=replace(run.motion, step=run.motion.median_step))
    return survey_stream(partial(_cut, run, stretch))


def survey_stream(make: Stretches) -> RunStream:
    """Go through a run once, to know what its stretches have in common."""
    samples = used = 0
    about: CollisionRun | None = None
    start = end = 0.0
    most_ddq = most = total = np.zeros(1)
    least = np.full(1, np.inf)
    for run in make():
        motion = run.motion
        if about is None:
            about, start = run, float(motion.t[0])
        samples, used, end = samples + len(motion.t), used + int(np.count_nonzero(run.used)), float(motion.t[-1])
        most_ddq = np.maximum(most_ddq, np.abs(motion.ddq).max(axis=0))
        rad = np.broadcast_to(motion.ddq_rad, motion.ddq.shape)
        least, most = np.minimum(least, rad.min(axis=0)), np.maximum(most, rad.max(axis=0))
        total = total + rad.sum(axis=0)
    if about is None:
        raise ValueError("a run without samples")
    return RunStream(about, Survey(samples, used, start, end, most_ddq, least, most, total / samples), make)


def whole_cells(stretch: int, cell: int) -> int:
    """Length of stretches, [samples]: about ``stretch``, and whole cells."""
    return max(stretch // cell, 1) * cell


def _cut(run: CollisionRun, stretch: int) -> Iterator[CollisionRun]:
    size = whole_cells(stretch, run.motion.cell)
    for first in range(0, len(run.motion.t), size):
        yield run.part(first, first + size)
