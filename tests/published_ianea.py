"""[D] Algorithm 4 line by line, for one state, with the package's outward-rounding intervals."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.interval import Interval
from modrob_cli.model.robot import Robot
from modrob_cli.spatial import rotation, translation


def transcribed(robot: Robot, links: LinkBoxes, q: Array, dq: Array, dq_a: Array, ddq: Interval) -> Interval:
    """[D] Algorithm 4 for one state (n,), in D-H frames, line by line; [u] of shape (n,)."""
    dh, n, z0 = dh_table(robot), robot.dof, np.array([0.0, 0.0, 1.0])
    R, z, r = [], [], []
    for i in range(n):
        row = [dh.theta[i], dh.d[i]]
        row[0 if dh.joint_types[i] == "revolute" else 1] += q[i]
        turn = rotation("z", row[0]) @ translation("z", row[1]) @ translation("x", dh.a[i]) @ rotation("x", dh.alpha[i])
        R.append(turn[:3, :3])
        z.append(turn[:3, :3].T @ z0)
        r.append(turn[:3, :3].T @ turn[:3, 3])
    w = w_a = np.zeros(3)
    dw, a = Interval(np.zeros(3)), Interval(-(dh.base_transform[:3, :3].T @ robot.gravity))
    motions = []
    for i in range(n):
        revolute = dh.joint_types[i] == "revolute"
        back = R[i].T
        if revolute:
            dw = _turned(back, dw + ddq[i] * z0 + np.cross(w_a, dq[i] * z0))
            w, w_a = back @ (w + dq[i] * z0), back @ (w_a + dq_a[i] * z0)
        else:
            dw, w, w_a = _turned(back, dw), back @ w, back @ w_a
        a = _turned(back, a) + _cross(dw, Interval(r[i])) + np.cross(w, np.cross(w_a, r[i]))
        if not revolute:
            a = a + np.cross(w_a, dq[i] * z[i]) + np.cross(w, dq_a[i] * z[i]) + ddq[i] * z[i]
        motions.append((w, w_a, dw, a))
    f = moment = Interval(np.zeros(3))
    u = [Interval(0.0)] * n
    for i in reversed(range(n)):
        w, w_a, dw, a = motions[i]
        m, c, inertia = links.mass[i], links.com[i], links.inertia_com[i]
        a_c = a + _cross(dw, c) + _cross(Interval(w), _cross(Interval(w_a), c))
        F = m * a_c
        rows = ((0, 1, 2), (1, 3, 4), (2, 4, 5))
        onward = R[i + 1] if i + 1 < n else np.eye(3)
        f, moment = _turned(onward, f) + F, _turned(onward, moment)
        spin = _stack([_sum([inertia[e] * w[k] for k, e in enumerate(row)]) for row in rows])
        pushed = _stack([_sum([inertia[e] * dw[k] for k, e in enumerate(row)]) for row in rows])
        moment = moment + _cross(c, F) + _cross(Interval(r[i]), f) + pushed + _cross(Interval(w_a), spin)
        drawn = moment if dh.joint_types[i] == "revolute" else f
        u[i] = _sum([drawn[k] * z[i][k] for k in range(3)])
    return _stack(u)


def _sum(parts: list[Interval]) -> Interval:
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total


def _stack(parts: list[Interval]) -> Interval:
    return Interval(np.stack([p.inf for p in parts]), np.stack([p.sup for p in parts]))


def _turned(M: Array, x: Interval) -> Interval:
    return _stack([_sum([x[k] * M[i, k] for k in range(3)]) for i in range(3)])


def _cross(x: Interval, y: Interval) -> Interval:
    return _stack([x[(k + 1) % 3] * y[(k + 2) % 3] - x[(k + 2) % 3] * y[(k + 1) % 3] for k in range(3)])
