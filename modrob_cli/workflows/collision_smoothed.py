"""Motions low-passed without phase shift, as for identification, for collision bands."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.long_run import LongRun, prepare_long_run
from modrob_cli.identify.long_signals import MotionPiece, Sizes
from modrob_cli.identify.long_source import LongSource
from modrob_cli.identify.run import Run, prepare_run
from modrob_cli.identify.signal_cutoff import choose_cutoff
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_runs import CollisionRun, RunHead, joined


@dataclass(frozen=True)
class Smoothed:
    """A log that can be gone through stretch by stretch.

    Parameters
    ----------
    stretch : samples of each, whole cells
    """

    head: RunHead
    options: CollisionOptions
    made: LongRun | Run
    stretch: int

    def stretches(self) -> Iterator[CollisionRun]:
        """All stretches, from the first sample that counts to the last one."""
        return aligned((self._run(piece) for piece in self._pieces()), self.stretch, self.options.skip)

    def _pieces(self) -> Iterable[MotionPiece | Run]:
        return [self.made] if isinstance(self.made, Run) else self.made.pieces()

    def _run(self, piece: MotionPiece | Run) -> CollisionRun:
        head, options = self.head, self.options
        cutoff = self.made.signals.cutoff if isinstance(self.made, Run) else self.made.motion.cutoff
        effort = piece.signals.effort if isinstance(piece, Run) else piece.effort
        source = f"positions and velocities low-passed at {cutoff:.4g} Hz without phase shift (not causal)"
        states, rad = (piece.q, piece.dq, piece.ddq), options.radii(head.robot)["ddq"]
        return replace(head.run(options, piece.t, states, rad, effort, source), used=piece.used)


def smooth_log(head: RunHead, log: JointLog, options: CollisionOptions, stretch: int) -> Smoothed:
    """A log that is in memory.

    Raises
    ------
    UsageError
        If the cut-off does not fit.
    NumericalError
        If the log is too short.
    """
    cutoff = options.cutoff or choose_cutoff(log).cutoff
    run = prepare_run(head.robot, log, options.effort, cutoff)
    return Smoothed(_with_standstill(head, run.standstill, 1.0 / run.signals.rate), options, run, stretch)


def smooth_long(
    head: RunHead, log: LongSource, options: CollisionOptions, stretch: int, sizes: Sizes | None = None
) -> Smoothed:
    """A long log; errors as for :func:`smooth_log`."""
    run = prepare_long_run(head.robot, log, options.effort, options.cutoff, sizes, fit=False)
    return Smoothed(_with_standstill(head, run.standstill, run.known.step), options, run, stretch)


def _with_standstill(head: RunHead, standstill: Array, step: float) -> RunHead:
    """Joints without a velocity band get that of the noise, in which the sign of the velocity is open."""
    joints = tuple(
        joint
        if joint.friction.velocity_band > 0.0
        else replace(joint, friction=replace(joint.friction, velocity_band=float(band)))
        for joint, band in zip(head.robot.joints, standstill, strict=True)
    )
    robot: Robot = replace(head.robot, joints=joints)
    return replace(head, robot=robot, step=step)


def aligned(pieces: Iterable[CollisionRun], stretch: int, skip: float) -> Iterator[CollisionRun]:
    """The samples between the first and last that count, and behind ``skip`` [s], in stretches of equal length."""
    held: CollisionRun | None = None
    for piece in pieces:
        if held is None:
            if not piece.used.any():
                continue
            piece = piece.part(int(piece.used.argmax()), len(piece.used))
        if piece.motion.t[-1] >= skip:
            piece = piece.part(int(np.searchsorted(piece.motion.t, skip)), len(piece.used))
            held = piece if held is None else joined(held, piece)
        while held is not None and held.used[stretch:].any():
            yield held.part(0, stretch)
            held = held.part(stretch, len(held.used))
    if held is not None and held.used.any():
        yield held.part(0, int(np.flatnonzero(held.used)[-1]) + 1)
