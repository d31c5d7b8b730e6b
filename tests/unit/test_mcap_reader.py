"""Joint states from MCAP: against the mcap package's own decoder; bad files end in clear errors."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli.errors import InputFileError
from modrob_cli.io.cdr import JointStateDecoder
from modrob_cli.io.mcap_reader import read_joint_log
from tests.mcap_samples import JOINT_STATE_DEFINITION, joint_state, write_mcap

NAMES = ("a", "b", "c")


def messages(count: int = 20, names: tuple[str, ...] = NAMES, **changes: Any) -> list[dict[str, Any]]:
    rng = np.random.default_rng(1)
    out = []
    for k in range(count):
        fields = {key: rng.normal(size=len(names)) for key in ("position", "velocity", "effort")} | changes
        out.append(joint_state(100.0 + 0.01 * k, names, **fields))
    return out


def refusal(path: Path, **options: Any) -> str:
    with pytest.raises(InputFileError) as caught:
        read_joint_log(path, **options)
    assert caught.value.exit_code == 3
    return str(caught.value)


@pytest.mark.parametrize("compression", ["NONE", "LZ4", "ZSTD"])
def test_reads_what_the_package_s_own_decoder_reads(tmp_path: Path, compression: str) -> None:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    path = write_mcap(tmp_path / "run.mcap", {"/joint_states": messages(300)}, compression=compression)
    log = read_joint_log(path)
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        decoded = [item.decoded_message for item in reader.iter_decoded_messages()]
    assert log.name == "run"
    assert log.joint_names == NAMES
    assert log.dq is not None
    np.testing.assert_array_equal(log.q, [message.position for message in decoded])
    np.testing.assert_array_equal(log.dq, [message.velocity for message in decoded])
    np.testing.assert_array_equal(log.effort, [message.effort for message in decoded])
    # Half a nanosecond: the resolution of the stamps.
    np.testing.assert_allclose(log.t, 0.01 * np.arange(300), rtol=0, atol=0.5e-9)


@pytest.mark.parametrize("frame", ["", "x", "base_link"])
@pytest.mark.parametrize("names", [("a",), ("joint_1", "j2"), ("é", "", "abc")])
def test_decoder_aligns_like_the_package_s(frame: str, names: tuple[str, ...]) -> None:
    from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic

    kind = "sensor_msgs/msg/JointState"
    values = np.arange(len(names)) + 0.5
    for effort in (values, ()):
        message = joint_state(3.25, names, values, (), effort, frame)
        data = serialize_dynamic(kind, JOINT_STATE_DEFINITION)[kind](message)
        mine, reference = JointStateDecoder().decode(data), generate_dynamic(kind, JOINT_STATE_DEFINITION)[kind](data)
        assert mine.names == tuple(reference.name)
        assert mine.stamp == reference.header.stamp.sec * 10**9 + reference.header.stamp.nanosec
        for field in ("position", "velocity", "effort"):
            np.testing.assert_array_equal(getattr(mine, field), getattr(reference, field))


def test_decoder_reads_big_endian_and_refuses_other_encodings() -> None:
    name = struct.pack(">I", 2) + b"q\0"
    data = b"\0\0\0\0" + struct.pack(">iII", 7, 9, 1) + b"\0\0\0\0" + struct.pack(">I", 1) + name + b"\0\0"
    # The count ends 32 bytes after the encapsulation header, so its doubles are aligned to 8 bytes as they are.
    data += struct.pack(">Id", 1, 2.5) + struct.pack(">I", 0) + struct.pack(">I", 0)
    state = JointStateDecoder().decode(data)
    assert (state.stamp, state.names, list(state.position)) == (7_000_000_009, ("q",), [2.5])
    with pytest.raises(ValueError, match="not a CDR message"):
        JointStateDecoder().decode(b"\0\x07" + data[2:])


def test_decoder_never_fails_in_another_way_on_damaged_messages() -> None:
    from mcap_ros2._dynamic import serialize_dynamic

    kind = "sensor_msgs/msg/JointState"
    good = serialize_dynamic(kind, JOINT_STATE_DEFINITION)[kind](messages(1)[0])
    rng = np.random.default_rng(2)
    decoder = JointStateDecoder()
    for _ in range(3000):
        data = bytearray(good[: rng.integers(len(good) + 1)] if rng.random() < 0.3 else good)
        for place in rng.integers(len(data), size=rng.integers(1, 4)) if data else ():
            data[place] = rng.integers(256)
        try:
            decoder.decode(bytes(data))
        except ValueError:
            continue
    np.testing.assert_array_equal(decoder.decode(good).position, messages(1)[0]["position"])


def test_joints_are_found_by_name_in_every_message(tmp_path: Path) -> None:
    rows = []
    for k in range(6):
        order = list(np.random.default_rng(k).permutation(3))
        names = [NAMES[i] for i in order]
        rows.append(joint_state(k, names, [10.0 * i + k for i in order], (), [i - k for i in order]))
    path = write_mcap(tmp_path / "run.mcap", {"/joint_states": rows})
    log = read_joint_log(path, ("c", "a"))
    np.testing.assert_array_equal(log.q, [[20.0 + k, k] for k in range(6)])
    np.testing.assert_array_equal(log.effort, [[2.0 - k, -k] for k in range(6)])
    assert log.dq is None


def test_messages_about_other_joints_only_are_skipped(tmp_path: Path) -> None:
    rows = messages(10)
    gripper = joint_state(100.055, ["finger"], [0.1])
    path = write_mcap(tmp_path / "run.mcap", {"/joint_states": [*rows[:6], gripper, *rows[6:]]})
    assert len(read_joint_log(path, NAMES).t) == 10


def test_missing_joints_list_both_sides(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / "run.mcap", {"/joint_states": messages()})
    for wanted in (("a", "elbow", "wrist"), ("elbow", "wrist")):
        text = refusal(path, joint_names=wanted)
        assert "elbow, wrist; the robot has " + ", ".join(wanted) in text
        assert "the log has a, b, c" in text
        assert "joint_names:" in text


def test_several_topics_must_be_chosen_from(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / "run.mcap", {"/left": messages(5), "/right": messages(7)})
    assert "several topics with joint states: /left, /right; choose one with --topic" in refusal(path)
    assert len(read_joint_log(path, topic="/right").t) == 7
    assert "no topic /up, joint states are on /left, /right" in refusal(path, topic="/up")


def test_other_types_are_listed(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / "run.mcap", {"/state": messages(3)}, kind="my_msgs/msg/Other")
    assert "/state (my_msgs/msg/Other, cdr)" in refusal(path)


@pytest.mark.parametrize("velocity", [(), (1.0, np.nan, 2.0)])
def test_velocities_that_are_empty_or_nan_count_as_not_recorded(tmp_path: Path, velocity: tuple[float, ...]) -> None:
    rows = messages(4)
    rows[2]["velocity"] = list(velocity)
    assert read_joint_log(write_mcap(tmp_path / "run.mcap", {"/joint_states": rows})).dq is None


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("effort", [], "effort in message 3: found 0 values for 3 joints"),
        ("effort", [1.0, np.nan, 1.0], "effort in message 3: found nan for b"),
        ("position", [1.0, 2.0], "position in message 3: found 2 values for 3 joints"),
        ("position", [1.0, 2.0, np.inf], "position in message 3: found inf for c"),
    ],
)
def test_positions_and_efforts_must_be_there(tmp_path: Path, field: str, value: list[float], words: str) -> None:
    rows = messages(5)
    rows[2][field] = value
    assert words in refusal(write_mcap(tmp_path / "run.mcap", {"/joint_states": rows}))


def test_nan_of_a_joint_that_is_not_wanted_does_not_matter(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / "run.mcap", {"/joint_states": messages(5, effort=[1.0, np.nan, 1.0])})
    assert read_joint_log(path, ("a", "c")).effort.shape == (5, 2)


def test_repeated_stamps_are_left_out_and_counted(tmp_path: Path) -> None:
    rows = messages(6)
    again = {**rows[2], "position": [9.0, 9.0, 9.0]}
    log = read_joint_log(write_mcap(tmp_path / "run.mcap", {"/joint_states": [*rows[:3], again, again, *rows[3:]]}))
    assert log.repeated == 2
    np.testing.assert_array_equal(log.q, [row["position"] for row in rows])


def test_stamps_that_go_back_or_stand_still_are_refused(tmp_path: Path) -> None:
    rows = messages(6)
    swapped = [rows[0], rows[2], rows[1], *rows[3:]]
    path = write_mcap(tmp_path / "run.mcap", {"/joint_states": swapped})
    assert "time goes back by 0.01 s after message 2" in refusal(path)
    still = write_mcap(tmp_path / "still.mcap", {"/joint_states": [rows[0]] * 4})
    assert "all 4 messages have the same header stamp" in refusal(still)


def test_a_message_that_names_a_joint_twice_is_refused(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / "run.mcap", {"/joint_states": messages(3, names=("a", "b", "a"))})
    assert "names a joint twice" in refusal(path)


def test_epoch_times_keep_their_resolution(tmp_path: Path) -> None:
    rows = [joint_state(0, ["a"], [0.0], (), [0.0]) for _ in range(5)]
    for k, row in enumerate(rows):
        row["header"]["stamp"] = {"sec": 1_700_000_000, "nanosec": 200_000 * k}
    log = read_joint_log(write_mcap(tmp_path / "run.mcap", {"/joint_states": rows}))
    # Exact differences of whole nanoseconds; as seconds since 1970 they would be off by 1e-7.
    np.testing.assert_allclose(log.t, 2e-4 * np.arange(5), rtol=0, atol=1e-15)


def test_what_is_not_an_mcap_file(tmp_path: Path) -> None:
    empty, text = tmp_path / "empty.mcap", tmp_path / "text.mcap"
    empty.touch()
    text.write_text("t,q1,q2\n")
    assert "found an empty file" in refusal(empty)
    assert "found something else, expected an MCAP file" in refusal(text)
    assert "found a folder" in refusal(tmp_path)
    assert "file not found" in refusal(tmp_path / "none.mcap")


def test_files_without_messages(tmp_path: Path) -> None:
    assert "found no topic of type" in refusal(write_mcap(tmp_path / "run.mcap", {}))


def test_every_cut_and_every_flipped_byte_gives_a_clear_error_or_the_same_log(tmp_path: Path) -> None:
    good = write_mcap(tmp_path / "good.mcap", {"/joint_states": messages(60)}, chunk_size=2000)
    raw, log = good.read_bytes(), read_joint_log(good)
    rng = np.random.default_rng(4)
    damaged = [raw[:cut] for cut in rng.integers(1, len(raw), size=100)]
    for place in rng.integers(len(raw), size=200):
        flipped = bytearray(raw)
        flipped[place] ^= int(rng.integers(1, 256))
        damaged.append(bytes(flipped))
    path = tmp_path / "bad.mcap"
    refused = 0
    for data in damaged:
        path.write_bytes(data)
        try:
            again = read_joint_log(path)
        except InputFileError:
            refused += 1
        else:
            # The damage sits where nothing of the data is, such as an index or an unused time.
            np.testing.assert_array_equal(again.effort, log.effort)
    assert refused > 200
