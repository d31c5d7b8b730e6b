"""The two velocities that enter the friction nonlinearly, by variable projection.

For each velocity the other parameters follow by linear least squares; what is left is a search in one unknown.
G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973).
"""

from collections.abc import Sequence

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.friction_terms import FrictionShape
from modrob_cli.identify.regression_rows import Rows, filtered_column
from modrob_cli.identify.robust import RobustFit, spread
from modrob_cli.identify.run import Run

GRID = 16

WIDEST = 0.3
"""Largest transition width that is tried, as a share of the RMS velocity."""

WORTH = 0.01
"""A wider transition has to lower the residual (RMS) by at least this share of the joint's torque (RMS)."""

CHI_SQUARE = 3.84
"""95 % quantile of the chi-square distribution with one degree of freedom."""

GLITCH = 6.0
"""Residuals beyond this many robust standard deviations get less weight when widths are compared.

Not fewer: what a transition of the wrong width leaves near reversals is what the comparison is about.
"""


def sharpest(runs: Sequence[Run], j: int) -> float:
    """Width of a transition that is over where standstill ends."""
    return 0.5 * max(float(run.standstill[j]) for run in runs)


def transition_width(runs: Sequence[Run], j: int, rows: Rows, fit: RobustFit, per_log: bool) -> float:
    """How gradually the Coulomb torque changes sign, [rad/s] or [m/s].

    The transition is sharp unless a gradual one (elastic gears, torque that was filtered before it was recorded)
    explains the record significantly better (likelihood ratio over the effective samples, 95 %) and by an amount that
    matters; then that which explains most is taken. It must matter because the Coulomb torque grows with the width at
    the cost of the viscous one, and nothing but the few samples near reversals tells the width.

    Parameters
    ----------
    rows : of the terms with a sharp transition;  fit : their robust fit
    """
    limit = GLITCH * spread(fit.residual)
    weights = np.minimum(1.0, limit / np.maximum(np.abs(fit.residual), max(limit, np.finfo(float).tiny)))
    narrow = sharpest(runs, j)
    speed = max(float(np.sqrt(np.mean(run.dq[run.used, j] ** 2))) for run in runs if run.used.any())
    if not 2.0 * narrow < WIDEST * speed:
        return narrow
    grid = np.geomspace(narrow, WIDEST * speed, GRID)
    sizes = np.full(GRID, np.inf)
    residual = np.empty(0)
    for k, width in enumerate(grid):
        changed = rows.replaced("coulomb", filtered_column(runs, j, "coulomb", FrictionShape(float(width))))
        left = (changed.centred() if per_log else changed).residual(weights)
        size = float(np.sqrt(np.mean(left**2)))
        if size < sizes.min():
            residual = left
        sizes[k] = size
    best = int(np.argmin(sizes))
    torque = np.sqrt(np.mean(np.concatenate([run.tau[run.used, j] for run in runs]) ** 2))
    if not sizes[0] - sizes[best] > WORTH * torque:
        return narrow
    ratio = 2.0 * np.log(sizes[0] / max(sizes[best], np.finfo(float).tiny))
    return float(grid[best]) if rows.effective(residual) * ratio > CHI_SQUARE else narrow


def stribeck_velocity(
    runs: Sequence[Run], j: int, rows: Rows, weights: Array, width: float, per_log: bool
) -> float | str:
    """Velocity of the Stribeck term that explains most, or the reason why the data do not support such a term.

    It has to pay for its two parameters (Schwarz's criterion over the effective samples), and must lie inside the
    range that was searched: from four times the width of the transition to half of the largest velocity.

    Parameters
    ----------
    rows : of the other terms;  weights : of their robust fit, shape (M,)
    width : of the transition between the signs of the Coulomb torque
    """
    top = 0.5 * max(float(np.max(np.abs(run.dq[run.used, j]), initial=0.0)) for run in runs)
    if not 8.0 * width < top:
        return "the joint moves too slowly to tell friction at low speed from that at high speed"

    def cost(logarithm: float) -> float:
        column = filtered_column(runs, j, "stribeck", FrictionShape(width, float(np.exp(logarithm))))
        wider = rows.joined("stribeck", column)
        return float(np.sum((wider.centred() if per_log else wider).residual(weights) ** 2))

    grid = np.log(np.geomspace(4.0 * width, top, GRID))
    costs = np.array([cost(x) for x in grid])
    best = int(np.argmin(costs))
    if best in (0, GRID - 1):
        side = "below the lowest" if best == 0 else "above the highest"
        return f"its velocity lies {side} that the motion shows"
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(cost, bounds=(grid[best - 1], grid[best + 1]), method="bounded", options={"xatol": 1e-4})
    residual = (rows.centred() if per_log else rows).residual(weights)
    count = rows.effective(residual)
    gain = float(np.sum(residual**2)) / max(float(found.fun), np.finfo(float).tiny)
    if count * np.log(gain) < 2.0 * np.log(count):
        return "it explains no more than its two parameters would explain of noise"
    return float(np.exp(found.x))
