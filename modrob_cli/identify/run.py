"""One log made ready for identification: motion, recorded torque, torque of the nominal rigid bodies."""

from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.identify.effort import EffortKind, effort_factors, holds_gravity
from modrob_cli.identify.signal_cutoff import motion_noise
from modrob_cli.identify.signal_glitches import without_glitches
from modrob_cli.identify.signals import Mask, Signals, low_pass, prepare
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot

STANDSTILL = 0.01
"""Velocity taken for standstill, as a share of the RMS velocity of the joint; more where it drowns in noise."""

NOISE_MULTIPLE = 3.0
"""Velocity taken for standstill at least, in standard deviations of the velocity's noise."""

SLOWEST = 1e-6
"""Least velocity taken for standstill, [rad/s] or [m/s]: below, positions in double precision are all noise."""

LEAST_FAST = 0.1
"""A joint moves if it is faster than standstill in at least this share of the samples."""


@dataclass(frozen=True)
class Run:
    """One log made ready; N samples, n joints.

    Attributes
    ----------
    name : of the log, for reports
    signals : evenly sampled, low-passed motion; where it may be used
    tau : joint torque as recorded, not filtered, shape (N, n), [N m] or [N]
    tau_rigid : torque of the nominal rigid bodies along the low-passed motion, shape (N, n); without gravity if the
        recorded torque is without
    used : samples that count, shape (N,); those of ``signals`` or a part of them
    noise_dq, noise_ddq : noise that the low-pass left in velocity and acceleration, RMS, shape (n,)
    standstill : velocity below which the sign of dq is uncertain, shape (n,), [rad/s] or [m/s]
    gravity : False if the recorded torque is without gravity
    glitches : single wild samples of position or velocity that were replaced
    """

    name: str
    signals: Signals
    tau: Array
    tau_rigid: Array
    used: Mask
    noise_dq: Array
    noise_ddq: Array
    standstill: Array
    gravity: bool = True
    glitches: int = 0

    @property
    def t(self) -> Array:
        """Times (N,), [s]."""
        return self.signals.t

    @property
    def q(self) -> Array:
        """Low-passed positions, shape (N, n)."""
        return self.signals.q

    @property
    def dq(self) -> Array:
        """Low-passed velocities, shape (N, n)."""
        return self.signals.dq

    @property
    def ddq(self) -> Array:
        """Low-passed accelerations, shape (N, n)."""
        return self.signals.ddq

    @property
    def duration(self) -> float:
        """Length of the log, [s]."""
        return float(self.t[-1] - self.t[0])

    def filtered(self, x: Array) -> Array:
        """The filter of the motion applied to another signal along the first axis.

        Recorded torque and model pass it alike, so that noise beyond the cut-off does not count and the jump of the
        friction at a reversal is blurred in both in the same way.
        """
        return low_pass(x, self.signals.rate, self.signals.cutoff)

    def between(self, start: float, end: float) -> "Run":
        """The same run with only the samples start <= t < end counting; times from the first sample, [s]."""
        since = self.t - self.t[0]
        return replace(self, used=self.used & (since >= start) & (since < end))


def prepare_run(robot: Robot, log: JointLog, effort: EffortKind, cutoff: float | None = None) -> Run:
    """Prepare one log: signals, joint torque from effort, rigid-body torque.

    Parameters
    ----------
    log : joints in the robot's order
    effort : what the log calls effort
    cutoff : of the low-pass, [Hz]; None for the default of :func:`modrob_cli.identify.signals.prepare`

    Raises
    ------
    UsageError
        If the robot lacks constants that ``effort`` needs, or the cut-off does not fit.
    NumericalError
        If the log is too short.
    """
    factors = effort_factors(robot, effort)
    log, glitches = without_glitches(log)
    signals = prepare(log, cutoff)
    gravity = holds_gravity(effort)
    model = robot if gravity else replace(robot, gravity=np.zeros(3))
    tau_rigid = rnea(model, signals.q, signals.dq, signals.ddq)
    noise = motion_noise(log, signals.cutoff)
    speed = np.sqrt(np.mean(signals.dq[signals.used] ** 2, axis=0))
    standstill = standstill_of(speed, noise[0])
    fast = np.mean(np.abs(signals.dq[signals.used]) > standstill, axis=0) > LEAST_FAST
    signals = replace(signals, moving=signals.moving & fast)
    tau = signals.effort if np.all(factors == 1.0) else signals.effort * factors
    return Run(log.name, signals, tau, tau_rigid, signals.used, *noise, standstill, gravity, glitches)


def standstill_of(speed: Array, noise: Array) -> Array:
    """Velocities taken for standstill from RMS velocity and its noise, shape (n,) each, [rad/s] or [m/s]."""
    return np.asarray(np.maximum(np.maximum(STANDSTILL * speed, NOISE_MULTIPLE * noise), SLOWEST))
