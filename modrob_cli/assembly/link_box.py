r"""The central inertia of a link as a function of its bodies' masses and centres of mass.

With body b at rotation R_b, translation t_b in the link's frame, r_b = R_b c_b + t_b, and a quadratic form g for each
tensor entry (g(v) = v'v - v_k^2 for a diagonal entry kk, g(v) = -v_k v_l for an entry kl), the entry is

.. math:: f(m, c) = \sum_b (R_b I_b R_b')_{kl} + \sum_b m_b g(r_b - \bar c) - \sum_{b \in F} m_b g(R_b c_b),

where \bar c = \sum m_b r_b / \sum m_b and F are the bodies whose tensor is given about their frame's origin instead
of their centre of mass. The first sum is independent of the rest; this module evaluates the rest and its gradient

.. math:: \partial f / \partial m_b = g(r_b - \bar c) - [b \in F]\, g(R_b c_b), \qquad
          \partial f / \partial c_b = 2 m_b R_b' A (r_b - \bar c - [b \in F]\, R_b c_b), \quad g(v) = v' A v,

at points and over boxes. Rounding is to nearest; :mod:`modrob_cli.assembly.inertia_range` allows for it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices
from modrob_cli.model.body import PlacedBody

Ends = tuple[Array, Array]

_K = np.array([0, 0, 0, 1, 1, 2])
_L = np.array([0, 1, 2, 1, 2, 2])


def _forms() -> Array:
    """Matrices A of the six quadratic forms, shape (6, 3, 3), in the order xx, xy, xz, yy, yz, zz."""
    forms = np.zeros((6, 3, 3))
    for entry, (k, l) in enumerate(zip(_K, _L, strict=True)):  # noqa: E741 - the formula's index
        if k == l:
            forms[entry] = np.eye(3)
            forms[entry, k, k] = 0.0
        else:
            forms[entry, k, l] = forms[entry, l, k] = -0.5
    return forms


FORMS = _forms()


@dataclass(frozen=True)
class LinkBox:
    """Bodies of one link; a point of its box is (m_1..m_B, c_1..c_B), shape (4 B,).

    Attributes
    ----------
    R, t : shape (B, 3, 3), (B, 3);  about_frame : shape (B,), 1 for bodies in F, else 0
    """

    R: Array
    t: Array
    about_frame: Array

    @classmethod
    def of(cls, bodies: list[PlacedBody]) -> "LinkBox":
        """From bodies placed in the link's frame."""
        R = np.stack([placed.pose[:3, :3] for placed in bodies])
        t = np.stack([placed.pose[:3, 3] for placed in bodies])
        return cls(R, t, np.array([float(placed.body.inertia_about == "frame") for placed in bodies]))

    def _split(self, x: Array) -> tuple[Array, Array]:
        """Masses (K, B) and centres of mass (K, B, 3) of points (K, 4 B)."""
        size = len(self.t)
        return x[:, :size], x[:, size:].reshape(-1, size, 3)

    def value(self, x: Array, entry: Indices) -> Array:
        """Value of f at points x (K, 4 B) for entries (K,), without the bodies' own tensors; shape (K,)."""
        m, c = self._split(x)
        turned = np.einsum("bij,kbj->kbi", self.R, c)
        r = turned + self.t
        total = m.sum(axis=1)
        centre = np.einsum("kb,kbi->ki", m, r) / np.where(total > 0.0, total, 1.0)[:, None]
        A = FORMS[entry]
        v = r - centre[:, None]
        spread = np.einsum("kbi,kij,kbj->kb", v, A, v) - self.about_frame * np.einsum(
            "kbi,kij,kbj->kb", turned, A, turned
        )
        return np.asarray((m * spread).sum(axis=1))

    def gradient(self, low: Array, high: Array, entry: Indices) -> Ends:
        """Bounds of the gradient over boxes (K, 4 B) for entries (K,); two arrays of shape (K, 4 B)."""
        m_low, c_low = self._split(low)
        m_high, c_high = self._split(high)
        turned = _linear(self.R, 0.5 * (c_low + c_high), 0.5 * (c_high - c_low))
        lever = self._levers(m_low, m_high, turned)
        A = FORMS[entry]
        by_mass = _form(lever, entry)
        own = _form(turned, entry)
        by_mass = (by_mass[0] - self.about_frame * own[1], by_mass[1] - self.about_frame * own[0])
        flag = self.about_frame[:, None]
        inner = (lever[0] - flag * turned[1], lever[1] - flag * turned[0])
        RtA = np.einsum("bji,kjl->kbil", self.R, A)
        force = _linear(RtA, 0.5 * (inner[0] + inner[1]), 0.5 * (inner[1] - inner[0]))
        m2 = (2.0 * m_low[..., None], 2.0 * m_high[..., None])
        by_com = (
            np.minimum(m2[0] * force[0], m2[1] * force[0]),
            np.maximum(m2[0] * force[1], m2[1] * force[1]),
        )
        flat = len(entry), -1
        return (
            np.concatenate([by_mass[0], by_com[0].reshape(flat)], axis=1),
            np.concatenate([by_mass[1], by_com[1].reshape(flat)], axis=1),
        )

    def curvature(self) -> Array:
        """Sign of the second derivative of f in each variable alone, shape (6, 4 B); 2 stands for no fixed sign.

        Along c_b: (R' A R)_kk times 2 m_b (1 - w_b), or for b in F times -2 m_b w_b, with w_b = m_b / total. Along m_b
        f is monotone for b not in F (then an end point is best for either end, coded 0). A curvature within rounding
        of zero counts as zero.
        """
        along = np.einsum("bji,ejl,bli->ebi", self.R, FORMS, self.R)
        along = np.where(np.abs(along) < 1e-14, 0.0, np.sign(along)) * (1.0 - 2.0 * self.about_frame[:, None])
        by_mass = np.repeat((2.0 * self.about_frame)[None], 6, axis=0)
        return np.concatenate([by_mass, along.reshape(6, -1)], axis=1)

    def is_concave(self, low: Array, high: Array, entry: Indices, sign: Array) -> NDArray[np.bool_]:
        """True where sign f is known to be jointly concave in the variables that are free in a box, shape (K,).

        For diagonal entries and fixed masses, f is a weighted variance, convex in the c_b outside F, and a linear
        function minus a square in those of F.
        """
        free_mass, free_com = self._split(high - low)
        blocked = np.where(sign[:, None] < 0.0, self.about_frame, 1.0 - self.about_frame)[:, :, None]
        return np.asarray((_K[entry] == _L[entry]) & ~free_mass.any(axis=1) & ~(free_com * blocked).any(axis=(1, 2)))

    def _levers(self, m_low: Array, m_high: Array, turned: Ends) -> Ends:
        """Bounds of r_b - centre = sum_j w_j (r_b - r_j), w_j = m_j / total, shape (K, B, 3) each.

        The pairwise form keeps r_b out of the centre of mass, and so the sign of short levers.
        """
        r_low, r_high = turned[0] + self.t, turned[1] + self.t
        others_low = m_low.sum(axis=1, keepdims=True) - m_low
        others_high = m_high.sum(axis=1, keepdims=True) - m_high
        w_low, w_high = _share(m_low, others_high), _share(m_high, others_low)
        gap_low = r_low[:, :, None] - r_high[:, None, :]
        gap_high = r_high[:, :, None] - r_low[:, None, :]
        same = np.eye(len(self.t), dtype=bool)[None, :, :, None]
        gap_low, gap_high = np.where(same, 0.0, gap_low), np.where(same, 0.0, gap_high)
        weight = (w_low[:, None, :, None], w_high[:, None, :, None])
        low = np.minimum(weight[0] * gap_low, weight[1] * gap_low).sum(axis=2)
        high = np.maximum(weight[0] * gap_high, weight[1] * gap_high).sum(axis=2)
        return low, high


def _share(part: Array, rest: Array) -> Array:
    """Share part / (part + rest), 0 where both are 0."""
    total = part + rest
    return np.asarray(np.where(total > 0.0, part / np.where(total > 0.0, total, 1.0), 0.0))


def _linear(M: Array, mid: Array, rad: Array) -> Ends:
    """Range of M v over boxes of v (midpoint and radius), exact for each component."""
    centre = np.einsum("...ij,...j->...i", M, mid)
    spread = np.einsum("...ij,...j->...i", np.abs(M), rad)
    return centre - spread, centre + spread


def _form(v: Ends, entry: Indices) -> Ends:
    """Range of the quadratic forms of the entries (K,) over boxes of v (K, B, 3); exact: no variable twice."""
    low, high = v
    square_high = np.maximum(low**2, high**2)
    square_low = np.where((low <= 0.0) & (high >= 0.0), 0.0, np.minimum(low**2, high**2))
    k, l = _K[entry][:, None, None], _L[entry][:, None, None]  # noqa: E741 - the formula's index
    a = [np.take_along_axis(end, k, axis=2)[..., 0] for end in v]
    b = [np.take_along_axis(end, l, axis=2)[..., 0] for end in v]
    products = np.stack([x * y for x in a for y in b])
    diagonal = (k == l)[..., 0]
    lower = square_low.sum(axis=2) - np.take_along_axis(square_low, k, axis=2)[..., 0]
    upper = square_high.sum(axis=2) - np.take_along_axis(square_high, k, axis=2)[..., 0]
    return (
        np.where(diagonal, lower, -products.max(axis=0)),
        np.where(diagonal, upper, -products.min(axis=0)),
    )
