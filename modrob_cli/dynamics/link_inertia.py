"""Bodies of a link joined into one set of linear parameters (m, m c, I about the link's origin)."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.body import PlacedBody, tensor
from modrob_cli.spatial import parallel_axis


@dataclass(frozen=True)
class LinearParameters:
    """Mass (), first moment (3,) and tensor about the origin (3, 3), in the frame of the link."""

    mass: float
    moment: Array
    inertia: Array

    def central(self) -> tuple[float, Array, Array]:
        """Mass, centre of mass (3,) and tensor about it (3, 3); a centre of mass of zero where there is no mass."""
        com = self.moment / self.mass if self.mass > 0.0 else np.zeros(3)
        return self.mass, com, self.inertia - self.mass * parallel_axis(com)


def joined(bodies: Iterable[PlacedBody]) -> LinearParameters:
    """Nominal parameters of rigidly joined bodies; all zero for none. No division, so massless parts are fine."""
    mass, moment, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
    for placed in bodies:
        R, t = placed.pose[:3, :3], placed.pose[:3, 3]
        body = placed.body
        m, c = float(body.mass.nominal), body.com.nominal
        own = tensor(body.inertia.nominal)
        if body.inertia_about == "frame":
            own = own - m * parallel_axis(c)
        r = R @ c + t
        mass += m
        moment = moment + m * r
        inertia = inertia + R @ own @ R.T + m * parallel_axis(r)
    return LinearParameters(mass, moment, inertia)
