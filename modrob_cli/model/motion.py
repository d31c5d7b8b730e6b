"""Sampled motions of an arm, as they are planned or computed: pieces, thinning, limits."""

from dataclasses import dataclass, field

import numpy as np

from modrob_cli.arrays import Array, frozen
from modrob_cli.errors import ShapeError
from modrob_cli.model.robot import Robot

ALLOWED_EXCESS = 1e-9
"""Going beyond a limit by this, relative to 1 + the limit, is rounding (a plan that touches its limit), not a fault."""

QUANTITIES = (("position", "q"), ("velocity", "dq"), ("acceleration", "ddq"))


@dataclass(frozen=True)
class MotionPiece:
    """Consecutive samples of a motion.

    Attributes
    ----------
    t : times, shape (T,), [s]
    q, dq, ddq : shape (T, n), [rad] or [m] and derivatives
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they fit together.

        Raises
        ------
        ShapeError
            If they do not.
        """
        object.__setattr__(self, "t", frozen(self.t, (-1,)))
        if self.q.ndim != 2:
            raise ShapeError(f"expected positions of shape (samples, joints), got {self.q.shape}")
        for key in ("q", "dq", "ddq"):
            object.__setattr__(self, key, frozen(getattr(self, key), (len(self.t), self.q.shape[1])))

    def every(self, step: int, first: int = 0) -> "MotionPiece":
        """Every ``step``-th sample from ``first`` on."""
        picked = slice(first, None, step)
        return MotionPiece(self.t[picked], self.q[picked], self.dq[picked], self.ddq[picked])


class ThinnedMotion:
    """Evenly picked samples of a motion that comes in pieces and whose length is not known before its end.

    Every ``step``-th sample is kept; whenever more than ``most`` have come together, every other one is dropped and the
    step doubles. So between ``most / 2`` and ``most`` remain of a long motion, all of a short one.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self.step = 1
        self._seen = 0
        self._pieces: list[MotionPiece] = []

    def add(self, piece: MotionPiece) -> None:
        """Take the next piece of the motion."""
        self._pieces.append(piece.every(self.step, -self._seen % self.step))
        self._seen += len(piece.t)
        while sum(len(part.t) for part in self._pieces) > self.most:
            self._pieces = [self.motion().every(2)]
            self.step *= 2

    def motion(self) -> MotionPiece:
        """Samples that were kept so far.

        Raises
        ------
        ShapeError
            If there was no piece yet.
        """
        if not self._pieces:
            raise ShapeError("a motion without samples")
        parts = ([getattr(part, key) for part in self._pieces] for key in ("t", "q", "dq", "ddq"))
        return MotionPiece(*(np.concatenate(part) for part in parts))


@dataclass
class Excess:
    """How a joint leaves the range of one quantity.

    Attributes
    ----------
    joint : name;  quantity : position, velocity or acceleration
    limit : (lower, upper)
    count : samples outside;  first_time : of the first of them, [s]
    worst : largest distance from the range;  worst_time : where it is reached first, [s]
    """

    joint: str
    quantity: str
    limit: tuple[float, float]
    count: int = 0
    first_time: float = 0.0
    worst: float = 0.0
    worst_time: float = 0.0

    def add(self, t: Array, values: Array) -> None:
        """Take the next samples, shapes (T,)."""
        beyond = np.maximum(self.limit[0] - values, values - self.limit[1])
        outside = np.flatnonzero(beyond > ALLOWED_EXCESS * (1.0 + max(abs(self.limit[0]), abs(self.limit[1]))))
        if not len(outside):
            return
        if not self.count:
            self.first_time = float(t[outside[0]])
        self.count += len(outside)
        peak = int(beyond.argmax())
        if beyond[peak] > self.worst:
            self.worst, self.worst_time = float(beyond[peak]), float(t[peak])


@dataclass
class LimitWatch:
    """Compares a motion that comes in pieces with the position, velocity and acceleration limits of a robot."""

    robot: Robot
    watched: list[tuple[int, str, Excess]] = field(init=False)

    def __post_init__(self) -> None:
        """List the limits that are known."""
        self.watched = [
            (i, key, Excess(joint.name, quantity, limit))
            for i, joint in enumerate(self.robot.joints)
            for quantity, key in QUANTITIES
            if (limit := getattr(joint.limits, quantity)) is not None
        ]

    def add(self, piece: MotionPiece) -> None:
        """Take the next piece of the motion."""
        for i, key, excess in self.watched:
            excess.add(piece.t, getattr(piece, key)[:, i])

    def found(self) -> list[Excess]:
        """Joints and quantities that left their range, base to tip."""
        return [excess for _, _, excess in self.watched if excess.count]
