"""Base parameters of a robot: the fewest numbers that decide its torques, and how standard parameters make them up.

Link frames are those of :class:`modrob_cli.model.joint.Joint`: axis z is the joint's axis, carried along by the motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.identify.base_columns import Column, columns, complete_regressor
from modrob_cli.identify.base_grouping import TOLERANCE, Grouping, group
from modrob_cli.model.robot import Robot

_SEED = 20260
_STATES_PER_JOINT = 30
_KEEP_FIRST = ("I_zz", "mc_x", "mc_y", "I_xx", "I_xy", "I_xz", "I_yz", "I_yy", "mc_z", "m")
"""Within a link; the last three are those that move on to the link before in Khalil's rules."""


@dataclass(frozen=True)
class BaseModel:
    """Base parameters of a robot, rigid bodies and drives together.

    Attributes
    ----------
    columns : the C standard parameters
    grouping : which of them stand for the groups, and the transform (p, C) from standard to base
    """

    columns: tuple[Column, ...]
    grouping: Grouping

    @property
    def count(self) -> int:
        """Number p of base parameters, drives included."""
        return self.grouping.rank

    @property
    def representatives(self) -> tuple[Column, ...]:
        """The standard parameter that each base parameter is named after."""
        return tuple(self.columns[k] for k in self.grouping.independent)

    @property
    def rigid_count(self) -> int:
        """How many numbers of the rigid bodies alone the torque depends on: the rank of their columns."""
        rigid = [k for k, column in enumerate(self.columns) if column.is_rigid]
        return int(np.linalg.matrix_rank(self.grouping.transform[:, rigid]))

    def base(self, standard: Array) -> Array:
        """Base parameters (..., p) of standard parameters (..., C)."""
        return np.asarray(standard @ self.grouping.transform.T)

    def formula(self, index: int) -> str:
        """How standard parameters combine, such as ``I_zz1 + I_yy2 + 0.25 m2``; sorted by link."""
        row = self.grouping.transform[index]
        first = int(self.grouping.independent[index])
        terms = [(first, 1.0)] + [(int(k), float(row[k])) for k in np.flatnonzero(row) if k != first]
        out = ""
        for k, factor in terms:
            size = f"{abs(factor):.6g}"
            name = self.columns[k].name if size == "1" else f"{size} {self.columns[k].name}"
            out += (f" {'-' if factor < 0.0 else '+'} " if out else "") + name
        return out

    def regressor(self, complete: Array) -> Array:
        """Columns (..., p) of the base parameters from the complete regressor (..., C)."""
        return np.asarray(complete[..., self.grouping.independent])


def base_model(
    robot: Robot, tolerance: float = TOLERANCE, moving: Sequence[int] | None = None, rest: Array | None = None
) -> BaseModel:
    """Base parameters of a robot from its regressor at random states (fixed seed).

    Parameters
    ----------
    tolerance : relative; a standard parameter whose own effect on the torque is a smaller share counts as dependent
    moving : joints (from 0) that move and whose torques count, None for all; the others rest
    rest : positions of the joints that rest, shape (n,) (those of moving ones do not matter), [rad] or [m]

    Raises
    ------
    NumericalError
        If the robot's data are beyond the range of numbers.
    """
    q, dq, ddq = random_states(robot, _STATES_PER_JOINT * robot.dof + 30)
    parameters = columns(robot)
    if moving is None:
        W = complete_regressor(robot, q, dq, ddq)
    else:
        resting = np.setdiff1d(np.arange(robot.dof), moving)
        q[:, resting] = 0.0 if rest is None else rest[resting]
        dq[:, resting] = ddq[:, resting] = 0.0
        W = complete_regressor(robot, q, dq, ddq)[:, np.asarray(moving)]
    return BaseModel(parameters, group(W.reshape(-1, W.shape[2]), preference(robot, parameters), tolerance))


def random_states(robot: Robot, count: int) -> tuple[Array, Array, Array]:
    """States without any pattern: q within +-pi or +-1 m, velocities and accelerations that matter beside gravity."""
    rng = np.random.default_rng(_SEED)
    span = np.array([np.pi if joint.type == "revolute" else 1.0 for joint in robot.joints])
    shape = (count, robot.dof)
    return rng.uniform(-span, span, shape), rng.uniform(-3.0, 3.0, shape), rng.uniform(-10.0, 10.0, shape)


def preference(robot: Robot, parameters: tuple[Column, ...]) -> Indices:
    """Friction first, then links from base to tip, rotors last.

    So what a link's motion cannot tell apart moves on to the link before it, and a rotor joins the link that it turns.
    The rotor of a prismatic joint comes before the masses that it moves, else it would stand in their formulas.
    """

    def rank(k: int) -> tuple[int, int, int]:
        column = parameters[k]
        if column.is_rigid:
            return 1, column.number, _KEEP_FIRST.index(column.kind)
        late = column.kind == "armature" and robot.joints[column.number - 1].type == "revolute"
        return (2 if late else 0), column.number, k

    return np.array(sorted(range(len(parameters)), key=rank), dtype=np.intp)
