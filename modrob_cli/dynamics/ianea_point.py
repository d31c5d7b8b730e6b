r"""The published interval algorithm IANEA* at one state after the other, for a control loop. [R] Alg. 1, [D] Alg. 4.

The same formulas as in :mod:`modrob_cli.dynamics.ianea`, made for many states at once, in plain Python numbers:
for a single state that is several times faster than arrays. Rounding: to nearest, then outward by 1e-12 of the sum of
the absolute values of all ends; not proven. Where a proof counts, use :func:`modrob_cli.dynamics.ianea.ianea`.
"""

import math
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_point import OUTWARD, PointBounds, PointDrives
from modrob_cli.dynamics.ianea_links import LinkBox, LinkBoxes, link_boxes
from modrob_cli.dynamics.interval_vectors import Range
from modrob_cli.dynamics.link_inertia import LinearParameters
from modrob_cli.dynamics.newton_euler import nominal_links
from modrob_cli.errors import ShapeError
from modrob_cli.model.joint import Joint
from modrob_cli.model.robot import Robot

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
_ROWS = ((0, 1, 2), (1, 3, 4), (2, 4, 5))
_ZERO = (0.0, 0.0, 0.0)


class IaneaPoint:
    """Enclosure of M(q) ddq + C(q, dq) dq_a + g(q) + friction(dq) + disturbance, with the C of NEA*.

    Parameters
    ----------
    links : interval parameters of the links; the robot's own bodies give the nominal torque

    Raises
    ------
    ShapeError
        If there are other numbers of links and joints.
    """

    def __init__(self, robot: Robot, links: LinkBoxes) -> None:
        if len(links.frames) != robot.dof:
            raise ShapeError(f"parameters of {len(links.frames)} links for {robot.dof} joints")
        boxes = zip(robot.joints, link_boxes(links), nominal_links(robot), strict=True)
        self._links = [_Link.of(*parts) for parts in boxes]
        self._up: Vector = _vector(-robot.gravity)
        self._drives = PointDrives(robot)

    def __call__(self, q: Array, dq: Array, dq_a: Array, ddq: Array) -> PointBounds:
        """Bounds at one state, shape (n,) each; dq is the joints' velocity, dq_a what C is multiplied by."""
        placed = [link.at(angle) for link, angle in zip(self._links, q.tolist(), strict=True)]
        states = self._motions(placed, dq.tolist(), dq_a.tolist(), ddq.tolist())
        nominal, mid, rad = self._torques(placed, states)
        drives = self._drives(dq, ddq)
        margin = OUTWARD * float((np.abs(mid) + rad).sum())
        return PointBounds(
            nominal + self._drives.nominal_rotors * ddq, mid - rad + drives[0] - margin, mid + rad + drives[1] + margin
        )

    def _motions(self, placed: "list[_Place]", dq: list[float], dq_a: list[float], ddq: list[float]) -> "list[_Motion]":
        """From base to tip. [D] Alg. 4, lines 10-21."""
        omega, omega_a, alpha, acc = _ZERO, _ZERO, _ZERO, self._up
        out = []
        for link, (E, p), v, w, a in zip(self._links, placed, dq, dq_a, ddq, strict=True):
            acc = _back(E, _moved(omega, omega_a, alpha, acc, p))
            omega, omega_a, alpha = _back(E, omega), _back(E, omega_a), _back(E, alpha)
            if link.is_revolute:
                alpha = (alpha[0] + omega_a[1] * v, alpha[1] - omega_a[0] * v, alpha[2] + a)
                omega = (omega[0], omega[1], omega[2] + v)
                omega_a = (omega_a[0], omega_a[1], omega_a[2] + w)
            else:
                x, y = omega_a[1] * v + omega[1] * w, omega_a[0] * v + omega[0] * w
                acc = (acc[0] + x, acc[1] - y, acc[2] + a)
            out.append((omega, omega_a, alpha, acc))
        return out

    def _torques(self, placed: "list[_Place]", motions: "list[_Motion]") -> tuple[Array, Array, Array]:
        """Nominal torques, midpoints and half-widths, from tip to base. [D] Alg. 4, lines 25-34."""
        count = len(placed)
        nominal, mid, rad = np.empty(count), np.empty(count), np.empty(count)
        F = N = f = n = f_rad = n_rad = _ZERO
        for i in reversed(range(count)):
            link, (E, p) = self._links[i], placed[i]
            own_F, own_N = link.nominal_wrench(*motions[i])
            F, N = _add(F, own_F), _add(N, own_N)
            if not link.box.is_massless:
                own_f, own_n = link.wrench(*motions[i])
                f, f_rad = _add(f, own_f[0]), _add(f_rad, own_f[1])
                n, n_rad = _add(n, own_n[0]), _add(n_rad, own_n[1])
            drawn = (N, n, n_rad) if link.is_revolute else (F, f, f_rad)
            nominal[i], mid[i], rad[i] = (part[2] for part in drawn)
            F, N, f, n = _turn(E, F), _turn(E, N), _turn(E, f), _turn(E, n)
            f_rad, n_rad = link.turned_width(E, f_rad), link.turned_width(E, n_rad)
            N, n = _add(N, _cross(p, F)), _add(n, _cross(p, f))
            n_rad = _add(n_rad, _cross_width(p, f_rad))
        return nominal, mid, rad


_Place = tuple[Matrix, Vector]
_Motion = tuple[Vector, Vector, Vector, Vector]
_Box = tuple[Vector, Vector]
"""Midpoints and half-widths."""


@dataclass(frozen=True)
class _Link:
    """One link as plain numbers; ``R``, ``t``: the frame of its box; ``zero``: rotation of its joint at 0."""

    box: LinkBox
    R: Matrix
    t: Vector
    is_revolute: bool
    zero: Matrix
    size: Matrix
    origin: Vector
    mass: float
    moment: Vector
    inertia: Matrix
    spin: float

    @classmethod
    def of(cls, joint: Joint, box: LinkBox, nominal: LinearParameters) -> "_Link":
        """From the model; ``spin`` is what NEA* adds for the tensor about the centre of mass."""
        zero = joint.zero_placement[:3, :3]
        spin = float(nominal.moment @ nominal.moment) / nominal.mass if nominal.mass > 0.0 else 0.0
        return cls(
            box=box,
            R=_matrix(box.R),
            t=_vector(box.t),
            is_revolute=joint.type == "revolute",
            zero=_matrix(zero),
            size=_matrix(np.abs(zero)),
            origin=_vector(joint.placement[:3, 3]),
            mass=nominal.mass,
            moment=_vector(nominal.moment),
            inertia=_matrix(nominal.inertia),
            spin=spin,
        )

    def at(self, q: float) -> _Place:
        """Turn by the joint alone is folded into the first matrix; origin in the frame of the link before."""
        if not self.is_revolute:
            axis = (self.zero[0][2] * q, self.zero[1][2] * q, self.zero[2][2] * q)
            return self.zero, _add(self.origin, axis)
        c, s = math.cos(q), math.sin(q)
        x, y, z = ((c * row[0] + s * row[1], c * row[1] - s * row[0], row[2]) for row in self.zero)
        return (x, y, z), self.origin

    def turned_width(self, E: Matrix, rad: Vector) -> Vector:
        """Half-widths in the frame before: turned by the joint first, then by its placement, as published."""
        if self.is_revolute:
            # the joint's own turn is zero' E; its first column is (cos, sin, 0)
            a, b = self.zero, E
            c = abs(a[0][0] * b[0][0] + a[1][0] * b[1][0] + a[2][0] * b[2][0])
            s = abs(a[0][1] * b[0][0] + a[1][1] * b[1][0] + a[2][1] * b[2][0])
            rad = (c * rad[0] + s * rad[1], s * rad[0] + c * rad[1], rad[2])
        return _turn(self.size, rad)

    def nominal_wrench(self, omega: Vector, omega_a: Vector, alpha: Vector, acc: Vector) -> _Box:
        """Force and moment about the origin at nominal values, as in ``newton_euler_star``."""
        h, m = self.moment, self.mass
        swing = _add(_cross(alpha, h), _cross(omega, _cross(omega_a, h)))
        force = (m * acc[0] + swing[0], m * acc[1] + swing[1], m * acc[2] + swing[2])
        momentum = _turn(self.inertia, omega)
        k = self.spin
        momentum = (momentum[0] - k * omega[0], momentum[1] - k * omega[1], momentum[2] - k * omega[2])
        moment = _add(_turn(self.inertia, alpha), _cross(omega_a, momentum))
        return force, _add(moment, _cross(h, acc))

    def wrench(self, omega: Vector, omega_a: Vector, alpha: Vector, acc: Vector) -> tuple[_Box, _Box]:
        """Intervals of force and moment about the link's origin. [D] Alg. 4, lines 22-28."""
        if not self.box.is_moved:
            return self._own_wrench(omega, omega_a, alpha, acc)
        acc = _back(self.R, _moved(omega, omega_a, alpha, acc, self.t))
        seen = (_back(self.R, omega), _back(self.R, omega_a), _back(self.R, alpha), acc)
        force, moment = (_turned_box(self.R, box) for box in self._own_wrench(*seen))
        mid, rad = _cross(self.t, force[0]), _cross_width(self.t, force[1])
        return force, (_add(moment[0], mid), _add(moment[1], rad))

    def _own_wrench(self, omega: Vector, omega_a: Vector, alpha: Vector, acc: Vector) -> tuple[_Box, _Box]:
        """The same about the origin of the frame of the parameters."""
        c = self.box.com
        swing = _cross_numbers(c, alpha)
        first = _cross_numbers(c, omega_a)  # c x omega_a = -(omega_a x c)
        spin = (_cross(omega, first[0]), _cross_width(omega, first[1]))
        mid = tuple(acc[k] - swing[0][k] - spin[0][k] for k in range(3))
        rad = _add(swing[1], spin[1])
        force = _split([_times(self.box.mass, mid[k], rad[k]) for k in range(3)])
        lever = _cross_ranges(c, force)
        turning, momentum = _matrix_times(self.box.inertia, alpha), _matrix_times(self.box.inertia, omega)
        gyro = (_cross(omega_a, momentum[0]), _cross_width(omega_a, momentum[1]))
        moment = tuple(_add(_add(lever[k], turning[k]), gyro[k]) for k in range(2))
        return force, (moment[0], moment[1])


def _vector(x: Array) -> Vector:
    a, b, c = x.tolist()
    return a, b, c


def _matrix(x: Array) -> Matrix:
    a, b, c = (_vector(row) for row in x)
    return a, b, c


def _add(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _cross_width(a: Vector, rad: Vector) -> Vector:
    x, y, z = abs(a[0]), abs(a[1]), abs(a[2])
    return y * rad[2] + z * rad[1], z * rad[0] + x * rad[2], x * rad[1] + y * rad[0]


def _turn(M: Matrix, x: Vector) -> Vector:
    a, b, c = M
    u, v, w = x
    return a[0] * u + a[1] * v + a[2] * w, b[0] * u + b[1] * v + b[2] * w, c[0] * u + c[1] * v + c[2] * w


def _back(M: Matrix, x: Vector) -> Vector:
    a, b, c = M
    u, v, w = x
    return a[0] * u + b[0] * v + c[0] * w, a[1] * u + b[1] * v + c[1] * w, a[2] * u + b[2] * v + c[2] * w


def _moved(omega: Vector, omega_a: Vector, alpha: Vector, acc: Vector, t: Vector) -> Vector:
    """Acceleration at another point of the same body."""
    return _add(acc, _add(_cross(alpha, t), _cross(omega, _cross(omega_a, t))))


def _turned_box(M: Matrix, box: _Box) -> _Box:
    a, b, c = ((abs(row[0]), abs(row[1]), abs(row[2])) for row in M)
    return _turn(M, box[0]), _turn((a, b, c), box[1])


def _times(factor: Range, mid: float, rad: float) -> Range:
    """An interval times an interval: midpoint and half-width."""
    low, high = factor
    if low == high:
        return low * mid, abs(low) * rad
    if rad == 0.0:
        return 0.5 * (low + high) * mid, 0.5 * (high - low) * abs(mid)
    a, b = mid - rad, mid + rad
    ends = (low * a, low * b, high * a, high * b)
    inf, sup = min(ends), max(ends)
    return 0.5 * (inf + sup), 0.5 * (sup - inf)


def _split(parts: list[Range]) -> _Box:
    (a, u), (b, v), (c, w) = parts
    return (a, b, c), (u, v, w)


def _cross_numbers(ends: list[Range], x: Vector) -> _Box:
    """Three intervals cross numbers."""
    (a, u), (b, v), (c, w) = ((0.5 * (low + high), 0.5 * (high - low)) for low, high in ends)
    return _cross((a, b, c), x), _cross_width(x, (u, v, w))


def _cross_ranges(ends: list[Range], box: _Box) -> _Box:
    """Three intervals cross three intervals. [R] Definition 6."""
    mid, rad = box
    parts = []
    for i, j in ((1, 2), (2, 0), (0, 1)):
        plus, minus = _times(ends[i], mid[j], rad[j]), _times(ends[j], mid[i], rad[i])
        parts.append((plus[0] - minus[0], plus[1] + minus[1]))
    return _split(parts)


def _matrix_times(ends: list[Range], x: Vector) -> _Box:
    """A symmetric matrix of intervals times numbers. [R] Definition 5."""
    parts = []
    for row in _ROWS:
        mid = rad = 0.0
        for k, entry in enumerate(row):
            low, high = ends[entry]
            mid += 0.5 * (low + high) * x[k]
            rad += 0.5 * (high - low) * abs(x[k])
        parts.append((mid, rad))
    return _split(parts)
