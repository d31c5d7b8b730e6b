"""Signals of a log that is too long for memory: what is known of the whole log, and its motion piece by piece.

The pieces put one after the other are those that :func:`modrob_cli.identify.signals.prepare` gives of the whole log, up
to rounding: each is filtered with so many samples on either side that less than 1e-15 of the filter's memory is left
at its ends. Two figures are defined otherwise than for a log in memory, where a log is longer than a few minutes: the
spectrum is the average over more segments, and the limits of glitches come from every k-th sample.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError
from modrob_cli.identify.long_source import LongSource
from modrob_cli.identify.long_spectrum import SEGMENT, LongSpectrum
from modrob_cli.identify.long_steps import MOST_BINS, step_statistics
from modrob_cli.identify.signal_cutoff import cutoff_from, noise_floor, segment_length
from modrob_cli.identify.signal_glitches import difference, limits_from, repaired
from modrob_cli.identify.signals import (
    FEWEST_USED,
    MARGIN,
    Mask,
    checked_cutoff,
    filter_memory,
    filtered_motion,
    grid_size,
    resample,
    uneven,
    used_samples,
)
from modrob_cli.model.log import JointLog

STRETCH = 2**16
"""Samples that are worked on at once."""

SAMPLE = 2**18
"""Samples at most from which the limits of glitches are found."""

KNOTS = 100
"""Samples after which nothing is left of what a spline saw: each further one leaves less than half of it."""


@dataclass(frozen=True)
class Sizes:
    """How much is done at once; smaller for tests.

    Attributes
    ----------
    stretch, segment, sample : as the constants of these names
    bins : different steps that are told apart at once
    """

    stretch: int = STRETCH
    segment: int = SEGMENT
    sample: int = SAMPLE
    bins: int = MOST_BINS


@dataclass(frozen=True)
class Overview:
    """What is known of a whole log before it is filtered; n joints.

    Attributes
    ----------
    step, gap : usual and longest step between samples, [s];  resampled : whether they differ too much
    count : samples, after resampling
    limits : of glitches: of positions and velocities, shape (n,) each; None for velocities that were not recorded
    frequency, density : spectrum of the velocities as recorded, or else of the positions
    extent : range of the positions, shape (n,)
    """

    step: float
    gap: float
    resampled: bool
    count: int
    limits: tuple[Array, Array | None]
    frequency: Array
    density: Array
    extent: Array

    @property
    def rate(self) -> float:
        """Samples per second."""
        return 1.0 / self.step

    def choose_cutoff(self) -> float:
        """As :func:`modrob_cli.identify.signal_cutoff.choose_cutoff`, [Hz]."""
        derived = self.limits[1] is None
        return cutoff_from(self.frequency, self.density, self.rate, self.extent, derived).cutoff


def overview(source: LongSource, sizes: Sizes) -> Overview:
    """Look at a whole log twice for its times and once for its values.

    Raises
    ------
    NumericalError
        If it is too short for anything.
    """
    if source.count < FEWEST_USED:
        raise NumericalError(
            f"{source.name} has {source.count} samples, expected {FEWEST_USED} or more; use a longer log"
        )
    steps = step_statistics(source, 4 * sizes.stretch, sizes.bins)
    resampled = uneven(steps.shortest, steps.longest, steps.median)
    count = grid_size(source.duration, steps.median) if resampled else source.count
    n = source.piece(0, 1).q.shape[1]
    spectrum = LongSpectrum(1.0 / steps.median, min(sizes.segment, segment_length(source.count)), n)
    every = -(-source.count // sizes.sample)
    positions, velocities = _GlitchSample(every), _GlitchSample(every)
    low, high = np.asarray(np.inf), np.asarray(-np.inf)
    for first in range(0, source.count, sizes.stretch):
        # Two samples more on either side, so that every sample can be compared with its neighbours.
        begin = max(first - 2, 0)
        log = source.piece(begin, first + sizes.stretch + 2)
        core = slice(first - begin, first - begin + sizes.stretch)
        low, high = np.minimum(low, log.q[core].min(axis=0)), np.maximum(high, log.q[core].max(axis=0))
        positions.add(log.q, core)
        if log.dq is not None:
            velocities.add(log.dq, core)
        spectrum.add((log.q if log.dq is None else log.dq)[core])
    limits = positions.limits(), velocities.limits() if source.has_velocity else None
    return Overview(steps.median, steps.longest, resampled, count, limits, *spectrum.density(), high - low)


class _GlitchSample:
    """Every k-th sample of a signal, and its difference from what its neighbours let expect."""

    def __init__(self, every: int) -> None:
        self.every = every
        self._differences: list[Array] = []
        self._values: list[Array] = []

    def add(self, x: Array, core: slice) -> None:
        # Copies: a view would keep the whole piece.
        self._differences.append(difference(x)[:: self.every].copy())
        self._values.append(x[core][:: self.every].copy())

    def limits(self) -> Array:
        return limits_from(np.concatenate(self._differences), np.concatenate(self._values))


@dataclass(frozen=True)
class MotionPiece:
    """A stretch of a log, evenly sampled; N samples, n joints.

    Attributes
    ----------
    first : number of its first sample in the log
    t : times from the first sample of the log, shape (N,), [s]
    q, dq, ddq : low-passed positions and their derivatives, shape (N, n)
    raw : positions without glitches, not filtered, shape (N, n)
    effort : as recorded (interpolated where resampled), shape (N, n)
    used : as for :class:`modrob_cli.identify.signals.Signals`
    glitches : whether there was one in the samples that it was made from
    """

    first: int
    t: Array
    q: Array
    dq: Array
    ddq: Array
    raw: Array
    effort: Array
    used: Mask
    glitches: bool


class LongMotion:
    """The motion of a long log, low-passed, piece by piece.

    Parameters
    ----------
    cutoff : [Hz]; None: as for :func:`modrob_cli.identify.signals.prepare`

    Raises
    ------
    UsageError
        If the cut-off is not between 0 and half the sampling rate.
    """

    def __init__(self, source: LongSource, known: Overview, cutoff: float | None, sizes: Sizes) -> None:
        self.source = source
        self.known = known
        self.cutoff = checked_cutoff(source.name, cutoff, known.step)
        self.overlap = filter_memory(known.rate, self.cutoff) + KNOTS
        stretches = -(-known.count // max(sizes.stretch, 2 * self.overlap))
        self.stretch = -(-known.count // stretches)  # even ones: a short one at the end would judge by too little
        self.end = (known.count - 1) * known.step if known.resampled else source.duration

    def spans(self) -> Iterator[tuple[int, int]]:
        """First and last + 1 sample of all pieces, but those that lie in gaps as a whole."""
        first = 0
        while first < self.known.count:
            last = min(first + self.stretch, self.known.count)
            ahead = self._nothing_before(first, last)
            if ahead is None:
                yield first, last
                first = last
            else:
                first = max(last, ahead // self.stretch * self.stretch)

    def pieces(self) -> Iterator[MotionPiece]:
        """All these pieces."""
        return (self.piece(first, last) for first, last in self.spans())

    def times(self) -> Iterator[tuple[Array, Mask]]:
        """Their times and which samples count, without the motion."""
        for first, last in self.spans():
            t = self._times(first, last)
            begin, end = self._recorded(t)
            recorded = self.source.times(begin, end)
            yield t, used_samples(t, (0.0, self.end), recorded, self.known.step, self.cutoff)

    def _nothing_before(self, first: int, last: int) -> int | None:
        """If nothing was recorded between these samples or near them: the first sample that is near something again."""
        if not self.known.resampled:
            return None
        step, source = self.known.step, self.source
        number = source.find((first - self.overlap) * step)
        if number >= source.count:
            return None
        time = source.times(number, number + 1)[0]
        return int(time / step) - self.overlap if time >= (last + self.overlap) * step else None

    def number(self, t: float) -> int:
        """Number of samples before the time t [s]; more than there are for one behind the end."""
        if not self.known.resampled:
            return self.source.find(t)
        guess = int(min(t / self.known.step, self.known.count))
        times = self._times(max(guess - 2, 0), guess + 3)
        return max(guess - 2, 0) + int(np.searchsorted(times, t))

    def piece(self, first: int, last: int) -> MotionPiece:
        """The samples first <= k < last."""
        begin, end = max(first - self.overlap, 0), min(last + self.overlap, self.known.count)
        log, t, glitches = self._read(begin, end)
        q, dq, effort = resample(log, t) if self.known.resampled else (log.q, log.dq, log.effort)
        core = slice(first - begin, last - begin)
        motion = filtered_motion(t, q, dq, self.known.rate, self.cutoff, core)
        used = used_samples(t[core], (0.0, self.end), log.t, self.known.step, self.cutoff)
        return MotionPiece(first, t[core], *motion, q[core], effort[core], used, glitches)

    def _times(self, first: int, last: int) -> Array:
        if self.known.resampled:
            return np.arange(first, last, dtype=float) * self.known.step
        return self.source.times(first, last)

    def _recorded(self, t: Array) -> tuple[int, int]:
        """First and last + 1 of the samples as recorded that matter between these times."""
        margin = MARGIN / self.cutoff
        return self.source.find(t[0] - margin) - KNOTS, self.source.find(t[-1] + margin) + KNOTS

    def _read(self, begin: int, end: int) -> tuple[JointLog, Array, bool]:
        """What was recorded around these samples without glitches, their times, whether there was a glitch."""
        t = self._times(begin, end)
        log = self.source.piece(*(self._recorded(t) if self.known.resampled else (begin, end)))
        log, glitches = without_wild(log, self.known.limits)
        return log, t, glitches > 0


def without_wild(log: JointLog, limits: tuple[Array, Array | None]) -> tuple[JointLog, int]:
    """A piece of a log without glitches, and how many there were."""
    q, places = repaired(log.q, limits[0])
    dq, count = log.dq, len(places)
    if log.dq is not None and limits[1] is not None:
        dq, places = repaired(log.dq, limits[1])
        count += len(places)
    return (replace(log, q=q, dq=dq), count) if count else (log, 0)


def repaired_floor(source: LongSource, known: Overview, sizes: Sizes, glitches: bool) -> Array:
    """Noise floor of what was recorded, without glitches if there are any, shape (n,)."""
    frequency, density = known.frequency, known.density
    if glitches:
        spectrum = LongSpectrum(known.rate, min(sizes.segment, segment_length(source.count)), len(known.extent))
        for first in range(0, source.count, sizes.stretch):
            begin = max(first - KNOTS, 0)
            log, _ = without_wild(source.piece(begin, first + sizes.stretch + KNOTS), known.limits)
            x = log.q if log.dq is None else log.dq
            spectrum.add(x[first - begin : first - begin + sizes.stretch])
        frequency, density = spectrum.density()
    return noise_floor(frequency, density, known.rate)
