"""Points of a motion as a file gives them, and which joints of the robot they are for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.yaml_builder import shorten
from modrob_cli.model.trajectory_points import MotionPoints

MOST_POINTS = 200_000
"""Points, samples or messages of a motion; more are a recording."""


@dataclass(frozen=True)
class GivenMotion:
    """Points from a file.

    Attributes
    ----------
    kind : what the file holds: ``joint-trajectory``, ``samples`` or ``joint-states``
    notes : what was changed or left out in reading
    place : file and place of the joints, for faults; its message is empty
    """

    points: MotionPoints
    kind: str
    place: Fault
    notes: tuple[str, ...] = ()

    def for_joints(self, names: Sequence[str]) -> "GivenMotion":
        """Points in the order of these joints; as they are, where they name no joints.

        Raises
        ------
        InputFileError
            If joints are missing, or there are others.
        """
        found = self.points.joint_names
        if found is None:
            return self
        missing = [name for name in names if name not in found]
        others = [name for name in found if name not in names]
        if missing or others:
            parts = [f"missing: {_list(missing)}"] if missing else []
            parts += [f"not in the robot: {_list(others)}"] if others else []
            message = f"found the joints {_list(found)}, expected {_list(names)}; {'; '.join(parts)}"
            raise InputFileError(replace(self.place, message=f"{message}; rename the joints in one of the files"))
        order = np.array([found.index(name) for name in names], dtype=np.intp)
        return replace(self, points=self.points.picked(order, tuple(names)))


def _list(names: Sequence[str]) -> str:
    return ", ".join(shorten(name)[1:-1] for name in names)
