r"""Which columns of a regressor are independent, and how the others combine from them.

A regressor W whose columns depend on each other, :math:`W_d = W_b K`, gives the same torque for all parameters with
the same :math:`\beta = \pi_b + K \pi_d`: the base parameters. M. Gautier, "Numerical calculation of the base inertial
parameters of robots", J. Robotic Systems 8 (1991), eqs. 13-22.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.errors import NumericalError

TOLERANCE = 1e-6
"""A column counts as dependent if the columns before it leave less than this share of it."""

_CLEAR = 1e3
"""A rank is clear if the least share that was kept is this many times the largest that was dropped."""
_ROUNDED_AWAY = 1e-9


@dataclass(frozen=True)
class Grouping:
    """Independent columns b of a regressor with C columns, and what the others add to them.

    Attributes
    ----------
    independent : indices of b, in order of choice, shape (p,)
    transform : base = transform @ standard, shape (p, C); the identity in the columns ``independent``
    kept, dropped : smallest share left of an independent column, largest share left of a dependent one (0 if none)
    pivots : absolute diagonal of the rank-revealing QR of the normalised columns, falling, shape (C,)
    """

    independent: Indices
    transform: Array
    kept: float
    dropped: float
    pivots: Array

    @property
    def rank(self) -> int:
        """Number of base parameters."""
        return len(self.independent)

    @property
    def is_clear(self) -> bool:
        """True if kept and dropped columns are far apart, so that the tolerance does not decide."""
        return self.kept > _CLEAR * self.dropped


def triangular(W: Array) -> Array:
    """Triangular factor R of W = Q R, shape (C, C): it has the same dependencies and norms with few rows."""
    rows = np.vstack([W, np.zeros((max(0, W.shape[1] - len(W)), W.shape[1]))])
    return np.asarray(np.linalg.qr(rows, mode="r"))


def group(W: Array, preference: Indices, tolerance: float = TOLERANCE, negligible: float = TOLERANCE) -> Grouping:
    """Find independent columns and the combinations of the others.

    The rank comes from a QR decomposition with column pivoting. Which columns stand for the groups is a matter of
    taste: they are taken in the order of ``preference`` (each that the ones before it do not imply), so that the
    formulas are those a person expects. Should that order give another rank, the pivots decide.

    Parameters
    ----------
    W : regressor, shape (rows, C); columns of any scale
    preference : a permutation of the columns, the ones to keep first
    tolerance : least share of a column that those before it must leave
    negligible : a column smaller than this beside the largest counts as zero

    Raises
    ------
    NumericalError
        If the regressor is not finite.
    """
    from scipy.linalg import qr, solve_triangular

    if not np.isfinite(W).all():
        raise NumericalError("the regressor has values that are not finite; look at the sizes in the robot file")
    R = triangular(W)
    norms = np.linalg.norm(R, axis=0)
    # Columns that are next to nothing beside the largest (rounding, angles with few digits) are not blown up.
    norms = np.where(norms > negligible * norms.max(initial=0.0), norms, np.inf)
    R = R / norms
    _, upper, order = qr(R, mode="economic", pivoting=True)
    pivots = np.abs(np.diag(upper))
    rank = int(np.count_nonzero(pivots > tolerance))
    chosen, shares = _choose(R, preference, tolerance)
    if len(chosen) != rank:
        chosen, shares = _choose(R, np.asarray(order), tolerance)
    others = np.setdiff1d(np.arange(R.shape[1]), chosen)
    Q, base = np.linalg.qr(R[:, chosen])
    K = solve_triangular(base, Q.T @ R[:, others]) / norms[chosen][:, None]
    K = np.where(np.isinf(norms[others]), 0.0, K * np.where(np.isinf(norms[others]), 0.0, norms[others]))
    transform = np.zeros((len(chosen), R.shape[1]))
    transform[:, chosen] = np.eye(len(chosen))
    transform[:, others] = np.where(np.abs(K) > _ROUNDED_AWAY, K, 0.0)
    left = [shares[k] for k in others]
    kept = min((shares[k] for k in chosen), default=0.0)
    return Grouping(chosen, transform, kept, max(left, default=0.0), pivots)


def _choose(R: Array, preference: Indices, tolerance: float) -> tuple[Indices, dict[int, float]]:
    """Columns that the ones chosen before do not imply, and the share left of every column.

    Gram-Schmidt, each column twice, which keeps the basis orthogonal to rounding (Giraud et al. 2005).
    """
    basis = np.empty((R.shape[0], 0))
    chosen: list[int] = []
    shares: dict[int, float] = {}
    for k in preference.tolist():
        rest = R[:, k] - basis @ (basis.T @ R[:, k])
        rest = rest - basis @ (basis.T @ rest)
        shares[k] = float(np.linalg.norm(rest))
        if shares[k] > tolerance:
            chosen.append(k)
            basis = np.column_stack([basis, rest / shares[k]])
    return np.array(chosen, dtype=np.intp), shares
