"""Where the material of a link may run: from joint to joint along the common normal, for pictures."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.assembly.common_normal import decompose
from modrob_cli.model.robot import Robot

_DETOUR = 2.0


def link_paths(robot: Robot) -> list[Array]:
    """Polylines of links 0..n in their link frames (link 0: in the base frame), each of shape (k, 3).

    A path follows the first axis to the common normal, the normal, and the second axis. Where that is a long detour
    (nearly parallel axes) it is the straight line.
    """
    following = [*(joint.placement for joint in robot.joints), robot.tool_transform]
    return [_path(T) for T in following]


def _path(T: Array) -> Array:
    start, end = np.zeros(3), T[:3, 3]
    split = decompose(T)
    first = np.array([0.0, 0.0, -split.p])
    second = end - split.n * T[:3, 2]
    points = np.stack([start, first, second, end])
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    return points if length <= _DETOUR * np.linalg.norm(end) + 1e-9 else np.stack([start, end])
