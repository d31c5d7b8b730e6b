r"""Torques of the rigid bodies over a box of states, and their derivatives by the joint variables, as balls.

A link with linear parameters (m, h = m c, I) asks of a joint with the screw (w, v) the torque w.n + v.f, with

.. math:: f = m\,acc + \alpha \times h + \omega \times (\omega \times h), \qquad
          n = I \alpha + \omega \times I \omega + h \times acc,

so with respect to the link's motion its gradient is

.. math:: g_{acc} = m v + w \times h, \quad g_\alpha = I w + h \times v, \quad
          g_\omega = (\omega \times h) \times v + h \times (v \times \omega) + I \omega \times w + I (w \times \omega),

and with respect to the screw it is (n, f). The same holds at any other point p of the link, with acc and v taken there;
back at the origin, n gains p x f, and the gradient g_alpha gains p x g_acc and g_omega gains
(omega x p) x g_acc + p x (g_acc x omega). The chain rule with the derivatives of motion and screws does the rest.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import EPS, Ball, concatenate, cross, dot
from modrob_cli.dynamics.box_motion import BoxLink, StateBox, box_links
from modrob_cli.dynamics.box_parameters import BoxParameters, link_parameters, sum_of, sym_apply
from modrob_cli.model.robot import Robot


@dataclass(frozen=True)
class BoxTorques:
    """Enclosures over a box of states and the parameters that can be the worst there.

    Attributes
    ----------
    torque : shape (n, S, T), S = lower, upper: each encloses the torques that matter for its side
    slopes : derivatives by ``directions``, shape (n, S, K, T)
    directions : (joint, 0 for q, 1 for dq, 2 for ddq)
    """

    torque: Ball
    slopes: Ball
    directions: list[tuple[int, int]]


def box_torques(robot: Robot, box: StateBox) -> BoxTorques:
    """Torques and derivatives over a box of states."""
    n, count = box.q.c.shape
    directions = box.directions()
    torque = Ball(np.zeros((n, 2, count)), np.zeros((n, 2, count)))
    slopes = Ball(np.zeros((n, 2, len(directions), count)), np.zeros((n, 2, len(directions), count)))
    positions = np.array([k for k, (_, kind) in enumerate(directions) if kind == 0], dtype=int)
    for i, link in enumerate(box_links(robot, box)):
        parameters = link_parameters(robot, i, link)
        if not parameters:
            continue
        own_torque, by_motion, by_screws = _link_torque(link, parameters)
        joints = slice(0, i + 1)
        _add(torque, (joints,), own_torque)
        _add(slopes, (joints, slice(None), slice(0, by_motion.c.shape[2])), by_motion)
        moved = positions[: by_screws.c.shape[2]]
        _add(slopes, (joints, slice(None), moved), by_screws)
    return BoxTorques(torque, slopes, directions)


def _add(total: Ball, where: tuple[slice | Array, ...], part: Ball) -> None:
    """Add to a part of a sum in place, as ``Ball.__add__``."""
    c = total.c[where] + part.c
    total.c[where] = c
    total.r[where] += part.r + EPS * np.abs(c)


def _link_torque(link: BoxLink, bodies: list[BoxParameters]) -> tuple[Ball, Ball, Ball]:
    """Torque (J, S, T) of one link and its derivatives through motion and screws, (J, S, K, T)."""
    found = [_body_torque(link, body) for body in bodies]
    torque = sum_of(part.torque for part in found)
    by_motion, by_screw = sum_of(part.by_motion for part in found), sum_of(part.by_screw for part in found)
    motion = concatenate([link.slopes.omega, link.slopes.alpha, link.slopes.acc], axis=0)
    turns = concatenate([link.turns.w, link.turns.v], axis=0)
    return torque, _contract(by_motion, motion[:, None]), _contract(by_screw, turns)


@dataclass(frozen=True)
class _BodyTorque:
    """Torque (J, S, T) and its gradient by (omega, alpha, acc), (9, J, S, T), and by (w, v), (6, J, S, T)."""

    torque: Ball
    by_motion: Ball
    by_screw: Ball


def _body_torque(link: BoxLink, p: BoxParameters) -> _BodyTorque:
    """The module's formulas at the body's own point, then moved to the link's origin."""
    w, v = link.screws.w[:, :, None], link.screws.v[:, :, None]
    omega, alpha, acc = (x[:, None, None] for x in (link.motion.omega, link.motion.alpha, link.motion.acc))
    if p.point is not None:
        v = v + cross(w, p.point)
        lag = cross(omega, p.point)
        acc = acc + cross(alpha, p.point) + cross(omega, lag)
    momentum = sym_apply(p.inertia, omega)
    force, by_acc = p.mass * acc, p.mass * v
    moment = sym_apply(p.inertia, alpha) + cross(omega, momentum)
    by_alpha = sym_apply(p.inertia, w)
    by_omega = cross(momentum, w) + sym_apply(p.inertia, cross(w, omega))
    if p.moment is not None:
        h, swing = p.moment, cross(omega, p.moment)
        force = force + cross(alpha, h) + cross(omega, swing)
        moment = moment + cross(h, acc)
        by_acc, by_alpha = by_acc + cross(w, h), by_alpha + cross(h, v)
        by_omega = by_omega + cross(swing, v) + cross(h, cross(v, omega))
    torque = dot(w, moment) + dot(v, force)
    if p.point is not None:
        moment, by_alpha = moment + cross(p.point, force), by_alpha + cross(p.point, by_acc)
        by_omega = by_omega + cross(lag, by_acc) + cross(p.point, cross(by_acc, omega))
    by_motion, by_screw = _stretched([by_omega, by_alpha, by_acc]), _stretched([moment, force])
    return _BodyTorque(torque, by_motion, by_screw)


def _stretched(parts: list[Ball]) -> Ball:
    """Vectors (3, J, S, T) below one another; axes of length one are stretched."""
    shape = np.broadcast_shapes(*(part.c.shape for part in parts))
    return concatenate([Ball(np.broadcast_to(x.c, shape), np.broadcast_to(x.r, shape)) for x in parts], axis=0)


def _contract(gradient: Ball, slopes: Ball) -> Ball:
    """Sums over the first axis (at most nine) of (X, J, S, T) times (X, J, K, T); axes of length one are stretched."""
    size = np.abs(slopes.c)
    radius = slopes.r + EPS * size
    rule = "xjst,xjkt->jskt"
    centre = np.einsum(rule, gradient.c, slopes.c)
    return Ball(centre, np.einsum(rule, np.abs(gradient.c), radius) + np.einsum(rule, gradient.r, size + radius))
