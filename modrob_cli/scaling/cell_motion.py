r"""Motion of the links over cells of time, and its derivative by time, as balls.

The forward recursion of :mod:`modrob_cli.dynamics.link_motion` along a known motion q(t), differentiated once by time.
A turn by q about z makes x of the coordinates R' x_before, and its derivative R' x_before' + (x cross z) dq.

Two motions are followed, because torques of a motion at c times the speed are static + c^2 dynamic: one of gravity
alone, and one of velocities and accelerations without gravity. Derivatives are by the time of the unscaled motion.

Turning enclosures from link to link makes them wider each time; so what is known over a cell is cut with the value at
the cell's middle -+ radius times the largest derivative (mean-value theorem).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import Ball, apply, concatenate, cross, cross_z, stack
from modrob_cli.dynamics.box_motion import BoxPosition
from modrob_cli.model.robot import Robot
from modrob_cli.scaling.curve_cells import CellStates


@dataclass(frozen=True)
class Moving:
    """A vector quantity, or J of them: value and derivative by time, balls of shape (3, T) or (3, J, T).

    ``rate`` is None where only the value matters (at the middle of a cell).
    """

    value: Ball
    rate: Ball | None

    def then(self, value: Ball, rate: Ball | None) -> "Moving":
        """Return the sum with another value and rate."""
        return Moving(self.value + value, None if self.rate is None or rate is None else self.rate + rate)


@dataclass(frozen=True)
class CellLink:
    """What is known of one link, in its frame at its origin.

    Attributes
    ----------
    fall : acceleration against gravity, (3, T)
    omega, alpha, acc : of the motion without gravity, (3, T)
    w, v : unit motions of joints 1 to this one, (3, J, T)
    """

    fall: Moving
    omega: Moving
    alpha: Moving
    acc: Moving
    w: Moving
    v: Moving

    def seen_from(self, R: Array, t: Array) -> "CellLink":
        """The same in another frame of the link, at constant rotation R (3, 3) and translation t (3,)."""
        acc, v = self.acc, self.v
        if np.any(t != 0.0):
            arm = Ball.exact(t[:, None])
            acc, v = at_point(self.omega, self.alpha, acc, arm, None), _screw_at(self.w, v, arm, None)
        parts = (self.fall, self.omega, self.alpha, acc, self.w, v)
        return CellLink(*(_turned(R.T, part) for part in parts))


def _turned(R: Array, x: Moving) -> Moving:
    return Moving(apply(R, x.value), None if x.rate is None else apply(R, x.rate))


def at_point(omega: Moving, alpha: Moving, acc: Moving, p: Ball, p_rate: Ball | None) -> Moving:
    """Acceleration of the point at p: acc + alpha x p + omega x (omega x p)."""
    lag = cross(omega.value, p)
    value = acc.value + cross(alpha.value, p) + cross(omega.value, lag)
    if omega.rate is None or alpha.rate is None or acc.rate is None:
        return Moving(value, None)
    lag_rate = cross(omega.rate, p)
    rate = acc.rate + cross(alpha.rate, p) + cross(omega.rate, lag)
    if p_rate is not None:
        lag_rate = lag_rate + cross(omega.value, p_rate)
        rate = rate + cross(alpha.value, p_rate)
    return Moving(value, rate + cross(omega.value, lag_rate))


def _screw_at(w: Moving, v: Moving, p: Ball, p_rate: Ball | None) -> Moving:
    """Velocity v + w x p of the point at p in unit motions."""
    value = v.value + cross(w.value, p)
    if w.rate is None or v.rate is None:
        return Moving(value, None)
    rate = v.rate + cross(w.rate, p)
    return Moving(value, rate if p_rate is None else rate + cross(w.value, p_rate))


@dataclass(frozen=True)
class _Step:
    """One joint over cells: its position and the balls (T,) of its motion; ``moves`` if rates are wanted."""

    position: BoxPosition
    dq: Ball
    ddq: Ball
    dddq: Ball
    moves: bool

    def to_link(self, x: Moving) -> Moving:
        """Into the link's coordinates."""
        value = self.position.to_link(x.value)
        if x.rate is None:
            return Moving(value, None)
        rate = self.position.to_link(x.rate)
        return Moving(value, rate + cross_z(value) * self.dq if self.position.is_revolute else rate)

    @property
    def p_rate(self) -> Ball | None:
        """Velocity of the link's origin in the previous link's frame; None for a revolute joint."""
        if self.position.is_revolute or not self.moves:
            return None
        still = Ball.exact(np.zeros_like(self.dq.c))
        return apply(self.position.R, stack([still, still, self.dq]))


def _along_z(x: Ball) -> Ball:
    zero = np.zeros_like(x.c)
    return Ball(np.stack([zero, zero, x.c]), np.stack([zero, zero, x.r]))


def _next_link(before: CellLink, step: _Step) -> CellLink:
    """The recursion of ``link_motion.next_motion`` and ``body_terms.joint_screws``, and its derivative."""
    p, p_rate = step.position.p, step.p_rate
    at_joint = at_point(before.omega, before.alpha, before.acc, p, p_rate)
    fall, omega, alpha, acc = (step.to_link(x) for x in (before.fall, before.omega, before.alpha, at_joint))
    w, v = step.to_link(before.w), step.to_link(_screw_at(before.w, before.v, p, p_rate))
    side = cross_z(omega.value)
    pushed, speed = _along_z(step.ddq), _along_z(step.dq)
    more = None
    if omega.rate is not None:
        more = cross_z(omega.rate) * step.dq + side * step.ddq
    if step.position.is_revolute:
        jerk = None if more is None else more + _along_z(step.dddq)
        alpha = alpha.then(side * step.dq + pushed, jerk)
        omega = omega.then(speed, pushed)
    else:
        jerk = None if more is None else more.twice() + _along_z(step.dddq)
        acc = acc.then((side * step.dq).twice() + pushed, jerk)
    count = step.dq.c.shape[0]
    axis, still = np.zeros((3, 1, count)), Ball.exact(np.zeros((3, 1, count)))
    axis[2] = 1.0
    own_w, own_v = (Ball.exact(axis), still) if step.position.is_revolute else (still, Ball.exact(axis))
    return CellLink(fall, omega, alpha, acc, _with(w, own_w), _with(v, own_v))


def _with(screws: Moving, own: Ball) -> Moving:
    """Add the link's own joint, whose unit motion is constant."""
    rate = screws.rate
    if rate is not None:
        rate = concatenate([rate, Ball.exact(np.zeros_like(own.c))], axis=1)
    return Moving(concatenate([screws.value, own], axis=1), rate)


def _base(robot: Robot, count: int, moves: bool) -> CellLink:
    def vector(value: Array) -> Moving:
        return Moving(Ball.exact(value), Ball.exact(np.zeros_like(value)) if moves else None)

    fall = vector(np.repeat(-robot.gravity[:, None], count, axis=1))
    still, none = vector(np.zeros((3, count))), vector(np.zeros((3, 0, count)))
    return CellLink(fall, still, still, still, none, none)


def cell_links(robot: Robot, states: CellStates) -> Iterator[tuple[CellLink, CellLink]]:
    """For links 1..n: what is known at the middle of each cell (without rates), and over the whole of it."""
    count = len(states.radius)
    middle, whole = _base(robot, count, False), _base(robot, count, True)
    for i, joint in enumerate(robot.joints):
        steps = []
        for state, moves in ((states.middle, False), (states.whole, True)):
            q, dq, ddq, dddq = (state[k, i] for k in range(4))
            steps.append(_Step(BoxPosition.of(joint, q), dq, ddq, dddq, moves))
        middle = _next_link(middle, steps[0])
        whole = _narrowed(_next_link(whole, steps[1]), middle, states.radius)
        yield middle, whole


def _narrowed(whole: CellLink, middle: CellLink, radius: Array) -> CellLink:
    """Cut each value over a cell with its mean-value form."""

    def cut(name: str) -> Moving:
        wide, point = getattr(whole, name), getattr(middle, name).value
        return Moving(wide.value.both(Ball(point.c, point.r + wide.rate.mag * radius)), wide.rate)

    return CellLink(*(cut(name) for name in ("fall", "omega", "alpha", "acc", "w", "v")))
