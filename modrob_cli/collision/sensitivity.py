r"""How small a contact is certain to be found.

A torque from outside, e, moves what the motor has to give by -e, whatever the parameters are. Without it the
measurement can be anywhere in the band, so it is certain to leave a band of width w when abs(e) > w, and not before.
A force F along the unit vector d at a point with the Jacobian J makes e_j = F (J' d)_j: it is certain to be found
when F max_j abs(J' d)_j / w_j > 1. With filters this is so once the contact lasts longer than the filter remembers.

Over all directions: with the rows a_j = J'_j / w_j, the force needed along d is 1 / max_j abs(a_j d). The least over
the unit sphere is 1 / max norm(a_j). The largest is the farthest point of the polytope {x : abs(a_j x) <= 1 for all
j} from the origin, one of its vertices: all intersections of three of its planes are looked at, so the answer is
exact. If the rows span less than three dimensions there are forces that no joint feels, and the answer is infinite.
"""

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.robot import Robot

AXES = ("x", "y", "z")
_BLIND = 1e-9
"""Three rows of norm 1 whose determinant is below this span no space."""
_SLACK = 1e-9


@dataclass(frozen=True)
class LinkPoint:
    """A point of the arm.

    Attributes
    ----------
    label : for people
    link : 1 .. n, or n + 1 for the end effector
    point : in the frame of the link or the end effector, shape (3,), [m]
    """

    label: str
    link: int
    point: Array


@dataclass(frozen=True)
class ContactForces:
    """Smallest force [N] that is certain to be found, at each of N samples; infinite where no joint feels it.

    Attributes
    ----------
    axes : along x, y and z of the base frame, either sense, shape (N, 3)
    easiest, hardest : along the best and the worst direction of all, shape (N,)
    """

    axes: Array
    easiest: Array
    hardest: Array


def point_jacobian(robot: Robot, q: Array, where: LinkPoint) -> Array:
    """Translational Jacobian of a point in the base frame, shape (N, 3, n), at positions (N, n)."""
    frames = robot.link_frames(q)
    place = frames[:, where.link - 1, :3, :3] @ where.point + frames[:, where.link - 1, :3, 3]
    J = np.zeros((len(q), 3, robot.dof))
    for i, joint in enumerate(robot.joints[: min(where.link, robot.dof)]):
        axis = frames[:, i, :3, 2]
        lever = place - frames[:, i, :3, 3]
        J[:, :, i] = np.cross(axis, lever) if joint.type == "revolute" else axis
    return J


def contact_forces(robot: Robot, q: Array, width: Array, where: LinkPoint) -> ContactForces:
    """Smallest forces that are certain to be found.

    Parameters
    ----------
    q : positions, shape (N, n);  width : of the filtered band, shape (N, n), [N m] or [N], > 0
    """
    rows = point_jacobian(robot, q, where).transpose(0, 2, 1) / np.maximum(width, 1e-300)[:, :, None]
    with np.errstate(divide="ignore"):
        axes = 1.0 / np.abs(rows).max(axis=1)
        easiest = 1.0 / np.linalg.norm(rows, axis=2).max(axis=1)
    return ContactForces(axes, easiest, _farthest_vertex(rows))


def _farthest_vertex(rows: Array) -> Array:
    """Largest norm of x with abs(rows x) <= 1, shape (N,), for rows (N, n, 3); infinite if it is unbounded."""
    size = np.linalg.norm(rows, axis=2)
    felt = size > _BLIND * size.max(axis=1, keepdims=True)  # a lever of 1e-17 m is rounding
    rows, size = np.where(felt[:, :, None], rows, 0.0), np.where(felt, size, 0.0)
    safe = np.maximum(size, 1e-300)
    best = np.full(len(rows), -np.inf)
    spanned = np.zeros(len(rows), dtype=bool)
    for three in combinations(range(rows.shape[1]), 3):
        A = rows[:, three]
        volume = np.abs(np.linalg.det(A / safe[:, three, None])) * (size[:, three] > 0.0).all(axis=1)
        good = np.flatnonzero(volume > _BLIND)
        spanned[good] = True
        if not len(good):
            continue
        inverse = np.linalg.inv(A[good])
        for signs in product((1.0,), (-1.0, 1.0), (-1.0, 1.0)):  # x and -x are alike
            x = inverse @ np.array(signs)
            inside = np.abs(np.einsum("tji,ti->tj", rows[good], x)).max(axis=1) <= 1.0 + _SLACK
            norm = np.where(inside, np.linalg.norm(x, axis=1), -np.inf)
            best[good] = np.maximum(best[good], norm)
    return np.where(spanned, best, np.inf)
