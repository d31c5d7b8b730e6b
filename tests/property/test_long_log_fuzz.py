"""Logs read piece by piece against the same logs read whole: equal samples and notes, or equal errors."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli.errors import InputFileError, ModrobError
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.long_log import open_long_log
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.model.log import JointLog
from tests.mcap_samples import JOINT_STATE, Form, Topic, cdr_topic, joint_state, write_topics
from tests.property.test_log_fuzz import damaged
from tests.unit.io.test_log_kinds import KINDS

NAMES = ("a", "b", "c")
Rng = np.random.Generator
Messages = list[dict[str, Any]]
STEP = 0.01


def motion(rng: Rng, count: int) -> Messages:
    """Messages of a slow motion, evenly in time."""
    phase = rng.uniform(0.0, 6.0, 3)
    return [
        joint_state(100.0 + STEP * k, NAMES, np.sin(0.05 * k + phase), np.cos(0.05 * k + phase), rng.normal(size=3))
        for k in range(count)
    ]


def set_time(message: dict[str, Any], seconds: float) -> None:
    """Give a message another stamp."""
    nanoseconds = round(seconds * 1e9)
    message["header"]["stamp"] = {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}


def time_of(message: dict[str, Any]) -> float:
    """The stamp of a message, [s]."""
    stamp = message["header"]["stamp"]
    return float(stamp["sec"] + 1e-9 * stamp["nanosec"])


def late(rng: Rng, messages: Messages) -> None:
    """Some messages come after others, by up to 0.1 s, or some more."""
    for k in rng.integers(0, len(messages) - 12, 4):
        shift = int(rng.integers(1, 11 if rng.random() < 0.9 else 12))
        messages.insert(k + shift, messages.pop(k))


def repeated(rng: Rng, messages: Messages) -> None:
    """Some stamps come twice, next to one another or a little apart."""
    for k in rng.integers(8, len(messages), 4):
        set_time(messages[k], time_of(messages[k - int(rng.integers(1, 8))]))


def strayed(rng: Rng, messages: Messages) -> None:
    """Some stamps are far off; the first and the last one too."""
    for k in (0, len(messages) - 1, *rng.integers(1, len(messages), 2)):
        if rng.random() < 0.5:
            set_time(messages[k], float(rng.uniform(1.0, 300.0)))


def missing(rng: Rng, messages: Messages) -> None:
    """Some values are missing."""
    for k in rng.integers(0, len(messages), 5):
        key = str(rng.choice(["position", "velocity", "effort"]))
        messages[k][key] = [float("nan"), *messages[k][key][1:]] if rng.random() < 0.5 else []


def without_velocities(rng: Rng, messages: Messages) -> None:
    """No velocity is recorded at all."""
    for message in messages:
        message["velocity"] = []


def shuffled(rng: Rng, messages: Messages) -> None:
    """The order of the joints, or the frame, changes for a while."""
    first = int(rng.integers(0, len(messages)))
    for message in messages[first : first + int(rng.integers(1, 40))]:
        for key in ("name", "position", "velocity", "effort"):
            message[key] = message[key][::-1]


def second_publisher(rng: Rng, messages: Messages) -> None:
    """Another arm speaks in between, with another frame or without; few or many times."""
    frame = str(rng.choice(["", "other"]))
    every = int(rng.choice([2, 3, 60]))
    for k in range(1, len(messages), every):
        messages[k]["position"] = [x + 2.0 for x in messages[k]["position"]]
        messages[k]["header"]["frame_id"] = frame


def gap(rng: Rng, messages: Messages) -> None:
    """A stretch is missing."""
    first = int(rng.integers(1, len(messages) - 1))
    del messages[first : first + 20]


def partial(rng: Rng, messages: Messages) -> None:
    """Some messages tell about two joints only."""
    for k in rng.integers(0, len(messages), 3):
        for key in ("name", "position", "velocity", "effort"):
            messages[k][key] = messages[k][key][:2]


TROUBLES: list[Callable[[Rng, Messages], None]] = [
    late,
    repeated,
    strayed,
    missing,
    without_velocities,
    shuffled,
    second_publisher,
    gap,
    partial,
]


def read_whole(path: Path, options: LogOptions, names: tuple[str, ...]) -> tuple[JointLog | None, ModrobError | None]:
    """The log, or why there is none."""
    try:
        return read_joint_log(path, names, options=options), None
    except ModrobError as error:
        return None, error


def compare(path: Path, options: LogOptions, window: int, names: tuple[str, ...] = NAMES) -> bool:
    """Read both ways; True if there is a log, False if there is an error."""
    whole, problem = read_whole(path, options, names)
    if whole is None:
        assert problem is not None
        with pytest.raises(type(problem)) as found:
            open_long_log(path, names, options, window)
        assert str(found.value) == str(problem)
        return False
    with open_long_log(path, names, options, window) as long:
        assert (long.name, long.joint_names, long.count) == (whole.name, whole.joint_names, len(whole.t))
        assert (long.start, long.duration, long.repeated) == (whole.start, whole.t[-1], whole.repeated)
        assert long.notes == whole.notes
        assert long.has_velocity == (whole.dq is not None)
        piece = long.piece(0, long.count)
        for key in ("t", "q", "dq", "effort"):
            np.testing.assert_array_equal(getattr(piece, key), getattr(whole, key), err_msg=key)
        assert long.largest[2] == np.abs(whole.effort).max()
        middle = float(whole.t[len(whole.t) // 2])
        assert long.find(middle) == len(whole.t) // 2
        part = long.piece(3, len(whole.t) + 5)
        np.testing.assert_array_equal(part.t, whole.t[3:])
    return True


@pytest.mark.parametrize("seed", range(60))
def test_troubled_logs_of_one_channel(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    messages = motion(rng, int(rng.integers(60, 200)))
    for k in rng.choice(len(TROUBLES) - 1, int(rng.integers(0, 4)), replace=False):
        TROUBLES[k](rng, messages)
    if rng.random() < 0.1:
        partial(rng, messages)
    topic = cdr_topic("/joint_states", JOINT_STATE, messages)
    path = write_topics(tmp_path / "log.mcap", [topic], Form(chunk_size=int(rng.choice([300, 2000, 20000]))))
    for publisher in (None, 1, 2):
        for time in ("header", "log"):
            options = LogOptions(time=time, publisher=publisher)
            compare(path, options, int(rng.integers(1, 50)))


@pytest.mark.parametrize("seed", range(12))
def test_several_channels_and_topics(tmp_path: Path, seed: int) -> None:
    """Two channels of one topic, at the same time or after one another; and a topic of another kind before them."""
    rng = np.random.default_rng(seed)
    topics: list[Topic] = []
    for k in range(2):
        one = cdr_topic("/joint_states" if rng.random() < 0.8 else "/others", JOINT_STATE, motion(rng, 50))
        shift = int(rng.choice([0, 7, 60_000]))
        topics.append(Topic(one.topic, one.kind, [(t + k * shift, raw) for t, raw in one.messages], schema=one.schema))
    path = write_topics(tmp_path / "log.mcap", topics, Form(chunk_size=1000))
    for publisher in (None, 1, 2, 3):
        compare(path, LogOptions(publisher=publisher), 8)
        compare(path, LogOptions(topic="/joint_states", time="log", publisher=publisher), 8)


@pytest.mark.parametrize("kind", list(KINDS))
def test_damaged_logs_of_every_kind(tmp_path: Path, kind: str) -> None:
    """The same bytes are broken as in the test of the whole reader; what is left is the same either way."""
    raw = write_topics(tmp_path / "good.mcap", [KINDS[kind]()], Form("NONE", 1000, checksums=False)).read_bytes()
    rng = np.random.default_rng(5)
    path = tmp_path / "bad.mcap"
    path.write_bytes(raw)
    assert compare(path, LogOptions(), 4, ("a", "b"))
    read = 0
    for _ in range(20):
        path.write_bytes(damaged(raw, rng))
        read += compare(path, LogOptions(time="log"), 4, ("a", "b"))
    assert read > 5


def test_errors_name_the_file(tmp_path: Path) -> None:
    for raw in (b"", b"nothing", b"\x89MCAP0\r\n"):
        path = tmp_path / "log.mcap"
        path.write_bytes(raw)
        with pytest.raises(InputFileError) as found:
            open_long_log(path, NAMES, LogOptions())
        assert str(path) in str(found.value)
