"""Joint torques with 60 digits, written independently of the package: base frame, decimal arithmetic.

Every double is taken as the exact number it is. Sines and cosines come from mpmath, sums and products from ``decimal``.
"""

from decimal import Decimal, getcontext, localcontext
from typing import Any

import mpmath
import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.robot import Robot

DIGITS = 60
Vector = list[Decimal]
Matrix = list[Vector]


def exact(values: Array) -> Any:
    """Nested lists of decimals, each exactly the double."""
    return [exact(item) for item in values] if np.ndim(values) else Decimal(float(values))


def cos_sin(angle: float) -> tuple[Decimal, Decimal]:
    """Cosine and sine of the exact double, to 60 digits."""
    with mpmath.workdps(DIGITS + 15):
        x = mpmath.mpf(angle)
        return Decimal(mpmath.nstr(mpmath.cos(x), DIGITS + 5)), Decimal(mpmath.nstr(mpmath.sin(x), DIGITS + 5))


def times(A: Matrix, B: Matrix) -> Matrix:
    return [[sum((a * b[j] for a, b in zip(row, B, strict=True)), Decimal(0)) for j in range(len(B[0]))] for row in A]


def apply(A: Matrix, x: Vector) -> Vector:
    return [sum((a * b for a, b in zip(row, x, strict=True)), Decimal(0)) for row in A]


def add(*vectors: Vector) -> Vector:
    return [sum(parts, Decimal(0)) for parts in zip(*vectors, strict=True)]


def scale(factor: Decimal, x: Vector) -> Vector:
    return [factor * item for item in x]


def cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a: Vector, b: Vector) -> Decimal:
    return sum((x * y for x, y in zip(a, b, strict=True)), Decimal(0))


def turn_z(angle: float) -> Matrix:
    c, s = cos_sin(angle)
    one, zero = Decimal(1), Decimal(0)
    return [[c, -s, zero], [s, c, zero], [zero, zero, one]]


def rigid_torques(robot: Robot, q: Array, dq: Array, ddq: Array, parameters: list[tuple[Any, Any, Any]]) -> Vector:
    """Torques of the rigid bodies, all vectors in the base frame.

    ``parameters`` holds (mass, com, inertia entries) of each body of the robot as doubles.
    """
    with localcontext() as context:
        context.prec = DIGITS
        return _rigid_torques(robot, q, dq, ddq, parameters)


def _rigid_torques(robot: Robot, q: Array, dq: Array, ddq: Array, parameters: list[tuple[Any, Any, Any]]) -> Vector:
    zero = [Decimal(0)] * 3
    R: Matrix = [[Decimal(int(i == j)) for j in range(3)] for i in range(3)]
    p, v_ang, a_ang, a_lin = zero, zero, zero, scale(Decimal(-1), exact(robot.gravity))
    axes, origins, wrenches = [], [], []
    for i, joint in enumerate(robot.joints):
        placement = exact(joint.placement)
        step = apply(R, [row[3] for row in placement[:3]])
        R = times(R, [row[:3] for row in placement[:3]])
        axis = [row[2] for row in R]
        rate, push = Decimal(float(dq[i])), Decimal(float(ddq[i]))
        if joint.type == "prismatic":
            step = add(step, scale(Decimal(float(q[i])), axis))
        a_lin = add(a_lin, cross(a_ang, step), cross(v_ang, cross(v_ang, step)))
        p = add(p, step)
        R = times(R, turn_z(joint.offset))
        if joint.type == "revolute":
            a_ang = add(a_ang, scale(push, axis), cross(v_ang, scale(rate, axis)))
            v_ang = add(v_ang, scale(rate, axis))
            R = times(R, turn_z(float(q[i])))
        else:
            a_lin = add(a_lin, scale(push, axis), scale(2 * rate, cross(v_ang, axis)))
        axes.append(axis)
        origins.append(p)
        for placed, body in zip(robot.bodies, parameters, strict=True):
            if placed.link == i + 1:
                about_com = placed.body.inertia_about == "com"
                wrenches.append((i, *_body_wrench(R, p, placed.pose, body, about_com, v_ang, a_ang, a_lin)))
    torques = []
    for j, joint in enumerate(robot.joints):
        total = Decimal(0)
        for i, point, force, moment in wrenches:
            if i >= j:
                lever = add(point, scale(Decimal(-1), origins[j]))
                total += dot(axes[j], force if joint.type == "prismatic" else add(moment, cross(lever, force)))
        torques.append(total)
    return torques


def _body_wrench(
    R: Matrix,
    p: Vector,
    pose: Array,
    body: tuple[Any, Any, Any],
    about_com: bool,
    v_ang: Vector,
    a_ang: Vector,
    a_lin: Vector,
) -> tuple[Vector, Vector, Vector]:
    """Point of the centre of mass, force there, and moment about it."""
    mass, com, entries = Decimal(float(body[0])), exact(np.asarray(body[1])), exact(np.asarray(body[2]))
    frame = exact(pose)
    Rb = times(R, [row[:3] for row in frame[:3]])
    arm = add(apply(R, [row[3] for row in frame[:3]]), apply(Rb, com))
    xx, xy, xz, yy, yz, zz = entries
    inertia = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    if not about_com:
        square = dot(com, com)
        inertia = [
            [inertia[k][m] - mass * ((square if k == m else Decimal(0)) - com[k] * com[m]) for m in range(3)]
            for k in range(3)
        ]
    turned = times(times(Rb, inertia), [list(column) for column in zip(*Rb, strict=True)])
    acc = add(a_lin, cross(a_ang, arm), cross(v_ang, cross(v_ang, arm)))
    moment = add(apply(turned, a_ang), cross(v_ang, apply(turned, v_ang)))
    return add(p, arm), scale(mass, acc), moment


def nominal_parameters(robot: Robot) -> list[tuple[Any, Any, Any]]:
    """Nominal parameters of all bodies, for :func:`rigid_torques`."""
    return [(p.body.mass.nominal, p.body.com.nominal, p.body.inertia.nominal) for p in robot.bodies]


assert getcontext().prec >= 28  # the default context is not changed by this module
