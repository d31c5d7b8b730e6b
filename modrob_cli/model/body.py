"""Rigid bodies with boxes of parameters."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array, frozen
from modrob_cli.model.uncertain import Uncertain

INERTIA_ENTRIES = ("xx", "xy", "xz", "yy", "yz", "zz")
"""Order of the six entries of an inertia tensor in every array and table of modrob."""

_ROWS, _COLUMNS = np.triu_indices(3)

InertiaPoint = Literal["com", "frame"]


def tensor(entries: Array) -> Array:
    """Symmetric matrices (..., 3, 3) from entries (..., 6) in the order xx, xy, xz, yy, yz, zz."""
    out = np.empty((*entries.shape[:-1], 3, 3))
    out[..., _ROWS, _COLUMNS] = entries
    out[..., _COLUMNS, _ROWS] = entries
    return out


def tensor_entries(matrix: Array) -> Array:
    """Entries (..., 6) in the order xx, xy, xz, yy, yz, zz of symmetric matrices (..., 3, 3)."""
    return np.asarray(matrix[..., _ROWS, _COLUMNS])


@dataclass(frozen=True)
class RigidBody:
    """Dynamic parameters of one rigid body in a frame of its own.

    Attributes
    ----------
    name : where it comes from, for reports
    mass : shape (), [kg]
    com : centre of mass, shape (3,), [m]
    inertia : tensor entries xx, xy, xz, yy, yz, zz, shape (6,), [kg m^2]
    inertia_about : the point the tensor refers to: the centre of mass ("com") or the origin of the frame
        ("frame"; [D] Table 2.2 and most module data). It decides which set the box describes.
    """

    name: str
    mass: Uncertain
    com: Uncertain
    inertia: Uncertain
    inertia_about: InertiaPoint = "com"

    @property
    def is_massless(self) -> bool:
        """True if the mass is exactly zero and no inertia is left."""
        mass, inertia = self.mass.interval, self.inertia.interval
        return bool(mass.sup == 0.0 and np.all(inertia.inf == 0.0) and np.all(inertia.sup == 0.0))


@dataclass(frozen=True)
class PlacedBody:
    """A rigid body fixed to a link.

    Attributes
    ----------
    link : 0 for the fixed base, i for the link that joint i moves (counted from 1)
    pose : frame of the body in the link's frame, shape (4, 4)
    """

    link: int
    pose: Array
    body: RigidBody

    def __post_init__(self) -> None:
        """Freeze the pose."""
        object.__setattr__(self, "pose", frozen(self.pose, (4, 4)))
