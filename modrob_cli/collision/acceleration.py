r"""Acceleration from measured velocities, causal, with a bound of its error.

Over the last w steps of length h the mean acceleration is (dq_k - dq_{k-w}) / (w h). With velocities known to +-nu and
abs(d ddq / dt) <= J it differs from the acceleration at k by at most

.. math:: \frac{2 \nu}{w h} + \frac{J w h}{2},

which is smallest for w h = 2 sqrt(nu / J), namely 2 sqrt(nu J). Where a joint may change its direction, Coulomb
friction jumps, and with it the acceleration of all joints: there a stated jump is added, as long as it may lie in the
window. A joint may do so where its measured velocity is within the noise and a stated speed of zero, or changes its
sign.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.errors import NumericalError


@dataclass(frozen=True)
class VelocityKnowledge:
    """What is known of the velocities, shape (n,) each.

    Attributes
    ----------
    noise : half-width of the measured ones
    jerk : largest change of acceleration per time, > 0, [rad/s^3] or [m/s^3]
    jump : largest sudden change of acceleration where a joint reverses
    still : speed below which a joint may reverse
    """

    noise: Array
    jerk: Array
    jump: Array
    still: Array


def estimation_windows(known: VelocityKnowledge, step: float) -> Indices:
    """Samples over which each joint's acceleration is estimated, shape (n,), at this step [s].

    Raises
    ------
    NumericalError
        If a jerk is not positive.
    """
    if not np.all(np.isfinite(known.jerk) & (known.jerk > 0.0)):
        raise NumericalError("the largest jerk of every joint has to be positive")
    return np.maximum(np.round(2.0 * np.sqrt(known.noise / known.jerk) / step), 1.0).astype(np.intp)


def measured_acceleration(
    t: Array, dq: Array, known: VelocityKnowledge, step: float | None = None
) -> tuple[Array, Array, int]:
    """Acceleration from velocities and the half-width of its error.

    Parameters
    ----------
    t : increasing times, shape (N,), [s];  dq : measured velocities, shape (N, n)
    step : of a longer log that this is a piece of, [s]; None: the median one. Of a piece, samples before ``first``
        lack their past, and the last one lacks the step behind it.

    Returns
    -------
    ddq, tolerance : shape (N, n)
    first : samples before have no full window; there the tolerance does not hold

    Raises
    ------
    NumericalError
        If a jerk is not positive, or the log is shorter than a window.
    """
    windows = estimation_windows(known, float(np.median(np.diff(t))) if step is None else step)
    longest = int(windows.max())
    if longest >= len(t):
        raise NumericalError("the log is shorter than the window over which accelerations are estimated")
    jumps = _may_jump(dq, known, longest)
    ddq, tolerance = np.zeros_like(dq), np.zeros_like(dq)
    for j, w in enumerate(windows.tolist()):
        # Real time stamps: a step that is longer than the median one still gives the mean over its own length.
        length = t[w:] - t[:-w]
        ddq[w:, j] = (dq[w:, j] - dq[:-w, j]) / length
        tolerance[w:, j] = 2.0 * known.noise[j] / length + 0.5 * known.jerk[j] * length + known.jump[j] * jumps[w:]
    return ddq, tolerance, longest


def _may_jump(dq: Array, known: VelocityKnowledge, window: int) -> Array:
    """1 where some joint may have reversed within the window before a sample or the step behind it, else 0."""
    near = np.abs(dq) <= known.noise + known.still
    near[1:] |= np.sign(dq[1:]) != np.sign(dq[:-1])
    total = np.concatenate([[0], np.cumsum(near.any(axis=1))])
    k = np.arange(len(dq))
    last, first = np.minimum(k + 2, len(dq)), np.maximum(k - window, 0)
    return np.asarray(total[last] > total[first], dtype=float)
