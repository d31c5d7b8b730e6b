"""MCAP files that are written: what two independent readers find in them."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli import __version__
from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, ShapeError, UsageError
from modrob_cli.io.cdr_layout import ConstantField, DoublesField, Field, MessageLayout, StampField, Stamps, TextField
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import (
    POINT_LISTS,
    TRUTH_LISTS,
    controller_state,
    joint_state,
    joint_trajectory,
    joint_truth,
    wrench_stamped,
)

PARTS = ("reference", "feedback", "error", "output")
NAMES = ("a", "shoulder lift", "é3")
POINT = ("positions", "velocities", "accelerations", "effort")
PARTS = ("reference", "feedback", "error", "output")


def some(layout: MessageLayout, count: int, step: int, start: int = 1_700_000_000_000_000_000) -> tuple[Stamps, Array]:
    rng = np.random.default_rng(count)
    values = rng.normal(size=(count, layout.width)) * 10.0 ** rng.integers(-300, 300, size=(count, layout.width))
    if count:
        values[0, :2] = np.nan, -0.0
    return start + step * np.arange(count, dtype=np.int64), values


def all_kinds() -> list[Series]:
    """Series of every kind of message, over more than one chunk, with stamps that coincide."""
    layouts = {
        "/joint_states": (joint_state(NAMES), 4000, 1_000_000),
        "/positions": (joint_state(NAMES, velocity=False, effort=False), 1300, 3_000_001),
        "/state": (
            controller_state(NAMES, dict.fromkeys(PARTS, POINT_LISTS[:3])),
            2000,
            2_000_000,
        ),
        "/contact": (wrench_stamped("tool"), 1000, 4_000_000),
        "/truth": (joint_truth(NAMES), 4000, 1_000_000),
        "/plan": (joint_trajectory(NAMES, np.array([0, 1_500_000_000, 2**32 + 1]), accelerations=False), 1, 1),
        "/nothing": (joint_state(NAMES[:1]), 0, 1),
    }
    return [Series(topic, layout, *some(layout, count, step)) for topic, (layout, count, step) in layouts.items()]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Series]]:
    series = all_kinds()
    path = tmp_path_factory.mktemp("mcap") / "all.mcap"
    write_mcap(path, series, {"modrob": {"version": "1", "seed": "7"}, "note": {}})
    return path, series


def values_of(message: Any) -> list[float]:
    """Numbers of a message in the order of the layout."""
    kind = type(message).__name__.split("__")[-1]
    if kind == "JointState":
        return [*message.position, *message.velocity, *message.effort]
    if kind == "JointTrajectoryControllerState":
        points = [getattr(message, part) for part in PARTS]
        assert message.speed_scaling_factor == 1.0
        assert len(message.multi_dof_joint_names) == len(message.multi_dof_output.transforms) == 0
        assert len(message.multi_dof_error.accelerations) == 0
        return [x for point in points for key in POINT for x in getattr(point, key)]
    if kind == "WrenchStamped":
        assert message.header.frame_id == "tool"
        return [getattr(getattr(message.wrench, part), axis) for part in ("force", "torque") for axis in "xyz"]
    if kind == "JointTruth":
        return [x for part in TRUTH_LISTS for x in getattr(message, part)]
    assert kind == "JointTrajectory"
    times = [(point.time_from_start.sec, point.time_from_start.nanosec) for point in message.points]
    assert times == [(0, 0), (1, 500_000_000), (4, 294_967_297)]
    return [x for point in message.points for key in POINT for x in getattr(point, key)]


def check(found: dict[str, list[tuple[int, Any]]], series: list[Series]) -> None:
    """Names, stamps and numbers are those of the series, bit by bit."""
    assert set(found) == {one.topic for one in series if len(one.stamps)}
    for one in series:
        messages = found.get(one.topic, [])
        stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for _, m in messages]
        assert stamps == [time for time, _ in messages] == one.stamps.tolist()
        values = np.array([values_of(message) for _, message in messages]).reshape(-1, one.layout.width)
        assert np.array_equal(values.view(np.int64), one.values.view(np.int64))
        for _, message in messages[:1]:
            if one.topic != "/contact":
                assert tuple(getattr(message, "name", None) or message.joint_names) == NAMES


@pytest.mark.filterwarnings("ignore:.*_time is deprecated")  # of new versions of mcap; old ones know nothing else
def test_mcap_reads_back_what_was_written(written: tuple[Path, list[Series]]) -> None:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    path, series = written
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header, summary = reader.get_header(), reader.get_summary()
        assert (header.profile, header.library) == ("ros2", f"modrob {__version__}")
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == sum(len(one.stamps) for one in series)
        assert len(summary.chunk_indexes) > 1
        assert [(m.name, m.metadata) for m in reader.iter_metadata()] == [
            ("modrob", {"version": "1", "seed": "7"}),
            ("note", {}),
        ]
        found: dict[str, list[tuple[int, Any]]] = {}
        for in_order in (True, False):  # with the indexes; as the messages stand in the file
            found, times = {}, []
            for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=in_order):
                assert schema is not None
                assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
                assert message.publish_time == message.log_time
                assert message.sequence == len(found.setdefault(channel.topic, []))
                found[channel.topic].append((message.log_time, decoded))
                times.append(message.log_time)
            assert times == sorted(times)
            check(found, series)
        # Seeking needs right indexes.
        start = int(series[0].stamps[3000])
        some_later = list(reader.iter_messages(topics=["/truth"], start_time=start, end_time=start + 2_000_000))
        assert [message.log_time for _, _, message in some_later] == [start, start + 1_000_000]


def test_indexes_point_at_the_messages(written: tuple[Path, list[Series]]) -> None:
    """Place, time and channel of every message, in the indexes behind each chunk and in that of the chunks."""
    import zstandard
    from mcap.reader import make_reader
    from mcap.records import Chunk, MessageIndex
    from mcap.stream_reader import StreamReader

    path, series = written
    raw, data, found = path.read_bytes(), b"", 0
    with path.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True).records:
            if isinstance(record, Chunk):
                data = zstandard.ZstdDecompressor().decompress(record.data)
            if isinstance(record, MessageIndex):
                for time, place in record.records:
                    opcode, _, channel, _, log_time = struct.unpack_from("<BQHIQ", data, place)
                    assert (opcode, channel, log_time) == (5, record.channel_id, time)
                    found += 1
        stream.seek(0)
        summary = make_reader(stream).get_summary()
        assert summary is not None
        for chunk in summary.chunk_indexes:
            assert raw[chunk.chunk_start_offset] == 6
            for channel, offset in chunk.message_index_offsets.items():
                assert struct.unpack_from("<BQH", raw, offset)[::2] == (7, channel)
    assert found == sum(len(one.stamps) for one in series)


def test_rosbags_reads_back_what_was_written(written: tuple[Path, list[Series]]) -> None:
    from rosbags.highlevel import AnyReader

    path, series = written
    found: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([path]) as reader:
        assert {c.topic: c.msgcount for c in reader.connections} == {one.topic: len(one.stamps) for one in series}
        for connection, time, raw in reader.messages():
            found.setdefault(connection.topic, []).append((time, reader.deserialize(raw, connection.msgtype)))
    check(found, series)


def test_layouts_agree_with_the_encoder_of_rosbags() -> None:
    """Byte by byte, where rosbags knows the type."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    times = np.array([5, 10**9], dtype=np.int64)
    for layout in (joint_state(NAMES[:2]), joint_state(("x",), effort=False), joint_trajectory(NAMES, times)):
        stamps, values = some(layout, 3, 1)
        for raw in layout.encode(stamps, values):
            again = store.serialize_cdr(store.deserialize_cdr(raw, layout.type_name), layout.type_name)
            assert bytes(again) == raw


def test_our_own_reader_reads_it(written: tuple[Path, list[Series]], tmp_path: Path) -> None:
    layout = joint_state(NAMES)
    stamps, values = 10**6 * np.arange(50, dtype=np.int64), np.random.default_rng(1).normal(size=(50, 9))
    write_mcap(tmp_path / "a.mcap", [Series("/joint_states", layout, stamps, values)])
    log = read_joint_log(tmp_path / "a.mcap", NAMES)
    assert log.dq is not None
    assert np.array_equal(np.hstack([log.q, log.dq, log.effort]), values)


def test_same_input_same_bytes(written: tuple[Path, list[Series]], tmp_path: Path) -> None:
    path, _ = written
    write_mcap(tmp_path / "again.mcap", all_kinds(), {"modrob": {"version": "1", "seed": "7"}, "note": {}})
    assert (tmp_path / "again.mcap").read_bytes() == path.read_bytes()


def test_an_empty_file_is_a_file(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    write_mcap(tmp_path / "empty.mcap", [])
    with (tmp_path / "empty.mcap").open("rb") as stream:
        assert list(make_reader(stream, validate_crcs=True).iter_messages()) == []


def test_what_does_not_fit_is_refused(tmp_path: Path) -> None:
    layout = joint_state(("a",))
    stamps, values = np.array([5, 4]), np.zeros((2, 3))
    with pytest.raises(ShapeError, match="decrease"):
        Series("/a", layout, stamps, values)
    with pytest.raises(ShapeError, match="2 stamps"):
        Series("/a", layout, stamps, values[:, :2])
    with pytest.raises(ShapeError, match=r"shape \(2, 3\)"):
        layout.encode(stamps, values[:1])
    for bad in (-1, 2**31 * 10**9):
        with pytest.raises(NumericalError, match="stamp"):
            layout.encode(np.array([0, bad]), values)
    good = Series("/a", layout, np.sort(stamps), values)
    with pytest.raises(ShapeError, match="one series"):
        write_mcap(tmp_path / "x.mcap", [good, good])
    with pytest.raises(UsageError, match="cannot write"):
        write_mcap(tmp_path / "no" / "x.mcap", [good])


def test_places_follow_the_rules_of_xcdr1() -> None:
    """By hand: alignment counts from the end of the four bytes at the beginning; an empty list is not padded."""
    fields: list[Field] = [StampField(), TextField("ab"), DoublesField(0), ConstantField("i", -2), DoublesField(1)]
    layout = MessageLayout("t", "", fields)
    (raw,) = layout.encode(np.array([3_000_000_004]), np.array([[1.5]]))
    wanted = "00010000 03000000 04000000 03000000 616200" + "00 00000000 feffffff 01000000 00000000 000000000000f83f"
    assert raw.hex() == wanted.replace(" ", "")
