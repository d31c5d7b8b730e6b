"""Bodies of a link joined into one set of linear parameters (m, m c, I about the link's origin)."""

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


def joined(bodies: list[PlacedBody]) -> LinearParameters:
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
