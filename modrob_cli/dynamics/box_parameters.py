r"""Parameters of a link that can be the worst for a joint's torque, anywhere in a box of states.

Where the torque of joint j grows (or falls) with one parameter of a body for all states of the box and all other
parameters, the extreme is at an end of that parameter's range: only the end is kept. This is done for the upper and
the lower bound of each joint apart. Which sign the torque's slope has follows from its coefficients over the box of
states (see :mod:`modrob_cli.dynamics.body_terms`; r = R c + t, Q = tr(B) 1 - B, all in the link's frame):

.. math:: \partial\tau/\partial I = R' B R, \quad \partial\tau/\partial c = m R' (y + 2 Q r), \quad
          \partial\tau/\partial m = y_0 + y \cdot r + r' Q r,

and for a tensor about the body frame's origin without the quadratic part, which then sits in the tensor: with r's
square replaced by r' Q r - (R c)' Q (R c).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import Ball, apply, cross, dot, lead, stack
from modrob_cli.dynamics.box_motion import BoxLink
from modrob_cli.dynamics.uncertain_body import is_exact
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody
from modrob_cli.model.robot import Robot

_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
_INDEX = ((0, 1, 2), (1, 3, 4), (2, 4, 5))
SIDES = np.array([-1.0, 1.0])
"""The lower and the upper bound, in this order on every axis S of length two."""


@dataclass(frozen=True)
class BoxParameters:
    """Parameters of one or more bodies in the link's frame, referred to a point of the link.

    The axes after the component are (J, S, T), joint, side, sample, or of length one. A body with its tensor about the
    centre of mass is referred to that (a ball), others to their frame's origin. That way the uncertain lever of the
    centre of mass enters as few products as possible.

    Attributes
    ----------
    mass : (...);  inertia : tensor about the point, (6, ...)
    point : (3, ...), None for the link's origin
    moment : mass times the centre of mass from the point, (3, ...), None for zero
    """

    mass: Ball
    inertia: Ball
    point: Ball | None
    moment: Ball | None


@dataclass(frozen=True)
class BoxTerms:
    """Coefficients y0 (J, T), y (3, J, T), B (6, J, T) of a link over a box of states."""

    y0: Ball
    y: Ball
    B: Ball

    @classmethod
    def of(cls, link: BoxLink) -> "BoxTerms":
        """As ``body_terms.body_terms``."""
        w, v = link.screws.w, link.screws.v
        omega, alpha, acc = (lead(x, 3) for x in (link.motion.omega, link.motion.alpha, link.motion.acc))
        y = cross(v, alpha) + cross(omega, cross(omega, v)) + cross(acc, w)
        u = cross(w, omega)
        half = Ball.exact(0.5)
        entries = [(w[k] * alpha[m] + w[m] * alpha[k] + u[k] * omega[m] + u[m] * omega[k]) * half for k, m in _PAIRS]
        return cls(dot(v, acc), y, stack(entries))

    def q_times(self, x: Ball) -> Ball:
        """Q x for vectors x (3, 1, 1)."""
        B = self.B
        return (B[0] + B[3] + B[5]) * x - sym_apply(B, x)


def sym_apply(entries: Ball, x: Ball) -> Ball:
    """Symmetric matrices, as six entries (6, ...), times vectors (3, ...)."""
    return stack([sum_of(entries[_INDEX[k][m]] * x[m] for m in range(3)) for k in range(3)])


def sum_of(parts: Iterable[Ball]) -> Ball:
    """Sum of one or more balls."""
    first, *rest = parts
    for part in rest:
        first = first + part
    return first


def link_parameters(robot: Robot, index: int, link: BoxLink) -> list[BoxParameters]:
    """Worst-case parameters behind joint ``index``: one set for all known bodies, one for each uncertain body."""
    bodies = robot.bodies_of(index + 1)
    known = known_parameters([placed for placed in bodies if is_exact(placed.body)])
    uncertain = [placed for placed in bodies if not is_exact(placed.body)]
    found = [known] if known is not None else []
    if uncertain:
        terms = BoxTerms.of(link)
        found += [_reduced(placed, terms) for placed in uncertain]
    return found


def known_parameters(bodies: Sequence[PlacedBody]) -> BoxParameters | None:
    """One set of parameters at the link's origin for bodies without any width; None for no bodies."""
    if not bodies:
        return None
    mass, moment, inertia = (sum_of(column) for column in zip(*map(_at_origin, bodies), strict=True))
    return BoxParameters(mass, inertia, None, moment)


def _at_origin(placed: PlacedBody) -> tuple[Ball, Ball, Ball]:
    """Mass, first moment and tensor about the link's origin of a known body."""
    body, R = placed.body, placed.pose[:3, :3]
    mass, com, inertia = (_full(part.interval) for part in (body.mass, body.com, body.inertia))
    arm = apply(R, com)
    r = arm + Ball.exact(placed.pose[:3, 3].reshape(3, 1, 1, 1))
    shift = _parallel_axis(r) - _parallel_axis(arm) if body.inertia_about == "frame" else _parallel_axis(r)
    return mass, mass * r, _rotated(R, inertia) + mass * shift


def _reduced(placed: PlacedBody, terms: BoxTerms) -> BoxParameters:
    """An uncertain body, each parameter at its worst end where that is certain."""
    body, R = placed.body, placed.pose[:3, :3]
    t = Ball.exact(placed.pose[:3, 3].reshape(3, 1, 1, 1))
    about_frame = body.inertia_about == "frame"
    slopes = _slopes(terms, R, t[:, 0], _full(body.com.interval)[:, 0], about_frame)
    intervals = (body.mass.interval, body.com.interval, body.inertia.interval)
    mass, com, inertia = (_worst(box, slope) for box, slope in zip(intervals, slopes, strict=True))
    arm, inertia = apply(R, com), _rotated(R, inertia)
    return BoxParameters(mass, inertia, t, mass * arm) if about_frame else BoxParameters(mass, inertia, arm + t, None)


def _full(box: Interval) -> Ball:
    """A parameter's whole range, with axes J, S, T of length one."""
    return Ball.between(box.inf[..., None, None, None], box.sup[..., None, None, None])


def _worst(box: Interval, slope: Ball) -> Ball:
    """The end (for each side) towards which the torque moves to that side, or the range; slope (..., J, T)."""
    toward = slope.sign[..., None, :] * SIDES[:, None]
    lower, upper = box.inf[..., None, None, None], box.sup[..., None, None, None]
    return Ball.between(np.where(toward > 0.0, upper, lower), np.where(toward < 0.0, lower, upper))


def _slopes(terms: BoxTerms, R: Array, t: Ball, com: Ball, about_frame: bool) -> tuple[Ball, Ball, Ball]:
    """Slopes of the torque by mass (J, T), centre of mass (3, J, T; per unit of mass) and tensor (6, J, T)."""
    arm = apply(R, com)
    r = arm + t
    by_mass = terms.y0 + dot(terms.y, r) + dot(r, terms.q_times(r))
    lever = r
    if about_frame:
        by_mass = by_mass - dot(arm, terms.q_times(arm))
        lever = t
    by_com = apply(R.T, terms.y + terms.q_times(lever).twice())
    return by_mass, by_com, _rotated(R.T, terms.B)


def _rotated(R: Array, entries: Ball) -> Ball:
    """Entries of R M R' for symmetric matrices M as six entries."""
    rows = [apply(R, stack([entries[_INDEX[k][m]] for m in range(3)])) for k in range(3)]  # rows of M, times R'
    turned = [apply(R, stack([rows[k][m] for k in range(3)])) for m in range(3)]  # columns of M R', R times them
    return stack([turned[m][k] for k, m in _PAIRS])


def _parallel_axis(r: Ball) -> Ball:
    """Entries of (r'r) 1 - r r'."""
    x, y, z = (r[k] * r[k] for k in range(3))
    return stack([y + z, -(r[0] * r[1]), -(r[0] * r[2]), x + z, -(r[1] * r[2]), x + y])
