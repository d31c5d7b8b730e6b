"""Logs in temporary files: pieces of them, which files are long, what is not streamed, what goes wrong."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli.errors import OutputError
from modrob_cli.io.joint_publishers import jumps
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.long_jumps import JumpCounter
from modrob_cli.io.long_log import LongLog, is_long, open_long_log
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.model.log import JointLog
from tests.mcap_samples import CONTROLLER_STATE, JOINT_STATE, Form, cdr_topic, joint_state, point, write_topics

NAMES = ("a", "b")


def states(count: int, names: tuple[str, ...] = NAMES, start: float = 5.0) -> list[dict[str, Any]]:
    """Messages at 100 Hz."""
    n = len(names)
    return [joint_state(start + 0.01 * k, names, [0.01 * k] * n, [1.0] * n, [2.0 * k] * n) for k in range(count)]


def test_pieces_of_a_log_in_memory() -> None:
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.integers(1, 10, 50)) * 1e-3
    t = np.round(t - t[0], 9)
    q, dq, effort = rng.normal(size=(3, 50, 2))
    log = JointLog("log", NAMES, t, q, dq, effort, 3, ("a note",), 7_000_000_000)
    with LongLog.of(log) as long:
        assert (long.count, long.start, long.repeated, long.notes) == (50, 7_000_000_000, 3, ("a note",))
        for first, last in ((0, 50), (10, 20), (-5, 3), (45, 99), (50, 60), (20, 20), (30, 10)):
            piece = long.piece(first, last)
            span = slice(max(first, 0), max(last, 0))
            np.testing.assert_allclose(piece.t, t[span], rtol=1e-15)
            np.testing.assert_array_equal(piece.q, log.q[span])
            np.testing.assert_array_equal(long.times(first, last), piece.t)
        for time in (-1.0, 0.0, float(t[7]), float(t[7]) + 1e-9, float(t[-1]), 99.0):
            assert long.find(time) == np.searchsorted(long.times(0, 50), time)
        np.testing.assert_array_equal(long.largest, [np.abs(x).max() for x in (q, dq, effort)])


def test_a_log_without_velocities() -> None:
    t = np.array([0.0, 0.01, 0.02, 0.03, 0.04])
    with LongLog.of(JointLog("log", NAMES, t, np.ones((5, 2)), None, np.ones((5, 2)))) as long:
        assert not long.has_velocity
        assert long.piece(0, 3).dq is None
        assert np.isnan(long.largest[1])


def test_which_logs_are_long(tmp_path: Path) -> None:
    """Counted are the messages of the longest topic that may be about joints; without a summary bytes are."""
    clock = cdr_topic(
        "/clock",
        "std_msgs/msg/Header",
        [states(1)[0]["header"]] * 400,
        "builtin_interfaces/Time stamp\n"
        "string frame_id\n" + "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
    )
    path = write_topics(tmp_path / "log.mcap", [cdr_topic("/joint_states", JOINT_STATE, states(100)), clock])
    assert is_long(path, samples=100)
    assert not is_long(path, samples=101)
    path.write_bytes(path.read_bytes()[:-50])
    assert not is_long(path, samples=1)
    assert is_long(path, size=path.stat().st_size)
    csv = tmp_path / "log.csv"
    csv.write_text("t,q.a,effort.a\n" * 10)
    assert not is_long(csv, samples=1, size=1)
    assert not is_long(tmp_path / "missing.mcap", samples=1, size=1)
    assert not is_long(tmp_path, samples=1, size=1)


@pytest.mark.parametrize("window", [1, 30, 1000])
def test_joints_spread_over_messages_and_csv_are_read_whole(tmp_path: Path, window: int) -> None:
    one = cdr_topic(
        "/joint_states", JOINT_STATE, [x for k in range(50) for x in (states(50, ("a",))[k], states(50, ("b",))[k])]
    )
    spread = write_topics(tmp_path / "spread.mcap", [one])
    csv = tmp_path / "log.csv"
    csv.write_text("t,q.a,q.b,effort.a,effort.b\n0,1,2,3,4\n0.5,1,2,3,5\n1,1,2,3,4\n")
    for path in (spread, csv):
        whole = read_joint_log(path, NAMES)
        with open_long_log(path, NAMES, LogOptions(), window) as long:
            np.testing.assert_array_equal(long.piece(0, 99).effort, whole.effort)
            np.testing.assert_array_equal(long.times(0, 99), whole.t)
            assert (long.notes, long.repeated) == (whole.notes, whole.repeated)


def test_topics_of_higher_rank_are_given_up(tmp_path: Path) -> None:
    """The state of a controller comes first in the file, joint states later; the latter count."""
    part = point([0.1, 0.2], [0.0, 0.0], [1.0, 1.0])
    parts = dict.fromkeys(("reference", "feedback", "error", "output"), part)
    state = {"header": states(1)[0]["header"], "joint_names": list(NAMES), **parts, "speed_scaling_factor": 1.0}
    early = cdr_topic("/controller_state", CONTROLLER_STATE, [state] * 20)
    late = cdr_topic("/joint_states", JOINT_STATE, states(60))
    late.messages = [(10**6 + time, raw) for time, raw in late.messages]
    path = write_topics(tmp_path / "log.mcap", [early, late], Form(chunk_size=500))
    with open_long_log(path, NAMES, LogOptions(), 8) as long:
        assert long.count == 60


def test_no_room_for_the_temporary_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_topics(tmp_path / "log.mcap", [cdr_topic("/joint_states", JOINT_STATE, states(100))])
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    with pytest.raises(OutputError, match="set TMPDIR to a folder with more room"):
        open_long_log(path, NAMES, LogOptions())


def test_jumps_by_pieces() -> None:
    """Against the count over all messages, for pieces of any length."""
    rng = np.random.default_rng(2)
    for _ in range(50):
        q = rng.choice([0.0, 1.0, 1.05, np.nan], (200, 2), p=[0.6, 0.3, 0.08, 0.02])
        single = np.arange(200, dtype=np.intp)
        found, total = jumps(q, single, single)
        counter, first = JumpCounter(2), 0
        while first < 199:
            last = min(first + int(rng.integers(1, 40)), 199)
            counter.add(single[first:last], q[first:last], q[first + 1 : last + 1], q[first:last])
            first = last
        counter.add(single[-1:], q[-1:], q[-1:], q[-1:])
        assert (counter.found, counter.total) == (len(found), total)
        if len(found):
            assert counter.example is not None
            assert counter.example[0] == found[0]
            np.testing.assert_array_equal(counter.example[1], q[found[0] - 1 : found[0] + 2])
