"""Curves through points: rest-to-rest polynomials, cubic and quintic splines, sin^2 profiles."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import ShapeError
from modrob_cli.model.trajectory_curves import PiecewiseCurve

REST_TO_REST = {
    5: (0.0, 0.0, 0.0, 10.0, -15.0, 6.0),
    7: (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0),
}
"""Polynomials from 0 to 1 over s = 0 .. 1 by their order, powers rising; the first two (of order 5) or three (of order
7) derivatives are zero at both ends. [D] Appendix B."""


def rest_to_rest(t: Array, q: Array, order: Literal[5, 7]) -> PiecewiseCurve:
    """Curve that rests at each of the points. [D] Appendix B.

    Parameters
    ----------
    t : increasing times from 0, shape (m + 1,), [s]
    q : positions, shape (m + 1,), [rad] or [m]
    """
    coefficients = np.diff(q)[:, None] * np.array(REST_TO_REST[order])
    coefficients[:, 0] = q[:-1]
    return PiecewiseCurve(t, coefficients, np.zeros(len(t) - 1))


def quintic_spline(t: Array, q: Array, dq: Array, ddq: Array) -> PiecewiseCurve:
    """Polynomials of order 5 that meet position, velocity and acceleration at each point; jerk may jump there.

    Parameters
    ----------
    t : increasing times from 0, shape (m + 1,), [s]
    q, dq, ddq : shape (m + 1,), [rad] or [m] and derivatives
    """
    length = np.diff(t)
    step = np.diff(q)
    v0, v1 = dq[:-1] * length, dq[1:] * length
    a0, a1 = ddq[:-1] * length**2, ddq[1:] * length**2
    coefficients = [
        q[:-1],
        v0,
        0.5 * a0,
        10.0 * step - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
        -15.0 * step + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
        6.0 * step - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1,
    ]
    return PiecewiseCurve(t, np.stack(coefficients, axis=1), np.zeros(len(length)))


def cubic_hermite(t: Array, q: Array, dq: Array) -> PiecewiseCurve:
    """Polynomials of order 3 that meet position and velocity at each point; acceleration may jump there.

    Parameters
    ----------
    t : increasing times from 0, shape (m + 1,), [s]
    q, dq : shape (m + 1,), [rad] or [m] and derivative
    """
    length = np.diff(t)
    step = np.diff(q)
    v0, v1 = dq[:-1] * length, dq[1:] * length
    coefficients = [q[:-1], v0, 3.0 * step - 2.0 * v0 - v1, -2.0 * step + v0 + v1]
    return PiecewiseCurve(t, np.stack(coefficients, axis=1), np.zeros(len(length)))


def spline_velocities(t: Array, q: Array) -> Array:
    """Velocities at points, with which cubic polynomials through them have no jump of acceleration; zero at both ends.

    The clamped cubic spline. At an inner point with the lengths h before and g after it, equal accelerations ask for
    g v_before + 2 (g + h) v + h v_after = 3 (g s_before / h + h s_after / g) with the steps s of position.

    Parameters
    ----------
    t : increasing times, shape (m + 1,), [s]
    q : positions, shape (m + 1, n), [rad] or [m]

    Returns
    -------
    velocities : shape (m + 1, n)
    """
    from scipy.linalg import solve_banded

    out = np.zeros_like(q)
    if len(t) < 3:
        return out
    length = np.diff(t)
    before, after = length[:-1, None], length[1:, None]
    step = np.diff(q, axis=0)
    right = 3.0 * (after / before * step[:-1] + before / after * step[1:])
    bands = np.zeros((3, len(t) - 2))
    bands[0, 1:] = length[:-2]
    bands[1] = 2.0 * (length[:-1] + length[1:])
    bands[2, :-1] = length[2:]
    out[1:-1] = solve_banded((1, 1), bands, right, check_finite=False)
    return out


def sin2_profiles(
    q: Array, dwell: Sequence[float], velocity: Array, acceleration: Array
) -> tuple[Array, tuple[PiecewiseCurve, ...]]:
    """Moves from point to point whose acceleration goes like sin^2, up to the jerk continuous. [D] 4.7.1.

    Each move speeds up with A sin^2(pi tau / T), goes on with constant velocity V = A T / 2 if it is long enough, and
    slows down like it sped up. All joints share the time law, in which at least one joint reaches its largest
    acceleration and, in a long move, one its largest velocity. [D] names the profile and its two limits only, so the
    pulse of acceleration is our reading: it keeps the jerk continuous, which elastic joints ask for.

    Parameters
    ----------
    q : points, shape (P, n), no two consecutive ones equal, P >= 2, [rad] or [m]
    dwell : rest at each point, >= 0, shape (P,), [s]
    velocity, acceleration : largest magnitudes V, A > 0, shape (n,)

    Returns
    -------
    times : when the arm arrives at each point, shape (P,), [s]
    curves : one for each joint

    Raises
    ------
    ShapeError
        If two consecutive points are equal.
    """
    knots, arrivals = [0.0], [0.0]
    rows: list[tuple[int, float, float, float]] = []
    ripples: list[float] = []

    def add(length: float, start: float, first: float, second: float, ripple: float) -> None:
        knots.append(knots[-1] + length)
        rows.append((move, start, first, second))
        ripples.append(ripple)

    for k in range(len(q)):
        move = max(k - 1, 0)
        if k:
            pulse, cruise = _durations(np.abs(q[k] - q[k - 1]), velocity, acceleration)
            v = 1.0 / (pulse + cruise)  # of the share of the way, which goes from 0 to 1
            half, turn = 0.5 * v * pulse, v * pulse / (4.0 * np.pi**2)
            add(pulse, 0.0, 0.0, half, -turn)
            if cruise > 0.0:
                add(cruise, half, v * cruise, 0.0, 0.0)
            add(pulse, 1.0 - half, 2.0 * half, -half, turn)
            arrivals.append(knots[-1])
        if dwell[k] > 0.0:
            add(dwell[k], 1.0 if k else 0.0, 0.0, 0.0, 0.0)
    moves = np.array([row[0] for row in rows])
    start, way = q[moves], np.diff(q, axis=0)[moves]
    law, ripple = np.array([row[1:] for row in rows]), np.array(ripples)
    curves = []
    for j in range(q.shape[1]):
        coefficients = way[:, j, None] * law
        coefficients[:, 0] += start[:, j]
        curves.append(PiecewiseCurve(np.array(knots), coefficients, way[:, j] * ripple))
    return np.array(arrivals), tuple(curves)


def _durations(way: Array, velocity: Array, acceleration: Array) -> tuple[float, float]:
    """Duration of a pulse of acceleration and of the constant velocity between two pulses, [s]."""
    moving = way > 0.0
    if not moving.any():
        raise ShapeError("two consecutive points are equal")
    v = float((velocity[moving] / way[moving]).min())
    a = float((acceleration[moving] / way[moving]).min())
    if 2.0 * v * v / a > 1.0:  # too short to reach the velocity
        return (2.0 / a) ** 0.5, 0.0
    pulse = 2.0 * v / a
    return pulse, 1.0 / v - pulse
