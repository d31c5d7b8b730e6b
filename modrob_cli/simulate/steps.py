"""Single steps of the arm that end early where a joint stops or meets an end stop."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.simulate.forward_dynamics import ForwardDynamics, Load, Rates, runge_kutta

CLOSE = 1e-12
"""Events are located to this part of a step; shorter steps are not taken."""

_SEARCH = 50


@dataclass
class State:
    """Where the arm is; changed by :meth:`Plant.advance`.

    Attributes
    ----------
    t : [s];  q, dq : shape (n,)
    work : what motors, friction, disturbance and contacts have done since the start, [J]
    lost : energy lost in end stops since the start, [J]
    """

    t: float
    q: Array
    dq: Array
    work: float = 0.0
    lost: float = 0.0


class Stepper:
    """Steps of an arm with end stops at low and high, shape (n,), infinite where there is none.

    Events are numbered: reversals 0 .. n - 1, upper end stops from n on, lower end stops from 2 n on.
    """

    def __init__(self, dynamics: ForwardDynamics, low: Array, high: Array) -> None:
        self._dynamics = dynamics
        self._low, self._high = low, high
        self._has_stops = bool(np.isfinite(low).any() or np.isfinite(high).any())

    def step(self, state: State, load: Load, first: Rates, h: float) -> tuple[float, State, int | None]:
        """Step of h seconds or up to the first event: its length, the state there, the number of the event."""
        part, trial, event = h, self._at(state, load, first, h), None
        if not self._beyond(trial, load):
            return part, trial, event
        before = self._gaps(state, load)
        for _ in range(2 * len(before)):
            gaps = self._gaps(trial, load)
            if event is not None:
                gaps[event] = 0.0
            n = len(state.q)
            gaps[n:][(before[n:] <= 0.0) & np.tile(gaps[:n] < 0.0, 2)] = 0.0  # it left, and turns before it comes back
            late = np.flatnonzero(gaps < 0.0)
            if not len(late):
                break
            event = int(late[np.argmin(before[late] / (before[late] - gaps[late]))])
            ends = float(before[event]), float(gaps[event])
            part, trial = self._locate(state, load, first, part, event, ends)
        return part, trial, event

    def _at(self, state: State, load: Load, first: Rates, h: float) -> State:
        if len(load.held) == len(state.q):
            return State(state.t + h, state.q, state.dq)
        q, dq, work = runge_kutta(self._dynamics, state.t, state.q, state.dq, first, load, h)
        return State(state.t + h, q, dq, work)

    def _beyond(self, at: State, load: Load) -> bool:
        """Whether any gap is negative; quicker than the gaps themselves."""
        count = np.count_nonzero
        if self._has_stops and (count(at.q > self._high) or count(at.q < self._low)):
            return True
        return bool(count(at.dq * load.sign < 0.0))

    def _gaps(self, at: State, load: Load) -> Array:
        """How far each event is away; negative beyond it: reversals (n), upper and lower end stops (n each)."""
        return np.concatenate([at.dq * load.sign, self._high - at.q, at.q - self._low])

    def _locate(
        self, state: State, load: Load, rates: Rates, h: float, event: int, ends: tuple[float, float]
    ) -> tuple[float, State]:
        """Time of an event within a step of h seconds, by regula falsi with Illinois' rule, and the state there.

        Parameters
        ----------
        ends : gap of the event at the start (not negative) and after h seconds (negative)
        """
        first, last = ends
        low, high, side = 0.0, h, 0
        size = max(first, -last)
        for _ in range(_SEARCH):
            part = low + (high - low) * first / (first - last)
            trial = self._at(state, load, rates, part)
            gap = float(self._gaps(trial, load)[event])
            if abs(gap) <= CLOSE * size or high - low <= CLOSE * h:
                break
            if gap > 0.0:
                low, first, last = part, gap, last * (0.5 if side > 0 else 1.0)
                side = 1
            else:
                high, last, first = part, gap, first * (0.5 if side < 0 else 1.0)
                side = -1
        return part, trial
