"""Motions from messages, samples and recordings: the curve through them, the joints they are for, and their faults."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline, KroghInterpolator

from modrob_cli.arrays import Array
from modrob_cli.errors import InputFileError
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import joint_state, joint_trajectory
from modrob_cli.model.trajectory_points import MotionPoints
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.trajectory_motion import load_trajectory

NAMES = ("j2", "j1")
T = np.array([0.0, 0.75, 1.5, 2.0, 3.25])
_RNG = np.random.default_rng(11)
Q, DQ, DDQ = _RNG.normal(size=(3, len(T), 2))
DERIVATIVES = {"q": (Q,), "q, dq": (Q, DQ), "q, dq, ddq": (Q, DQ, DDQ)}

Lists = tuple[Array, ...]
Writer = Callable[[Path, Lists], Path]


def message(lists: Lists, time: Callable[[float], Any]) -> dict[str, Any]:
    """A JointTrajectory as plain data."""
    keys = ("positions", "velocities", "accelerations")
    points = [
        {
            **{key: rows[k].tolist() for key, rows in zip(keys, lists, strict=False)},
            **{key: [] for key in keys[len(lists) :]},
            "effort": [],
            "time_from_start": time(T[k]),
        }
        for k in range(len(T))
    ]
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    return {"header": header, "joint_names": list(NAMES), "points": points}


def ros2(t: float) -> dict[str, int]:
    return {"sec": int(t), "nanosec": round(t % 1.0 * 1e9)}


def ros1(t: float) -> dict[str, int]:
    return {"secs": int(t), "nsecs": round(t % 1.0 * 1e9)}


def as_yaml(folder: Path, lists: Lists) -> Path:
    """As ``ros2 topic echo --once`` prints it."""
    import yaml

    path = folder / "motion.yaml"
    path.write_text(yaml.safe_dump(message(lists, ros2), sort_keys=False) + "---\n")
    return path


def as_json(folder: Path, lists: Lists) -> Path:
    path = folder / "motion.json"
    path.write_text(json.dumps(message(lists, ros1), separators=(",", ":")))
    return path


def as_goal(folder: Path, lists: Lists) -> Path:
    """A goal of FollowJointTrajectory, as rosbridge sends it."""
    path = folder / "goal.json"
    goal = {"op": "send_action_goal", "args": {"trajectory": message(lists, lambda t: t), "goal_tolerance": []}}
    path.write_text(json.dumps(goal, indent="\t"))
    return path


def as_csv(folder: Path, lists: Lists) -> Path:
    path = folder / "motion.csv"
    header = [f"{kind}.{name}" for kind, _ in zip(("q", "dq", "ddq"), lists, strict=False) for name in NAMES]
    rows = np.column_stack([T + 7.5, *lists])  # times that begin elsewhere; exact in binary
    path.write_text("\n".join([",".join(["t", *header]), *(",".join(map(repr, row)) for row in rows.tolist())]))
    return path


def as_mcap(folder: Path, lists: Lists) -> Path:
    path = folder / "motion.mcap"
    stamps = np.rint(T * 1e9).astype(np.int64)
    layout = joint_trajectory(NAMES, stamps, velocities=len(lists) > 1, accelerations=len(lists) > 2)
    values = np.hstack(lists).reshape(1, -1)
    other = Series("/joint_states", joint_state(("x",)), stamps, np.zeros((len(T), 3)))
    write_mcap(path, [other, Series("/plan", layout, stamps[:1], values)])
    return path


def as_states(folder: Path, lists: Lists) -> Path:
    """Joint states on a topic, with another joint in between and a repeated message."""
    path = folder / "states.mcap"
    stamps = np.rint(T * 1e9).astype(np.int64) + 1_700_000_000_000_000_000
    rows = [np.insert(rows, 1, 9.0, axis=1) for rows in lists]
    layout = joint_state((NAMES[0], "gripper", NAMES[1]), velocity=len(lists) > 1, effort=False)
    again = np.repeat(np.arange(len(T)), [1, 2, 1, 1, 1])
    write_mcap(path, [Series("/joint_states", layout, stamps[again], np.hstack(rows)[again])])
    return path


WRITERS: list[Writer] = [as_yaml, as_json, as_goal, as_csv, as_mcap]
CASES = [(writer, kind) for writer in WRITERS for kind in DERIVATIVES] + [(as_states, "q"), (as_states, "q, dq")]


@pytest.fixture
def planar(workspace: Path) -> Any:
    """A robot with the joints j1 and j2, in this order; the files have j2 first."""
    return load_robot(workspace / "planar.yaml").robot


def reference(lists: Lists, j: int) -> Any:
    """The curve of column j, by scipy: value at times, order of the derivative."""
    if len(lists) == 1:
        return CubicSpline(T, lists[0][:, j], bc_type="clamped")
    if len(lists) == 2:
        return CubicHermiteSpline(T, lists[0][:, j], lists[1][:, j])
    pieces = [
        KroghInterpolator(
            np.repeat(T[k : k + 2], 3), np.concatenate([[rows[i, j] for rows in lists] for i in (k, k + 1)])
        )
        for k in range(len(T) - 1)
    ]
    return lambda t, order: np.array([pieces[int(np.searchsorted(T, x)) - 1].derivative(x, order) for x in t])


@pytest.mark.parametrize(("write", "kind"), CASES, ids=lambda value: getattr(value, "__name__", value))
def test_curve_of_every_kind_of_file(planar: Any, tmp_path: Path, write: Writer, kind: str) -> None:
    lists = DERIVATIVES[kind]
    loaded = load_trajectory(write(tmp_path, lists), planar)
    assert loaded.joint_names == planar.joint_names == ("j1", "j2")
    assert loaded.detail == {1: "cubic-spline", 2: "cubic", 3: "quintic"}[len(lists)]
    motion = loaded.trajectory
    assert motion.duration == T[-1]
    # Points are met, in the order of the robot: the second column is j1.
    for k, rows in enumerate(lists):
        for before in (False, True):
            met = np.stack([curve.derivative(T, k, before) for curve in motion.curves], axis=1)
            # Rounding of coefficients of about 10, divided by (0.5 s)^k; q to 1e-12.
            np.testing.assert_allclose(met, rows[:, ::-1], rtol=0, atol=1e-12 * 4.0**k)
    # Away from points each derivative is that of the one below, by central differences.
    h = 1e-4
    t = np.random.default_rng(1).uniform(h, T[-1] - h, 300)
    t = t[np.abs(t[:, None] - T).min(axis=1) > h]
    values, above, below = motion.sample(t), motion.sample(t + h), motion.sample(t - h)
    for k in range(4):
        slope = (above[:, k] - below[:, k]) / (2.0 * h)
        scale = np.abs(values[:, : k + 2]).max() + np.abs(values[:, -1]).max()
        np.testing.assert_allclose(values[:, k + 1], slope, rtol=0, atol=1e-5 * scale)
        # Rounding: coefficients of about 100 divided by (0.5 s)^k, angles of scipy's own.
        for j in range(2):
            wanted = reference(lists, 1 - j)(t, k)
            np.testing.assert_allclose(values[:, k, j], wanted, rtol=0, atol=1e-11 * 10.0**k)


def test_positions_alone_give_a_smooth_motion_at_rest_at_both_ends(tmp_path: Path) -> None:
    curve = load_trajectory(as_csv(tmp_path, (Q,))).trajectory.curves[0]
    inner = T[1:-1]
    for k in (1, 2):
        np.testing.assert_allclose(curve.derivative(inner, k, before=True), curve.derivative(inner, k), atol=1e-12)
    ends = np.array([0.0, T[-1]])
    np.testing.assert_allclose(curve.derivative(ends, 1), 0.0, atol=1e-14)
    two = MotionPoints(np.array([0.0, 2.0]), np.array([[1.0], [2.0]])).curves()[0]
    # The rest-to-rest cubic 3 s^2 - 2 s^3: half way at 1.5 times the mean velocity.
    assert two.derivative(np.array([1.0]), 0)[0] == 1.5
    assert two.derivative(np.array([1.0]), 1)[0] == 0.75


def warnings_of(folder: Path, lists: Lists) -> str:
    return "\n".join(load_trajectory(as_yaml(folder, lists)).warnings)


def test_jumps_of_acceleration_are_said(tmp_path: Path) -> None:
    still = DQ.copy()
    still[[0, -1]] = 0.0
    text = warnings_of(tmp_path, (Q, still))
    curves = [CubicHermiteSpline(T, Q[:, j], still[:, j]) for j in range(2)]
    sizes = np.array([[abs(c(t + 1e-9, 2) - c(t - 1e-9, 2)) for c in curves] for t in T[1:-1]])
    k, j = np.unravel_index(sizes.argmax(), sizes.shape)
    assert "the acceleration jumps at 3 of 3 inner points" in text
    assert f"by {sizes[k, j]:.4g} /s^2 of {NAMES[j]} at t = {T[1 + k]:g} s" in text
    assert "begins" not in text
    assert warnings_of(tmp_path, (Q,)) == ""
    assert warnings_of(tmp_path, (Q, still, DDQ)) == ""
    assert "begins while joints move" in warnings_of(tmp_path, (Q, DQ, DDQ))
    assert "ends while joints move" in warnings_of(tmp_path, (Q, DQ, DDQ))


def test_samples_of_a_smooth_motion_are_no_jumps() -> None:
    t = np.arange(0.0, 2.0, 0.01)
    q, dq = np.sin(3.0 * t)[:, None], 3.0 * np.cos(3.0 * t)[:, None]
    points = MotionPoints(t, q, dq)
    assert not [text for text in points.warnings(points.curves()) if "jumps" in text]


def test_positions_of_a_motion_that_does_not_begin_at_rest(tmp_path: Path) -> None:
    t = np.arange(0.0, 2.0, 0.01)
    for q, words in ((np.sin(3.0 * t), "begin and end at rest"), (np.cos(np.pi * t / 1.99), "")):
        points = MotionPoints(t, np.stack([0.0 * t, q], axis=1), joint_names=("still", "moving"))
        text = "\n".join(points.warnings(points.curves()))
        assert (words in text) if words else not text
        assert "still" not in text


def test_what_was_changed_is_said(tmp_path: Path) -> None:
    assert "times are counted from there" in "\n".join(load_trajectory(as_csv(tmp_path, (Q,))).warnings)
    assert "1 messages that repeat" in "\n".join(load_trajectory(as_states(tmp_path, (Q,))).warnings)
    path = as_json(tmp_path, (Q,))
    path.write_text(path.read_text().replace('"effort":[]', '"effort":[1,2]'))
    assert load_trajectory(path).warnings == ("the effort in the points is not used",)


def test_points_without_names_go_by_order(planar: Any, tmp_path: Path) -> None:
    path = as_json(tmp_path, (Q,))
    path.write_text(path.read_text().replace('"joint_names":["j2","j1"]', '"joint_names":[]'))
    loaded = load_trajectory(path, planar)
    assert loaded.joint_names is None
    np.testing.assert_allclose(loaded.trajectory.sample(T, 0)[:, 0], Q, rtol=0, atol=1e-12)


@pytest.mark.parametrize("write", [as_yaml, as_goal, as_csv, as_mcap, as_states])
def test_joints_of_another_robot(planar: Any, workspace: Path, write: Writer) -> None:
    other = workspace / "other.yaml"
    other.write_text((workspace / "planar.yaml").read_text().replace("name: j1", "name: shoulder"))
    with pytest.raises(InputFileError) as caught:
        load_trajectory(write(workspace, (Q,)), load_robot(other).robot)
    assert "shoulder" in str(caught.value)
    assert re.search("missing|joints j2, j1|joints j1, j2", str(caught.value))
    loaded = load_trajectory(write(workspace, (Q,)))
    if write is not as_states:
        assert loaded.joint_names == NAMES
        with pytest.raises(InputFileError, match="expected 2 as the robot planar has: j1, j2"):
            loaded.check_joints(planar)
    else:
        assert loaded.joint_names == ("j2", "gripper", "j1")
