r"""What one rigid body asks of one joint, as a function of the body's own parameters.

In the body's frame, with its motion (omega, alpha, acc) and the unit motion screw (w, v) of joint j there,

.. math:: \tau_j = m\,(y_0 + y \cdot c) + \operatorname{tr}(B\, I_o), \qquad
          y_0 = v \cdot acc, \quad
          y = v \times \alpha + \omega \times (\omega \times v) + acc \times w, \quad
          B = \mathrm{sym}(w \alpha') + \mathrm{sym}((w \times \omega)\, \omega'),

where I_o is the tensor about the frame's origin. With the tensor about the centre of mass, I_o = I + m (c'c 1 - c c'),
the same reads m (y0 + y.c + c'Qc) + tr(B I) with Q = tr(B) 1 - B. It follows from Newton's and Euler's equations
[D] (2.15), (2.16) and virtual power; it is one row of the torque regressor for (m, m c, I_o).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.dynamics.link_motion import JointPosition, Motion
from modrob_cli.dynamics.vectors import apply, cross, dot

_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@dataclass(frozen=True)
class Screw:
    """Unit motion of a joint seen from a frame: angular velocity w and velocity v of the origin, (3, T) each."""

    w: Array
    v: Array

    def seen_from(self, R: Array, t: Array) -> "Screw":
        """The same motion in another frame of the body, at constant rotation R and translation t (3,)."""
        moved = self.v + cross(self.w, t[:, None]) if np.any(t != 0.0) else self.v
        return Screw(apply(R.T, self.w), apply(R.T, moved))


@dataclass(frozen=True)
class BodyTerms:
    """Coefficients of one body in one joint's torque.

    Attributes
    ----------
    y0 : shape (T,);  y : shape (3, T)
    B : entries xx, xy, xz, yy, yz, zz of the symmetric matrix, shape (6, T)
    """

    y0: Array
    y: Array
    B: Array

    def times(self, factor: float | Array) -> "BodyTerms":
        """Coefficients times a number, or one for each sample (T,); torque is linear in them."""
        return BodyTerms(factor * self.y0, factor * self.y, factor * self.B)

    def of_samples(self, which: Indices) -> "BodyTerms":
        """Coefficients at some of the samples."""
        return BodyTerms(self.y0[which], self.y[:, which], self.B[:, which])

    def __add__(self, other: "BodyTerms") -> "BodyTerms":
        """Sum of coefficients."""
        return BodyTerms(self.y0 + other.y0, self.y + other.y, self.B + other.B)


def body_terms(motion: Motion, screw: Screw) -> BodyTerms:
    """Coefficients from the body's motion and a joint's screw, both in the body's frame."""
    w, v, omega, alpha, acc = screw.w, screw.v, motion.omega, motion.alpha, motion.acc
    u = cross(w, omega)
    y = cross(v, alpha) + cross(omega, cross(omega, v)) + cross(acc, w)
    B = np.stack([0.5 * (w[i] * alpha[k] + w[k] * alpha[i] + u[i] * omega[k] + u[k] * omega[i]) for i, k in _PAIRS])
    return BodyTerms(dot(v, acc), y, B)


def joint_screws(positions: list[JointPosition]) -> Iterator[list[Screw]]:
    """For each link in turn, the screws of joints 1 to i in its frame at its origin."""
    screws: list[Screw] = []
    for position in positions:
        p = position.p
        screws = [Screw(position.to_link(s.w), position.to_link(s.v + cross(s.w, p))) for s in screws]
        axis = np.zeros((3, len(position.cos)))
        axis[2] = 1.0
        still = np.zeros_like(axis)
        screws.append(Screw(axis, still) if position.is_revolute else Screw(still, axis))
        yield screws
