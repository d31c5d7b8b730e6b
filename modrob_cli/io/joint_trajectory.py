"""``trajectory_msgs/JointTrajectory`` from YAML or JSON."""

import re
from pathlib import Path
from typing import Any

from modrob_cli.io.documents import check_part
from modrob_cli.io.given_motion import GivenMotion
from modrob_cli.io.yaml_builder import Path_
from modrob_cli.io.yaml_loader import YamlDocument, parse_yaml, read_text
from modrob_cli.schema.joint_trajectory import JointTrajectorySpec

_AROUND = ("trajectory", "joint_trajectory", "goal", "goal_trajectory", "request", "msg", "args")
"""Keys under which messages, goals of actions and rosbridge hold a trajectory."""
_DEEPEST = 4
_LAST_MARK = re.compile(r"^---[ \t\r]*\n?\s*\Z", re.MULTILINE)
"""What ``ros2 topic echo`` prints after a message."""


def load_motion_text(path: Path) -> YamlDocument:
    """Read YAML or JSON, with a ``---`` after its only document or without.

    Raises
    ------
    InputFileError
        As :func:`modrob_cli.io.yaml_loader.load_yaml`.
    """
    text = read_text(path)
    return parse_yaml(_LAST_MARK.sub("", text) if not text.startswith("---") else text, str(path))


def find_joint_trajectory(loaded: YamlDocument) -> Path_ | None:
    """Where in the data a trajectory is: at the top, or inside a goal or another message; None if there is none."""
    data: Any = loaded.data
    path: list[str | int] = []
    for _ in range(_DEEPEST + 1):
        if isinstance(data, list) and len(data) == 1:  # moveit_msgs/DisplayTrajectory has a list of them
            path.append(0)
            data = data[0]
        if not isinstance(data, dict) or "modrob" in data:
            return None
        if "points" in data or "joint_names" in data:
            return tuple(path)
        key = next((key for key in _AROUND if key in data), None)
        if key is None:
            return None
        path.append(key)
        data = data[key]
    return None


def read_joint_trajectory(loaded: YamlDocument, path: Path_) -> GivenMotion:
    """Points of the trajectory at this path.

    Raises
    ------
    InputFileError
        With all faults of the trajectory.
    """
    message = check_part(loaded, path, JointTrajectorySpec)
    points = message.to_points()
    notes = ("the effort in the points is not used",) if any(point.effort for point in message.points) else ()
    place = loaded.fault((*path, "joint_names" if message.joint_names else "points"), "")
    return GivenMotion(points, "joint-trajectory", place, notes)
