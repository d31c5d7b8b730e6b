"""``trajectory_msgs/JointTrajectory`` as YAML or JSON, as ``ros2 topic echo`` and rosbridge write it."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from modrob_cli.model.trajectory_points import MotionPoints
from modrob_cli.schema.base import Document, JointName
from modrob_cli.schema.located import LocatedFault, raise_faults

_LISTS = {"positions": "a position", "velocities": "a velocity", "accelerations": "an acceleration"}
_TIME_KEYS = ({"sec", "nanosec"}, {"secs", "nsecs"})
_SECOND = 1_000_000_000
_LAST_SECOND = 2**31


def _seconds(value: Any) -> Any:
    """Turn a duration of ROS 2 or ROS 1 into seconds."""
    if not isinstance(value, dict):
        return value
    sec, nanosec = (
        next((value[key] for key in keys if key in value), 0) for keys in (("sec", "secs"), ("nanosec", "nsecs"))
    )
    fits = any(value and set(value) <= keys for keys in _TIME_KEYS) and type(sec) is type(nanosec) is int
    if not fits or not (0 <= sec < _LAST_SECOND and 0 <= nanosec < _SECOND):
        message = "Input should be a time of 0 s or more: {sec: S, nanosec: N} with whole numbers, N < 1e9, or a number"
        raise PydanticCustomError("duration", message)
    return sec + nanosec / _SECOND


class JointTrajectoryPointSpec(Document):
    """A point of a trajectory; empty lists are not given."""

    positions: list[float] = []
    velocities: list[float] = []
    accelerations: list[float] = []
    effort: list[float] = []
    time_from_start: Annotated[float, Field(ge=0.0), BeforeValidator(_seconds)]


class JointTrajectorySpec(Document):
    """A trajectory of named joints; without names, of all joints of the robot, base to tip."""

    header: Any = None
    joint_names: list[JointName] = []
    points: list[JointTrajectoryPointSpec] = Field(min_length=2)

    @field_validator("joint_names")
    @classmethod
    def _names_differ(cls, names: list[str]) -> list[str]:
        raise_faults("joint_names", (
            LocatedFault((k,), "Input should be another name: each joint is named once", name)
            for k, name in enumerate(names) if name in names[:k]
        ))  # fmt: skip
        return names

    @field_validator("points")
    @classmethod
    def _points_fit(
        cls, points: list[JointTrajectoryPointSpec], info: ValidationInfo
    ) -> list[JointTrajectoryPointSpec]:
        names = info.data.get("joint_names") or []
        raise_faults("points", [*_time_faults(points), *_list_faults(points, len(names))])
        return points

    def to_points(self) -> MotionPoints:
        """Return the points."""
        rows = [np.array([getattr(point, key) for point in self.points], dtype=float) for key in _LISTS]
        q, dq, ddq = (row if row.size else None for row in rows)
        t = np.array([point.time_from_start for point in self.points])
        return MotionPoints(t, rows[0] if q is None else q, dq, ddq, tuple(self.joint_names) or None)


def _time_faults(points: Sequence[JointTrajectoryPointSpec]) -> Iterator[LocatedFault]:
    first = points[0].time_from_start
    if first != 0.0:
        message = (
            "Input should be 0 in the first point: until then a controller moves the arm there from wherever it is, "
            "which the file does not tell; make the start the first point"
        )
        yield LocatedFault((0, "time_from_start"), message, first)
    for k in range(1, len(points)):
        before, now = points[k - 1].time_from_start, points[k].time_from_start
        if not now > before:
            message = f"Input should be more than the {before!r} of the point before: times increase"
            yield LocatedFault((k, "time_from_start"), message, now)


def _list_faults(points: Sequence[JointTrajectoryPointSpec], joints: int) -> Iterator[LocatedFault]:
    """Lists whose length is not the number of joints, or that some points have and others have not."""
    count = joints or len(points[0].positions)
    why = "as joint_names has" if joints else "as the first point has"
    for k, point in enumerate(points):
        for key, value in _LISTS.items():
            found, given = getattr(point, key), bool(getattr(points[0], key))
            in_file = key in point.model_fields_set
            place, shown = ((k, key), found) if in_file else ((k,), {})
            if key == "positions" and not found:
                yield LocatedFault(place, "Input should have positions, one for each joint", shown)
            elif bool(found) != given:
                also = (
                    f"have {key} as the first point has" if given else f"be nothing here: the first point has no {key}"
                )
                yield LocatedFault(place, f"Input should {also}; give them in all points or in none", shown)
            elif found and len(found) != count:
                yield LocatedFault(place, f"Input should have {value} for each of {count} joints, {why}", shown)
        if point.accelerations and not point.velocities:
            message = "Input should be nothing here: a point with accelerations needs velocities too"
            yield LocatedFault((k, "accelerations"), message, point.accelerations)
