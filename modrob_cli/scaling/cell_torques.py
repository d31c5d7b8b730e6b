"""Torque bounds over cells of time, as functions of the factor.

The same form as at an instant, :mod:`modrob_cli.scaling.scaled_torque`: R(c^2) + alpha c^2 + beta c + gamma with a
convex R, at two ends of each cell (see :mod:`modrob_cli.scaling.cell_terms`); the larger one bounds the torque over
the cell. What is of second order in the cell's length, and all rounding, is part of alpha, beta and gamma. So the
factors that are safe all over a set of cells are found like those that are safe at samples.
"""

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.dynamics.ball import GROW, TINY, Ball
from modrob_cli.dynamics.body_terms import BodyTerms
from modrob_cli.dynamics.box_parameters import known_parameters
from modrob_cli.dynamics.drive_torque import DriveBox, drive_boxes
from modrob_cli.dynamics.uncertain_body import UncertainBody, is_exact
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.scaling.cell_motion import cell_links
from modrob_cli.scaling.cell_terms import (
    EVALUATION,
    dynamic_rates,
    dynamic_terms,
    known_torque,
    static_rates,
    static_terms,
    two_ends,
)
from modrob_cli.scaling.curve_cells import Cells, CellStates, cell_states
from modrob_cli.scaling.scaled_torque import Polynomial, bounds_at


class CellTorques:
    """Ranges of the torque over K cells, for any factor; rows like those of 2 K samples.

    Sample k stands for the beginning, K + k for the end of cell k.

    Attributes
    ----------
    states : enclosure of the motion
    rest : what is of second order, and rounding, in the static and the dynamic part, shape (2, n, 2 K)
    """

    def __init__(self, robot: Robot, trajectory: Trajectory, cells: Cells) -> None:
        self.cells = cells
        self.states = cell_states(trajectory, cells)
        self.samples = 2 * cells.count
        shape = (robot.dof, self.samples)
        self._static, self._dynamic = np.zeros(shape), np.zeros(shape)
        rest = np.zeros((2, *shape))  # static, dynamic
        self._terms: list[tuple[int, UncertainBody, BodyTerms, BodyTerms]] = []
        for i, links in enumerate(cell_links(robot, self.states)):
            bodies = robot.bodies_of(i + 1)
            known = known_parameters([placed for placed in bodies if is_exact(placed.body)])
            if known is not None:
                middle, whole = links
                for total, more, at, rate in (
                    (self._static, rest[0], static_terms(middle), static_rates(whole)),
                    (self._dynamic, rest[1], dynamic_terms(middle), dynamic_rates(whole)),
                ):
                    value, spread = _ends(known_torque(known, at), known_torque(known, rate), self.states.radius)
                    total[: i + 1] += value
                    more[: i + 1] += spread
            for body in (UncertainBody.of(placed) for placed in bodies if not is_exact(placed.body)):
                middle, whole = (link.seen_from(body.R, body.t) for link in links)
                radius = self.states.radius
                static = two_ends(body, static_terms(middle), static_rates(whole), radius)
                dynamic = two_ends(body, dynamic_terms(middle), dynamic_rates(whole), radius)
                rest[0, : i + 1] += static.rest
                rest[1, : i + 1] += dynamic.rest
                self._terms.append((i, body, static.terms, dynamic.terms))
        self.rest = rest
        self.polynomial = _drives(robot, self.states, rest)

    def rigid(self, u: float, which: Indices | None = None) -> Array:
        """R(u) as in ``ScaledTorques.rigid``, shape (2, n, 2 K or as many as ``which``)."""
        picked = slice(None) if which is None else which
        known = self._static[:, picked] + u * self._dynamic[:, picked]
        upper, lower = known.copy(), known.copy()
        for i, body, static, dynamic in self._terms:
            joints = i + 1
            if which is not None:
                rows = (np.arange(joints)[:, None] * self.samples + which).reshape(-1)
                static, dynamic = static.of_samples(rows), dynamic.of_samples(rows)
            low, high = body.torque_range(static + dynamic.times(u))
            upper[:joints] += high.reshape(joints, -1)
            lower[:joints] += low.reshape(joints, -1)
        return np.stack([upper, -lower])

    def bounds(self, c: float) -> tuple[Array, Array]:
        """Lower and upper bound of the torques over each cell at one factor, shape (n, K) each."""
        ends = bounds_at(self, c)
        larger = np.maximum(ends[..., : self.cells.count], ends[..., self.cells.count :])
        return -larger[1], larger[0]


def _ends(at: Ball, rate: Ball, radius: Array) -> tuple[Array, Array]:
    """Values (J, 2 T) at both ends of the linear part, and what the rest adds, of a scalar (J, T)."""
    step = rate.c * radius
    spread = (at.r + rate.r * radius + EVALUATION * (np.abs(at.c) + np.abs(step))) * GROW + TINY
    return np.concatenate([at.c - step, at.c + step], axis=-1), np.concatenate([spread, spread], axis=-1)


def _drives(robot: Robot, states: CellStates, rest: Array) -> Polynomial:
    """Friction, rotor and disturbance at both ends, and what the rest of the rigid bodies adds (2, n, 2 K)."""
    shape = (2, *rest.shape[1:])
    alpha, beta, gamma, moving = (np.empty(shape) for _ in range(4))
    slow = np.empty(rest.shape[1:])
    for i, drive in enumerate(drive_boxes(robot)):
        dq, dq_rest = _ends(states.middle[1, i], states.whole[2, i], states.radius)
        ddq, ddq_rest = _ends(states.middle[2, i], states.whole[3, i], states.radius)
        speed = states.whole[1, i]
        slow[i] = np.tile(_slow(drive, speed), 2)
        size = drive.coulomb[1] + max(abs(drive.rest[0]), abs(drive.rest[1]))
        more = rest[0, i] + EVALUATION * size + TINY
        for side, sign in enumerate((1.0, -1.0)):
            alpha[side, i] = _largest(drive.armature, sign * ddq) + drive.armature[1] * ddq_rest + rest[1, i]
            beta[side, i] = _largest(drive.viscous, sign * dq) + drive.viscous[1] * dq_rest
            fixed = max(sign * drive.rest[0], sign * drive.rest[1]) + more
            gamma[side, i] = drive.coulomb[1] + fixed
            moving[side, i] = _largest(drive.coulomb, np.tile(sign * speed.sign, 2)) + fixed
        for part in (alpha[:, i], beta[:, i]):
            part += EVALUATION * np.abs(part)
    return Polynomial(alpha, beta, gamma, moving, slow)


def _slow(drive: DriveBox, speed: Ball) -> Array:
    """Factor above which the joint moves faster than the velocity band all over the cell; infinite if it may rest."""
    least = (np.abs(speed.c) - speed.reach) * (1.0 - 2.0**-40)
    out = np.full_like(least, np.inf)
    np.divide(drive.velocity_band, least, out=out, where=least > 0.0)
    return out * GROW


def _largest(ends: tuple[float, float], rate: Array) -> Array:
    return np.maximum(ends[0] * rate, ends[1] * rate)
