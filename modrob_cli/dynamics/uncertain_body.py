"""Bodies with boxes, prepared once for many samples."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.body_terms import BodyTerms
from modrob_cli.dynamics.quadratic_range import entry, quadratic_range
from modrob_cli.model.body import PlacedBody, RigidBody
from modrob_cli.model.robot import Robot

_TWICE = np.array([1.0, 2.0, 2.0, 1.0, 2.0, 1.0])


def is_exact(body: RigidBody) -> bool:
    """True if no parameter of the body has any width."""
    return body.mass.is_exact and body.com.is_exact and body.inertia.is_exact


@dataclass(frozen=True)
class UncertainBody:
    """Box of one body as midpoints and half-widths (which enclose the given ends, rounded up).

    Attributes
    ----------
    link : 0-based index of the link that carries it;  R, t : its frame in the link's, shapes (3, 3), (3,)
    mass : (smallest, largest);  c, r : centre of mass, shape (3,) each
    inertia, spread : tensor entries times 1, 2, 2, 1, 2, 1, so that tr(B I) is a plain sum, shape (6,) each
    """

    link: int
    R: Array
    t: Array
    mass: tuple[float, float]
    c: Array
    r: Array
    inertia: Array
    spread: Array
    about_com: bool

    @classmethod
    def of(cls, placed: PlacedBody) -> "UncertainBody":
        """Prepare a placed body."""
        body = placed.body
        mass, com, inertia = body.mass.interval, body.com.interval, body.inertia.interval
        pose = placed.pose
        return cls(
            link=placed.link - 1,
            R=pose[:3, :3],
            t=pose[:3, 3],
            mass=(float(mass.inf), float(mass.sup)),
            c=com.mid,
            r=com.rad,
            inertia=inertia.mid * _TWICE,
            spread=inertia.rad * _TWICE,
            about_com=body.inertia_about == "com",
        )

    def torque_range(self, terms: BodyTerms) -> tuple[Array, Array]:
        """Smallest and largest torque (T,) that the body asks of a joint with these coefficients.

        Attained, up to rounding to nearest: the mass is independent of the factor it multiplies, the quadratic of the
        centre of mass is maximised exactly, the tensor enters linearly.
        """
        low, high = self._per_mass(terms)
        low = np.minimum(self.mass[0] * low, self.mass[1] * low)
        high = np.maximum(self.mass[0] * high, self.mass[1] * high)
        middle = self.inertia @ terms.B
        if self.spread.any():
            spread = self.spread @ np.abs(terms.B)
            return low + (middle - spread), high + (middle + spread)
        return low + middle, high + middle

    def _per_mass(self, terms: BodyTerms) -> tuple[Array, Array]:
        """Range of y0 + y.c + c'Qc over the box of the centre of mass (without the square for ``about_com`` false)."""
        start = terms.y0 + self.c @ terms.y
        if not self.about_com:
            reach = self.r @ np.abs(terms.y)
            return start - reach, start + reach
        Q = trace_minus(terms.B)
        Qc = np.stack([sum(entry(Q, k, m) * self.c[m] for m in range(3)) for k in range(3)])
        start += self.c @ Qc
        low, high = quadratic_range(terms.y + 2.0 * Qc, Q, self.r)
        return start + low, start + high


def trace_minus(B: Array) -> Array:
    """Entries (6, T) of Q = tr(B) 1 - B."""
    Q = -B
    trace = B[0] + B[3] + B[5]
    for k in (0, 3, 5):
        Q[k] += trace
    return Q


def uncertain_bodies(robot: Robot) -> list[UncertainBody]:
    """Moving bodies with any width, prepared, base to tip."""
    return [UncertainBody.of(p) for p in robot.bodies if p.link > 0 and not is_exact(p.body)]
