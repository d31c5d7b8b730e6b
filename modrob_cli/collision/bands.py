r"""Torque bands for collision detection: what the motors may ask for without contact. [S] III.B, (20)-(23).

For every sample, the true position and velocity lie within the stated noise of the measured ones, the true acceleration
within a tolerance of a known one, the parameters in their box. The band holds all torques of these states:

* the rigid bodies' exact range at the middle of the box of states (or IANEA's, [R] Alg. 1, with interval
  accelerations),
* widened by the sum over the variables x_k of q, dq, ddq of max abs(d tau / d x_k) times the half-width of x_k. The
  slopes are enclosed over cells of a few neighbouring samples and their noise, and over all parameters that can be
  the worst (see :mod:`modrob_cli.dynamics.box_bounds`). For a fixed parameter vector the mean-value theorem along the
  segment from the middle of a sample's box, which stays inside the cell, gives the bound;
* the exact range of friction, rotor and disturbance over the box of dq and ddq: both ends of a box are looked at, so
  the sign of the friction is open where the noise of dq straddles zero, and within the velocity band of the friction.

A cell is short, so the slopes are those of the sample but for terms of second order; against bounds of each sample's
own box this costs a tenth of the time.

What is approximate: nothing is left out, but the band of a box of states is wider than its exact range, because
different variables may have different worst parameters (figures in ``docs/collision.md``).
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.dynamics.ball import EPS, TINY, Ball
from modrob_cli.dynamics.box_derivatives import box_torques
from modrob_cli.dynamics.box_motion import StateBox
from modrob_cli.dynamics.drive_torque import drive_boxes, drive_nominal
from modrob_cli.dynamics.exact_bounds import TorqueBounds, exact_bounds
from modrob_cli.dynamics.ianea import ianea
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction
from modrob_cli.model.robot import Robot

Method = Literal["exact", "ianea"]

CELL = 0.02
"""Length of a cell [s]: slopes change by a few percent, and computing them does not cost more than the rest."""
_CELLS = 4096
"""Cells worked on at once."""


def cell_size(rate: float) -> int:
    """Samples in a cell at a sampling rate [Hz]."""
    return max(1, round(CELL * rate))


@dataclass(frozen=True)
class UncertainMotion:
    """A motion that is known up to half-widths; N samples, n joints.

    Attributes
    ----------
    t : strictly increasing times, shape (N,), [s]
    q, dq, ddq : shape (N, n), [rad] or [m] and derivatives
    q_rad, dq_rad : half-widths >= 0, shape (n,)
    ddq_rad : half-widths >= 0, shape (n,), or (N, n) where they change
    step : median step of the longer motion that this is a piece of, [s]; None: it is a whole one
    least : least ``ddq_rad`` of that motion, shape (n,); None: it is a whole one
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array
    q_rad: Array
    dq_rad: Array
    ddq_rad: Array
    step: float | None = None
    least: Array | None = None

    def __post_init__(self) -> None:
        """Check that the arrays fit together.

        Raises
        ------
        ShapeError
            If they do not.
        NumericalError
            If a half-width is negative or not finite.
        """
        shape = (len(self.t), self.q.shape[-1])
        if any(part.shape != shape for part in (self.q, self.dq, self.ddq)) or not len(self.t):
            raise ShapeError(f"expected a motion of shape {shape} with at least one sample")
        shapes = [part.shape for part in (self.q_rad, self.dq_rad, self.ddq_rad)]
        if shapes[:2] != [shape[1:]] * 2 or shapes[2] not in (shape, shape[1:]):
            raise ShapeError(f"half-widths of shapes {shapes}, expected {shape[1:]}, or {shape} for ddq")
        if not all(np.all(np.isfinite(part) & (part >= 0.0)) for part in (self.q_rad, self.dq_rad, self.ddq_rad)):
            raise NumericalError("half-widths of a motion must be finite and not negative")

    @property
    def median_step(self) -> float:
        """Median step, [s]; 1 for a single sample."""
        if self.step is not None:
            return self.step
        return float(np.median(np.diff(self.t))) if len(self.t) > 1 else 1.0

    @property
    def rate(self) -> float:
        """Samples per second, by the median step."""
        return 1.0 / self.median_step

    @property
    def least_ddq_rad(self) -> Array:
        """Half-width of ddq that no sample is below, shape (n,)."""
        if self.least is not None:
            return self.least
        return np.asarray(self.ddq_rad if self.ddq_rad.ndim == 1 else self.ddq_rad.min(axis=0))

    @property
    def cell(self) -> int:
        """Samples in a cell over which slopes are enclosed."""
        return cell_size(self.rate)

    @property
    def is_exact(self) -> bool:
        """True if nothing has any width."""
        return not (self.q_rad.any() or self.dq_rad.any() or self.ddq_rad.any())


@dataclass(frozen=True)
class StateWidths:
    """How far the box of states moves the lower and the upper end of the rigid bodies' torque, shape (2, N, n) each.

    ``noise``: that of q and dq; ``acceleration``: the half-width of ddq; ``varying``: what it has beyond its least one.
    """

    noise: Array
    acceleration: Array
    varying: Array


def torque_band(
    robot: Robot, motion: UncertainMotion, links: LinkBoxes | None = None, widths: StateWidths | None = None
) -> TorqueBounds:
    """Band of the joint torques without contact, at each sample.

    Parameters
    ----------
    links : for the published interval algorithm; None for the exact range
    widths : from :func:`state_widths`, where they are known already

    Returns
    -------
    TorqueBounds
        Outward. Nominal torque: at the middle of each box, see :func:`modrob_cli.dynamics.drive_torque.drive_nominal`.

    Raises
    ------
    ShapeError
        If a shape does not fit the robot.
    NumericalError
        If a result is not finite.
    """
    bare = _without_drives(robot)
    state = (motion.q, motion.dq, motion.ddq)
    rigid = (
        exact_bounds(bare, *state) if links is None else ianea(bare, *state, links, ddq_tolerance=motion.least_ddq_rad)
    )
    nominal, lower, upper = rigid.nominal.copy(), rigid.lower.copy(), rigid.upper.copy()
    if not motion.is_exact:
        found = widths or state_widths(robot, motion)
        # IANEA takes one half-width of ddq for all samples into its intervals.
        below, above = found.noise + (found.acceleration if links is None else found.varying)
        lower, upper = lower - below, upper + above
    for i, drive in enumerate(drive_boxes(robot)):
        more = motion.ddq_rad[..., i]
        down = _end(motion.dq[:, i], -motion.dq_rad[i]), _end(motion.ddq[:, i], -more)
        up = _end(motion.dq[:, i], motion.dq_rad[i]), _end(motion.ddq[:, i], more)
        size = np.maximum(drive.magnitude(*down), drive.magnitude(*up))
        low, high = drive.torque_range(*down)[0], drive.torque_range(*up)[1]
        lower[:, i] += low - EPS * (np.abs(lower[:, i]) + size) - TINY
        upper[:, i] += high + EPS * (np.abs(upper[:, i]) + size) + TINY
        nominal[:, i] += drive_nominal(robot.joints[i], motion.dq[:, i], motion.ddq[:, i], robot.disturbance[i])
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
        raise NumericalError("a torque band is not finite; check the motion and the model for absurd values")
    return TorqueBounds(nominal, lower, upper)


def _end(middle: Array, move: Array) -> Array:
    """One end of intervals, rounded outward; the middle itself where there is no width."""
    end = middle + move
    return np.where(move == 0.0, middle, np.nextafter(end, np.copysign(np.inf, move)))


def _without_drives(robot: Robot) -> Robot:
    """The rigid bodies alone."""
    joints = tuple(replace(joint, friction=Friction(), drive=Drive()) for joint in robot.joints)
    return replace(robot, joints=joints, disturbance=Interval(np.zeros(robot.dof)))


def state_widths(robot: Robot, motion: UncertainMotion) -> StateWidths:
    """How far the boxes of states move the ends of the rigid bodies' torque; rounded up.

    Pieces of a motion give what the whole gives if they begin at a multiple of its :attr:`UncertainMotion.cell`.
    """
    bare = _without_drives(robot)
    starts = np.arange(0, len(motion.t), motion.cell)
    widths = np.zeros((3, 2, len(starts), bare.dof))
    for first in range(0, 0 if motion.is_exact else len(starts), _CELLS):
        some = starts[first : first + _CELLS]
        piece = slice(some[0], starts[first + _CELLS] if first + _CELLS < len(starts) else len(motion.t))
        widths[:, :, first : first + _CELLS] = _cell_widths(bare, motion, piece, some - some[0])
    counts = np.diff(np.append(starts, len(motion.t)))
    return StateWidths(*np.repeat(widths, counts, axis=2))


def _cell_widths(bare: Robot, motion: UncertainMotion, piece: slice, starts: Indices) -> Array:
    """Sum of max abs(slope) times half-width as in :class:`StateWidths`, lower and upper end, (3, 2, cells, n)."""
    middle = np.stack([part[piece].T for part in (motion.q, motion.dq, motion.ddq)])
    still = [np.broadcast_to(rad[:, None], middle.shape[1:]) for rad in (motion.q_rad, motion.dq_rad)]
    moving = motion.ddq_rad[piece].T if motion.ddq_rad.ndim == 2 else motion.ddq_rad[:, None]
    rad = np.stack([*still, np.broadcast_to(moving, middle.shape[1:])])
    low = np.nextafter(np.minimum.reduceat(middle - rad, starts, axis=2), -np.inf)
    high = np.nextafter(np.maximum.reduceat(middle + rad, starts, axis=2), np.inf)
    most = np.maximum.reduceat(rad, starts, axis=2)
    box = Ball.between(low, high)
    with np.errstate(over="ignore", invalid="ignore"):  # not finite in the end is an error of its own
        found = box_torques(bare, StateBox(box[0], box[1], box[2]))
        reach = np.zeros((3, len(found.directions), len(starts)))
        for k, (i, kind) in enumerate(found.directions):
            reach[kind // 2, k] = most[kind, i]
            if kind == 2:
                reach[2, k] = most[kind, i] - motion.least_ddq_rad[i]
        total = np.einsum("jskt,wkt->wstj", found.slopes.mag, reach)
    return np.asarray(total * (1.0 + EPS))
