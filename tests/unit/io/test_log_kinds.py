"""Every kind of message about joints, written by other software, and which topic of a file is read."""

import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli.errors import InputFileError
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.mcap_reader import read_joint_log, read_recording
from modrob_cli.model.log import Recording
from tests.mcap_samples import (
    CONTROLLER_STATE,
    DEFINITIONS,
    DYNAMIC_JOINT_STATE,
    JOINT_STATE,
    Topic,
    cdr_topic,
    header,
    joint_state,
    json_topic,
    point,
    write_topics,
)

NAMES = ("a", "b")
COUNT = 25


def values() -> np.ndarray[Any, Any]:
    """Positions, velocities, efforts, shape (COUNT, 3, 2)."""
    t = 0.01 * np.arange(COUNT)[:, None]
    return np.stack([np.sin(t + [0, 1]), np.cos(t + [0, 1]), 3.0 * t + [0, 1]], axis=1)


def stamps() -> list[float]:
    return [100.0 + 0.01 * k for k in range(COUNT)]


def check(recording: Recording, velocity: bool = True, effort: bool = True) -> None:
    expected = values()
    assert recording.joint_names == NAMES
    np.testing.assert_array_equal(recording.stamps, np.round(np.array(stamps()) * 1e9).astype(np.int64))
    np.testing.assert_array_equal(recording.q, expected[:, 0])
    for has, found, column in ((velocity, recording.dq, 1), (effort, recording.effort, 2)):
        if has:
            np.testing.assert_array_equal(found, expected[:, column])
        else:
            assert found is None


def rows() -> list[tuple[float, Any]]:
    return list(zip(stamps(), values().tolist(), strict=True))


def joint_states() -> list[dict[str, Any]]:
    return [joint_state(t, NAMES, *x) for t, x in rows()]


def controller_states(older: bool) -> list[dict[str, Any]]:
    wrong = point([9.0, 9.0], [9.0, 9.0], [9.0, 9.0])
    names = ("desired", "actual", "error") if older else ("reference", "feedback", "error", "output")
    return [
        {"header": header(t), "joint_names": list(NAMES), "speed_scaling_factor": 1.0}
        | dict.fromkeys(names, wrong)
        | {names[1]: point(*x)}
        for t, x in rows()
    ]


def dynamic_states() -> list[dict[str, Any]]:
    """Interfaces in an order of their own for each joint; the second joint has a temperature too."""
    out = []
    for t, (q, dq, effort) in rows():
        first = {"interface_names": ["effort", "position", "velocity"], "values": [effort[0], q[0], dq[0]]}
        second = {
            "interface_names": ["position", "temp", "velocity", "effort"],
            "values": [q[1], 40.0, dq[1], effort[1]],
        }
        out.append({"header": header(t), "joint_names": list(NAMES), "interface_values": [first, second]})
    return out


def foxglove_json() -> list[dict[str, Any]]:
    return [
        {
            "timestamp": {"sec": round(t * 1e9) // 10**9, "nsec": round(t * 1e9) % 10**9},
            "joints": [
                {"name": name, "position": q, "velocity": dq, "effort": effort}
                for name, q, dq, effort in zip(NAMES, *x, strict=True)
            ],
        }
        for t, x in rows()
    ]


def field(number: int, content: bytes | float | int) -> bytes:
    """One field of a protobuf message, by the rules of the wire format."""

    def varint(value: int) -> bytes:
        head = []
        while value > 127:
            head.append(value & 127 | 128)
            value >>= 7
        return bytes([*head, value])

    if isinstance(content, float):
        return varint(number << 3 | 1) + struct.pack("<d", content)
    if isinstance(content, int):
        return varint(number << 3) + varint(content)
    return varint(number << 3 | 2) + varint(len(content)) + content


def foxglove_protobuf() -> list[tuple[int, bytes]]:
    out = []
    for k, (t, x) in enumerate(rows()):
        nanoseconds = round(t * 1e9)
        data = field(1, field(1, nanoseconds // 10**9) + field(2, nanoseconds % 10**9))
        for name, q, dq, effort in zip(NAMES, *x, strict=True):
            data += field(2, field(1, name.encode()) + field(2, q) + field(3, dq) + field(5, effort))
        out.append((1000 * k, data))
    return out


def foxglove_cdr() -> Topic:
    definition = """builtin_interfaces/Time timestamp
foxglove_msgs/JointState[] joints
================
MSG: foxglove_msgs/JointState
string name
float64 position
float64 velocity
float64 acceleration
float64 effort
================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
    messages = [
        {
            "timestamp": header(t)["stamp"],
            "joints": [
                {"name": name, "position": q, "velocity": dq, "acceleration": math.nan, "effort": effort}
                for name, q, dq, effort in zip(NAMES, *x, strict=True)
            ],
        }
        for t, x in rows()
    ]
    return cdr_topic("/j", "foxglove_msgs/msg/JointStates", messages, definition)


KINDS: dict[str, Callable[[], Topic]] = {
    "JointState": lambda: cdr_topic("/j", JOINT_STATE, joint_states()),
    "controller": lambda: cdr_topic("/j", CONTROLLER_STATE, controller_states(False)),
    "older controller": lambda: cdr_topic("/j", CONTROLLER_STATE, controller_states(True), DEFINITIONS["older"]),
    "dynamic": lambda: cdr_topic("/j", DYNAMIC_JOINT_STATE, dynamic_states()),
    "foxglove protobuf": lambda: Topic("/j", "foxglove.JointStates", foxglove_protobuf(), "protobuf", "protobuf"),
    "foxglove JSON": lambda: json_topic("/j", foxglove_json(), "foxglove.JointStates"),
    "foxglove CDR": foxglove_cdr,
    "JSON": lambda: json_topic("/j", joint_states(), "sensor_msgs/msg/JointState"),
    "JSON without type": lambda: json_topic("/j", joint_states(), ""),
}


@pytest.mark.parametrize("kind", list(KINDS))
def test_every_kind_gives_the_same_recording(tmp_path: Path, kind: str) -> None:
    path = write_topics(tmp_path / "run.mcap", [KINDS[kind]()])
    recording = read_recording(path)
    check(recording)
    assert recording.notes == ()
    assert recording.topic == "/j"


def test_joint_states_as_rosbags_writes_them(tmp_path: Path) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/joint_states", JOINT_STATE, typestore=store)
        for t, x in rows():
            stamp = types["builtin_interfaces/msg/Time"](**header(t)["stamp"])
            head = types["std_msgs/msg/Header"](stamp=stamp, frame_id="base")
            message = types[JOINT_STATE](head, list(NAMES), *(np.array(part) for part in x))
            writer.write(connection, round(t * 1e9), store.serialize_cdr(message, JOINT_STATE))
    check(read_recording(next((tmp_path / "bag").glob("*.mcap"))))


def test_bytes_that_the_foxglove_sdk_wrote() -> None:
    """JointStates(100.000000005, [a: 0.0, 0.25, effort -0.5; b: 1.5]), encoded by foxglove-sdk 0.30.3."""
    from modrob_cli.io.foxglove_protobuf import decode_joint_states, read_numbers

    data = bytes.fromhex(
        "0a0408641005121e0a016111000000000000000019000000000000d03f29000000000000e0bf120c0a016211000000000000f83f"
    )
    stamp, names, (position, velocity, effort) = decode_joint_states(data, read_numbers(b""))
    assert (stamp, names, position) == (100_000_000_005, ("a", "b"), [0.0, 1.5])
    np.testing.assert_array_equal([velocity, effort], [[0.25, np.nan], [-0.5, np.nan]])


def test_protobuf_field_numbers_come_from_the_descriptor(tmp_path: Path) -> None:
    """Other numbers, doubles that are not optional (0 is left out), one wrapped in a DoubleValue."""

    def describe(name: str, fields: dict[str, int]) -> bytes:
        return field(4, field(1, name.encode()) + b"".join(
            field(2, field(1, key.encode()) + field(3, number)) for key, number in fields.items()
        ))  # fmt: skip

    joint = describe("JointState", {"name": 4, "position": 3, "velocity": 2, "effort": 1})
    descriptor = field(1, joint + describe("JointStates", {"timestamp": 7, "joints": 300}))
    message = field(7, field(1, 5)) + field(300, field(4, b"a") + field(3, 2.5) + field(1, field(1, 1.25)))
    later = field(7, field(1, 6)) + field(300, field(4, b"a"))
    topic = Topic("/j", "foxglove.JointStates", [(0, message), (1, later)], "protobuf", "protobuf", descriptor)
    recording = read_recording(write_topics(tmp_path / "run.mcap", [topic]))
    np.testing.assert_array_equal(recording.q, [[2.5], [0.0]])
    np.testing.assert_array_equal(recording.effort, [[1.25], [0.0]])


@pytest.mark.parametrize("kind", ["foxglove protobuf", "JSON", "foxglove JSON"])
def test_damaged_messages_are_left_out_and_counted(tmp_path: Path, kind: str) -> None:
    topic = KINDS[kind]()
    rng = np.random.default_rng(3)
    messages = list(topic.messages)
    for k in range(1, COUNT, 2):
        time, raw = messages[k]
        data = bytearray(raw)
        data[rng.integers(len(data))] ^= 0xFF
        messages[k] = (time, bytes(data[: rng.integers(len(data))]))
    topic.messages = messages
    recording = read_recording(write_topics(tmp_path / "run.mcap", [topic]))
    assert len(recording.stamps) >= COUNT // 2
    assert any("could not be decoded" in note for note in recording.notes)


@pytest.mark.parametrize(
    "message",
    [
        b"[" * 100_000,
        b'{"name": ["a"], "position": [1' + b"0" * 10_000 + b"]}",
        b'{"name": ["a"], "position": [true]}',
        b'{"name": [1], "position": [1]}',
        b'{"name": ["a", "a"], "position": [1, 2]}',
        b'{"name": ["a"], "position": 3}',
        b'{"joints": [1]}',
        b'{"header": {"stamp": {"sec": 1e300, "nanosec": 0}}, "name": ["a"], "position": [1, 2]}',
        b'{"header": {"stamp": 1e300}, "name": ["a"], "position": [1, 2]}',
        b"\xff\xfe",
    ],
)
def test_hostile_json(tmp_path: Path, message: bytes) -> None:
    topic = json_topic("/j", joint_states())
    topic.messages = [*topic.messages, (10**9, message)]
    recording = read_recording(write_topics(tmp_path / "run.mcap", [topic]))
    assert len(recording.stamps) == COUNT
    assert any("could not be decoded" in note for note in recording.notes)


def test_joint_states_come_before_other_kinds(tmp_path: Path) -> None:
    """A file as the simulator writes it; the other topic comes first in it, and can be named."""
    states = cdr_topic("/joint_states", JOINT_STATE, joint_states())
    states.messages = [(time + 500_000, data) for time, data in states.messages]
    other = cdr_topic("/controller_state", CONTROLLER_STATE, controller_states(False))
    truth = Topic("/truth", "modrob_msgs/msg/JointTruth", [(0, b"\0\1\0\0")], schema=b"float64 x\n")
    path = write_topics(tmp_path / "run.mcap", [other, truth, states])
    assert read_recording(path).topic == "/joint_states"
    assert read_recording(path, options=LogOptions(topic="/controller_state")).topic == "/controller_state"


def test_other_kinds_are_read_where_no_joint_states_came(tmp_path: Path) -> None:
    empty = cdr_topic("/joint_states", JOINT_STATE, [])
    path = write_topics(tmp_path / "run.mcap", [empty, KINDS["dynamic"]()])
    check(read_recording(path))


def test_two_topics_of_one_rank_must_be_chosen_from(tmp_path: Path) -> None:
    topics = [cdr_topic("/left", JOINT_STATE, joint_states()), cdr_topic("/right", JOINT_STATE, joint_states()[:7])]
    path = write_topics(tmp_path / "run.mcap", topics)
    with pytest.raises(InputFileError, match=r"/left \(25 messages: a, b\); /right \(7 messages: a, b\); choose one"):
        read_joint_log(path)
    assert len(read_joint_log(path, topic="/right").t) == 7
    with pytest.raises(InputFileError, match="no topic /up, joint states are on /left, /right"):
        read_joint_log(path, topic="/up")


def test_what_cannot_be_decoded_is_said(tmp_path: Path) -> None:
    topic = cdr_topic("/j", CONTROLLER_STATE, controller_states(False))
    topic.schema, topic.schema_encoding = b"module control_msgs {};", "ros2idl"
    path = write_topics(tmp_path / "run.mcap", [topic])
    with pytest.raises(InputFileError, match="cannot be decoded: its definition is not in the file as ros2msg"):
        read_recording(path)


def test_other_types_are_listed(tmp_path: Path) -> None:
    path = write_topics(tmp_path / "run.mcap", [Topic("/state", "my_msgs/msg/Other", [(0, b"\0\1\0\0")], schema=b"")])
    with pytest.raises(InputFileError, match=r"only: /state \(my_msgs/msg/Other, cdr\)"):
        read_recording(path)


def test_joint_states_without_their_definition(tmp_path: Path) -> None:
    topic = cdr_topic("/j", JOINT_STATE, joint_states())
    topic.schema = b""
    check(read_recording(write_topics(tmp_path / "run.mcap", [topic])))
