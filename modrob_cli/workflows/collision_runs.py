"""Stretches of logs and planned motions, made ready for collision bands."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.collision.bands import UncertainMotion
from modrob_cli.collision.events import Contact
from modrob_cli.identify.effort import effort_factors
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.collision_options import CollisionOptions

PLANNED = (".yaml", ".yml", ".json")
"""Files that hold planned motions; others are logs."""


@dataclass(frozen=True)
class CollisionRun:
    """One log or planned motion, or a stretch of it.

    Attributes
    ----------
    robot : as it counts for this log: without gravity where the effort is
    start : time of the first sample [ns since 1970]; 0 for a planned motion
    motion : with its half-widths; ``t`` counts from the first sample of the log
    tau : recorded joint torque, shape (N, n); None for a planned motion
    tau_noise : half-width of its noise, shape (n,)
    used : samples that count, shape (N,)
    contacts : known contacts; None if the log does not tell about any
    source : where accelerations come from, in words
    """

    path: Path
    name: str
    robot: Robot
    start: int
    motion: UncertainMotion
    tau: Array | None
    tau_noise: Array
    used: NDArray[np.bool_]
    contacts: tuple[Contact, ...] | None
    source: str
    notes: tuple[str, ...]

    def part(self, first: int, last: int) -> "CollisionRun":
        """The samples first .. last - 1 alone."""
        motion, span = self.motion, slice(first, last)
        names = ("t", "q", "dq", "ddq", *(["ddq_rad"] if motion.ddq_rad.ndim == 2 else []))
        kept = {key: getattr(motion, key)[span] for key in names}
        tau = None if self.tau is None else self.tau[span]
        return replace(self, motion=replace(motion, **kept), tau=tau, used=self.used[span])


@dataclass(frozen=True)
class RunHead:
    """What all stretches of a log have in common; see :class:`CollisionRun`.

    Attributes
    ----------
    step : median step, [s]
    """

    path: Path
    name: str
    robot: Robot
    start: int
    step: float

    def run(
        self,
        options: CollisionOptions,
        t: Array,
        states: Sequence[Array],
        ddq_rad: Array,
        effort: Array,
        source: str,
    ) -> CollisionRun:
        """One stretch, all samples of which count.

        Parameters
        ----------
        states : q, dq, ddq, shape (N, n);  effort : as recorded
        """
        radii, factors = options.radii(self.robot), effort_factors(self.robot, options.effort)
        motion = UncertainMotion(t, states[0], states[1], states[2], radii["q"], radii["dq"], ddq_rad, self.step)
        used = np.ones(len(t), dtype=bool)
        common = (self.path, self.name, self.robot, self.start)
        return CollisionRun(*common, motion, effort * factors, radii["effort"] * factors, used, None, source, ())


def joined(one: CollisionRun, other: CollisionRun) -> CollisionRun:
    """Two stretches, one behind the other, whose half-widths do not change."""
    motion, more = one.motion, other.motion
    t, q, dq, ddq = (np.concatenate([getattr(motion, key), getattr(more, key)]) for key in ("t", "q", "dq", "ddq"))
    tau = None if one.tau is None or other.tau is None else np.concatenate([one.tau, other.tau])
    used = np.concatenate([one.used, other.used])
    return replace(one, motion=replace(motion, t=t, q=q, dq=dq, ddq=ddq), tau=tau, used=used)
