r"""Which inertia tensors a real body can have, for single values and for boxes.

A distribution of mass with total m > 0, centre c and inertia I_c about c exists if and only if its matrix of second
moments :math:`\Sigma_c = \tfrac12 \mathrm{tr}(I_c) 1 - I_c` is positive semi-definite; that is the same as a positive
semi-definite I_c whose principal moments keep the triangle inequality (Wensing, Kim, Slotine, "Linear matrix
inequalities for physically consistent inertial parameter identification", RA-L 2018, eqs. 13-17). For a tensor I_f
about the origin of the frame, :math:`\Sigma_c = \Sigma_f - m\,c c^T`.

Rounding: a smallest eigenvalue down to ``-TOLERANCE`` times the size of the second moments counts as zero, so that
point masses, rods and plates pass.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.body import RigidBody, tensor
from modrob_cli.spatial import parallel_axis

TOLERANCE = 1e-9
_MAX_CUTS = 60


@dataclass(frozen=True)
class Realizability:
    """What a body's box holds.

    Attributes
    ----------
    moments : principal moments of the nominal tensor about the nominal centre of mass, ascending, (3,), [kg m^2]
    nominal : the nominal values are those of a real body
    every : so are all members of the box (exact up to rounding: the least favourable member is a corner)
    some : so is at least one member of the box
    worst : principal moments at the least favourable corner, ascending, (3,), [kg m^2]
    """

    moments: Array
    nominal: bool
    every: bool
    some: bool
    worst: Array


def second_moments(inertia: Array) -> Array:
    """Matrices of second moments tr(I)/2 1 - I, shape (..., 3, 3), of tensors (..., 3, 3); and of I = tr(S) 1 - S."""
    return np.asarray(0.5 * np.trace(inertia, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - inertia)


def inertia_about_com(body: RigidBody) -> Array:
    """Nominal inertia tensor about the nominal centre of mass, axes of the body's frame, shape (3, 3), [kg m^2]."""
    inertia = tensor(body.inertia.nominal)
    if body.inertia_about == "com":
        return inertia
    return np.asarray(inertia - body.mass.nominal * parallel_axis(body.com.nominal))


def realizability(body: RigidBody) -> Realizability:
    """Decide whether nominal values, all members and some member of a body's box are those of a real body.

    ``every`` needs the corners alone: the smallest eigenvalue of Sigma_f(I) - m c c' is concave in (I, c) together
    and falls with m. ``some`` is the maximum of that concave function, decided by cutting planes with an upper and a
    lower bound; where these do not separate within 60 rounds the answer is "yes" (the only approximation here).
    """
    matrices, size = _corners(body)
    lowest = np.linalg.eigvalsh(second_moments(matrices))[:, 0]
    worst = matrices[int(np.argmin(lowest))]
    nominal = inertia_about_com(body)
    good = bool(np.linalg.eigvalsh(second_moments(nominal))[0] >= -TOLERANCE * size)
    every = bool(np.all(lowest >= -TOLERANCE * size))
    some = good or every or _some_member(body, size)
    moments = np.asarray(np.linalg.eigvalsh(np.stack([nominal, worst])), dtype=float)
    return Realizability(moments[0], good, every, some, moments[1])


def _corners(body: RigidBody) -> tuple[Array, float]:
    """Inertia tensors about the centre of mass at the corners of the box, largest mass; and the size of the data."""
    box = body.inertia.interval
    ends = [sorted({low, high}) for low, high in zip(box.inf.tolist(), box.sup.tolist(), strict=True)]
    entries = tensor(np.array(list(itertools.product(*ends))))
    shift = np.zeros((1, 3, 3))
    if body.inertia_about == "frame":
        com = body.com.interval
        ends = [sorted({low, high}) for low, high in zip(com.inf.tolist(), com.sup.tolist(), strict=True)]
        shift = body.mass.interval.sup * parallel_axis(np.array(list(itertools.product(*ends))))
    matrices = (entries[:, None] - shift[None]).reshape(-1, 3, 3)
    return matrices, float(max(np.abs(entries).max(), np.abs(shift).max()))


def _some_member(body: RigidBody, size: float) -> bool:
    """Look for a member (I, c) at the smallest mass with Sigma_f(I) - m c c' >= 0, by its Schur complement.

    F(x) = [[Sigma_f(I) / s, r c], [r c', 1]] with r^2 = m / s, s the size of the data: affine in x = (I, c).
    """
    about_frame = body.inertia_about == "frame"
    boxes = [body.inertia.interval] + ([body.com.interval] if about_frame else [])
    lower, upper = np.concatenate([box.inf for box in boxes]), np.concatenate([box.sup for box in boxes])
    dim = 4 if about_frame else 3
    slopes = np.zeros((len(lower), dim, dim))
    slopes[:6, :3, :3] = second_moments(tensor(np.eye(6))) / size
    constant = np.zeros((dim, dim))
    if about_frame:
        root = np.sqrt(body.mass.interval.inf / size)
        slopes[range(6, 9), range(3), 3] = slopes[range(6, 9), 3, range(3)] = root
        constant[3, 3] = 1.0
    return _has_semidefinite_member(constant, slopes, lower, upper)


def _has_semidefinite_member(constant: Array, slopes: Array, lower: Array, upper: Array) -> bool:
    """Whether constant + sum x_k slopes_k is positive semi-definite for some x in a box (Kelley's cutting planes).

    Each eigenvector v of a failed attempt gives the cut t <= v' F(x) v; the linear programme's optimum t bounds the
    largest possible smallest eigenvalue from above.
    """
    x = 0.5 * lower + 0.5 * upper
    if np.array_equal(lower, upper):
        return bool(np.linalg.eigvalsh(constant + np.tensordot(x, slopes, 1))[0] >= -TOLERANCE)
    from scipy.optimize import linprog

    rows: list[Array] = []
    sides: list[Array] = []
    for _ in range(_MAX_CUTS):
        values, vectors = np.linalg.eigh(constant + np.tensordot(x, slopes, 1))
        if values[0] >= -TOLERANCE:
            return True
        gains = np.einsum("ik,xij,jk->kx", vectors, slopes, vectors)
        rows.append(np.hstack([-gains, np.ones((len(gains), 1))]))
        sides.append(np.einsum("ik,ij,jk->k", vectors, constant, vectors))
        bounds = [*zip(lower, upper, strict=True), (None, None)]
        best = linprog([0.0] * len(x) + [-1.0], np.vstack(rows), np.concatenate(sides), bounds=bounds)
        if not best.success:
            return True
        if best.x[-1] < -TOLERANCE:
            return False
        x = best.x[:-1]
    return True
