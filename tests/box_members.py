"""Members of parameter boxes and the torques they give, by way of Pinocchio and plain enumeration."""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pinocchio as pin

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.model.body import PlacedBody, RigidBody
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain

Parameters = list[tuple[Any, Any, Any]]


def with_parameters(robot: Robot, parameters: Parameters) -> Robot:
    """The robot with exact bodies of these (mass, com, inertia), and without drives' uncertainty in mind."""
    bodies = tuple(
        replace(
            placed,
            body=RigidBody(
                placed.body.name,
                Uncertain.exact(mass),
                Uncertain.exact(com),
                Uncertain.exact(inertia),
                placed.body.inertia_about,
            ),
        )
        for placed, (mass, com, inertia) in zip(robot.bodies, parameters, strict=True)
    )
    return replace(robot, bodies=bodies)


def rigid_torque(robot: Robot, parameters: Parameters, q: Array, dq: Array, ddq: Array) -> Array:
    """Torques (n,) of the robot with these parameters, by Pinocchio."""
    model = build_model(with_parameters(robot, parameters))
    return np.asarray(pin.rnea(model, model.createData(), q, dq, ddq))


def random_parameters(robot: Robot, rng: np.random.Generator) -> Parameters:
    """A random member; about half of the values at an end of their interval."""

    def draw(part: Uncertain) -> Array:
        share = rng.random(part.nominal.shape)
        share = np.where(rng.random(part.nominal.shape) < 0.5, share.round(), share)
        return np.asarray(part.interval.inf + share * (part.interval.sup - part.interval.inf))

    return [(draw(p.body.mass), draw(p.body.com), draw(p.body.inertia)) for p in robot.bodies]


def body_function(robot: Robot, index: int, j: int, q: Array, dq: Array, ddq: Array) -> Array:
    """Torque of joint j per unit of (m, m c, I about the frame's origin) of one body, shape (10,), by Pinocchio.

    The order is that of Pinocchio's dynamic parameters: m, mc, xx, xy, yy, xz, yz, zz.
    """
    placed = robot.bodies[index]
    model = build_model(replace(robot, bodies=()))
    data = model.createData()
    Y = pin.computeJointTorqueRegressor(model, data, q, dq, ddq)[j, 10 * (placed.link - 1) : 10 * placed.link]
    return np.array([_shifted(placed, unit) @ Y for unit in np.eye(10)])


def many_torques(robot: Robot, q: Array, dq: Array, ddq: Array, rng: np.random.Generator, count: int) -> Array:
    """Rigid-body torques (count, n) of random members, by Pinocchio's regressor; half of all values at an end."""

    def draw(part: Uncertain) -> Array:
        shape = (count, *part.nominal.shape)
        share = rng.random(shape)
        share = np.where(rng.random(shape) < 0.5, share.round(), share)
        return np.asarray(part.interval.inf + share * (part.interval.sup - part.interval.inf))

    tau = np.zeros((count, robot.dof))
    for index, placed in enumerate(robot.bodies):
        if placed.link == 0 or placed.body.is_massless:
            continue
        mass, com, inertia = draw(placed.body.mass), draw(placed.body.com), draw(placed.body.inertia)
        xx, xy, xz, yy, yz, zz = inertia.T
        if placed.body.inertia_about == "com":
            x, y, z = com.T
            xx, yy, zz = xx + mass * (y * y + z * z), yy + mass * (x * x + z * z), zz + mass * (x * x + y * y)
            xy, xz, yz = xy - mass * x * y, xz - mass * x * z, yz - mass * y * z
        phi = np.stack([mass, *(mass[:, None] * com).T, xx, xy, yy, xz, yz, zz], axis=1)
        for j in range(placed.link):
            tau[:, j] += phi @ body_function(robot, index, j, q, dq, ddq)
    return tau


def _shifted(placed: PlacedBody, parameters: Array) -> Array:
    """Linear parameters (10,) of the body's frame expressed in the link's frame."""
    R, t = placed.pose[:3, :3], placed.pose[:3, 3]
    m, h = parameters[0], parameters[1:4]
    xx, xy, yy, xz, yz, zz = parameters[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    turned = R @ h
    # I about the new origin of points r + t: I + (2 r.t 1 - r t' - t r') + m (t.t 1 - t t')
    cross = 2.0 * turned @ t * np.eye(3) - np.outer(turned, t) - np.outer(t, turned)
    moved = R @ inertia @ R.T + cross + m * (t @ t * np.eye(3) - np.outer(t, t))
    return np.array(
        [m, *(turned + m * t), moved[0, 0], moved[0, 1], moved[1, 1], moved[0, 2], moved[1, 2], moved[2, 2]]
    )


def worst_parameters(robot: Robot, j: int, q: Array, dq: Array, ddq: Array, sign: float) -> Parameters:
    """The member that makes sign * torque of joint j largest, body by body, by enumerating the faces of each box."""
    out: Parameters = []
    for index, placed in enumerate(robot.bodies):
        body = placed.body
        exact = body.mass.is_exact and body.com.is_exact and body.inertia.is_exact
        if exact or placed.link <= j:
            out.append((body.mass.nominal, body.com.nominal, body.inertia.nominal))
            continue
        out.append(_worst_body(body, sign * body_function(robot, index, j, q, dq, ddq)))
    return out


def _worst_body(body: RigidBody, w: Array) -> tuple[Any, Any, Any]:
    """Largest m (w0 + w1.c) + w2.I_o over the box; w in Pinocchio's order."""
    weights = w[[4, 5, 7, 6, 8, 9]]
    inertia = np.where(weights >= 0.0, body.inertia.interval.sup, body.inertia.interval.inf)
    xx, xy, yy, xz, yz, zz = w[4:]
    B = np.array([[xx, xy / 2, xz / 2], [xy / 2, yy, yz / 2], [xz / 2, yz / 2, zz]])
    Q = np.trace(B) * np.eye(3) - B if body.inertia_about == "com" else np.zeros((3, 3))

    def value(c: Array) -> float:
        return float(w[0] + w[1:4] @ c + c @ Q @ c)

    com = max(_face_points(w[1:4], Q, body.com.interval.inf, body.com.interval.sup), key=value)
    mass = body.mass.interval.sup if value(com) >= 0.0 else body.mass.interval.inf
    return float(mass), com, inertia


def _face_points(b: Array, Q: Array, low: Array, high: Array) -> list[Array]:
    """Vertices and stationary points (inside the box) of all faces."""
    points = []
    choices = [(0, 1, 2) if high[k] > low[k] else (0,) for k in range(3)]
    for choice in product(*choices):
        c = np.where(np.array(choice) == 1, high, low)
        free = [k for k in range(3) if choice[k] == 2]
        if free:
            held = [k for k in range(3) if k not in free]
            A = 2.0 * Q[np.ix_(free, free)]
            rhs = -b[free] - 2.0 * Q[np.ix_(free, held)] @ c[held]
            c[free] = np.clip(np.linalg.lstsq(A, rhs, rcond=None)[0], low[free], high[free])
        points.append(c)
    return points
