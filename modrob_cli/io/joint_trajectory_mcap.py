"""Motions from MCAP files: a ``trajectory_msgs/msg/JointTrajectory``, or positions of ``sensor_msgs/msg/JointState``.

A motion has to be whole: a file that is damaged anywhere is refused.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.given_motion import MOST_POINTS, GivenMotion
from modrob_cli.io.joint_trajectory import read_joint_trajectory
from modrob_cli.io.joint_trajectory_cdr import StateMessage, decode_joint_trajectory, decode_state
from modrob_cli.io.mcap_records import McapFile
from modrob_cli.io.yaml_builder import shorten
from modrob_cli.io.yaml_loader import YamlDocument
from modrob_cli.model.trajectory_points import MotionPoints
from modrob_cli.schema.base import JOINT_NAME

TRAJECTORY, STATE = "trajectory_msgs/msg/JointTrajectory", "sensor_msgs/msg/JointState"


def read_motion_mcap(path: Path, joint_names: Sequence[str] | None, topic: str | None) -> GivenMotion:
    """Points of the motion on one topic.

    Parameters
    ----------
    joint_names : joints of the robot; a topic with joint states may have more. None: those that the file names.
    topic : which one; None: the only one with trajectories or, if there is none, the only one with joint states

    Raises
    ------
    InputFileError
        If the file cannot be read or is damaged, has no such topic or several, or its messages make no motion.
    """
    messages = _Messages(path)
    messages.read()
    kind, name = messages.choose(topic)
    raw = messages.found[kind][name]
    if kind == STATE:
        return _motion_of_states(path, name, raw, joint_names)
    if len(raw) > 1:
        raise _error(path, f"found {len(raw)} trajectories on {shorten(name)}, expected one; cut the recording")
    try:
        data = decode_joint_trajectory(raw[0])
    except ValueError as error:
        raise _error(path, f"the message on {shorten(name)} is not a {TRAJECTORY}: {error}") from error
    return read_joint_trajectory(YamlDocument(str(path), data, {}), ())


def _error(path: Path, message: str) -> InputFileError:
    return InputFileError(Fault(str(path), message))


@dataclass
class _Messages:
    """Messages of the two kinds by topic, in the order of the file."""

    path: Path
    found: dict[str, dict[str, list[bytes]]] = field(default_factory=lambda: {TRAJECTORY: {}, STATE: {}})
    others: set[str] = field(default_factory=set)

    def read(self) -> None:
        """Read the whole file.

        Raises
        ------
        InputFileError
            If it cannot be read, is damaged, or has too many messages on a topic.
        """
        file = McapFile(self.path)
        for block in file.blocks():
            for number in np.unique(block.channels).tolist():
                into = self._list_of(file, number)
                if into is None:
                    continue
                mine = block.channels == number
                places = zip(block.starts[mine].tolist(), block.lengths[mine].tolist(), strict=True)
                into.extend(block.data[start : start + length] for start, length in places)
                if len(into) > MOST_POINTS:
                    raise _error(self.path, f"found more than {MOST_POINTS} messages on one topic; cut the recording")
        if file.damage:
            reasons = "; ".join(file.sentences())
            raise _error(self.path, f"the file is damaged, and a motion has to be whole: {reasons}")

    def _list_of(self, file: McapFile, number: int) -> list[bytes] | None:
        """Messages so far of the topic of a channel, if it is of a kind that is wanted."""
        channel = file.channels.get(number)
        schema = file.schemas.get(channel.schema) if channel is not None else None
        if channel is None or schema is None or channel.encoding != "cdr" or schema.name not in self.found:
            name = f"{channel.topic} ({schema.name if schema else 'no schema'})" if channel else f"channel {number}"
            self.others.add(name)
            return None
        return self.found[schema.name].setdefault(channel.topic, [])

    def choose(self, topic: str | None) -> tuple[str, str]:
        """Kind and name of the topic to use.

        Raises
        ------
        InputFileError
            If there is none or a choice.
        """
        for kind, topics in self.found.items():
            if topic in topics:
                return kind, str(topic)
            if topic is None and len(topics) == 1:
                return kind, next(iter(topics))
            if topic is None and topics:
                what = f"found several topics of type {kind}: {_list(topics)}"
                raise _error(self.path, f"{what}; choose one with --topic")
        usable = [name for topics in self.found.values() for name in topics]
        if usable:
            raise _error(self.path, f"found no messages on the topic {shorten(str(topic))}, but on {_list(usable)}")
        wanted = f"expected messages of type {TRAJECTORY} or {STATE} (cdr)"
        raise _error(self.path, f"found {_list(self.others) or 'no messages'}, {wanted}")


def _list(names: Sequence[str] | set[str] | dict[str, list[bytes]]) -> str:
    return ", ".join(shorten(name)[1:-1] for name in sorted(names))


def _motion_of_states(path: Path, topic: str, raw: list[bytes], joint_names: Sequence[str] | None) -> GivenMotion:
    """Samples of the wanted joints; messages about other joints only are left out, so are repeated times."""
    states = []
    for index, data in enumerate(raw, start=1):
        try:
            states.append(decode_state(data))
        except ValueError as error:
            raise _error(path, f"message {index} on {shorten(topic)} is not a {STATE}: {error}") from error
    wanted = tuple(joint_names) if joint_names is not None else states[0].names
    rows = [(index, state) for index, state in enumerate(states, start=1) if set(wanted) & set(state.names)]
    if not rows:
        named = _list({name for state in states for name in state.names})
        raise _error(path, f"found the joints {named or '(none)'} on {shorten(topic)}, expected {', '.join(wanted)}")
    stamps = np.array([state.stamp for _, state in rows], dtype=np.int64)
    steps = np.diff(stamps)
    if (steps < 0).any():
        k = int(np.argmax(steps < 0)) + 1
        message = f"message {rows[k][0]} on {shorten(topic)}: time goes back by {-steps[k - 1] / 1e9:.6g} s"
        raise _error(path, f"{message}; expected times that increase")
    keep = np.concatenate([[True], steps > 0])
    kept = [row for row, good in zip(rows, keep, strict=True) if good]
    if len(kept) < 2:
        message = f"found {len(rows)} messages on {shorten(topic)} with one time stamp"
        raise _error(path, f"{message}, expected two or more with times that increase")
    columns = _Columns(path, topic, wanted)
    q = np.stack([columns.values(index, state, state.positions, "position") for index, state in kept])
    velocities = {bool(len(state.velocities)) for _, state in kept}
    if len(velocities) == 2:
        raise _error(
            path, f"found velocities in some of the messages on {shorten(topic)}, expected them in all or none"
        )
    dq = (
        np.stack([columns.values(k, state, state.velocities, "velocity") for k, state in kept])
        if True in velocities
        else None
    )
    times = (stamps[keep] - stamps[0]) / 1e9
    left = len(rows) - len(kept)
    notes = (f"{left} messages that repeat the time of the one before were left out",) if left else ()
    return GivenMotion(MotionPoints(times, q, dq, None, wanted), "joint-states", Fault(str(path), ""), notes)


class _Columns:
    """Finds the wanted joints in every message."""

    def __init__(self, path: Path, topic: str, wanted: tuple[str, ...]) -> None:
        self.path, self.topic, self.wanted = path, topic, wanted
        self._places: dict[tuple[str, ...], list[int]] = {}

    def values(self, index: int, state: StateMessage, values: Array, what: str) -> Array:
        """Values of the wanted joints in message ``index``, shape (n,)."""
        place = f"message {index} on {shorten(self.topic)}"
        if len(values) != len(state.names):
            found = f"found {len(values)} values of {what} for {len(state.names)} joints"
            raise _error(self.path, f"{place}: {found}, expected one for each")
        if state.names not in self._places:
            strange = [name for name in state.names if not re.match(JOINT_NAME, name) or state.names.count(name) > 1]
            if strange:
                message = f"found the joint name {shorten(strange[0])} twice, or with characters that names do not have"
                raise _error(self.path, f"{place}: {message}")
            missing = [name for name in self.wanted if name not in state.names]
            if missing:
                found = f"found the joints {_list(state.names)}, {_list(missing)} missing"
                raise _error(self.path, f"{place}: {found}; give log and robot the same names")
            self._places[state.names] = [state.names.index(name) for name in self.wanted]
        out = values[self._places[state.names]]
        if not np.isfinite(out).all():
            j = int(np.argmin(np.isfinite(out)))
            raise _error(self.path, f"{place}: found {what} {out[j]} of {self.wanted[j]}, expected a finite number")
        return out
