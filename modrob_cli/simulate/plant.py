"""The true arm over time: fixed steps that end early where a joint stops or meets an end stop.

Steps are those of the classical Runge-Kutta method under constant motor torque. A joint at rest is held by any friction
up to its breakaway torque, exactly: neither position nor velocity creep. No step crosses a jump of friction, contact
force or end stop. End stops do not rebound. What is approximate: the method (fourth order), and a joint that reverses
twice within one step.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices
from modrob_cli.model.scenario import Contact
from modrob_cli.simulate.box_problem import HIGH, INSIDE, LOW, solve_box_problem
from modrob_cli.simulate.forward_dynamics import ForwardDynamics, Load, Modes, runge_kutta
from modrob_cli.simulate.truth import TrueRobot

Flags = NDArray[np.bool_]

_EVENTS = 32
"""A joint that stops more often than that within one step chatters; it is then held for the rest of the step."""
_SEARCH = 50
_CLOSE = 1e-12
"""Events are located to this part of a step; shorter steps are not taken."""


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


@dataclass(frozen=True)
class StopHit:
    """A joint met an end stop: time [s], joint (from 0), speed before [rad/s] or [m/s]."""

    t: float
    joint: int
    speed: float


@dataclass
class Plant:
    """A true robot, its contacts and its end stops.

    Attributes
    ----------
    hits : end stops met so far
    """

    truth: TrueRobot
    contacts: tuple[Contact, ...] = ()
    end_stops: bool = True
    hits: list[StopHit] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Prepare dynamics and end stops."""
        self.dynamics = ForwardDynamics(self.truth, self.contacts)
        limits = [joint.limits.position if self.end_stops else None for joint in self.truth.robot.joints]
        self._low = np.array([-np.inf if limit is None else limit[0] for limit in limits])
        self._high = np.array([np.inf if limit is None else limit[1] for limit in limits])
        self._has_stops = any(limit is not None for limit in limits)
        self._dry = (self.dynamics.coulomb > 0.0) | (self.truth.breakaway > 0.0)
        self._breaks = self.dynamics.forces.breaks()

    def advance(self, state: State, tau: Array, h: float) -> None:
        """Move on by h seconds under constant motor torque tau, shape (n,).

        Raises
        ------
        NumericalError
            If the forces at rest cannot be found (some inertia is zero).
        """
        end = state.t + h
        for moment in self._breaks:
            if state.t + _CLOSE * h < moment < end - _CLOSE * h:
                self._advance_until(state, tau, moment, h)
        self._advance_until(state, tau, end, h)

    def accelerations(self, state: State, tau: Array) -> Array:
        """Accelerations just after now under motor torque tau, shape (n,)."""
        load = self._load(state, tau, 0.0, frozenset())
        return self.dynamics.rates(state.t, state.q, state.dq, load)[0]

    def external_torque(self, state: State) -> Array:
        """Joint torques of the contacts just after now, shape (n,)."""
        forces = self.dynamics.forces
        return forces.torque(forces.active(state.t, 0.0) if self.contacts else (), state.t, state.q)

    def _advance_until(self, state: State, tau: Array, end: float, h: float) -> None:
        """Move on to a time before which no contact begins or ends."""
        locked: frozenset[int] = frozenset()
        for count in range(_EVENTS + self.truth.robot.dof):
            left = end - state.t
            if left <= _CLOSE * h:
                break
            load = self._load(state, tau, left, locked)
            part, trial, event = self._step(state, load, left)
            if event is not None and event < len(tau) and (state.dq[event] == 0.0 or count >= _EVENTS):
                locked |= {event}  # it would turn back at once, or it chatters
                state.dq[event] = 0.0
                continue
            state.t, state.q, state.dq = state.t + part, trial.q, trial.dq
            state.work += trial.work
            if event is not None:
                self._settle(state, event)
        state.t = end

    def _load(self, state: State, tau: Array, h: float, locked: frozenset[int]) -> Load:
        """What acts from now on for h seconds; decides which joints at rest stay there, and where the others go."""
        active = self.dynamics.forces.active(state.t, h) if self.contacts else ()
        load = Load(tau, active, Modes(np.sign(state.dq)))
        upper, lower = state.q >= self._high, state.q <= self._low
        rest = np.flatnonzero((state.dq == 0.0) & (self._dry | upper | lower))
        if not len(rest):
            return load
        sign = load.modes.sign
        sign[rest] = self._directions(state, load, rest, upper[rest], lower[rest])
        sign[list(locked)] = 0.0
        return replace(load, modes=Modes(sign, tuple(i for i in rest.tolist() if sign[i] == 0.0)))

    def _directions(self, state: State, load: Load, rest: Indices, upper: Flags, lower: Flags) -> Array:
        """Direction in which each joint at rest starts to move, 0 where it is held; (k,)."""
        reach = self.truth.breakaway[rest]
        low, high = np.where(upper, -np.inf, -reach), np.where(lower, np.inf, reach)
        all_held = replace(load, modes=Modes(load.modes.sign, tuple(rest.tolist())))
        hold = self.dynamics.holding_torque(state.t, state.q, state.dq, all_held)[rest]
        if ((low <= hold) & (hold <= high)).all():
            return np.zeros(len(rest))
        ddq, _ = self.dynamics.rates(state.t, state.q, state.dq, load)
        A = self.dynamics.inverse_inertia(state.q)[np.ix_(rest, rest)]
        _, found = solve_box_problem(A, ddq[rest], low, high)
        return np.array([{LOW: 1.0, INSIDE: 0.0, HIGH: -1.0}[way] for way in found])

    def _step(self, state: State, load: Load, h: float) -> tuple[float, State, int | None]:
        """Step of h seconds or up to the first event: its length, the state there, the number of the event."""
        part, trial, event = h, self._trial(state, load, h), None
        before = self._gaps(state, load)
        for _ in range(2 * len(before)):
            gaps = self._gaps(trial, load)
            if event is not None:
                gaps[event] = 0.0
            if not (gaps < 0.0).any():
                break
            late = np.flatnonzero(gaps < 0.0)
            event = int(late[np.argmin(before[late] / (before[late] - gaps[late]))])
            part, trial = self._locate(state, load, part, event, float(before[event]), float(gaps[event]))
        return part, trial, event

    def _trial(self, state: State, load: Load, h: float) -> State:
        if len(load.modes.held) == len(state.q):
            return State(state.t + h, state.q, state.dq)
        q, dq, work = runge_kutta(self.dynamics, state.t, state.q, state.dq, load, h)
        return State(state.t + h, q, dq, work)

    def _gaps(self, at: State, load: Load) -> Array:
        """How far each event is away; negative beyond it: reversals (n), upper and lower end stops (n each)."""
        sign = load.modes.sign
        moving = np.where(self._dry & (sign != 0.0), at.dq * sign, np.inf)
        return np.concatenate([moving, self._high - at.q, at.q - self._low]) if self._has_stops else moving

    def _locate(self, state: State, load: Load, h: float, event: int, first: float, last: float) -> tuple[float, State]:
        """Time of an event within a step of h seconds, by regula falsi with Illinois' rule, and the state there."""
        low, high, side = 0.0, h, 0
        size = max(first, -last)
        for _ in range(_SEARCH):
            part = low + (high - low) * first / (first - last)
            trial = self._trial(state, load, part)
            gap = float(self._gaps(trial, load)[event])
            if abs(gap) <= _CLOSE * size or high - low <= _CLOSE * h:
                break
            if gap > 0.0:
                low, first, last = part, gap, last * (0.5 if side > 0 else 1.0)
                side = 1
            else:
                high, last, first = part, gap, first * (0.5 if side < 0 else 1.0)
                side = -1
        return part, trial

    def _settle(self, state: State, event: int) -> None:
        """Make the event exact: velocity zero after a reversal, or position and impact at an end stop."""
        n = len(state.q)
        joint = event % n
        if event < n:
            state.dq[joint] = 0.0
            return
        self.hits.append(StopHit(state.t, joint, abs(float(state.dq[joint]))))
        state.q[joint] = (self._high if event < 2 * n else self._low)[joint]
        before = self.dynamics.kinetic_energy(state.q, state.dq)
        self._impact(state)
        state.lost += before - self.dynamics.kinetic_energy(state.q, state.dq)

    def _impact(self, state: State) -> None:
        """Stop the joints that run into their end stops; the impulses move the other joints too."""
        upper, lower = state.q >= self._high, state.q <= self._low
        at = np.flatnonzero(upper | lower)
        A = self.dynamics.inverse_inertia(state.q)
        low, high = np.where(upper[at], -np.inf, 0.0), np.where(lower[at], np.inf, 0.0)
        impulse, found = solve_box_problem(A[np.ix_(at, at)], state.dq[at], low, high)
        state.dq = state.dq + A[:, at] @ impulse
        state.dq[at[np.equal(found, INSIDE)]] = 0.0
