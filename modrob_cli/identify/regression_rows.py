"""From runs to the rows of one joint's regression: filtered columns, filtered target, places in time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError
from modrob_cli.identify.covariance import Timeline, effective_samples
from modrob_cli.identify.friction_terms import FrictionShape, JointMotion, columns
from modrob_cli.identify.run import Run
from modrob_cli.identify.signals import Mask

FEWEST_ROWS = 50


@dataclass(frozen=True)
class Rows:
    """Rows of one joint's regression, those of all runs one below the other; M rows, p columns.

    Attributes
    ----------
    terms : names of the columns
    phi : shape (M, p);  target : shape (M,)
    timeline : where each row comes from
    """

    terms: tuple[str, ...]
    phi: Array
    target: Array
    timeline: Timeline

    def only(self, terms: Sequence[str]) -> "Rows":
        """Some of the columns."""
        if tuple(terms) == self.terms:
            return self  # millions of rows are not copied in vain
        picked = [self.terms.index(term) for term in terms]
        return replace(self, terms=tuple(terms), phi=self.phi[:, picked])

    def joined(self, term: str, column: Array) -> "Rows":
        """One column more."""
        return replace(self, terms=(*self.terms, term), phi=np.column_stack([self.phi, column]))

    def replaced(self, term: str, column: Array) -> "Rows":
        """Another column in the place of one."""
        phi = self.phi.copy()
        phi[:, self.terms.index(term)] = column
        return replace(self, phi=phi)

    def residual(self, weights: Array) -> Array:
        """What weighted least squares leaves of the target, times the root of the weights, shape (M,)."""
        root = np.sqrt(weights)
        scaled, target = self.phi * root[:, None], self.target * root
        scale = np.linalg.norm(scaled, axis=0)
        scaled /= np.where(scale > 0.0, scale, 1.0)
        return np.asarray(target - scaled @ np.linalg.lstsq(scaled, target, rcond=None)[0])

    def effective(self, residual: Array) -> float:
        """Number of independent samples that carry as much as this residual does, shape (M,)."""
        line, total = self.timeline, 0.0
        for k, mine in line.spans():
            series = np.zeros(line.lengths[k])
            series[line.index[mine]] = residual[mine]
            total += effective_samples(series, mine.stop - mine.start)
        return total

    def centred(self) -> "Rows":
        """Each log's means taken out of columns and target, which is what an offset per log amounts to."""
        phi, target = self.phi.copy(), self.target.copy()
        for _, mine in self.timeline.spans():
            phi[mine] -= phi[mine].mean(axis=0)
            target[mine] -= target[mine].mean()
        return replace(self, phi=phi, target=target)

    def scaled_condition(self) -> float:
        """Condition number of the columns scaled to length one."""
        values = np.linalg.svd(self.phi / np.linalg.norm(self.phi, axis=0), compute_uv=False)
        return float(values[0] / values[-1]) if len(values) else 1.0


def joint_motion(run: Run, j: int) -> JointMotion:
    """What the columns of joint j are made of."""
    return JointMotion(run.dq[:, j], run.ddq[:, j], run.tau_rigid[:, j])


def picked_runs(runs: Sequence[Run], j: int) -> list[int]:
    """Runs in which joint j moves; all of them if it moves in none."""
    moving = [k for k, run in enumerate(runs) if run.signals.moving[j] and run.used.any()]
    return moving or list(range(len(runs)))


def joint_rows(
    runs: Sequence[Run], j: int, terms: Sequence[str], shape: FrictionShape, targets: Sequence[Array]
) -> Rows:
    """Rows of joint j: columns and target pass the same low-pass; samples near standstill are left out.

    At standstill friction may be anything up to the Coulomb torque. Because the columns are built from the motion
    first and filtered afterwards, the rows next to a reversal carry the same blur of the friction's jump as the
    filtered torque does ("parallel filtering", M. Gautier, Proc. IEEE ICRA (1997) 1443).

    Parameters
    ----------
    targets : for each run what the columns have to explain, shape (N,), not filtered

    Raises
    ------
    NumericalError
        If fewer than 50 rows are left.
    """
    parts = []
    for k in picked_runs(runs, j):
        run, motion = runs[k], joint_motion(runs[k], j)
        chosen = row_mask(run, j)
        both = np.column_stack([columns(terms, motion, shape), targets[k]])
        parts.append((run.filtered(both)[chosen], np.flatnonzero(chosen), np.full(int(chosen.sum()), k)))
    stacked, index, number = (np.concatenate([part[i] for part in parts]) for i in range(3))
    if len(stacked) < FEWEST_ROWS:
        names = ", ".join(run.name for run in runs[:3]) + (" ..." if len(runs) > 3 else "")
        raise NumericalError(
            f"{names}: only {len(stacked)} samples are left for joint {j + 1} after the ends of the log, gaps, "
            "standstill and the held-out part; use longer logs, a higher --cutoff or a smaller --holdout"
        )
    lengths = tuple(len(run.t) for run in runs)
    timeline = Timeline(number, index, lengths, tuple(run.signals.rate for run in runs))
    return Rows(tuple(terms), stacked[:, :-1], stacked[:, -1], timeline)


def filtered_column(runs: Sequence[Run], j: int, term: str, shape: FrictionShape) -> Array:
    """Column of one term at the rows of :func:`joint_rows`, shape (M,)."""
    parts = []
    for k in picked_runs(runs, j):
        column = columns([term], joint_motion(runs[k], j), shape)[:, 0]
        parts.append(runs[k].filtered(column)[row_mask(runs[k], j)])
    return np.concatenate(parts)


def row_mask(run: Run, j: int) -> Mask:
    """Samples of a run that become rows of joint j, shape (N,)."""
    if not run.signals.moving[j]:
        return run.used
    return np.asarray(run.used & (np.abs(run.dq[:, j]) > run.standstill[j]))
