"""MCAP files for tests, written by the mcap package's own ROS 2 writer."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

JOINT_STATE_DEFINITION = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""


def joint_state(
    stamp: float,
    names: Sequence[str],
    position: Iterable[float],
    velocity: Iterable[float] = (),
    effort: Iterable[float] = (),
    frame: str = "",
) -> dict[str, Any]:
    """One message; the stamp is in seconds."""
    nanoseconds = round(stamp * 1e9)
    return {
        "header": {"stamp": {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}, "frame_id": frame},
        "name": list(names),
        "position": [float(x) for x in position],
        "velocity": [float(x) for x in velocity],
        "effort": [float(x) for x in effort],
    }


def write_mcap(
    path: Path,
    topics: dict[str, Sequence[dict[str, Any]]],
    kind: str = "sensor_msgs/msg/JointState",
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
