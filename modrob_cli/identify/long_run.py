"""A long log made ready like one in memory (see :mod:`modrob_cli.identify.run`), piece by piece."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.identify.effort import EffortKind, effort_factors, holds_gravity
from modrob_cli.identify.long_signals import LongMotion, MotionPiece, Overview, Sizes, overview, repaired_floor
from modrob_cli.identify.long_source import LongSource
from modrob_cli.identify.run import LEAST_FAST, Run, standstill_of
from modrob_cli.identify.signal_cutoff import noise_from
from modrob_cli.identify.signals import VELOCITY_BAND, Mask, Signals, check_used, in_motion
from modrob_cli.model.robot import Robot


@dataclass(frozen=True)
class LongRun:
    """A long log made ready; n joints.

    Attributes
    ----------
    motion : the low-passed motion
    factors : joint torque per effort, shape (n,)
    speed : RMS velocity of the used samples, shape (n,)
    noise_dq, noise_ddq, standstill, gravity : as for :class:`Run`
    moving : as for :class:`modrob_cli.identify.signals.Signals`
    """

    motion: LongMotion
    factors: Array
    speed: Array
    noise_dq: Array
    noise_ddq: Array
    standstill: Array
    moving: Mask
    gravity: bool

    @property
    def known(self) -> Overview:
        """What is known of the whole log."""
        return self.motion.known

    @property
    def duration(self) -> float:
        """Length of the log, [s]."""
        return self.motion.end

    def run(self, robot: Robot, piece: MotionPiece, rigid: bool) -> Run:
        """A piece as a run; torques of the rigid bodies are zero unless ``rigid``."""
        motion = (piece.q, piece.dq, piece.ddq)
        known, band = self.known, VELOCITY_BAND * self.speed
        signals = Signals(
            piece.t, *motion, piece.effort, piece.used, self.moving, band, known.rate, self.motion.cutoff,
            known.resampled, known.gap,
        )  # fmt: skip
        model = robot if self.gravity else replace(robot, gravity=np.zeros(3))
        tau_rigid = rnea(model, *motion) if rigid else np.zeros_like(piece.q)
        noise = (self.noise_dq, self.noise_ddq, self.standstill)
        tau = piece.effort * self.factors
        return Run(self.motion.source.name, signals, tau, tau_rigid, piece.used, *noise, self.gravity)

    def pieces(self) -> Iterator[MotionPiece]:
        """All pieces of the motion."""
        return self.motion.pieces()


def prepare_long_run(
    robot: Robot,
    source: LongSource,
    effort: EffortKind,
    cutoff: float | None = None,
    sizes: Sizes | None = None,
    fit: bool = True,
) -> LongRun:
    """Find out what :func:`modrob_cli.identify.run.prepare_run` says of the whole log.

    Parameters
    ----------
    cutoff : of the low-pass, [Hz]; None: chosen from the spectrum
    fit : whether something is to be fitted; if not, joints count as moving that are at standstill most of the time

    Raises
    ------
    UsageError
        If the robot lacks constants that ``effort`` needs, or the cut-off does not fit.
    NumericalError
        If the log is too short.
    """
    sizes = sizes or Sizes()
    factors = effort_factors(robot, effort)
    known = overview(source, sizes)
    motion = LongMotion(source, known, known.choose_cutoff() if cutoff is None else cutoff, sizes)
    sums = _MotionSums(robot.dof)
    for piece in motion.pieces():
        sums.add(piece)
    check_used(source.name, motion.end, source.count, sums.count, motion.cutoff)
    speed = np.sqrt(sums.square / sums.count)
    floor = repaired_floor(source, known, sizes, sums.glitches)
    noise = noise_from(floor, known.rate, motion.cutoff, derived=not source.has_velocity)
    standstill = standstill_of(speed, noise[0])
    moving = in_motion(sums.noise / sums.count, sums.high - sums.low)
    if fit:
        fast = sum((np.abs(piece.dq[piece.used]) > standstill).sum(axis=0) for piece in motion.pieces())
        moving &= fast / sums.count > LEAST_FAST
    return LongRun(motion, factors, speed, *noise, standstill, moving, holds_gravity(effort))


class _MotionSums:
    """Sums over the used samples; n joints."""

    def __init__(self, n: int) -> None:
        self.count = 0
        self.glitches = False
        self.square, self.noise = np.zeros(n), np.zeros(n)
        self.low, self.high = np.full(n, np.inf), np.full(n, -np.inf)

    def add(self, piece: MotionPiece) -> None:
        self.glitches |= piece.glitches
        if not piece.used.any():
            return
        q = piece.q[piece.used]
        self.count += len(q)
        self.square += (piece.dq[piece.used] ** 2).sum(axis=0)
        self.noise += ((piece.raw[piece.used] - q) ** 2).sum(axis=0)
        self.low, self.high = np.minimum(self.low, q.min(axis=0)), np.maximum(self.high, q.max(axis=0))
