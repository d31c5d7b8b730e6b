r"""Coefficients of one body in the torques of the joints before it, over cells of time.

The coefficients y0, y, B of :mod:`modrob_cli.dynamics.body_terms` are functions of time; at t_m + s with abs(s) <= r

.. math:: \kappa(t_m + s) \in \kappa_m + s\,\kappa'_c + [-\rho, \rho], \qquad \rho = \rho_m + r \rho',

with the enclosure kappa'_c -+ rho' of their derivative over the cell (mean-value theorem, coefficient by coefficient).
For fixed parameters the torque is linear in kappa. So its largest value over the parameters and over the linear part
is convex in s: it is reached at s = r or s = -r, where it is that of a body at one instant. What rho adds is bounded
apart; it is of second order in r.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ball import GROW, Ball, cross, dot, lead, stack
from modrob_cli.dynamics.body_terms import BodyTerms
from modrob_cli.dynamics.box_parameters import BoxParameters
from modrob_cli.dynamics.uncertain_body import UncertainBody
from modrob_cli.scaling.cell_motion import CellLink, Moving

_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
_TWICE = np.array([1.0, 2.0, 2.0, 1.0, 2.0, 1.0])
EVALUATION = 2.0**-44
"""512 u: the rounding of a range over a box from given coefficients (below 100 u), of a sum over bodies and of the few
operations here, relative to the sum of absolute values."""


@dataclass(frozen=True)
class Terms:
    """Coefficients y0 (J, T), y (3, J, T), B (6, J, T) as balls; None for B stands for zero."""

    y0: Ball
    y: Ball
    B: Ball | None

    def with_tensor(self) -> "Terms":
        """B as zeros where it is None."""
        if self.B is not None:
            return self
        zero = np.zeros((6, *self.y0.c.shape))
        return Terms(self.y0, self.y, Ball(zero, zero))


def static_terms(link: CellLink) -> Terms:
    """Coefficients of gravity."""
    fall = lead(link.fall.value, 3)
    return Terms(dot(link.v.value, fall), cross(fall, link.w.value), None)


def static_rates(link: CellLink) -> Terms:
    """Their derivative by time."""
    fall, rate = lead(link.fall.value, 3), lead(_rate(link.fall), 3)
    w, v, w_rate, v_rate = link.w.value, link.v.value, _rate(link.w), _rate(link.v)
    y = cross(rate, w) + cross(fall, w_rate)
    return Terms(dot(v_rate, fall) + dot(v, rate), y, None)


def dynamic_terms(link: CellLink) -> Terms:
    """Coefficients of velocities and accelerations, as ``body_terms.body_terms``."""
    w, v = link.w.value, link.v.value
    omega, alpha, acc = (lead(x.value, 3) for x in (link.omega, link.alpha, link.acc))
    y = cross(v, alpha) + cross(omega, cross(omega, v)) + cross(acc, w)
    u = cross(w, omega)
    return Terms(dot(v, acc), y, _symmetric([(w, alpha), (u, omega)]))


def dynamic_rates(link: CellLink) -> Terms:
    """Their derivative by time, product by product."""
    w, v, w_rate, v_rate = link.w.value, link.v.value, _rate(link.w), _rate(link.v)
    omega, alpha, acc = (lead(x.value, 3) for x in (link.omega, link.alpha, link.acc))
    omega_rate, alpha_rate, acc_rate = (lead(_rate(x), 3) for x in (link.omega, link.alpha, link.acc))
    lag, lag_rate = cross(omega, v), cross(omega_rate, v) + cross(omega, v_rate)
    y = cross(v_rate, alpha) + cross(v, alpha_rate) + cross(omega_rate, lag) + cross(omega, lag_rate)
    y = y + cross(acc_rate, w) + cross(acc, w_rate)
    u, u_rate = cross(w, omega), cross(w_rate, omega) + cross(w, omega_rate)
    B = _symmetric([(w_rate, alpha), (w, alpha_rate), (u_rate, omega), (u, omega_rate)])
    return Terms(dot(v_rate, acc) + dot(v, acc_rate), y, B)


def _rate(x: Moving) -> Ball:
    if x.rate is None:
        raise ValueError("rates are known over whole cells only")
    return x.rate


def _symmetric(pairs: list[tuple[Ball, Ball]]) -> Ball:
    """Entries of the sum of sym(a b') = (a b' + b a') / 2."""
    half = Ball.exact(0.5)
    entries = []
    for k, m in _PAIRS:
        first, *rest = (a[k] * b[m] + a[m] * b[k] for a, b in pairs)
        for part in rest:
            first = first + part
        entries.append(first * half)
    return stack(entries)


@dataclass(frozen=True)
class TwoEnds:
    """Coefficients at both ends of the linear part, and what the rest adds to a torque.

    Attributes
    ----------
    terms : y0 (J 2 T,), y (3, J 2 T), B (6, J 2 T): joint by joint, first the ends s = -r of all cells, then s = r
    rest : shape (J, 2 T), rounded up
    """

    terms: BodyTerms
    rest: Array


def two_ends(body: UncertainBody, middle: Terms, rates: Terms, radius: Array) -> TwoEnds:
    """Ends for a body with a box of parameters."""
    middle, rates = middle.with_tensor(), rates.with_tensor()

    def ends(at: Ball, rate: Ball) -> tuple[Array, Array, Array]:
        step = rate.c * radius
        values = np.concatenate([at.c - step, at.c + step], axis=-1)
        size = np.abs(at.c) + np.abs(step)
        return values, at.r + rate.r * radius + EVALUATION * size, size

    y0, y, B = (ends(a, b) for a, b in ((middle.y0, rates.y0), (middle.y, rates.y), (middle.B, rates.B)))  # type: ignore[arg-type]
    count = 2 * len(radius)
    terms = BodyTerms(y0[0].reshape(-1), y[0].reshape(3, -1), B[0].reshape(6, -1))
    rest = largest_torque(body, y0[1], y[1], B[1]) * GROW
    return TwoEnds(terms, np.concatenate([rest, rest], axis=-1).reshape(-1, count))


def largest_torque(body: UncertainBody, y0: Array, y: Array, B: Array) -> Array:
    """Bound of the torque for coefficients up to these, >= 0, of shape (J, T), (3, J, T), (6, J, T)."""
    com = np.abs(body.c) + body.r
    per_mass = y0 + np.einsum("k,kjt->jt", com, y)
    if body.about_com:
        c2 = com**2
        # |c|' |Q| |c| with Q_kk the sum of the other two entries of the diagonal, and Q_km = -B_km
        weights = [c2[1] + c2[2], 2 * com[0] * com[1], 2 * com[0] * com[2]]
        weights += [c2[0] + c2[2], 2 * com[1] * com[2], c2[0] + c2[1]]
        per_mass = per_mass + np.einsum("k,kjt->jt", np.array(weights), B)
    return np.asarray(body.mass[1] * per_mass + np.einsum("k,kjt->jt", np.abs(body.inertia) + body.spread, B))


def known_torque(parameters: BoxParameters, terms: Terms) -> Ball:
    """Torques (J, T) of known bodies at the link's origin."""
    mass, moment = parameters.mass[..., 0, :], parameters.moment
    out = terms.y0 * mass
    if moment is not None:
        out = out + dot(terms.y, moment[:, :, 0])
    if terms.B is not None:
        for k in range(6):
            out = out + terms.B[k] * parameters.inertia[k, :, 0] * Ball.exact(_TWICE[k])
    return out
