r"""Motion of the links over boxes of q, dq, ddq, and its derivatives: the forward recursion on balls.

For every link in turn: enclosures, over all states of the box, of the motion (omega, alpha, acc; see
:mod:`modrob_cli.dynamics.link_motion`), of the screws of the joints before it, and of the derivatives of both with
respect to the joint variables. A joint variable changes nothing before its joint; at its own link the derivative is
simple, because a turn about z by q only turns the coordinates,

.. math:: \partial x / \partial q_i = x \times z \quad (x = \omega, \alpha, acc, w, v),

and from there outward derivatives follow the differentiated recursion, in which the later rotations are constant.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import Ball, apply, concatenate, cos_sin, cross, cross_z, stack, turn_back
from modrob_cli.model.joint import Joint
from modrob_cli.model.robot import Robot


@dataclass(frozen=True)
class BoxMotion:
    """Motion of a frame, or its derivatives: vectors (3, T) or (3, K, T)."""

    omega: Ball
    alpha: Ball
    acc: Ball


@dataclass(frozen=True)
class BoxScrews:
    """Unit motions of joints, (3, J, T), or their derivatives, (3, J, K, T). See ``body_terms.Screw``."""

    w: Ball
    v: Ball


@dataclass(frozen=True)
class StateBox:
    """Enclosures of q, dq, ddq, balls of shape (n, T) each."""

    q: Ball
    dq: Ball
    ddq: Ball

    @property
    def middle(self) -> "StateBox":
        """The midpoint alone."""
        return StateBox(*(Ball.exact(x.c) for x in (self.q, self.dq, self.ddq)))

    def directions(self) -> list[tuple[int, int]]:
        """The variables that have any width: (joint, 0 for q, 1 for dq, 2 for ddq), from base to tip."""
        states = (self.q, self.dq, self.ddq)
        return [(i, k) for i in range(len(self.q.c)) for k, state in enumerate(states) if state.r[i].any()]


@dataclass(frozen=True)
class BoxLink:
    """What is known of one link.

    Attributes
    ----------
    slopes : derivatives of the motion by the first K of ``StateBox.directions``, those of joints up to this one
    turns : derivatives of the screws by those of them that are positions
    """

    motion: BoxMotion
    slopes: BoxMotion
    screws: BoxScrews
    turns: BoxScrews


@dataclass(frozen=True)
class BoxPosition:
    """A joint over its range of positions: rotation R Rz(q) and origin p, ball (3, 1) or (3, T), of its link."""

    R: Array
    cos: Ball
    sin: Ball
    p: Ball
    is_revolute: bool

    @classmethod
    def of(cls, joint: Joint, q: Ball) -> "BoxPosition":
        """Of one joint at positions q, shape (T,)."""
        R, p = joint.zero_placement[:3, :3], Ball.exact(joint.placement[:3, 3][:, None])
        if joint.type == "revolute":
            return cls(R, *cos_sin(q), p, True)
        still = Ball.exact(np.zeros_like(q.c))
        slide = apply(R, stack([still, still, q]))
        return cls(R, Ball.exact(np.ones_like(q.c)), still, p + slide, False)

    def to_link(self, x: Ball) -> Ball:
        """Vectors (3, ..., T) into the link's coordinates."""
        x = apply(self.R.T, x)
        return turn_back(self.cos, self.sin, x) if self.is_revolute else x

    def moved(self, screws: BoxScrews) -> BoxScrews:
        """Screws, or derivatives of screws, seen from the link."""
        return BoxScrews(self.to_link(screws.w), self.to_link(screws.v + cross(screws.w, self.p)))


def _axis(*shape: int) -> Ball:
    """Unit vectors along z, shape (3, ...)."""
    z = np.zeros((3, *shape))
    z[2] = 1.0
    return Ball.exact(z)


def _none(*shape: int) -> Ball:
    return Ball.exact(np.zeros((3, *shape)))


def box_links(robot: Robot, box: StateBox) -> Iterator[BoxLink]:
    """Links 1..n over a box of states."""
    count = box.q.c.shape[1]
    active = set(box.directions())
    gravity = Ball.exact(np.repeat(-robot.gravity[:, None], count, axis=1))
    motion = BoxMotion(_none(count), _none(count), gravity)
    slopes = BoxMotion(_none(0, count), _none(0, count), _none(0, count))
    screws = BoxScrews(_none(0, count), _none(0, count))
    turns = BoxScrews(_none(0, 0, count), _none(0, 0, count))
    reach = _half_widths(box)
    none, still = np.zeros((0, count)), np.zeros(count)
    lengths = _Lengths(still, still, np.full(count, np.linalg.norm(robot.gravity)), none, none)
    middle = box_links(robot, box.middle) if active else iter(())
    for i, joint in enumerate(robot.joints):
        position = BoxPosition.of(joint, box.q[i])
        slopes = _next_slopes(motion, slopes, position, box.dq[i])
        motion = _next_motion(motion, position, box.dq[i], box.ddq[i])
        kinds = [k for k in range(3) if (i, k) in active]
        slopes = _joined([slopes, *(_own_slope(motion, k, position.is_revolute) for k in kinds)])
        turns = position.moved(turns)
        screws = _with_own(position.moved(screws), position.is_revolute)
        turns = _next_turns(turns, screws, 0 in kinds, position.is_revolute)
        if active:
            lengths = lengths.behind(joint, box.q[i], box.dq[i], box.ddq[i])
            motion, screws = _narrowed(BoxLink(motion, slopes, screws, turns), lengths, next(middle), *reach)
        yield BoxLink(motion, slopes, screws, turns)


def _half_widths(box: StateBox) -> tuple[Array, Array]:
    """Half-widths of the variables of ``directions``, (K, T), and of those of them that are positions."""
    states = (box.q, box.dq, box.ddq)
    found = box.directions()
    reach = np.array([states[kind].reach[i] for i, kind in found]).reshape(len(found), box.q.c.shape[1])
    return reach, reach[[kind == 0 for _, kind in found]]


@dataclass(frozen=True)
class _Lengths:
    """Bounds of the lengths of a link's vectors, which no turn changes: (T,), and (J, T) for the screws."""

    omega: Array
    alpha: Array
    acc: Array
    w: Array
    v: Array

    def behind(self, joint: Joint, q: Ball, dq: Ball, ddq: Ball) -> "_Lengths":
        """Of the link behind a joint; the recursion of ``margin.torque_magnitude``."""
        revolute = joint.type == "revolute"
        arm = np.linalg.norm(joint.placement[:3, 3]) + (0.0 if revolute else q.mag)
        speed, push, spin = dq.mag, ddq.mag, self.alpha + self.omega**2
        omega, alpha, acc = self.omega, self.alpha, self.acc + spin * arm
        if revolute:
            omega, alpha = omega + speed, alpha + push + omega * speed
        else:
            acc = acc + push + 2.0 * omega * speed
        own = np.full((1, len(speed)), 1.0 if revolute else 0.0)
        w, v = np.concatenate([self.w, own]), np.concatenate([self.v + self.w * arm, 1.0 - own])
        return _Lengths(omega, alpha, acc, w, v)


def _narrowed(
    link: BoxLink, lengths: _Lengths, middle: BoxLink, reach: Array, turn_reach: Array
) -> tuple[BoxMotion, BoxScrews]:
    """Motion and screws, cut with bounds of their lengths and with their mean-value forms.

    Turning an enclosure from link to link makes it wider each time. The lengths stop that for large boxes; the values
    at the midpoint -+ |derivatives| times half-widths are exact to first order for small ones.
    """

    def narrow(wide: Ball, length: Array, point: Ball, slopes: Ball, rad: Array) -> Ball:
        size = np.abs(slopes.c) + slopes.r
        mean_value = Ball(point.c, point.r + np.einsum("...kt,kt->...t", size, rad[: size.shape[-2]]))
        return wide.both(mean_value).both(Ball(np.zeros_like(wide.c), np.broadcast_to(length, wide.c.shape)))

    def all_of(name: str, parts: tuple[BoxMotion | BoxScrews, ...], rad: Array) -> Ball:
        wide, point, slopes = (getattr(part, name) for part in parts)
        return narrow(wide, getattr(lengths, name), point, slopes, rad)

    motions, screws = (link.motion, middle.motion, link.slopes), (link.screws, middle.screws, link.turns)
    motion = BoxMotion(*(all_of(name, motions, reach) for name in ("omega", "alpha", "acc")))
    return motion, BoxScrews(*(all_of(name, screws, turn_reach) for name in ("w", "v")))


def _next_motion(before: BoxMotion, position: BoxPosition, dq: Ball, ddq: Ball) -> BoxMotion:
    """As ``link_motion.next_motion``."""
    at_joint = before.acc + cross(before.alpha, position.p) + cross(before.omega, cross(before.omega, position.p))
    omega, alpha, acc = (position.to_link(x) for x in (before.omega, before.alpha, at_joint))
    z = _axis(1)
    if position.is_revolute:
        return BoxMotion(omega + z * dq, alpha + cross_z(omega) * dq + z * ddq, acc)
    return BoxMotion(omega, alpha, acc + (cross_z(omega) * dq).twice() + z * ddq)


def _next_slopes(before: BoxMotion, slopes: BoxMotion, position: BoxPosition, dq: Ball) -> BoxMotion:
    """Derivatives by the variables of earlier joints: the recursion of the motion, differentiated."""
    p = position.p
    at_joint = slopes.acc + cross(slopes.alpha, p) + cross(slopes.omega, cross(before.omega, p))
    at_joint = at_joint + cross(before.omega, cross(slopes.omega, p))
    omega, alpha, acc = (position.to_link(x) for x in (slopes.omega, slopes.alpha, at_joint))
    if position.is_revolute:
        return BoxMotion(omega, alpha + cross_z(omega) * dq, acc)
    return BoxMotion(omega, alpha, acc + (cross_z(omega) * dq).twice())


def _own_slope(motion: BoxMotion, kind: int, is_revolute: bool) -> BoxMotion:
    """Derivative of a link's motion by the position, velocity or acceleration of its own joint, (3, T)."""
    omega = motion.omega
    still = _none(omega.c.shape[1])
    z = _axis(omega.c.shape[1])
    if is_revolute:
        turned = BoxMotion(cross_z(omega), cross_z(motion.alpha), cross_z(motion.acc))
        return (turned, BoxMotion(z, cross_z(omega), still), BoxMotion(still, z, still))[kind]
    pushed = cross_z(motion.alpha) + cross(omega, cross_z(omega))
    return BoxMotion(still, still, (pushed, cross_z(omega).twice(), z)[kind])


def _joined(parts: list[BoxMotion]) -> BoxMotion:
    """Derivatives (3, K, T) and further ones (3, T) as one set."""

    def join(name: str) -> Ball:
        first, *rest = (getattr(part, name) for part in parts)
        return concatenate([first, *(x[:, None] for x in rest)], axis=1)

    return BoxMotion(join("omega"), join("alpha"), join("acc"))


def _with_own(screws: BoxScrews, is_revolute: bool) -> BoxScrews:
    """Add the link's own joint."""
    count = screws.w.c.shape[-1]
    own = (_axis(1, count), _none(1, count)) if is_revolute else (_none(1, count), _axis(1, count))
    return BoxScrews(concatenate([screws.w, own[0]], axis=1), concatenate([screws.v, own[1]], axis=1))


def _next_turns(turns: BoxScrews, screws: BoxScrews, moves: bool, is_revolute: bool) -> BoxScrews:
    """Derivatives (3, J, K, T): a row of zeros for the link's own joint, and the derivative by its position."""
    row = _none(1, *turns.w.c.shape[2:])
    w, v = concatenate([turns.w, row], axis=1), concatenate([turns.v, row], axis=1)
    if moves:
        still = Ball.exact(np.zeros_like(screws.w.c))
        own = (cross_z(screws.w), cross_z(screws.v)) if is_revolute else (still, cross_z(screws.w))
        w, v = (concatenate([x, y[:, :, None]], axis=2) for x, y in zip((w, v), own, strict=True))
    return BoxScrews(w, v)
