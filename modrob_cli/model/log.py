"""A recording of an arm in motion."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, frozen
from modrob_cli.errors import ShapeError


@dataclass(frozen=True)
class JointLog:
    """Joint positions and efforts over time, as recorded; columns in the order of ``joint_names``.

    Attributes
    ----------
    name : where it comes from, for reports
    joint_names : n names
    t : strictly increasing times from the first sample, shape (N,), [s]
    q : positions, shape (N, n), [rad] or [m]
    dq : velocities, shape (N, n), [rad/s] or [m/s]; None if they were not recorded
    effort : shape (N, n); what it means (joint torque, motor torque, current) is for the user to say
    repeated : number of samples that were left out because their time was that of the sample before
    """

    name: str
    joint_names: tuple[str, ...]
    t: Array
    q: Array
    dq: Array | None
    effort: Array
    repeated: int = 0

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they fit together."""
        object.__setattr__(self, "t", frozen(self.t, (-1,)))
        shape = (len(self.t), len(self.joint_names))
        for key in ("q", "dq", "effort"):
            value = getattr(self, key)
            if value is not None:
                object.__setattr__(self, key, frozen(value, shape))
        if np.any(np.diff(self.t) <= 0.0):
            raise ShapeError("the times of a log must increase strictly")
