"""``task/1``: a planned motion of the tool, for any arm that can follow it."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from modrob_cli.model.task import Move, Task
from modrob_cli.schema.base import Angle, Angles3, Document, Name, Point
from modrob_cli.spatial import from_xyz_rpy, skew

MOST_DURATION = 3600.0
"""Longer tasks are a slip in the unit [s]."""
_SHORTEST = 1e-9

Duration = Annotated[float, Field(ge=0.01, le=MOST_DURATION, description="[s]")]


class ArcSpec(Document):
    """An arc about an axis."""

    centre: Point = Field(description="a point of the axis [m]")
    axis: Point = Field(description="direction; of any length")
    angle: Angle = Field(description="how far, by the right-hand rule; 2*pi for a circle")

    @model_validator(mode="after")
    def _has_an_axis(self) -> Self:
        if not np.linalg.norm(self.axis) > _SHORTEST:
            raise PydanticCustomError("axis", "Input should have an axis that is not zero")
        return self


class MoveSpec(Document):
    """One move, from rest to rest; without a target the tool waits."""

    duration: Duration
    xyz: Point | None = Field(default=None, description="end of a straight line [m]; left out: where it was")
    rpy: Angles3 | None = Field(default=None, description="orientation at the end: roll, pitch, yaw")
    quaternion: Annotated[list[float], Field(min_length=4, max_length=4)] | None = Field(
        default=None, description="orientation at the end, in place of rpy: w, x, y, z"
    )
    arc: ArcSpec | None = Field(default=None, description="an arc in place of a straight line")

    @model_validator(mode="after")
    def _says_one_thing(self) -> Self:
        if self.arc is not None and self.xyz is not None:
            raise PydanticCustomError("way", "Input should have xyz or arc, not both")
        if self.rpy is not None and self.quaternion is not None:
            raise PydanticCustomError("turn", "Input should have rpy or quaternion, not both")
        size = 1.0 if self.quaternion is None else float(np.linalg.norm(self.quaternion))
        if not abs(size - 1.0) < 1e-3:
            message = "Input should have a quaternion of length 1, found {size}"
            raise PydanticCustomError("quaternion", message, {"size": f"{size:.6g}"})
        return self

    def to_model(self) -> Move:
        """Return the move."""
        R = None
        if self.rpy is not None:
            R = from_xyz_rpy([0.0, 0.0, 0.0], self.rpy)[:3, :3]
        elif self.quaternion is not None:
            w, *vector = np.array(self.quaternion) / np.linalg.norm(self.quaternion)
            S = skew(np.array(vector))
            R = np.eye(3) + 2.0 * w * S + 2.0 * S @ S
        xyz = None if self.xyz is None else np.array(self.xyz)
        if self.arc is None:
            return Move(self.duration, xyz, R)
        return Move(self.duration, None, R, np.array(self.arc.centre), np.array(self.arc.axis), self.arc.angle)


class TaskDocument(Document):
    """What a tool does, from the pose on that the joint positions at the start give it."""

    modrob: Literal["task/1"]
    name: Name
    source: str = ""
    description: str = ""
    start: Annotated[list[Angle], Field(min_length=1)] = Field(
        description="joint positions at t = 0, base to tip [rad] or [m]"
    )
    rows: Literal["pose", "position"] = Field(default="pose", description="position: the orientation is free")
    frame: Literal["base", "start"] = Field(
        default="base", description="frame of all poses: that of the base, or of the tool at the start"
    )
    moves: Annotated[list[MoveSpec], Field(min_length=1, max_length=1000)]

    def to_model(self) -> Task:
        """Return the task."""
        moves = tuple(move.to_model() for move in self.moves)
        return Task(self.name, np.array(self.start), moves, self.rows, self.frame == "start")
