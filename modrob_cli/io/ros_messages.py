"""Layouts of the ROS 2 messages that are written, with their definitions."""

from collections.abc import Mapping, Sequence

from modrob_cli.io.cdr_layout import (
    ConstantField,
    DoublesField,
    Field,
    MessageLayout,
    PlainDoublesField,
    StampField,
    Stamps,
    TextField,
    TextsField,
)

_SEPARATOR = "=" * 80
_NO_TIME: tuple[Field, ...] = (ConstantField("i", 0), ConstantField("I", 0))

_TYPES = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    "trajectory_msgs/JointTrajectoryPoint": "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\n"
    "float64[] effort\nbuiltin_interfaces/Duration time_from_start\n",
    "trajectory_msgs/MultiDOFJointTrajectoryPoint": "geometry_msgs/Transform[] transforms\n"
    "geometry_msgs/Twist[] velocities\ngeometry_msgs/Twist[] accelerations\n"
    "builtin_interfaces/Duration time_from_start\n",
}
"""Definitions of the types that messages are made of."""


def _definition(text: str, *used: str) -> str:
    """Text of a message and of all types that it uses, as rosbag2 stores them."""
    return "".join([text, *(f"{_SEPARATOR}\nMSG: {name}\n{_TYPES[name]}" for name in used)])


def _header(frame_id: str = "") -> list[Field]:
    return [StampField(), TextField(frame_id)]


_HEADER_TYPES = ("std_msgs/Header", "builtin_interfaces/Time")


def joint_state(
    names: Sequence[str], *, position: bool = True, velocity: bool = True, effort: bool = True
) -> MessageLayout:
    """``sensor_msgs/msg/JointState``; values: positions, velocities, efforts, those that are wanted, n of each."""
    text = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    lists = [DoublesField(len(names) if wanted else 0) for wanted in (position, velocity, effort)]
    fields = [*_header(), TextsField(tuple(names)), *lists]
    return MessageLayout("sensor_msgs/msg/JointState", _definition(text, *_HEADER_TYPES), fields)


POINT_LISTS = ("positions", "velocities", "accelerations", "effort")
"""Lists of a ``trajectory_msgs/JointTrajectoryPoint``."""


def controller_state(names: Sequence[str], lists: Mapping[str, Sequence[str]]) -> MessageLayout:
    """``control_msgs/msg/JointTrajectoryControllerState`` in its form of ROS 2 Jazzy.

    The factor of speed scaling is 1; lists for joints of several degrees of freedom are empty.

    Parameters
    ----------
    lists : for each of reference, feedback, error and output those of :data:`POINT_LISTS` that are not empty

    Returns
    -------
    layout : values are reference, feedback, error, output, each with its lists in the order of :data:`POINT_LISTS`, n
        of each
    """
    parts = ("reference", "feedback", "error", "output")
    text = "std_msgs/Header header\nstring[] joint_names\n"
    text += "".join(f"trajectory_msgs/JointTrajectoryPoint {part}\n" for part in parts)
    text += "string[] multi_dof_joint_names\n"
    text += "".join(f"trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_{part}\n" for part in parts)
    text += "float64 speed_scaling_factor\n"
    used = ["builtin_interfaces/Duration", "trajectory_msgs/JointTrajectoryPoint"]
    used += ["trajectory_msgs/MultiDOFJointTrajectoryPoint", "geometry_msgs/Transform", "geometry_msgs/Twist"]
    used += ["geometry_msgs/Vector3", "geometry_msgs/Quaternion"]
    fields = [*_header(), TextsField(tuple(names))]
    for part in parts:
        fields += [DoublesField(len(names) if key in lists.get(part, ()) else 0) for key in POINT_LISTS]
        fields += _NO_TIME
    empty: list[Field] = [*[ConstantField("I", 0)] * 3, *_NO_TIME]
    fields += [TextsField(()), *empty * 4, ConstantField("d", 1.0)]
    name = "control_msgs/msg/JointTrajectoryControllerState"
    return MessageLayout(name, _definition(text, *_HEADER_TYPES, *used), fields)


def wrench_stamped(frame_id: str) -> MessageLayout:
    """``geometry_msgs/msg/WrenchStamped``; values: force x, y, z [N], torque x, y, z [Nm]."""
    text = "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n"
    used = (*_HEADER_TYPES, "geometry_msgs/Wrench", "geometry_msgs/Vector3")
    fields = [*_header(frame_id), PlainDoublesField(6)]
    return MessageLayout("geometry_msgs/msg/WrenchStamped", _definition(text, *used), fields)


TRUTH_LISTS = (
    "position",
    "velocity",
    "acceleration",
    "motor_torque",
    "friction_torque",
    "external_torque",
)
"""Lists of a ``modrob_msgs/msg/JointTruth``."""


def joint_truth(names: Sequence[str]) -> MessageLayout:
    """``modrob_msgs/msg/JointTruth``, our own: what happened in a simulation; values: TRUTH_LISTS, n of each."""
    text = "std_msgs/Header header\nstring[] name\n" + "".join(f"float64[] {part}\n" for part in TRUTH_LISTS)
    fields = [*_header(), TextsField(tuple(names)), *[DoublesField(len(names))] * len(TRUTH_LISTS)]
    return MessageLayout("modrob_msgs/msg/JointTruth", _definition(text, *_HEADER_TYPES), fields)


PERTURBATION_LISTS = ("perturbation", "lower", "upper")
"""Lists of a ``modrob_msgs/msg/JointPerturbation``."""


def joint_perturbation(names: Sequence[str]) -> MessageLayout:
    """``modrob_msgs/msg/JointPerturbation``, our own: torque that a model lacks, with its bounds; n of each list."""
    text = "std_msgs/Header header\nstring[] name\n" + "".join(f"float64[] {part}\n" for part in PERTURBATION_LISTS)
    fields = [*_header(), TextsField(tuple(names)), *[DoublesField(len(names))] * len(PERTURBATION_LISTS)]
    return MessageLayout("modrob_msgs/msg/JointPerturbation", _definition(text, *_HEADER_TYPES), fields)


def joint_trajectory(
    names: Sequence[str],
    times: Stamps,
    *,
    velocities: bool = True,
    accelerations: bool = True,
    joints: int | None = None,
) -> MessageLayout:
    """``trajectory_msgs/msg/JointTrajectory`` whose points have the given ``time_from_start``, shape (P,), [ns].

    Values: for each point positions, then those of velocities and accelerations that are wanted, n of each, where n is
    the number of names, or of ``joints`` where they have no names.
    """
    text = "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n"
    used = (*_HEADER_TYPES, "trajectory_msgs/JointTrajectoryPoint", "builtin_interfaces/Duration")
    n = len(names) if joints is None else joints
    lists = [DoublesField(n), DoublesField(n * velocities), DoublesField(n * accelerations), DoublesField(0)]
    fields = [*_header(), TextsField(tuple(names)), ConstantField("I", len(times))]
    for time in times.tolist():
        fields += [*lists, ConstantField("i", time // 10**9), ConstantField("I", time % 10**9)]
    return MessageLayout("trajectory_msgs/msg/JointTrajectory", _definition(text, *used), fields)
