"""Which torque bounds the options ask for."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.interval_tight import tight_intervals
from modrob_cli.dynamics.box_bounds import box_bounds
from modrob_cli.dynamics.ddq_bounds import Method as Form
from modrob_cli.dynamics.ddq_bounds import ddq_bounds
from modrob_cli.dynamics.exact_bounds import TorqueBounds, exact_bounds
from modrob_cli.dynamics.ianea import ianea
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.dynamics.width_share import (
    Widths,
    WidthShare,
    acceleration_widths,
    parameter_widths,
    ranked,
    without_width,
)
from modrob_cli.errors import UsageError
from modrob_cli.model.motion import MotionPiece
from modrob_cli.model.robot import Robot

MOST_CORNERS = 8
"""Up to this many tolerances of acceleration the bounds are exact, at up to 2^8 times the cost; else an enclosure."""

Method = Literal["exact", "ianea"]
Bounder = Callable[[MotionPiece], TorqueBounds]


@dataclass(frozen=True)
class BoundsOptions:
    """How the bounds are computed.

    Attributes
    ----------
    ddq_tolerance, q_noise, dq_noise : half-widths, one for all joints or one each, [rad] or [m] and derivatives; None
        for none
    """

    method: Method = "exact"
    ddq_tolerance: list[float] | None = None
    q_noise: list[float] | None = None
    dq_noise: list[float] | None = None


@dataclass(frozen=True)
class Tolerances:
    """Half-widths of q, dq and ddq, shape (n,) each."""

    q: Array
    dq: Array
    ddq: Array

    @classmethod
    def of(cls, options: BoundsOptions, dof: int) -> "Tolerances":
        """One number per joint.

        Raises
        ------
        UsageError
            If there are neither one nor as many numbers as joints, or one is negative.
        """
        return cls(
            per_joint(options.q_noise, dof, "--q-noise"),
            per_joint(options.dq_noise, dof, "--dq-noise"),
            per_joint(options.ddq_tolerance, dof, "--ddq-tolerance"),
        )

    @property
    def has_noise(self) -> bool:
        """True if positions or velocities have a width."""
        return bool(self.q.any() or self.dq.any())


def per_joint(values: list[float] | None, dof: int, option: str) -> Array:
    """Half-widths, shape (n,), from one number, n numbers, or none.

    Raises
    ------
    UsageError
        If the count does not fit or a number is negative.
    """
    given = [0.0] if values is None else values
    if len(given) not in (1, dof):
        raise UsageError(f"{option}: found {len(given)} numbers, expected one, or one for each of the {dof} joints")
    if min(given) < 0.0:
        raise UsageError(f"{option}: found {min(given):g}, expected half-widths >= 0")
    return np.array(given * (dof // len(given)))


def bounder(robot: Robot, method: Method, tolerances: Tolerances) -> Bounder:
    """The function that bounds the torques of a piece of a motion.

    Raises
    ------
    UsageError
        If the published algorithm is asked for noise, which it does not know.
    """
    if method == "ianea":
        if tolerances.has_noise:
            raise UsageError(
                "--q-noise and --dq-noise need --method exact; the published algorithm takes q and dq as exact"
            )
        # In the D-H frames, as published; tight link parameters, so that only the algorithm itself is compared.
        frames = dh_table(robot).frames
        tight = tight_intervals(robot, frames)
        links = LinkBoxes(tight.mass, tight.com, tight.inertia_com, frames)
        return lambda m: ianea(robot, m.q, m.dq, m.ddq, links, ddq_tolerance=tolerances.ddq)
    if tolerances.has_noise:
        return lambda m: box_bounds(robot, m.q, m.dq, m.ddq, tolerances.q, tolerances.dq, tolerances.ddq)
    if tolerances.ddq.any():
        form: Form = "corners" if np.count_nonzero(tolerances.ddq) <= MOST_CORNERS else "cheap"
        return lambda m: ddq_bounds(robot, m.q, m.dq, m.ddq, tolerances.ddq, form)
    return lambda m: exact_bounds(robot, m.q, m.dq, m.ddq)


def shares(robot: Robot, motion: MotionPiece, tolerances: Tolerances) -> list[list[WidthShare]]:
    """For each joint, what its width comes from: parameters, tolerance and noise, largest first."""
    widths = parameter_widths(robot, motion.q, motion.dq, motion.ddq)
    for more in (acceleration_widths(robot, motion.q, tolerances.ddq), _noise_widths(robot, motion, tolerances)):
        for joint, found in zip(widths, more, strict=True):
            joint.update(found)
    return [ranked(joint) for joint in widths]


def _noise_widths(robot: Robot, motion: MotionPiece, tolerances: Tolerances) -> list[Widths]:
    """Mean width by the noise of each position and velocity alone, at nominal parameters."""
    bare, zero = without_width(robot), np.zeros(robot.dof)
    widths: list[Widths] = [{} for _ in robot.joints]
    if not tolerances.has_noise:
        return widths
    still = exact_bounds(bare, motion.q, motion.dq, motion.ddq)  # friction at rest has a width without any noise
    for word, half_widths in (("position", tolerances.q), ("velocity", tolerances.dq)):
        for k in map(int, np.flatnonzero(half_widths)):
            alone = zero.copy()
            alone[k] = half_widths[k]
            radii = (alone, zero) if word == "position" else (zero, alone)
            found = box_bounds(bare, motion.q, motion.dq, motion.ddq, *radii, zero)
            more = (found.upper - still.upper) + (still.lower - found.lower)
            for j, width in enumerate(np.maximum(more, 0.0).mean(axis=0)):
                widths[j][f"{robot.joints[k].name} {word} noise"] = float(width)
    return widths
