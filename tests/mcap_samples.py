"""MCAP files for tests, written by the mcap package and its ROS 2 serializer."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

_LINE = "=" * 80
_HEADER = f"""{_LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""
_POINT = f"""{_LINE}
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
"""

JOINT_STATE = "sensor_msgs/msg/JointState"
CONTROLLER_STATE = "control_msgs/msg/JointTrajectoryControllerState"
DYNAMIC_JOINT_STATE = "control_msgs/msg/DynamicJointState"

JOINT_STATE_DEFINITION = f"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{_HEADER}"""
DEFINITIONS = {
    JOINT_STATE: JOINT_STATE_DEFINITION,
    CONTROLLER_STATE: f"""std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint reference
trajectory_msgs/JointTrajectoryPoint feedback
trajectory_msgs/JointTrajectoryPoint error
trajectory_msgs/JointTrajectoryPoint output
float64 speed_scaling_factor
{_POINT}{_HEADER}""",
    "older": f"""std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint desired
trajectory_msgs/JointTrajectoryPoint actual
trajectory_msgs/JointTrajectoryPoint error  # Redundant, but useful
{_POINT}{_HEADER}""",
    DYNAMIC_JOINT_STATE: f"""# comment
std_msgs/Header header
string[] joint_names
InterfaceValue[] interface_values
{_LINE}
MSG: control_msgs/InterfaceValue
string[] interface_names
float64[] values
{_HEADER}""",
}


def joint_state(
    stamp: float,
    names: Sequence[str],
    position: Iterable[float],
    velocity: Iterable[float] = (),
    effort: Iterable[float] = (),
    frame: str = "",
) -> dict[str, Any]:
    """One message; the stamp is in seconds."""
    return {
        "header": header(stamp, frame),
        "name": list(names),
        "position": [float(x) for x in position],
        "velocity": [float(x) for x in velocity],
        "effort": [float(x) for x in effort],
    }


def header(stamp: float, frame: str = "") -> dict[str, Any]:
    """A header; the stamp is in seconds."""
    nanoseconds = round(stamp * 1e9)
    return {"stamp": {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}, "frame_id": frame}


def point(
    positions: Iterable[float] = (), velocities: Iterable[float] = (), effort: Iterable[float] = ()
) -> dict[str, Any]:
    """A ``trajectory_msgs/JointTrajectoryPoint``."""
    return {
        "positions": list(positions),
        "velocities": list(velocities),
        "accelerations": [],
        "effort": list(effort),
        "time_from_start": {"sec": 0, "nanosec": 0},
    }


def serialize(kind: str, message: dict[str, Any], definition: str | None = None) -> bytes:
    """One message in CDR, by the mcap package."""
    from mcap_ros2._dynamic import serialize_dynamic

    encoder = serialize_dynamic(kind, definition or DEFINITIONS[kind])[kind]
    return bytes(encoder(message))


@dataclass
class Topic:
    """Messages of one channel: pairs of log time [ns] and bytes."""

    topic: str
    kind: str
    messages: Sequence[tuple[int, bytes]]
    encoding: str = "cdr"
    schema_encoding: str = "ros2msg"
    schema: bytes = b""


def cdr_topic(topic: str, kind: str, messages: Sequence[dict[str, Any]], definition: str | None = None) -> Topic:
    """Messages in CDR; their log time is their number in microseconds."""
    from mcap_ros2._dynamic import serialize_dynamic

    text = definition or DEFINITIONS[kind]
    encoder = serialize_dynamic(kind, text)[kind]
    return Topic(topic, kind, [(1000 * k, bytes(encoder(one))) for k, one in enumerate(messages)], schema=text.encode())


def json_topic(topic: str, messages: Sequence[Any], kind: str = "JointState") -> Topic:
    """Messages in JSON; their log time is their number in microseconds."""
    raw = [(1000 * k, json.dumps(one).encode()) for k, one in enumerate(messages)]
    return Topic(topic, kind, raw, "json", "jsonschema", b"{}")


@dataclass
class Form:
    """How a file is packed."""

    compression: str = "ZSTD"
    chunk_size: int = 4096
    chunked: bool = True
    checksums: bool = True
    data_checksum: bool = False
    extra: dict[str, Any] = field(default_factory=dict)


def write_topics(path: Path, topics: Sequence[Topic], form: Form | None = None) -> Path:
    """Write channels, their messages merged by log time."""
    from mcap.writer import CompressionType, Writer

    form = form or Form()
    with path.open("wb") as stream:
        writer = Writer(
            stream,
            chunk_size=form.chunk_size,
            compression=CompressionType[form.compression],
            use_chunking=form.chunked,
            enable_crcs=form.checksums,
            enable_data_crcs=form.data_checksum,
            **form.extra,
        )
        writer.start("ros2", "tests")
        rows = []
        for topic in topics:
            schema = writer.register_schema(topic.kind, topic.schema_encoding, topic.schema) if topic.kind else 0
            channel = writer.register_channel(topic.topic, topic.encoding, schema)
            rows += [(time, channel, data) for time, data in topic.messages]
        for time, channel, data in sorted(rows, key=lambda row: row[0]):
            writer.add_message(channel, time, data, time)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def write_mcap(
    path: Path,
    topics: dict[str, Sequence[dict[str, Any]]],
    kind: str = JOINT_STATE,
    compression: str = "ZSTD",
    chunk_size: int = 4096,
) -> Path:
    """Write messages of one type to topics."""
    from mcap.writer import CompressionType
    from mcap_ros2.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=chunk_size, compression=CompressionType[compression])
        schema = writer.register_msgdef(kind, JOINT_STATE_DEFINITION)
        for topic, messages in topics.items():
            for index, message in enumerate(messages):
                writer.write_message(topic, schema, message, log_time=index, publish_time=index)
        writer.finish()  # type: ignore[no-untyped-call]
    return path
