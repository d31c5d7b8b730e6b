"""From a fit in units of the record to torque, and what is to be said about it."""

from collections.abc import Mapping, Sequence

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError
from modrob_cli.identify.covariance import quantile
from modrob_cli.identify.friction_terms import NON_NEGATIVE
from modrob_cli.identify.regression_result import DIRECTIONAL, Estimate

GAIN = "torque_share"
"""Column of the rigid-body torque when the gain is unknown: the recorded effort per unit of torque, 1 / gain."""


def in_torque(
    terms: list[str], values: Array, matrix: Array, stderr: Array
) -> tuple[list[str], Array, Array, Array, float]:
    """From effort per unit to torque per unit: gain = 1 / share, the others times the gain; errors to first order."""
    place = terms.index(GAIN)
    share = float(values[place])
    if share == 0.0:
        raise NumericalError("the recorded effort does not follow the rigid-body torque: the drive gain is infinite")
    gain = 1.0 / share
    jacobian = gain * np.eye(len(values))
    jacobian[:, place] = -values * gain**2
    jacobian[place, place] = -(gain**2)
    new = values * gain
    new[place] = gain
    fixed = [k for k, term in enumerate(terms) if term in ("transition_width", "stribeck_velocity")]
    for k in fixed:
        jacobian[k], new[k] = np.eye(len(values))[k], values[k]
    cov = jacobian @ matrix @ jacobian.T
    inflation = float(np.max(stderr / np.maximum(np.sqrt(np.diag(matrix)), np.finfo(float).tiny)))
    names = ["drive_gain" if term == GAIN else term for term in terms]
    return names, new, cov, inflation * np.sqrt(np.diag(cov)), abs(gain)


def fit_notes(estimates: Mapping[str, Estimate], outliers: float) -> tuple[str, ...]:
    """What is to be said about estimates and outliers, in words."""
    notes = []
    for term in NON_NEGATIVE:
        estimate = estimates.get(term)
        if estimate is None or estimate.value is None or estimate.interval is None or estimate.value >= 0.0:
            continue
        if estimate.interval[1] >= 0.0:
            notes.append(f"{term} is negative but not distinguishable from zero; the robot file gets the fit without")
        else:
            notes.append(f"{term} is negative, which no joint has: it makes up for errors of the rigid-body model")
    if outliers > 0.05:
        notes.append(f"{outliers:.0%} of the samples count less as outliers: look at the residuals")
    return tuple(notes)


def directional(
    estimates: Mapping[str, Estimate], terms: Sequence[str], correlation: Array, confidence: float
) -> dict[str, Estimate]:
    """Friction in each direction, with the errors that follow from those of its two parts.

    Parameters
    ----------
    correlation : of the terms, shape (p, p)
    """
    found = {}
    for name, (term, other, sign) in DIRECTIONAL.items():
        a, b = estimates.get(term), estimates.get(other)
        if a is None or b is None or a.value is None or b.value is None:
            continue
        size, more = a.stderr or 0.0, b.stderr or 0.0
        variance = (
            size**2 + more**2 + 2.0 * sign * float(correlation[terms.index(term), terms.index(other)]) * size * more
        )
        value, stderr = a.value + sign * b.value, float(np.sqrt(max(variance, 0.0)))
        dof = min(a.dof or np.inf, b.dof or np.inf)
        half = float(quantile(confidence, np.array(dof))) * stderr
        found[name] = Estimate(value, stderr, (value - half, value + half), dof)
    return found
