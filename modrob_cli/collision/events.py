"""Where a measured torque leaves its band: events, and what they are worth against known contacts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array

Mask = NDArray[np.bool_]
Side = Literal["lower", "upper"]


@dataclass(frozen=True)
class Band:
    """A filtered measurement and its filtered band, shape (N, n) each, [N m] or [N]; ``t``: shape (N,), [s].

    ``middle`` is the filtered nominal torque, c0 of [S] (26).
    """

    t: Array
    measured: Array
    lower: Array
    upper: Array
    middle: Array

    @property
    def excess(self) -> Array:
        """How far the measurement is above the upper end (positive) or below the lower one (negative), shape (N, n)."""
        above = np.maximum(self.measured - self.upper, 0.0)
        return np.asarray(above - np.maximum(self.lower - self.measured, 0.0))

    @property
    def residual(self) -> Array:
        """Residual r = c_m - c0 of [S] (25)."""
        return self.measured - self.middle


@dataclass(frozen=True)
class Rules:
    """What counts as one event.

    Attributes
    ----------
    merge : stretches of one joint and side that are closer than this are one event, [s]
    shortest : events shorter than this do not count, [s]
    """

    merge: float = 0.05
    shortest: float = 0.0


@dataclass(frozen=True)
class Event:
    """One joint outside its band on one side.

    Attributes
    ----------
    start, end : first and last sample outside, [s]
    joint : index
    peak : largest distance from the band, [N m] or [N];  peak_time : where, [s]
    """

    start: float
    end: float
    joint: int
    side: Side
    peak: float
    peak_time: float


@dataclass(frozen=True)
class Contact:
    """A known contact, start <= t < end, [s]."""

    name: str
    start: float
    end: float


@dataclass(frozen=True)
class Score:
    """Events against known contacts.

    Attributes
    ----------
    false_alarms : events that begin outside every contact and the time that the arm needs to settle behind it
    false_samples : part of the samples outside contacts and settling with any joint outside its band
    delays : for each contact the time from its start to the first event in it, [s]; None where there is none
    """

    false_alarms: int
    false_samples: float
    delays: tuple[float | None, ...]

    @property
    def detected(self) -> int:
        """Contacts that were found."""
        return sum(delay is not None for delay in self.delays)


class EventFinder:
    """Finds the events of one run, whose samples come piece by piece."""

    def __init__(self, rules: Rules) -> None:
        self._rules = rules
        self._found: dict[tuple[int, Side], list[Event]] = {}
        self._last: dict[tuple[int, Side], int] = {}
        self._count = 0

    def add(self, t: Array, excess: Array) -> None:
        """Take the next samples.

        Parameters
        ----------
        t : shape (N,);  excess : signed distance from the band, 0 inside, shape (N, n)
        """
        sides: tuple[tuple[Side, float], ...] = (("lower", -1.0), ("upper", 1.0))
        for joint in np.flatnonzero((excess != 0.0).any(axis=0)).tolist():
            for side, sign in sides:
                beyond = sign * excess[:, joint]
                for first, last in _stretches(t, beyond > 0.0, self._rules.merge):
                    peak = first + int(beyond[first : last + 1].argmax())
                    times = float(t[first]), float(t[last])
                    self._put(Event(*times, joint, side, float(beyond[peak]), float(t[peak])), first, last)
        self._count += len(t)

    def _put(self, event: Event, first: int, last: int) -> None:
        """Join an event with the one before it, if they are one, or begin a new one."""
        key = event.joint, event.side
        before = self._found.setdefault(key, [])
        near = before and (
            self._count + first - self._last[key] <= 1 or event.start - before[-1].end <= self._rules.merge
        )
        if near:
            peak = event if event.peak > before[-1].peak else before[-1]
            event = replace(before[-1], end=event.end, peak=peak.peak, peak_time=peak.peak_time)
        if before and (near or not self._counts(before[-1])):
            before.pop()
        before.append(event)
        self._last[key] = self._count + last

    def _counts(self, event: Event) -> bool:
        return event.end - event.start >= self._rules.shortest

    @property
    def events(self) -> list[Event]:
        """All events up to now in the order of their starts."""
        found = [event for events in self._found.values() for event in events if self._counts(event)]
        return sorted(found, key=lambda event: (event.start, event.joint, event.side))


def find_events(t: Array, excess: Array, rules: Rules) -> list[Event]:
    """Events in the order of their starts.

    Parameters
    ----------
    t : shape (N,);  excess : signed distance from the band, 0 inside, shape (N, n)
    """
    finder = EventFinder(rules)
    finder.add(t, excess)
    return finder.events


def _stretches(t: Array, outside: Mask, merge: float) -> list[tuple[int, int]]:
    """First and last sample of runs that are outside; runs closer than ``merge`` are one."""
    where = np.flatnonzero(outside)
    if not len(where):
        return []
    breaks = np.flatnonzero((np.diff(where) > 1) & (np.diff(t[where]) > merge))
    firsts = where[np.concatenate([[0], breaks + 1])]
    lasts = where[np.concatenate([breaks, [len(where) - 1]])]
    return list(zip(firsts.tolist(), lasts.tolist(), strict=True))


class Scorer:
    """Compares with known contacts, samples coming piece by piece.

    Parameters
    ----------
    settle : time behind a contact in which the filter and the controller still answer to it, [s]
    """

    def __init__(self, contacts: Sequence[Contact], settle: float) -> None:
        self._contacts, self._settle = contacts, settle
        self._free = self._outside = 0

    def add(self, t: Array, excess: Array) -> None:
        """Take the next samples, as :meth:`EventFinder.add`."""
        free = np.ones(len(t), dtype=bool)
        for contact in self._contacts:
            free &= (t < contact.start) | (t >= contact.end + self._settle)
        self._free += int(np.count_nonzero(free))
        self._outside += int(np.count_nonzero((excess[free] != 0.0).any(axis=1)))

    def score(self, events: Sequence[Event]) -> Score:
        """What these events are worth."""
        alarms = sum(
            all(not contact.start <= event.start < contact.end + self._settle for contact in self._contacts)
            for event in events
        )
        delays = tuple(_delay(events, contact, self._settle) for contact in self._contacts)
        return Score(alarms, self._outside / self._free if self._free else 0.0, delays)


def score(t: Array, excess: Array, events: Sequence[Event], contacts: Sequence[Contact], settle: float) -> Score:
    """Compare events with known contacts; see :class:`Scorer`."""
    scorer = Scorer(contacts, settle)
    scorer.add(t, excess)
    return scorer.score(events)


def _delay(events: Sequence[Event], contact: Contact, settle: float) -> float | None:
    """Time to the first event of a contact; an event that is under way when it starts does not count as found."""
    starts = [event.start for event in events if contact.start <= event.start < contact.end + settle]
    return min(starts) - contact.start if starts else None
