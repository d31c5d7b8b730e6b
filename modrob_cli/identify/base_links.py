r"""Which link's data are wrong: each link's parameters in turn are let free, and the gain is compared.

Friction, offsets and rotors of all joints are free in every hypothesis, so that they are not taken for masses. A
hypothesis with k parameters that lowers the weighted sum of squared residuals by G is worth

.. math:: \text{evidence} = G / \kappa - k \ln(N / \kappa)

(twice the log-likelihood ratio with the penalty of G. Schwarz, Annals of Statistics 6 (1978)), where kappa is the
variance inflation of correlated residuals: N samples count as N / kappa independent ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.newton_euler import nominal_links
from modrob_cli.dynamics.regressor import PARAMETERS
from modrob_cli.identify.base_columns import TENSOR_ORDER
from modrob_cli.identify.base_estimate import BaseEstimate
from modrob_cli.identify.base_parameters import BaseModel
from modrob_cli.model.body import tensor_entries
from modrob_cli.model.robot import Robot
from modrob_cli.spatial import parallel_axis

KINDS = ("mass", "first moment", "inertia", "all")
"""Corrections of one link: the mass (centre of mass and central inertia as given), the centre of mass, the inertia
tensor, or all ten parameters."""

ALIKE = 0.995
"""Two masses whose effects on the torque have this cosine cannot be told apart in practice."""

_VISIBLE = 1e-4
"""Least share of a correction's torque that friction and rotors must leave."""


@dataclass(frozen=True)
class Correction:
    """A change of one link's parameters that might explain the data.

    Attributes
    ----------
    link : from 1;  kind : one of ``mass``, ``first moment``, ``inertia``, ``all``
    size : number of parameters that the data can tell; 0 if the torque does not depend on them
    gain : by how much the weighted sum of squared residuals falls;  explained : that as a part of it, 0 .. 1
    share : the same as part of what all rigid-body parameters together explain, 0 .. 1
    evidence : see the module; above 0 the correction is better than none
    mass_factor, mass_stderr : for kind ``mass``: estimated true mass / given mass, and its standard error
    alike : other links whose mass the data cannot tell from this one's (kind ``mass``)
    """

    link: int
    kind: str
    size: int
    gain: float
    explained: float
    share: float
    evidence: float
    mass_factor: float | None
    mass_stderr: float | None
    alike: tuple[int, ...]


def corrections(
    robot: Robot, model: BaseModel, fit: BaseEstimate, accepted: Sequence[Correction] = ()
) -> list[Correction]:
    """All single-link corrections, the best first; those that the torque does not depend on come last.

    Parameters
    ----------
    accepted : corrections that are free in every hypothesis, as friction is
    """
    problem = _Problem.of(robot, model, fit, accepted)
    tried, masses = [], {}
    for link in range(1, robot.dof + 1):
        for kind, directions in link_directions(robot, link).items():
            effect = problem.effect(link, directions)
            tried.append(_correction(problem, link, kind, effect))
            if kind == "mass" and tried[-1].size:
                left = problem.beyond(effect[:, 0])
                masses[link] = left / np.linalg.norm(left)
    tried = [replace(item, alike=_alike(masses, item.link)) if item.kind == "mass" else item for item in tried]
    return sorted(tried, key=lambda item: (-item.evidence if item.size else np.inf, item.link, item.size))


def _alike(effects: dict[int, Array], link: int) -> tuple[int, ...]:
    """Links whose mass has nearly the same effect as that of one link."""
    own = effects.get(link)
    if own is None:
        return ()
    return tuple(other for other, effect in effects.items() if other != link and abs(own @ effect) > ALIKE)


def link_directions(robot: Robot, link: int) -> dict[str, Array]:
    """Directions in the ten parameters of a link, shape (10, k), by kind of correction; no mass without mass."""
    given = nominal_links(robot)[link - 1]
    out = {"first moment": np.eye(10)[:, 1:4], "inertia": np.eye(10)[:, 4:], "all": np.eye(10)}
    if given.mass > 0.0:
        com = given.moment / given.mass
        steiner = tensor_entries(parallel_axis(com))[TENSOR_ORDER]
        out["mass"] = given.mass * np.concatenate([[1.0], com, steiner])[:, None]
        # The tensor about the link's origin moves with the centre of mass: d(m (c'c 1 - c c')) for d(m c) = e_k.
        for k in range(3):
            e = np.eye(3)[k]
            shift = 2.0 * (com @ e) * np.eye(3) - np.outer(com, e) - np.outer(e, com)
            out["first moment"][4:, k] = tensor_entries(shift)[TENSOR_ORDER]
    return out


@dataclass(frozen=True)
class _Problem:
    """Weighted rows after friction, rotors and accepted corrections were taken out.

    Attributes
    ----------
    rows : effect of each standard parameter, shape (p + 1, C); without parameters that are not excited
    Q : orthonormal basis of what was taken out
    residual : what is left of the residual;  total : its square;  rigid : the part that rigid bodies can explain
    kappa, count : variance inflation and number of samples
    """

    rows: Array
    Q: Array
    residual: Array
    total: float
    rigid: float
    kappa: float
    count: float

    @classmethod
    def of(cls, robot: Robot, model: BaseModel, fit: BaseEstimate, accepted: Sequence[Correction]) -> "_Problem":
        p = model.count
        R, target = fit.factor[:, :p] * fit.excited, fit.factor[:, p]
        rows = R @ model.grouping.transform
        drives = [k for k, column in enumerate(model.columns) if not column.is_rigid]
        free = [rows[:, drives]]
        free += [rows[:, _columns_of(item.link)] @ link_directions(robot, item.link)[item.kind] for item in accepted]
        Q = _basis(np.column_stack(free))
        residual = target - Q @ (Q.T @ target)
        everything = _basis(R)
        rest = target - everything @ (everything.T @ target)
        total = float(residual @ residual)
        rigid = max(total - float(rest @ rest), 0.0)
        return cls(rows, Q, residual, total, rigid, max(fit.inflation, 1.0), float(fit.samples.sum()))

    def effect(self, link: int, directions: Array) -> Array:
        """Weighted torque of a link's directions (10, k), shape (p + 1, k)."""
        return np.asarray(self.rows[:, _columns_of(link)] @ directions)

    def beyond(self, effect: Array) -> Array:
        """What is left of an effect (p + 1, ...) when friction, rotors and accepted corrections are free."""
        effect = effect - self.Q @ (self.Q.T @ effect)
        return np.asarray(effect - self.Q @ (self.Q.T @ effect))


def _columns_of(link: int) -> slice:
    return slice(len(PARAMETERS) * (link - 1), len(PARAMETERS) * link)


def _basis(X: Array) -> Array:
    """Orthonormal basis of columns of any lengths; dependent ones are left out."""
    length = np.linalg.norm(X, axis=0)
    U, s, _ = np.linalg.svd(X[:, length > 0.0] / length[length > 0.0], full_matrices=False)
    return np.asarray(U[:, s > 1e-9 * s.max(initial=0.0)])


def _correction(problem: _Problem, link: int, kind: str, effect: Array) -> Correction:
    length = np.linalg.norm(effect, axis=0)
    left = problem.beyond(effect[:, length > 0.0] / length[length > 0.0])
    U, s, _ = np.linalg.svd(left, full_matrices=False)
    size = int(np.count_nonzero(s > _VISIBLE))
    gain = float(((U[:, :size].T @ problem.residual) ** 2).sum())
    evidence = gain / problem.kappa - size * np.log(max(problem.count / problem.kappa, 2.0))
    factor = stderr = None
    if kind == "mass" and size:
        alone = problem.beyond(effect[:, 0])
        factor = 1.0 + float(alone @ problem.residual / (alone @ alone))
        stderr = float(np.sqrt(problem.kappa / (alone @ alone)))
    explained = gain / problem.total if problem.total > 0.0 else 0.0
    share = min(gain / problem.rigid, 1.0) if problem.rigid > 0.0 else 0.0
    return Correction(link, kind, size, gain, explained, share, float(evidence), factor, stderr, ())
