"""The true arm over time: fixed steps that end early where a joint stops or meets an end stop.

Steps are those of the classical Runge-Kutta method under constant motor torque. A joint at rest is held by any friction
up to its breakaway torque, exactly: neither position nor velocity creep. No step crosses a jump of friction, contact
force or end stop. End stops do not rebound. What is approximate: the method (fourth order); a joint that reverses twice
within one step; and a joint that other forces than the motor's tear loose within a step starts at the next one.
"""

from dataclasses import dataclass, field

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.errors import NumericalError, UsageError
from modrob_cli.model.motion import ALLOWED_EXCESS
from modrob_cli.model.scenario import Contact
from modrob_cli.simulate.box_problem import HIGH, INSIDE, LOW, solve_box_problem
from modrob_cli.simulate.forward_dynamics import ForwardDynamics, Load, Rates
from modrob_cli.simulate.steps import CLOSE, State, Stepper
from modrob_cli.simulate.truth import TrueRobot

_EVENTS = 32
"""A joint that stops more often than that within one step chatters; it is then held for the rest of the step."""
_EDGE = 1e-6
"""A contact that begins or ends within this part of a step from its end does so at the end."""


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
        stops = np.array([limit is not None for limit in limits])
        self._dry = (self.dynamics.coulomb > 0.0) | (self.truth.breakaway > 0.0)
        self._watched = self._dry | stops
        self._stepper = Stepper(self.dynamics, self._low, self._high)
        self._breaks = self.dynamics.forces.breaks()

    def start(self, q: Array, dq: Array) -> State:
        """State at time 0 with positions and velocities, shape (n,) each.

        Raises
        ------
        UsageError
            If a joint would start beyond an end stop.
        NumericalError
            If an inertia is not positive there.
        """
        allowed = ALLOWED_EXCESS * (1.0 + np.abs(q))
        for i in np.flatnonzero((q < self._low - allowed) | (q > self._high + allowed)).tolist():
            limits = f"its limits {self._low[i]:.9g} .. {self._high[i]:.9g}"
            what = f"joint {self.truth.robot.joint_names[i]} would start at {q[i]:.9g}, beyond {limits}"
            raise UsageError(f"{what}; expected another start, or end_stops: false")
        state = State(0.0, np.clip(q, self._low, self._high), dq.copy())
        self.dynamics.check_inertia(state.q)
        return state

    def advance(self, state: State, tau: Array, h: float) -> Array:
        """Move on by h seconds under constant motor torque tau, shape (n,).

        Returns
        -------
        ddq : accelerations just after the start, shape (n,)

        Raises
        ------
        NumericalError
            If the forces at rest cannot be found, or the step does not come to an end.
        """
        end = state.t + h
        inside = [moment for moment in self._breaks if state.t + _EDGE * h < moment < end - _EDGE * h]
        ddq = self._advance_until(state, tau, inside[0] if inside else end, h)
        for moment in (*inside[1:], end) if inside else ():
            self._advance_until(state, tau, moment, h)
        return ddq

    def accelerations(self, state: State, tau: Array) -> Array:
        """Accelerations just after now under motor torque tau, shape (n,)."""
        return self._load(state, tau, 0.0, frozenset())[1][0]

    def external_torque(self, t: float, q: Array, h: float) -> Array:
        """Joint torques of the contacts just after t, shape (n,), where a step of h seconds begins."""
        forces = self.dynamics.forces
        return forces.torque(forces.active(t, 2.0 * _EDGE * h), t, q)

    def _advance_until(self, state: State, tau: Array, end: float, h: float) -> Array:
        """Move on to a time before which no contact begins or ends; accelerations at the start."""
        locked: frozenset[int] = frozenset()
        start = None
        for count in range(2 * (_EVENTS + len(tau))):
            left = end - state.t
            load, first = self._load(state, tau, left, locked)
            part, trial, event = self._stepper.step(state, load, first, left)
            if event is not None:
                joint = event % len(tau)
                if state.dq[joint] == 0.0 and part <= CLOSE * h or count >= _EVENTS and event < len(tau):
                    locked |= {joint}  # it would turn back at once, or it chatters
                    state.dq = np.where(np.arange(len(tau)) == joint, 0.0, state.dq)
                    continue
            start = first[0] if start is None else start
            state.t, state.q, state.dq = state.t + part, trial.q, trial.dq
            state.work += trial.work
            if event is not None:
                self._settle(state, event)
            if end - state.t <= CLOSE * h:
                state.t = end
                return start
        raise NumericalError(f"too many stops within one step at t = {state.t:.6g} s; expected more sub_steps")

    def _load(self, state: State, tau: Array, h: float, locked: frozenset[int]) -> tuple[Load, Rates]:
        """What acts for h seconds, and the accelerations and power now.

        Decides which joints at rest stay there, and where the others go.
        """
        dynamics, t, q, dq = self.dynamics, state.t, state.q, state.dq
        active = dynamics.forces.active(t, h) if self.contacts else ()
        sign = np.sign(dq) * self._watched
        if np.count_nonzero(dq) < len(dq):
            upper, lower = q >= self._high, q <= self._low
            rest = np.flatnonzero((dq == 0.0) & (self._dry | upper | lower))
            load = dynamics.load(tau, sign, active, tuple(rest.tolist()))
            held = dynamics.rates(t, q, dq, load)
            low = np.where(upper, -np.inf, -self.truth.breakaway)[rest]
            high = np.where(lower, np.inf, self.truth.breakaway)[rest]
            hold = dynamics.holding_torque(t, q, dq, held[0], load)[rest]
            if ((low <= hold) & (hold <= high)).all():
                return load, held
            sign[rest] = self._directions(state, load, rest, low, high)
            sign[list(locked)] = 0.0
            still = tuple(i for i in rest.tolist() if sign[i] == 0.0)
            load = dynamics.load(tau, sign, active, still)
        else:
            load = dynamics.load(tau, sign, active)
        return load, dynamics.rates(t, q, dq, load)

    def _directions(self, state: State, load: Load, rest: Indices, low: Array, high: Array) -> Array:
        """Direction in which each joint at rest starts to move, 0 where it is held; (k,)."""
        free = self.dynamics.rates(state.t, state.q, state.dq, load._replace(held=()))[0]
        A = self.dynamics.inverse_inertia(state.q)[np.ix_(rest, rest)]
        _, found = solve_box_problem(A, free[rest], low, high)
        return np.array([{LOW: 1.0, INSIDE: 0.0, HIGH: -1.0}[way] for way in found])

    def _settle(self, state: State, event: int) -> None:
        """Make the event exact: velocity zero after a reversal, or position and impact at an end stop."""
        n = len(state.q)
        joint = event % n
        if event < n:
            state.dq[joint] = 0.0  # of the trial state, which nobody else has
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
        out = (upper & (state.dq > 0.0)) | (lower & (state.dq < 0.0))
        state.dq[out] = 0.0  # what rounding leaves
