r"""The exact range of joint torques at one state after the other, fast enough for a control loop.

The same range as that of :mod:`modrob_cli.dynamics.exact_star`, whose code is made for many states at once. Here the
torque regressor at the state is Pinocchio's; every body's coefficients are linear in it, and everything that does not
depend on the state (poses, boxes, faces of boxes) is folded into constant matrices beforehand.

Rounding: to nearest, then outward by 1e-12 of the sum of the absolute values of all terms, which is far more than was
ever seen but is not proven. Where a proof counts, use ``exact_bounds_star``.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.drive_torque import DriveBox, drive_boxes
from modrob_cli.dynamics.link_inertia import LinearParameters, joined
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.dynamics.quadratic_faces import Faces
from modrob_cli.dynamics.uncertain_body import UncertainBody, is_exact, uncertain_bodies
from modrob_cli.model.body import PlacedBody, tensor
from modrob_cli.model.robot import Robot
from modrob_cli.spatial import parallel_axis

OUTWARD = 1e-12
"""How far ends are moved outward, relative to the sum of the absolute values of all terms of all joints."""

_ENTRIES = 10
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


class PointBounds(NamedTuple):
    """Torques at one state, shape (n,) each, [N m] or [N].

    Attributes
    ----------
    nominal : rigid bodies and rotors at nominal values; friction and disturbance excluded
    lower, upper : range over all admissible parameters; friction and disturbance included
    """

    nominal: Array
    lower: Array
    upper: Array


class ExactPoint:
    """Range of M(q) ddq + C(q, dq) dq_a + g(q) + friction(dq) + disturbance, with Christoffel's C.

    Not safe to share between threads: Pinocchio's work space.

    Raises
    ------
    NumericalError
        If a link has a nominal tensor of inertia that is not positive.
    """

    def __init__(self, robot: Robot) -> None:
        import pinocchio as pin

        self._regressor = pin.computeJointTorqueRegressor
        self._model: Any = build_model(robot)
        self._weightless: Any = build_model(robot)
        self._weightless.gravity.linear = np.zeros(3)
        self._data: Any = self._model.createData()
        self._still = np.zeros(robot.dof)
        links = range(1, robot.dof + 1)
        self._nominal = np.concatenate([_parameters(joined(robot.bodies_of(i))) for i in links])
        exact = [[placed for placed in robot.bodies_of(i) if is_exact(placed.body)] for i in links]
        self._known = np.concatenate([_parameters(joined(bodies)) for bodies in exact])
        self._size = sum((_sizes(placed, robot.dof) for placed in robot.bodies), np.zeros(_ENTRIES * robot.dof))
        self._groups = list(_groups(uncertain_bodies(robot)))
        self._drives = PointDrives(robot)

    def __call__(self, q: Array, dq: Array, dq_a: Array, ddq: Array) -> PointBounds:
        """Bounds at one state, shape (n,) each; dq is the joints' velocity, dq_a what C is multiplied by."""
        if dq_a is dq:
            Y = self._regressor(self._model, self._data, q, dq, ddq)
        else:
            Y = self._regressor(self._model, self._data, q, 0.5 * (dq + dq_a), ddq).copy()
            Y -= self._regressor(self._weightless, self._data, q, 0.5 * (dq - dq_a), self._still)
        lower = Y @ self._known
        upper = lower.copy()
        for group in self._groups:
            ends = group.torque_range(Y)
            lower += ends[0]
            upper += ends[1]
        drives = self._drives(dq, ddq)
        margin = OUTWARD * float((np.abs(Y) @ self._size).sum())
        return PointBounds(
            Y @ self._nominal + self._drives.nominal_rotors * ddq,
            lower + drives[0] - margin,
            upper + drives[1] + margin,
        )


class PointDrives:
    """Friction, rotors and disturbance of all joints at one state; see :mod:`modrob_cli.dynamics.drive_torque`."""

    def __init__(self, robot: Robot) -> None:
        boxes = drive_boxes(robot)
        self._ends = {key: _ends(boxes, key) for key in ("viscous", "coulomb", "armature", "rest")}
        self._band = np.array([box.velocity_band for box in boxes])
        drives = [joint.drive for joint in robot.joints]
        self.nominal_rotors = np.array([d.gear_ratio**2 * float(d.rotor_inertia.nominal) for d in drives])

    def __call__(self, dq: Array, ddq: Array) -> tuple[Array, Array]:
        """Smallest and largest torque, shape (n,) each."""
        coulomb, rest = self._ends["coulomb"], self._ends["rest"]
        low = np.where(dq > self._band, coulomb[0], -coulomb[1]) + rest[0]
        high = np.where(dq < -self._band, -coulomb[0], coulomb[1]) + rest[1]
        for ends, rate in ((self._ends["viscous"], dq), (self._ends["armature"], ddq)):
            first, second = ends[0] * rate, ends[1] * rate
            low += np.minimum(first, second)
            high += np.maximum(first, second)
        return low, high


def _ends(boxes: list[DriveBox], key: str) -> Array:
    """Lower and upper ends of a parameter of all joints, shape (2, n)."""
    return np.array([getattr(box, key) for box in boxes]).T


@dataclass(frozen=True)
class _Group:
    """Bodies whose range is found in the same way, B of them.

    Attributes
    ----------
    columns : columns of their links in the regressor, shape (B, 10)
    fold : regressor entries to what ``faces`` takes, then the torque of the tensor's midpoint, shape (B, 10, columns)
    faces : for the centre of mass; None where the torque per mass is linear in it; then ``fold`` has s and b
    spread : regressor entries to those of the tensor times its half-widths, shape (B, 10, 6); None for no width
    """

    columns: Array
    fold: Array
    faces: Faces | None
    spread: Array | None
    mass: Array

    def torque_range(self, Y: Array) -> tuple[Array, Array]:
        """Smallest and largest torque (n,) of these bodies together, from the regressor (n, 10 n)."""
        rows = Y[:, self.columns].swapaxes(0, 1)
        found = rows @ self.fold
        if self.faces is None:
            reach = np.abs(found[..., 1:4]).sum(axis=-1)
            low, high = found[..., 0] - reach, found[..., 0] + reach
        else:
            low, high = self.faces.value_range(found[..., :-1])
        low = np.minimum(self.mass[0] * low, self.mass[1] * low) + found[..., -1]
        high = np.maximum(self.mass[0] * high, self.mass[1] * high) + found[..., -1]
        if self.spread is not None:
            spread = np.abs(rows @ self.spread).sum(axis=-1)
            low, high = low - spread, high + spread
        return low.sum(axis=0), high.sum(axis=0)


def _groups(bodies: list[UncertainBody]) -> Iterator[_Group]:
    """Bodies sorted by which coordinates of the centre of mass are free, and whether the torque is quadratic there."""
    sorted_by: dict[tuple[int, ...], list[UncertainBody]] = {}
    for body in bodies:
        free = tuple(np.flatnonzero(body.r > 0.0).tolist()) if body.about_com else ()
        sorted_by.setdefault(free, []).append(body)
    for free, members in sorted_by.items():
        faces = Faces.of(len(free)) if free else None
        yield _Group(
            columns=np.array([np.arange(_ENTRIES * body.link, _ENTRIES * (body.link + 1)) for body in members]),
            fold=np.stack([_fold(body, free, faces) for body in members]),
            faces=faces,
            spread=np.stack([_spread(body) for body in members]) if any(b.spread.any() for b in members) else None,
            mass=np.array([body.mass for body in members]).T[..., None],
        )


def _fold(body: UncertainBody, free: tuple[int, ...], faces: Faces | None) -> Array:
    """Regressor entries (10,) of the body's link to what its range needs."""
    seen = _seen_from(body.R, body.t)
    # y0, y and tr(B 1) - B as linear functions of the entries; B's entries off the diagonal come twice in them
    y0, y, B = seen[:, 0], seen[:, 1:4], {pair: seen[:, 4 + n] for n, pair in enumerate(_PAIRS)}
    trace = B[0, 0] + B[1, 1] + B[2, 2]

    def Q(i: int, j: int) -> Array:
        return trace - B[i, i] if i == j else -0.5 * B[min(i, j), max(i, j)]

    c, r = body.c, body.r
    s, b = y0 + y @ c, [y[:, i] for i in range(3)]
    if body.about_com:
        Qc = [sum((Q(i, j) * c[j] for j in range(3)), np.zeros(_ENTRIES)) for i in range(3)]
        s = s + sum((Qc[i] * c[i] for i in range(3)), np.zeros(_ENTRIES))
        b = [b[i] + 2.0 * Qc[i] for i in range(3)]
    # the body's tensor is stored times 1, 2, 2, 1, 2, 1, as it multiplies the entries of B
    half = np.array([1.0, 0.5, 0.5, 1.0, 0.5, 1.0])
    middle = seen[:, 4:] @ (half * body.inertia)
    if faces is None:
        return np.stack([s, *(r[i] * b[i] for i in range(3)), middle], axis=1)
    curves = [r[i] * r[j] * Q(i, j) for n, i in enumerate(free) for j in free[n:]]
    features = np.stack([s, *(r[i] * b[i] for i in free), *curves], axis=1)
    return np.hstack([features @ faces.matrix, middle[:, None]])


def _spread(body: UncertainBody) -> Array:
    half = np.array([1.0, 0.5, 0.5, 1.0, 0.5, 1.0])
    return np.asarray(_seen_from(body.R, body.t)[:, 4:] * (half * body.spread))


def _seen_from(R: Array, t: Array) -> Array:
    """Matrix (10, 10): regressor entries of a link times this are those of a body whose frame is at R, t in it.

    Rows in Pinocchio's order (m, m c, I_xx, I_xy, I_yy, I_xz, I_yz, I_zz); columns in ours (xx, xy, xz, yy, yz, zz).
    """
    columns = []
    for k in range(_ENTRIES):
        unit = np.eye(_ENTRIES)[k]
        moment, inertia = R @ unit[1:4], R @ tensor(unit[4:]) @ R.T
        swing = 2.0 * float(t @ moment) * np.eye(3) - np.outer(t, moment) - np.outer(moment, t)
        moved = inertia + swing + unit[0] * parallel_axis(t)
        columns.append(_parameters(LinearParameters(float(unit[0]), moment + unit[0] * t, moved)))
    return np.stack(columns, axis=1)


def _parameters(link: LinearParameters) -> Array:
    """Parameters in the order of Pinocchio's regressor, shape (10,)."""
    inertia = [link.inertia[i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    return np.array([link.mass, *link.moment, *inertia])


def _sizes(placed: PlacedBody, dof: int) -> Array:
    """Bounds of the absolute values of a body's parameters, in the columns of its link, shape (10 n,)."""
    out = np.zeros(_ENTRIES * dof)
    if placed.link > 0:
        body = placed.body
        mass, com = float(body.mass.interval.mag), body.com.interval.mag
        own = np.concatenate([[mass], mass * com, body.inertia.interval.mag + mass * float(com @ com)])
        there = np.abs(_seen_from(placed.pose[:3, :3], placed.pose[:3, 3])) @ own
        out[_ENTRIES * (placed.link - 1) : _ENTRIES * placed.link] = there
    return out
