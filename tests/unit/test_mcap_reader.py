"""From messages to a log: joints by name, times, publishers, missing values."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli.errors import InputFileError, UsageError
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.mcap_reader import read_joint_log, read_recording
from tests.mcap_samples import JOINT_STATE, Topic, cdr_topic, joint_state, json_topic, write_mcap, write_topics

NAMES = ("a", "b", "c")


def messages(count: int = 20, names: tuple[str, ...] = NAMES, **changes: Any) -> list[dict[str, Any]]:
    """A slow motion; a message every 10 ms."""
    rng = np.random.default_rng(1)
    out = []
    for k in range(count):
        fields: dict[str, Any] = {key: rng.normal(size=len(names)) for key in ("velocity", "effort")}
        fields["position"] = np.sin(0.01 * k + np.arange(len(names)))
        out.append(joint_state(100.0 + 0.01 * k, names, **(fields | changes)))
    return out


def write(folder: Path, rows: list[dict[str, Any]]) -> Path:
    return write_mcap(folder / "run.mcap", {"/joint_states": rows})


def refusal(path: Path, joint_names: tuple[str, ...] | None = None, **options: Any) -> str:
    with pytest.raises(InputFileError) as caught:
        read_joint_log(path, joint_names, options=LogOptions(**options))
    assert caught.value.exit_code == 3
    return str(caught.value)


def noted(notes: tuple[str, ...], words: str) -> bool:
    return any(words in note for note in notes)


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
    assert log.notes == ()
    np.testing.assert_array_equal(log.q, [message.position for message in decoded])
    np.testing.assert_array_equal(log.dq, [message.velocity for message in decoded])
    np.testing.assert_array_equal(log.effort, [message.effort for message in decoded])
    # Half a nanosecond: the resolution of the stamps.
    np.testing.assert_allclose(log.t, 0.01 * np.arange(300), rtol=0, atol=0.5e-9)


def test_joints_are_found_by_name_in_every_message(tmp_path: Path) -> None:
    rows = []
    for k in range(6):
        order = list(np.random.default_rng(k).permutation(3))
        names = [NAMES[i] for i in order]
        rows.append(joint_state(k, names, [10.0 * i + k for i in order], (), [i - k for i in order]))
    log = read_joint_log(write(tmp_path, rows), ("c", "a"))
    np.testing.assert_array_equal(log.q, [[20.0 + k, k] for k in range(6)])
    np.testing.assert_array_equal(log.effort, [[2.0 - k, -k] for k in range(6)])
    assert log.dq is None
    assert noted(log.notes, "ignored joints of the log: b")


def test_messages_about_other_joints_only_are_skipped(tmp_path: Path) -> None:
    rows = messages(20)
    gripper = joint_state(100.055, ["finger"], [0.1])
    path = write(tmp_path, [*rows[:6], gripper, *rows[6:]])
    log = read_joint_log(path, NAMES)
    assert len(log.t) == 20
    assert noted(log.notes, "1 messages are about other joints only")
    assert noted(log.notes, "ignored joints of the log: finger")
    # Without a list of joints, one that comes in a twentieth of the messages is not made part of the log.
    assert read_joint_log(path).joint_names == NAMES


def test_missing_joints_list_both_sides(tmp_path: Path) -> None:
    path = write(tmp_path, messages())
    for wanted in (("a", "elbow", "wrist"), ("elbow", "wrist")):
        text = refusal(path, wanted)
        assert "elbow, wrist; the robot has " + ", ".join(wanted) in text
        assert "the log has a, b, c" in text
        assert "--map LOG=ROBOT" in text


def test_joints_are_renamed(tmp_path: Path) -> None:
    path = write(tmp_path, messages())
    log = read_joint_log(path, ("shoulder", "b"), options=LogOptions(joint_map={"c": "shoulder"}))
    np.testing.assert_array_equal(log.q, read_joint_log(path, ("c", "b")).q)
    # Two joints may change places.
    swapped = read_joint_log(path, ("a", "b"), options=LogOptions(joint_map={"a": "b", "b": "a"}))
    np.testing.assert_array_equal(swapped.q, read_joint_log(path, ("b", "a")).q)
    assert "--map renames d, but the log has a, b, c" in refusal(path, joint_map={"d": "x"})
    assert "--map gives two joints of the log one name" in refusal(path, joint_map={"a": "b"})


@pytest.mark.parametrize("velocity", [(), (1.0, np.nan, 2.0)])
def test_velocities_that_are_missing_somewhere_count_as_not_recorded(
    tmp_path: Path, velocity: tuple[float, ...]
) -> None:
    rows = messages(4)
    rows[2]["velocity"] = list(velocity)
    log = read_joint_log(write(tmp_path, rows))
    assert log.dq is None
    assert noted(log.notes, "velocities are missing in 1 of 4 samples")


@pytest.mark.parametrize(
    ("field", "value"),
    [("effort", []), ("effort", [1.0, np.nan, 1.0]), ("position", [1.0, 2.0, np.inf]), ("position", [])],
)
def test_samples_without_position_or_effort_are_left_out(tmp_path: Path, field: str, value: list[float]) -> None:
    rows = messages(5)
    rows[2][field] = value
    log = read_joint_log(write(tmp_path, rows))
    np.testing.assert_allclose(log.t, [0.0, 0.01, 0.03, 0.04], rtol=0, atol=1e-9)
    assert noted(log.notes, "1 of 5 samples lack a position or an effort")


def test_a_list_of_the_wrong_length_is_no_message(tmp_path: Path) -> None:
    rows = messages(5)
    rows[2]["position"] = [1.0, 2.0]
    log = read_joint_log(write(tmp_path, rows))
    assert len(log.t) == 4
    assert noted(log.notes, "1 messages of /joint_states could not be decoded and were left out (the first: position")


def test_a_joint_without_any_effort_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, messages(5, effort=[1.0, np.nan, 1.0]))
    assert "found no effort of b" in refusal(path)
    assert read_joint_log(path, ("a", "c")).effort.shape == (5, 2)
    none = write(tmp_path, messages(5, effort=[]))
    assert "found no effort of a, b, c" in refusal(none)
    assert read_recording(none).effort is None


def test_repeated_stamps_are_left_out_and_counted(tmp_path: Path) -> None:
    rows = messages(6)
    again = {**rows[2], "effort": [9.0, 9.0, 9.0]}
    log = read_joint_log(write(tmp_path, [*rows[:3], again, again, *rows[3:]]))
    assert log.repeated == 2
    assert noted(log.notes, "2 messages repeated the time before")
    np.testing.assert_array_equal(log.effort, [row["effort"] for row in rows])


def test_messages_that_came_a_little_late_are_sorted(tmp_path: Path) -> None:
    rows = messages(6)
    log = read_joint_log(write(tmp_path, [rows[0], rows[2], rows[3], rows[1], *rows[4:]]))
    np.testing.assert_array_equal(log.effort, [row["effort"] for row in rows])
    assert noted(log.notes, "sorted by time: 1 messages came after a later one, by 0.02 s at most")


def test_time_that_goes_back_far_is_refused(tmp_path: Path) -> None:
    rows = messages(60)
    path = write(tmp_path, [*rows[20:], *rows[:20]])
    assert "time goes back by 0.59 s after message 40" in refusal(path)
    # The recorder's clock went on.
    assert len(read_joint_log(path, options=LogOptions(time="log")).t) == 60


@pytest.mark.parametrize("place", [0, 7, 19])
def test_a_single_stamp_that_is_far_off_is_left_out(tmp_path: Path, place: int) -> None:
    rows = messages(20)
    shift = 3600 if place < 19 else -60
    rows[place]["header"]["stamp"]["sec"] += shift
    log = read_joint_log(write(tmp_path, rows))
    assert len(log.t) == 19
    assert noted(log.notes, "1 messages have no time or one far from")


def test_stamps_that_stand_still(tmp_path: Path) -> None:
    rows = messages(6)
    path = write(tmp_path, [rows[0]] * 4)
    assert "all 4 messages have the same header stamp; a log needs times that advance" in refusal(path)
    assert len(read_joint_log(path, options=LogOptions(time="log")).t) == 4
    for row in rows:
        row["header"]["stamp"] = {"sec": 0, "nanosec": 0}
    assert "all header stamps are 0; take the times of the recorder: --time log" in refusal(write(tmp_path, rows))


def test_messages_without_stamps(tmp_path: Path) -> None:
    rows: list[dict[str, Any]] = [{"name": ["a"], "position": [0.1 * k], "effort": [k]} for k in range(9)]
    path = write_topics(tmp_path / "run.mcap", [json_topic("/j", rows)])
    assert "9 of 9 messages have no time stamp; take the times of the recorder: --time log" in refusal(path)
    log = read_joint_log(path, options=LogOptions(time="log"))
    np.testing.assert_allclose(log.t, 1e-6 * np.arange(9), rtol=0, atol=1e-15)
    stamped = [row | {"header": {"stamp": 1.0 + k}} for k, row in enumerate(rows)]
    stamped[4] = rows[4]
    assert len(read_joint_log(write_topics(tmp_path / "run.mcap", [json_topic("/j", stamped)])).t) == 8


def test_a_message_that_names_a_joint_twice_is_left_out(tmp_path: Path) -> None:
    path = write(tmp_path, [*messages(5), *messages(3, names=("a", "b", "a"))])
    log = read_joint_log(path)
    assert log.q.shape == (5, 3)
    assert noted(log.notes, "it names a joint twice: a")


def test_epoch_times_keep_their_resolution(tmp_path: Path) -> None:
    rows = [joint_state(0, ["a"], [0.0], (), [0.0]) for _ in range(5)]
    for k, row in enumerate(rows):
        row["header"]["stamp"] = {"sec": 1_700_000_000, "nanosec": 200_000 * k}
    log = read_joint_log(write(tmp_path, rows))
    # Exact differences of whole nanoseconds; as seconds since 1970 they would be off by 1e-7.
    np.testing.assert_allclose(log.t, 2e-4 * np.arange(5), rtol=0, atol=1e-15)


def parts(rows: list[dict[str, Any]], wanted: slice, delay: int = 0) -> list[dict[str, Any]]:
    """Messages about some of the joints, their stamps later by ``delay`` [ns]."""
    out = []
    for row in rows:
        part: dict[str, Any] = {key: row[key][wanted] for key in ("name", "position", "velocity", "effort")}
        stamp = row["header"]["stamp"]
        later = stamp["sec"] * 10**9 + stamp["nanosec"] + delay
        part["header"] = {"stamp": {"sec": later // 10**9, "nanosec": later % 10**9}, "frame_id": ""}
        out.append(part)
    return out


def mixed(*lists: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [row for group in zip(*lists, strict=True) for row in group]


def test_joints_in_several_messages_of_one_stamp_are_put_together(tmp_path: Path) -> None:
    rows = messages(30)
    first, second = parts(rows, slice(0, 2)), parts(rows, slice(2, 3))
    log = read_joint_log(write(tmp_path, mixed(first, second)), NAMES)
    np.testing.assert_array_equal(log.q, [row["position"] for row in rows])
    np.testing.assert_array_equal(log.effort, [row["effort"] for row in rows])
    assert log.notes == ()
    lost = mixed(first, second)
    del lost[11]
    log = read_joint_log(write(tmp_path, lost), NAMES)
    assert len(log.t) == 29
    assert noted(log.notes, "1 times at which some were missing were left out")


def test_joints_in_messages_of_near_stamps_are_interpolated(tmp_path: Path) -> None:
    """A straight motion is met exactly; the joints with fewer messages give the times."""
    slow = [joint_state(10.0 + 0.02 * k, ["a"], [2.0 * k], (), [k]) for k in range(50)]
    fast = [joint_state(10.003 + 0.01 * k, ["b"], [k], (), [3 * k]) for k in range(99)]
    rows = sorted(
        [*slow, *fast], key=lambda row: row["header"]["stamp"]["sec"] * 10**9 + row["header"]["stamp"]["nanosec"]
    )
    log = read_joint_log(write(tmp_path, rows), ("a", "b"))
    t = 0.02 * np.arange(1, 50)
    np.testing.assert_allclose(log.t + 0.02, t, rtol=0, atol=1e-9)
    # Stamps are whole nanoseconds, positions change by 100 per second.
    np.testing.assert_allclose(log.q, np.stack([100.0 * t, (t - 0.003) * 100.0], axis=1), rtol=0, atol=1e-6)
    np.testing.assert_allclose(log.effort[:, 1], 3 * log.q[:, 1], rtol=1e-12)
    assert noted(log.notes, "interpolated along straight lines to the times of a, 0.003 s from the nearest message")


def test_two_publishers_on_one_topic_are_refused_and_can_be_chosen_from(tmp_path: Path) -> None:
    """A publisher of zeros between the messages of the robot, as a state publisher that was left running."""
    rows = messages(50)
    zeros = [joint_state(100.004 + 0.01 * k, ("c", "b", "a"), [0.0] * 3) for k in range(50)]
    path = write(tmp_path, mixed(rows, zeros))
    text = refusal(path)
    assert "positions jump to and fro" in text
    assert "choose one with --publisher: 1 (50 messages; channel 1; position+velocity+effort; joints a, b, c)" in text
    assert "2 (50 messages; channel 1; position; joints c, b, a)" in text
    log = read_joint_log(path, options=LogOptions(publisher=1))
    np.testing.assert_array_equal(log.effort, [row["effort"] for row in rows])
    with pytest.raises(UsageError, match="--publisher: found 3"):
        read_joint_log(path, options=LogOptions(publisher=3))
    # The numbers count all publishers of the topic, as modrob log info lists them.
    gripper = joint_state(99.0, ("finger",), [0.0])
    path = write(tmp_path, [gripper, *mixed(rows, zeros)])
    assert "--publisher: 2 (50 messages" in refusal(path, NAMES)
    assert read_joint_log(path, NAMES, options=LogOptions(publisher=2)).effort.shape == (50, 3)
    with pytest.raises(UsageError, match="--publisher: found 1"):
        read_joint_log(path, NAMES, options=LogOptions(publisher=1))


def test_publishers_whose_messages_look_alike_are_found_by_their_jumps(tmp_path: Path) -> None:
    rows = messages(200)
    rare = [row for k, row in enumerate(rows) for row in ([row, zero(row)] if k % 10 == 3 else [row])]
    path = write(tmp_path, rare)
    assert "nothing tells their messages apart" in refusal(path)
    assert len(read_joint_log(path, options=LogOptions(publisher=1)).t) == 220


def zero(row: dict[str, Any]) -> dict[str, Any]:
    stamp = {**row["header"]["stamp"], "nanosec": row["header"]["stamp"]["nanosec"] + 4_000_000}
    return {**row, "position": [0.0] * 3, "header": {"stamp": stamp, "frame_id": ""}}


def test_noise_and_single_glitches_are_not_taken_for_publishers(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    noisy = [row | {"position": rng.normal(size=3).tolist()} for row in messages(300)]
    assert len(read_joint_log(write(tmp_path, noisy)).t) == 300
    single = [row | {"position": rng.normal(size=1).tolist()} for row in messages(300, ("a",))]
    assert len(read_joint_log(write(tmp_path, single)).t) == 300
    glitches = [zero(row) if k in (5, 90) else row for k, row in enumerate(messages(300))]
    assert len(read_joint_log(write(tmp_path, glitches)).t) == 300


def test_topics_about_other_joints_are_no_choice(tmp_path: Path) -> None:
    arm, fingers = messages(30), messages(30, ("left", "right"))
    path = write_mcap(tmp_path / "run.mcap", {"/joint_states": arm, "/gripper/joint_states": fingers})
    assert "several topics" in refusal(path)
    assert read_recording(path, NAMES).topic == "/joint_states"
    text = refusal(path, ("left", "right", "x"))
    assert "not in the log: x" in text
    assert "other topics with joints: /joint_states (--topic)" in text


def test_two_channels_of_one_topic(tmp_path: Path) -> None:
    def channel(rows: list[dict[str, Any]], start: int) -> Topic:
        topic = cdr_topic("/joint_states", JOINT_STATE, rows)
        topic.messages = [(time + start, data) for time, data in topic.messages]
        return topic

    rows = messages(40)
    together = write_topics(tmp_path / "run.mcap", [channel(rows, 0), channel(rows, 1)])
    assert "two publishers send the same joints at the same time" in refusal(together)
    in_turn = write_topics(tmp_path / "run.mcap", [channel(rows[:20], 0), channel(rows[20:], 10**9)])
    assert len(read_joint_log(in_turn).t) == 40


def test_what_is_not_an_mcap_file(tmp_path: Path) -> None:
    empty, text = tmp_path / "empty.mcap", tmp_path / "text.mcap"
    empty.touch()
    text.write_text("t,q1,q2\n")
    assert "found an empty file" in refusal(empty)
    assert "found something else, expected an MCAP file" in refusal(text)
    assert "found a folder" in refusal(tmp_path)
    assert "file not found" in refusal(tmp_path / "none.mcap")
    text.write_bytes(b"SQLite format 3\0" + bytes(100))
    assert "found an SQLite file (a rosbag2 .db3); convert it" in refusal(text)


def test_messages_without_names(tmp_path: Path) -> None:
    empty = write(tmp_path, [joint_state(k, [], []) for k in range(9)])
    assert "the messages of /joint_states name no joints" in refusal(empty)
    assert "the messages of /joint_states name no joints" in refusal(empty, NAMES)
    nameless = write(tmp_path, [joint_state(k, [], [1.0, 2.0]) for k in range(9)])
    assert "has no messages that can be read" in refusal(nameless)
    assert "position has 2 values for 0 joints" in refusal(nameless)


def test_files_without_messages(tmp_path: Path) -> None:
    assert "found no topic with joint states" in refusal(write_mcap(tmp_path / "run.mcap", {}))
    path = write_topics(tmp_path / "run.mcap", [cdr_topic("/joint_states", JOINT_STATE, [])])
    assert "found no topic with joint states" in refusal(path)
