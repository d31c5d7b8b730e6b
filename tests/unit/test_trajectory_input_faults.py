"""Motions from messages, samples and recordings: what is wrong with them is found where it is."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli.errors import InputFileError, ShapeError, UsageError
from modrob_cli.io import given_motion, joint_trajectory_csv, joint_trajectory_mcap
from modrob_cli.io.joint_trajectory_cdr import decode_joint_trajectory, decode_state
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import joint_state, joint_trajectory
from modrob_cli.model.trajectory_points import MotionPoints
from modrob_cli.workflows.trajectory_motion import load_trajectory
from tests.mcap_samples import joint_state as state
from tests.mcap_samples import write_mcap as write_samples
from tests.unit.test_trajectory_inputs import DDQ, DQ, Q, T, as_csv, as_mcap, as_states

POINTS = [{"positions": [0, k], "time_from_start": k} for k in range(4)]
MANY_NAMES = ["a", "b"]


def fault_of(path: Path, **options: Any) -> str:
    with pytest.raises(InputFileError) as caught:
        load_trajectory(path, **options)
    text = str(caught.value)
    assert text.isprintable() or "\n" in text
    return text


def put(point: int, **keys: Any) -> list[dict[str, Any]]:
    return [{**entry, **keys} if k == point else entry for k, entry in enumerate(POINTS)]


@pytest.mark.parametrize(
    ("names", "points", "wanted"),
    [
        (MANY_NAMES, POINTS[:1], ["$.points", "at least 2"]),
        (MANY_NAMES, [], ["$.points", "at least 2"]),
        (MANY_NAMES, "x", ["$.points: found 'x', expected a valid list"]),
        (MANY_NAMES, put(2, time_from_start=1), [":26:4: $.points[2].time_from_start: found 1.0, expected more than"]),
        (MANY_NAMES, put(3, time_from_start={"sec": 1}), ["$.points[3].time_from_start: found 1.0"]),
        (MANY_NAMES, put(0, time_from_start=0.5), ["$.points[0].time_from_start: found 0.5, expected 0 in the first"]),
        (MANY_NAMES, put(1, time_from_start=-1), ["$.points[1].time_from_start: found -1"]),
        (MANY_NAMES, put(1, time_from_start={"sec": 1.5}), ["$.points[1].time_from_start: found a mapping, expected"]),
        (MANY_NAMES, put(1, time_from_start={"sec": 1, "nsecs": 2}), ["$.points[1].time_from_start"]),
        (MANY_NAMES, put(1, time_from_start={"sec": 1, "nanosec": 10**9}), ["$.points[1].time_from_start"]),
        (MANY_NAMES, put(1, time_from_start={"sec": 2**31}), ["$.points[1].time_from_start"]),
        (MANY_NAMES, put(1, time_from_start={"sec": True}), ["$.points[1].time_from_start"]),
        (MANY_NAMES, put(1, time_from_start={}), ["$.points[1].time_from_start"]),
        (MANY_NAMES, [*POINTS[:2], {"positions": [1, 2]}], ["$.points[2].time_from_start: required key is missing"]),
        (MANY_NAMES, put(1, positions=[1]), ["$.points[1].positions: found a list of 1, expected a position for each"]),
        (["a"], POINTS, [f"$.points[{k}].positions: found a list of 2" for k in range(4)]),
        (MANY_NAMES, put(1, positions=[]), ["$.points[1].positions: found a list of 0"]),
        (MANY_NAMES, put(1, velocities=[1, 1]), ["$.points[1].velocities", "no velocities; give them in all points"]),
        (MANY_NAMES, put(0, velocities=[1, 1]), ["$.points[1]: found a mapping, expected velocities", "$.points[3]"]),
        (MANY_NAMES, put(1, positions=[1, float("nan")]), ["$.points[1].positions[1]"]),
        (MANY_NAMES, put(1, positions=[1, float("inf")]), ["$.points[1].positions[1]"]),
        (MANY_NAMES, put(1, positions=[1, "2"]), ["$.points[1].positions[1]: found '2'"]),
        (MANY_NAMES, put(1, positions=[1, None]), ["$.points[1].positions[1]: found nothing"]),
        (MANY_NAMES, put(1, positoins=[1, 1]), ["$.points[1].positoins: unknown key", "mean positions"]),
        (MANY_NAMES, [{**p, "accelerations": [1, 1]} for p in POINTS], ["[0].accelerations", "needs velocities"]),
        (["a", "a"], POINTS, ["$.joint_names[1]: found 'a', expected another name"]),
        (["a", "\u202eb"], POINTS, ["U+202E"]),
        (["a", 2], POINTS, ["$.joint_names[1]: found 2"]),
        ("a", POINTS, ["$.joint_names"]),
    ],
)  # fmt: skip
def test_faults_of_messages(tmp_path: Path, names: Any, points: Any, wanted: list[str]) -> None:
    path = tmp_path / "x.json"
    text = json.dumps({"joint_names": names, "points": points}, indent=1)
    path.write_text(text.replace("NaN", ".nan").replace("Infinity", ".inf"))
    found = fault_of(path)
    for part in wanted:
        assert part in found


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("", "empty file"),
        ("---\n", "empty file"),
        ("[]", "expected a mapping that starts with"),
        ("{}", "the key modrob is missing"),
        ("trajectory: {trajectory: {trajectory: {trajectory: {trajectory: {trajectory: {points: []}}}}}}", "missing"),
        ("trajectory: 5", "the key modrob is missing"),
        ("trajectory: {joint_names: [a]}", "$.trajectory.points: required key is missing"),
        ("points: {}\n---\npoints: {}\n", "second document"),
        ("[" * 100000, "nesting deeper"),
        ("points: [" + "1," * 150000 + "]", "more than 100000 values"),
        ("points: &a [1, 2]\njoint_names: *b\n", "alias"),
        ("a: &a [x,x,x,x,x,x,x,x,x]\nb: &b [*a,*a,*a,*a,*a,*a,*a,*a,*a]\nc: &c [*b,*b,*b,*b,*b,*b,*b,*b,*b]\n"
         "d: &d [*c,*c,*c,*c,*c,*c,*c,*c,*c]\npoints: [*d,*d,*d,*d,*d,*d,*d,*d,*d,*d,*d,*d,*d]\n", "than 100000"),
        ("points: !!python/object/apply:os.system [x]", "tag"),
        ('{"points": [], "points": []}', "again"),
        ('{"points": [}', "not valid YAML"),
    ],
)  # fmt: skip
def test_hostile_texts(tmp_path: Path, text: str, wanted: str) -> None:
    for name in ("x.json", "x.yaml"):
        (tmp_path / name).write_text(text)
        assert wanted in fault_of(tmp_path / name)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("t,q1\n0,1\n", "found 1 samples, expected two or more"),
        ("t,q1\n", "found 0 samples"),
        ("", "empty file"),
        ("t\n0\n1\n", "columns q1"),
        ("t,q1,ddq1\n0,1,1\n1,1,1\n", "found no velocities"),
        ("t,q1,q3\n0,1,1\n1,1,1\n", "joints, expected 2"),
        ("t,dq1\n0,1\n1,1\n", "found no positions"),
        ("t,q.a,q.b,dq.a\n0,1,1,1\n1,1,1,1\n", "dq.b"),
        ("t,q1\n0,1\n0,2\n", ":3: column t: found 0.0, again the time"),
        ("t,q1\n1,1\n0,2\n", ":3: column t: found 0.0, earlier"),
        ("t,q1\n0,1\n1,nan\n", ":3: column q1: found 'nan', expected a finite number"),
        ("t,q1\n0,1\n1\n", ":3: found 1 columns"),
    ],
)
def test_faults_of_samples(tmp_path: Path, text: str, wanted: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text)
    assert wanted in fault_of(path)


def states(folder: Path, messages: list[dict[str, Any]]) -> Path:
    return write_samples(folder / "x.mcap", {"/joint_states": messages})


def test_faults_of_joint_states(tmp_path: Path) -> None:
    good = [state(k, "ab", (0, k), (1, 1)) for k in range(4)]

    def fault(index: int, **keys: Any) -> str:
        return fault_of(states(tmp_path, [{**m, **keys} if k == index else m for k, m in enumerate(good)]))

    assert "message 3 on '/joint_states': found 1 values of position for 2 joints" in fault(2, position=[1.0])
    assert "message 2 on '/joint_states': found position nan of b" in fault(1, position=[1.0, np.nan])
    assert "found velocities in some of the messages" in fault(3, velocity=[])
    assert "time goes back by 2 s" in fault(3, header=good[0]["header"])
    assert "found the joints a, c, b missing" in fault(2, name=["a", "c"])
    assert "twice" in fault(0, name=["a", "a"])
    assert "characters" in fault(0, name=["a", "b\x1b[31m"])
    assert "with one time stamp" in fault_of(states(tmp_path, good[:1] * 3))
    assert "found the joints (none)" in fault_of(states(tmp_path, [state(0, "", ()), state(1, "", ())]))


def test_topics(tmp_path: Path) -> None:
    stamps = np.arange(3, dtype=np.int64) * 10**9
    layout, plan = joint_state("ab", effort=False), joint_trajectory("ab", stamps)
    rows = [Series(topic, layout, stamps, np.arange(12.0).reshape(3, 4)) for topic in ("/one", "/two")]
    path = tmp_path / "x.mcap"
    write_mcap(path, rows)
    assert "found several topics of type sensor_msgs/msg/JointState: /one, /two; choose one" in fault_of(path)
    assert "found no messages on the topic '/three', but on /one, /two" in fault_of(path, topic="/three")
    assert load_trajectory(path, topic="/two").kind == "joint-states"
    write_mcap(path, [*rows, Series("/plan", plan, stamps[:1], np.zeros((1, 18)))])
    assert load_trajectory(path).kind == "joint-trajectory"
    assert load_trajectory(path, topic="/one").kind == "joint-states"
    write_mcap(path, [Series("/plan", plan, stamps[:2], np.zeros((2, 18)))])
    assert "found 2 trajectories on '/plan', expected one" in fault_of(path)
    write_mcap(path, [])
    assert "found no messages, expected messages of type trajectory_msgs" in fault_of(path)
    with pytest.raises(UsageError, match="--topic is for MCAP"):
        load_trajectory(as_csv(tmp_path, (Q,)), topic="/one")


def test_faults_inside_a_message_of_mcap(tmp_path: Path) -> None:
    stamps = np.array([0, 10**9, 10**9], dtype=np.int64)
    path = tmp_path / "x.mcap"
    write_mcap(path, [Series("/plan", joint_trajectory("ab", stamps), stamps[:1], np.zeros((1, 18)))])
    assert "$.points[2].time_from_start: found 1.0, expected more than the 1.0" in fault_of(path)


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    """Cut and flipped anywhere: a clear error, or the whole motion; never a traceback or another motion."""
    good = as_mcap(tmp_path, (Q, DQ, DDQ)).read_bytes()
    wanted = load_trajectory(tmp_path / "motion.mcap").trajectory.sample(np.linspace(0, 3, 31))
    path = tmp_path / "bad.mcap"
    rng = np.random.default_rng(5)
    for trial in range(200):
        place = int(rng.integers(len(good)))
        flipped = bytes([good[place] ^ (1 << int(rng.integers(8)))])
        path.write_bytes(good[:place] + (flipped + good[place + 1 :] if trial % 2 else b""))
        try:
            found = load_trajectory(path)
        except InputFileError:
            continue
        assert np.array_equal(found.trajectory.sample(np.linspace(0, 3, 31)), wanted)


def test_a_motion_of_which_a_part_is_lost_is_refused(tmp_path: Path) -> None:
    stamps = np.arange(4000, dtype=np.int64) * 10**6
    path = tmp_path / "x.mcap"
    write_mcap(path, [Series("/a", joint_state("ab"), stamps, np.random.default_rng(2).normal(size=(4000, 6)))])
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert "the file is damaged, and a motion has to be whole: the file ends in the middle" in fault_of(path)


def test_lengths_are_not_believed() -> None:
    stamps = np.arange(3, dtype=np.int64)
    (raw,) = joint_trajectory("ab", stamps).encode(stamps[:1], np.zeros((1, 18)))
    assert raw[20:24] == b"\x02\0\0\0"  # the number of names
    with pytest.raises(ValueError, match="a list runs past the end of the message"):
        decode_joint_trajectory(raw[:20] + b"\xff\xff\xff\x0f" + raw[24:])


def test_damaged_messages(tmp_path: Path) -> None:
    """Any bytes in the place of a message: ValueError or a message, at once."""
    stamps = np.arange(3, dtype=np.int64)
    rng = np.random.default_rng(6)
    for layout, decode in (
        (joint_trajectory("ab", stamps), decode_joint_trajectory),
        (joint_state("ab"), decode_state),
    ):
        (raw,) = layout.encode(stamps[:1], np.zeros((1, layout.width)))
        for _ in range(500):
            data = bytearray(raw[: int(rng.integers(len(raw) + 1))])
            for place in rng.integers(max(len(data), 1), size=int(rng.integers(4))):
                if data:
                    data[place] = int(rng.integers(256))
            try:
                decode(bytes(data))
            except ValueError:
                continue


def test_long_files_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joint_trajectory_csv, "MOST_POINTS", 4)
    monkeypatch.setattr(joint_trajectory_mcap, "MOST_POINTS", 4)
    assert "more than 4 samples" in fault_of(as_csv(tmp_path, (Q,)))
    assert "more than 4 messages" in fault_of(as_states(tmp_path, (Q,)))
    assert given_motion.MOST_POINTS >= 100_000


def test_paths_that_are_no_files(tmp_path: Path) -> None:
    for name in ("x.csv", "x.mcap", "x.json", "x.yaml"):
        assert "file not found" in fault_of(tmp_path / name)
        (tmp_path / f"folder-{name}").mkdir()
        assert "found a folder" in fault_of(tmp_path / f"folder-{name}")
        (tmp_path / name).write_bytes(b"\xff\xfe\x00garbage")
        assert fault_of(tmp_path / name)


def test_names_of_files_become_names_of_motions(tmp_path: Path) -> None:
    for stem, name in (("a b", "a_b"), ("..x", "x"), ("\u202eé", "trajectory"), ("m" * 90, "m" * 64)):
        path = as_csv(tmp_path, (Q,)).rename(tmp_path / f"{stem}.csv")
        assert load_trajectory(path).name == name


def test_points_that_do_not_fit() -> None:
    with pytest.raises(ShapeError):
        MotionPoints(T[:1], Q[:1])
    with pytest.raises(ShapeError):
        MotionPoints(T, Q, None, DDQ)
    with pytest.raises(ShapeError):
        MotionPoints(T, Q, DQ[:3])
