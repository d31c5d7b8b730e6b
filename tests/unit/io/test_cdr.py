"""Walking through CDR messages: against the mcap package and rosbags; damaged bytes end in ValueError."""

import struct
from typing import Any

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.io import joint_cdr
from modrob_cli.io.cdr import walk
from modrob_cli.io.joint_batch import Batch
from modrob_cli.io.joint_cdr import CdrDecoder
from modrob_cli.io.mcap_chunks import Block, Schema
from modrob_cli.io.ros_definitions import parse_definitions
from tests.mcap_samples import DEFINITIONS, JOINT_STATE, JOINT_STATE_DEFINITION, joint_state, serialize

SCHEMA = Schema(JOINT_STATE, "ros2msg", JOINT_STATE_DEFINITION.encode())


def block(messages: list[bytes]) -> Block:
    lengths = np.array([len(one) for one in messages])
    starts = np.cumsum(lengths) - lengths
    zeros = np.zeros(len(messages), dtype=np.int64)
    return Block(b"".join(messages), zeros, starts, lengths, zeros)


def decode(messages: list[bytes], decoder: CdrDecoder | None = None) -> list[Batch]:
    decoder = decoder or CdrDecoder(0, SCHEMA)
    every = np.arange(len(messages))
    return list(decoder.decode(block(messages), every, every))


def rows(batches: list[Batch]) -> dict[int, tuple[int, tuple[str, ...], Array]]:
    """Stamp, names and values (3, n) of each message."""
    return {
        int(number): (int(batch.stamps[k]), batch.source.names, batch.values[:, k])
        for batch in batches
        for k, number in enumerate(batch.order)
    }


@pytest.mark.parametrize("frame", ["", "x", "base_link"])
@pytest.mark.parametrize("names", [("a",), ("joint_1", "j2"), ("é", "", "abc")])
def test_decodes_what_two_other_decoders_decode(frame: str, names: tuple[str, ...]) -> None:
    from mcap_ros2._dynamic import generate_dynamic
    from rosbags.typesys import Stores, get_typestore

    values = np.arange(len(names)) + 0.5
    for effort in (values, ()):
        data = serialize(JOINT_STATE, joint_state(3.25, names, values, (), effort, frame))
        stamp, found, mine = rows(decode([data]))[0]
        first = generate_dynamic(JOINT_STATE, JOINT_STATE_DEFINITION)[JOINT_STATE](data)
        second: Any = get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr(data, JOINT_STATE)
        for reference in (first, second):
            assert found == tuple(reference.name)
            assert stamp == reference.header.stamp.sec * 10**9 + reference.header.stamp.nanosec
            for row, key in zip(mine, ("position", "velocity", "effort"), strict=True):
                expected = getattr(reference, key)
                np.testing.assert_array_equal(row, expected if len(expected) else [np.nan] * len(names))


def test_messages_of_all_forms_in_one_block_keep_their_numbers() -> None:
    rng = np.random.default_rng(1)
    messages, expected = [], []
    for k in range(300):
        names = [("a", "b"), ("b", "a"), ("a", "b", "c"), ("x",)][rng.integers(4)]
        effort = rng.normal(size=len(names)) if rng.random() < 0.5 else ()
        frame = ["", "base"][rng.integers(2)]
        position = rng.normal(size=len(names))
        messages.append(serialize(JOINT_STATE, joint_state(k, names, position, (), effort, frame)))
        expected.append((k * 10**9, names, position, effort))
    found = rows(decode(messages))
    assert sorted(found) == list(range(300))
    for k, (stamp, names, position, effort) in enumerate(expected):
        assert found[k][:2] == (stamp, names)
        np.testing.assert_array_equal(found[k][2][0], position)
        assert np.isnan(found[k][2][1]).all()
        np.testing.assert_array_equal(found[k][2][2], effort if len(effort) else [np.nan] * len(names))


def test_a_form_that_comes_again_only_later_gives_no_empty_batches() -> None:
    first, second = (serialize(JOINT_STATE, joint_state(1, names, [1, 2])) for names in (("a", "b"), ("b", "a")))
    decoder = CdrDecoder(0, SCHEMA)
    for messages in ([first, second], [second, second], [first]):
        assert all(len(batch.order) for batch in decode(messages, decoder))


def test_messages_that_are_all_different_are_decoded_one_by_one() -> None:
    messages = [serialize(JOINT_STATE, joint_state(k, ["a"], [k], (), [-k], f"{k:05}")) for k in range(500)]
    decoder = CdrDecoder(0, SCHEMA)
    found = rows(decode(messages, decoder))
    np.testing.assert_array_equal([found[k][2][0, 0] for k in range(500)], np.arange(500))
    # Else the time would grow with the square of their number.
    assert max(len(known) for known in decoder._templates.values()) == 64


def test_messages_that_differ_in_numbers_only_are_walked_through_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    monkeypatch.setattr(joint_cdr, "walk", lambda *arguments: calls.append(1) or walk(*arguments))  # type: ignore[func-returns-value]
    messages = [serialize(JOINT_STATE, joint_state(k, ["a", "b"], [k, 1], [2, k], [-k, 3])) for k in range(100)]
    assert sorted(rows(decode(messages))) == list(range(100))
    assert len(calls) == 1


def test_big_endian_and_other_encodings() -> None:
    data = b"\0\0\0\0" + struct.pack(">iII", 7, 9, 1) + b"\0\0\0\0" + struct.pack(">I", 1)
    data += struct.pack(">I", 2) + b"q\0\0\0"
    # The count ends 32 bytes after the encapsulation header, so its doubles are aligned to 8 bytes as they are.
    data += struct.pack(">Id", 1, 2.5) + struct.pack(">I", 0) + struct.pack(">I", 0)
    stamp, names, values = rows(decode([data]))[0]
    assert (stamp, names, values[0, 0]) == (7_000_000_009, ("q",), 2.5)
    decoder = CdrDecoder(0, SCHEMA)
    assert decode([b"\0\x07" + data[2:], b""], decoder) == []
    assert (decoder.faults.count, decoder.faults.reason) == (2, "it is empty")


@pytest.mark.parametrize("kind", list(DEFINITIONS))
def test_damaged_messages_are_counted_and_never_fail_in_another_way(kind: str) -> None:
    name = JOINT_STATE if kind == JOINT_STATE else "control_msgs/msg/X"
    definitions = parse_definitions(name, DEFINITIONS[kind])
    good = serialize(JOINT_STATE, joint_state(1.0, ["a", "b"], [1, 2], [3, 4], [5, 6])) + bytes(200)
    rng = np.random.default_rng(2)
    short = f"{name.split('/')[0]}/{name.split('/')[-1]}"
    for _ in range(3000):
        data = bytearray(good[: rng.integers(len(good) + 1)] if rng.random() < 0.3 else good)
        for place in rng.integers(len(data), size=rng.integers(1, 6)) if data else ():
            data[place] = rng.integers(256)
        try:
            walk(bytes(data), short, definitions)
        except ValueError:
            continue


def test_a_damaged_count_of_empty_structures_does_not_hang() -> None:
    definitions = parse_definitions("a/B", "Empty[] all\n===\nMSG: a/Empty\nuint8 X=1\n")
    with pytest.raises(ValueError, match="a list is too long"):
        walk(b"\0\1\0\0" + b"\xff" * 4, "a/B", definitions)
    endless = parse_definitions("a/B", "B inner\n")
    with pytest.raises(ValueError, match="nested too deeply"):
        walk(b"\0\1\0\0", "a/B", endless)


def test_definitions() -> None:
    text = """# comment
uint8 KIND=3
string<=10 name "default"   # bounded
float64[3] fixed
float64[<=5] bounded
geometry_msgs/msg/Point[] points
Header header
bool flag true
================
MSG: geometry_msgs/Point
float64 x
float64 y 0.5
"""
    fields = parse_definitions("p/msg/M", text)["p/M"]
    assert [(f.name, f.type, f.is_list, f.length) for f in fields] == [
        ("name", "string", False, None),
        ("fixed", "float64", False, 3),
        ("bounded", "float64", True, None),
        ("points", "geometry_msgs/Point", True, None),
        ("header", "std_msgs/Header", False, None),
        ("flag", "bool", False, None),
    ]
    for wrong in ("float64 []x", "Missing x", "float64 x\n====\nfloat64 y"):
        with pytest.raises(ValueError, match="found|lacks"):
            parse_definitions("p/M", wrong)
