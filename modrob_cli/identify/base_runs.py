"""Recorded motions and torques for the identification of all joints at once, condensed to triangular factors."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.identify.base_columns import complete_regressor, nominal_values
from modrob_cli.identify.base_parameters import BaseModel
from modrob_cli.model.robot import Robot

Mask = NDArray[np.bool_]

MOST_SAMPLES = 100_000
"""Longer recordings are thinned evenly; at 100 Hz this is a quarter of an hour."""

_CHUNK = 2048


@dataclass(frozen=True)
class TorqueRun:
    """One recording.

    Attributes
    ----------
    name : for reports
    t : times, increasing, about even, shape (N,), [s]
    q, dq, ddq : shape (N, n), [rad] or [m] and derivatives
    tau : joint torque as recorded, shape (N, n), [N m] or [N]; not low-passed, which would blur the jumps of friction
        here but not in the regressor
    use : samples that count, shape (N,) or for each joint (N, n). Leave out ends of filters, contacts, and joints near
        standstill, where the sign of the friction is not known
    """

    name: str
    t: Array
    q: Array
    dq: Array
    ddq: Array
    tau: Array
    use: Mask

    def __post_init__(self) -> None:
        """Check shapes and spread the mask over the joints.

        Raises
        ------
        ShapeError
            If shapes do not fit together.
        """
        shape = (len(self.t), *self.q.shape[1:])
        if any(x.shape != shape for x in (self.q, self.dq, self.ddq, self.tau)) or len(shape) != 2:
            raise ShapeError(f"{self.name}: expected q, dq, ddq and tau of one shape (samples, joints)")
        use = self.use[:, None] if self.use.ndim == 1 else self.use
        if use.shape[0] != shape[0] or use.shape[1] not in (1, shape[1]):
            raise ShapeError(f"{self.name}: expected a mask of shape ({shape[0]},) or {shape}, got {self.use.shape}")
        object.__setattr__(self, "use", np.array(np.broadcast_to(use, shape)))

    def every(self, step: int) -> "TorqueRun":
        """Every ``step``-th sample."""
        keys = ("t", "q", "dq", "ddq", "tau", "use")
        return self if step == 1 else replace(self, **{key: getattr(self, key)[::step] for key in keys})


def thinned(runs: Sequence[TorqueRun]) -> tuple[TorqueRun, ...]:
    """The runs with at most :data:`MOST_SAMPLES` samples together."""
    step = -(-sum(len(run.t) for run in runs) // MOST_SAMPLES)
    return tuple(run.every(max(step, 1)) for run in runs)


def chunks(robot: Robot, model: BaseModel, run: TorqueRun) -> Iterator[tuple[slice, Array, Array]]:
    """Rows of a run in pieces: which samples, base regressor (T, n, p), torque beyond the nominal robot's (T, n)."""
    nominal = nominal_values(robot)
    for start in range(0, len(run.t), _CHUNK):
        part = slice(start, start + _CHUNK)
        W = complete_regressor(robot, run.q[part], run.dq[part], run.ddq[part])
        yield part, model.regressor(W), run.tau[part] - W @ nominal


@dataclass(frozen=True)
class Factors:
    """Triangular factors of [W_j, r_j] per joint, shape (n, p + 1, p + 1), and the samples of each joint, shape (n,).

    r is the torque beyond that of the nominal robot, so that the solution is the deviation from the robot file.
    """

    blocks: Array
    samples: Array

    def weighted(self, sigma: Array) -> Array:
        """Triangular factor (p + 1, p + 1) of all rows, those of joint j divided by sigma_j."""
        rows = (self.blocks / sigma[:, None, None]).reshape(-1, self.blocks.shape[2])
        return np.asarray(np.linalg.qr(rows, mode="r"))


def condense(robot: Robot, model: BaseModel, runs: Sequence[TorqueRun]) -> Factors:
    """Run through all samples once.

    Raises
    ------
    NumericalError
        If no joint has samples that count, or a value is not finite.
    """
    size = model.count + 1
    blocks = np.zeros((robot.dof, size, size))
    samples = np.zeros(robot.dof)
    for run in runs:
        for part, W, rest in chunks(robot, model, run):
            for j in range(robot.dof):
                use = run.use[part, j]
                rows = np.column_stack([W[use, j], rest[use, j]])
                if not np.isfinite(rows).all():
                    raise NumericalError(f"{run.name}: a sample that is to be used is not finite")
                blocks[j] = np.linalg.qr(np.vstack([blocks[j], rows]), mode="r")
                samples[j] += len(rows)
    if not samples.sum() > 2 * size:
        raise NumericalError(f"{int(samples.sum())} usable samples for {size - 1} parameters; use longer recordings")
    return Factors(blocks, samples)
