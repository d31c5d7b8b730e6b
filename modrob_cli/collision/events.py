"""Where a measured torque leaves its band: events, and what they are worth against known contacts."""

from collections.abc import Sequence
from dataclasses import dataclass
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


def find_events(t: Array, excess: Array, rules: Rules) -> list[Event]:
    """Events in the order of their starts.

    Parameters
    ----------
    t : shape (N,);  excess : signed distance from the band, 0 inside, shape (N, n)
    """
    events = []
    for joint in range(excess.shape[1]):
        for side, beyond in (("lower", -excess[:, joint]), ("upper", excess[:, joint])):
            for first, last in _stretches(t, beyond > 0.0, rules.merge):
                if t[last] - t[first] < rules.shortest:
                    continue
                peak = first + int(beyond[first : last + 1].argmax())
                ends = (float(t[first]), float(t[last]))
                kind: Side = "lower" if side == "lower" else "upper"
                events.append(Event(*ends, joint, kind, float(beyond[peak]), float(t[peak])))
    return sorted(events, key=lambda event: (event.start, event.joint))


def _stretches(t: Array, outside: Mask, merge: float) -> list[tuple[int, int]]:
    """First and last sample of runs that are outside; runs closer than ``merge`` are one."""
    where = np.flatnonzero(outside)
    if not len(where):
        return []
    breaks = np.flatnonzero((np.diff(where) > 1) & (np.diff(t[where]) > merge))
    firsts = where[np.concatenate([[0], breaks + 1])]
    lasts = where[np.concatenate([breaks, [len(where) - 1]])]
    return list(zip(firsts.tolist(), lasts.tolist(), strict=True))


def score(t: Array, excess: Array, events: Sequence[Event], contacts: Sequence[Contact], settle: float) -> Score:
    """Compare events with known contacts.

    Parameters
    ----------
    settle : time behind a contact in which the filter and the controller still answer to it, [s]
    """
    free = np.ones(len(t), dtype=bool)
    for contact in contacts:
        free &= (t < contact.start) | (t >= contact.end + settle)
    alarms = sum(
        all(not contact.start <= event.start < contact.end + settle for contact in contacts) for event in events
    )
    outside = (excess[free] != 0.0).any(axis=1)
    delays = tuple(_delay(events, contact, settle) for contact in contacts)
    return Score(alarms, float(outside.mean()) if len(outside) else 0.0, delays)


def _delay(events: Sequence[Event], contact: Contact, settle: float) -> float | None:
    """Time to the first event of a contact; an event that is under way when it starts does not count as found."""
    starts = [event.start for event in events if contact.start <= event.start < contact.end + settle]
    return min(starts) - contact.start if starts else None
