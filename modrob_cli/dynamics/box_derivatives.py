r"""Torques of the rigid bodies over a box of states, and their derivatives by the joint variables, as balls.

A link with linear parameters (m, h = m c, I) asks of a joint with the screw (w, v) the torque w.n + v.f, with

.. math:: f = m\,acc + \alpha \times h + \omega \times (\omega \times h), \qquad
          n = I \alpha + \omega \times I \omega + h \times acc,

so with respect to the link's motion its gradient is

.. math:: g_{acc} = m v + w \times h, \quad g_\alpha = I w + h \times v, \quad
          g_\omega = (\omega \times h) \times v + h \times (v \times \omega) + I \omega \times w + I (w \times \omega),

and with respect to the screw it is (n, f). The chain rule with the derivatives of motion and screws does the rest.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import EPS, Ball, concatenate, cross, dot
from modrob_cli.dynamics.box_motion import BoxLink, StateBox, box_links
from modrob_cli.dynamics.box_parameters import BoxParameters, link_parameters, sym_apply
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
        if parameters is None:
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


def _link_torque(link: BoxLink, p: BoxParameters) -> tuple[Ball, Ball, Ball]:
    """Torque (J, S, T) of one link and its derivatives through motion and screws, (J, S, K, T)."""
    w, v = link.screws.w[:, :, None], link.screws.v[:, :, None]
    omega, alpha, acc = (x[:, None, None] for x in (link.motion.omega, link.motion.alpha, link.motion.acc))
    m, h, inertia = p.mass, p.moment, p.inertia
    swing, momentum = cross(omega, h), sym_apply(inertia, omega)
    force = m * acc + cross(alpha, h) + cross(omega, swing)
    moment = sym_apply(inertia, alpha) + cross(omega, momentum) + cross(h, acc)
    by_acc = m * v + cross(w, h)
    by_alpha = sym_apply(inertia, w) + cross(h, v)
    by_omega = cross(swing, v) + cross(h, cross(v, omega)) + cross(momentum, w) + sym_apply(inertia, cross(w, omega))
    gradient = concatenate([by_omega, by_alpha, by_acc], axis=0)
    slopes = concatenate([link.slopes.omega, link.slopes.alpha, link.slopes.acc], axis=0)
    by_motion = _contract(gradient, slopes[:, None])
    by_screws = _contract(moment, link.turns.w) + _contract(force, link.turns.v)
    return dot(w, moment) + dot(v, force), by_motion, by_screws


def _contract(gradient: Ball, slopes: Ball) -> Ball:
    """Sums over the first axis, of at most nine, of (X, J, S, T) times (X, J, K, T); axes of length one are stretched."""
    size = np.abs(slopes.c)
    radius = slopes.r + EPS * size
    rule = "xjst,xjkt->jskt"
    centre = np.einsum(rule, gradient.c, slopes.c)
    return Ball(centre, np.einsum(rule, np.abs(gradient.c), radius) + np.einsum(rule, gradient.r, size + radius))
