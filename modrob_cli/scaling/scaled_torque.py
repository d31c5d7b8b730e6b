r"""Torque ranges of a motion that is run c times as fast, as functions of c.

With q(c t), velocities are c dq and accelerations c^2 ddq. The coefficients of every body ([D] 2.4, see
:mod:`modrob_cli.dynamics.body_terms`) are linear in u = c^2, so the exact upper bound of a joint's torque is

.. math:: U(c) = R(c^2) + \alpha c^2 + \beta c + \gamma

with a convex function R (a maximum over bodies of functions linear in u), rotors in alpha, viscous friction in beta,
dry friction and disturbance in gamma. The lower bound is the mirror image. Nothing is split that shares parameters,
unlike [S] (14)-(19), where a payload's mass counts once with gravity and once, independently, with acceleration.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.dynamics.body_terms import BodyTerms
from modrob_cli.dynamics.exact_bounds import Prepared, uncertain_terms
from modrob_cli.dynamics.link_motion import base_motion, by_joint, joint_positions, link_motions, weightless
from modrob_cli.dynamics.margin import UNDERFLOW, UNIT, roundings, torque_magnitude
from modrob_cli.dynamics.newton_euler import backward
from modrob_cli.dynamics.uncertain_body import UncertainBody
from modrob_cli.model.robot import Robot

_ABOVE = 1.0 + 2.0**-40
"""At this much more than the velocity band over the speed a joint is certain to be faster than the band."""
_MORE = 2.0
"""Operations of this module on top of those that the rounding margin of a torque counts."""


@dataclass(frozen=True)
class Polynomial:
    """alpha c^2 + beta c + gamma, for upper (0) and mirrored lower side (1) and each joint, shape (2, n, T) each.

    ``gamma`` has the sign of the Coulomb torque as an interval, ``gamma_moving`` as the sign of the velocity, which
    holds for c >= ``slow``, shape (n, T).
    """

    alpha: Array
    beta: Array
    gamma: Array
    gamma_moving: Array
    slow: Array


class ScaledTorques:
    """Ranges of the torque at T samples of a motion, for any factor.

    Parameters
    ----------
    q, dq, ddq : shape (T, n), [rad] or [m] and derivatives at c = 1

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    NumericalError
        If the robot has too many bodies for the proof of the rounding margin.
    """

    def __init__(self, robot: Robot, q: Array, dq: Array, ddq: Array) -> None:
        prepared = Prepared.of(robot)
        q, dq, ddq = by_joint(robot, q, dq, ddq)
        count, still = q.shape[1], np.zeros_like(q)
        positions = joint_positions(robot, q)
        rest = link_motions(positions, still, still, base_motion(robot, count))
        moving = link_motions(positions, dq, ddq, weightless(count))
        self._static = backward(positions, rest, prepared.known)
        self._dynamic = backward(positions, moving, prepared.known)
        parts = [uncertain_terms(prepared.uncertain, positions, [(1.0, motion)]) for motion in (rest, moving)]
        self._terms: list[tuple[int, UncertainBody, BodyTerms, BodyTerms]] = [
            (joint, body, static, dynamic) for (joint, body, static), (_, _, dynamic) in zip(*parts, strict=True)
        ]
        magnitude = torque_magnitude(robot, q, still, still)
        self.polynomial = drive_polynomial(
            prepared, dq, ddq, magnitude, torque_magnitude(robot, q, dq, ddq) - magnitude
        )
        self.samples = count

    def rigid(self, u: float, which: Indices | None = None) -> Array:
        """R(u): largest torque of the rigid bodies, and the negative of the smallest, shape (2, n, T or K).

        Parameters
        ----------
        u : square of the factor, >= 0
        which : numbers of the samples that are wanted, shape (K,); None for all
        """
        picked = slice(None) if which is None else which
        known = self._static[:, picked] + u * self._dynamic[:, picked]
        upper, lower = known.copy(), known.copy()
        for joint, body, static, dynamic in self._terms:
            if which is not None:
                static, dynamic = static.of_samples(which), dynamic.of_samples(which)
            low, high = body.torque_range(static + dynamic.times(u))
            upper[joint] += high
            lower[joint] += low
        return np.stack([upper, -lower])


def drive_polynomial(prepared: Prepared, dq: Array, ddq: Array, static: Array, dynamic: Array) -> Polynomial:
    """Friction, rotor, disturbance and rounding margin, for states of shape (n, T).

    ``static`` and ``dynamic`` are the parts of the torque's magnitude that do not and that do grow with c^2.
    """
    shape = (2, *dq.shape)
    alpha, beta, gamma, moving = (np.empty(shape) for _ in range(4))
    slow = np.empty(dq.shape)
    unit = _MORE * roundings(prepared.robot.dof) * UNIT
    for i, drive in enumerate(prepared.drives):
        speed, push = np.abs(dq[i]), np.abs(ddq[i])
        with np.errstate(divide="ignore", invalid="ignore"):
            slow[i] = np.where(speed > 0.0, drive.velocity_band / speed * _ABOVE, np.inf)
        for side, sign in enumerate((1.0, -1.0)):
            alpha[side, i] = _largest(drive.armature, sign * ddq[i]) + unit * (dynamic[i] + drive.armature[1] * push)
            beta[side, i] = _largest(drive.viscous, sign * dq[i]) + unit * drive.viscous[1] * speed
            size = static[i] + drive.coulomb[1] + max(abs(drive.rest[0]), abs(drive.rest[1]))
            rest = max(sign * drive.rest[0], sign * drive.rest[1]) + unit * size + UNDERFLOW
            gamma[side, i] = drive.coulomb[1] + rest
            moving[side, i] = _largest(drive.coulomb, sign * np.sign(dq[i])) + rest
    return Polynomial(alpha, beta, gamma, moving, slow)


class TorqueRanges(Protocol):
    """Torque ranges of samples or cells as functions of the factor."""

    polynomial: Polynomial
    samples: int

    def rigid(self, u: float, which: Indices | None = None) -> Array:
        """R(u), shape (2, n, T or K); see ``ScaledTorques.rigid``."""


def bounds_at(torques: TorqueRanges, c: float) -> Array:
    """Largest torque and the negative of the smallest at a factor >= 0, shape (2, n, T).

    For c = 0 these are the torques of a motion that is infinitely slow.
    """
    p = torques.polynomial
    gamma = np.where(c >= p.slow, p.gamma_moving, p.gamma)
    return np.asarray(torques.rigid(c * c) + (p.alpha * c + p.beta) * c + gamma)


def _largest(ends: tuple[float, float], rate: Array) -> Array:
    return np.maximum(ends[0] * rate, ends[1] * rate)
