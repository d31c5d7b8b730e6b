"""``modrob trajectory`` and ``modrob bounds`` with motions from other tools, and what they write for them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import Result

from modrob_cli.workflows import trajectory_mcap
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.trajectory_motion import load_trajectory

Modrob = Callable[..., Result]

ROOT = Path(__file__).parents[2]
MOTIONS = ["table-b1", "fourier-6", "sin2-2r", "spline-2r", "d-3-44"]
PLAN: dict[str, Any] = {
    "joint_names": ["j2", "j1"],
    "points": [
        {"positions": [0, 0], "velocities": [0, 0], "time_from_start": {"sec": 0, "nanosec": 0}},
        {"positions": [0.3, 0.1], "velocities": [0.5, 0.2], "time_from_start": {"sec": 1, "nanosec": 0}},
        {"positions": [0.4, 0.5], "velocities": [0, 0], "time_from_start": {"sec": 1, "nanosec": 500000000}},
    ],
}


@pytest.fixture
def plan(workspace: Path) -> Path:
    path = workspace / "plan.json"
    path.write_text(json.dumps(PLAN, indent=1))
    return path


@pytest.mark.parametrize("name", MOTIONS)
def test_what_is_written_is_read_back(modrob: Modrob, tmp_path: Path, name: str) -> None:
    """The curve through the samples has their positions, velocities and accelerations, so those of the motion."""
    source = ROOT / "trajectories" / f"{name}.yaml"
    assert modrob("trajectory", source, "--rate", 50, "-o", tmp_path).exit_code == 0
    there = load_trajectory(source).trajectory
    t = np.arange(int(there.duration * 50)) / 50
    for ending in ("csv", "mcap"):
        back = load_trajectory(tmp_path / f"{name}.{ending}")
        assert (back.detail, back.joint_names) == ("quintic", None)
        assert abs(back.trajectory.duration - there.duration) <= 1e-9  # messages have whole nanoseconds
        # Samples whose time is off by an ulp are on the curve between two samples, where hardly anything is lost.
        np.testing.assert_allclose(back.trajectory.sample(t, 2), there.sample(t, 2), rtol=0, atol=1e-9)


def test_samples_in_mcap_are_those_in_csv(modrob: Modrob, plan: Path, workspace: Path) -> None:
    """Read by rosbags; the joints have the names and the order of the robot."""
    from rosbags.highlevel import AnyReader

    robot = workspace / "planar.yaml"
    assert modrob("trajectory", plan, "--robot", robot, "--rate", 20, "-o", workspace / "out").exit_code == 0
    rows = np.loadtxt(workspace / "out" / "plan.csv", delimiter=",", skiprows=1)
    found: dict[str, list[Any]] = {}
    with AnyReader([workspace / "out" / "plan.mcap"]) as reader:
        for connection, stamp, raw in reader.messages():
            found.setdefault(connection.topic, []).append((stamp, reader.deserialize(raw, connection.msgtype)))
    states = found["/desired/joint_states"]
    np.testing.assert_array_equal([stamp for stamp, _ in states], np.rint(rows[:, 0] * 1e9))
    assert {tuple(state.name) for _, state in states} == {("j1", "j2")}
    np.testing.assert_array_equal([np.concatenate([s.position, s.velocity]) for _, s in states], rows[:, 1:5])
    ((_, motion),) = found["/joint_trajectory"]
    assert motion.joint_names == ["j1", "j2"]
    lists = [np.concatenate([p.positions, p.velocities, p.accelerations]) for p in motion.points]
    np.testing.assert_array_equal(lists, rows[:, 1:])
    times = [p.time_from_start.sec + p.time_from_start.nanosec / 1e9 for p in motion.points]
    np.testing.assert_allclose(times, rows[:, 0], rtol=1e-15)
    back = load_trajectory(workspace / "out" / "plan.mcap", load_robot(robot).robot)
    assert back.joint_names == ("j1", "j2")


def test_mcap_records_where_it_comes_from(modrob: Modrob, plan: Path, tmp_path: Path) -> None:
    from mcap.reader import make_reader

    from modrob_cli.io.outputs import sha256

    assert modrob("trajectory", plan, "-o", tmp_path / "out").exit_code == 0
    with (tmp_path / "out" / "plan.mcap").open("rb") as stream:
        records = {record.name: record.metadata for record in make_reader(stream).iter_metadata()}
    assert set(records["modrob"]) == {"version"}
    assert records["inputs"] == {"plan.json": f"sha256:{sha256(plan)}"}


def test_result_and_warnings(modrob: Modrob, plan: Path, workspace: Path) -> None:
    result = modrob("trajectory", plan, "-o", workspace / "out", "--json")
    assert result.exit_code == 0
    data = json.loads(result.stdout)
    assert (data["kind"], data["detail"], data["dof"]) == ("joint-trajectory", "cubic", 2)
    assert [joint["name"] for joint in data["joints"]] == ["j2", "j1"]
    (warning,) = data["warnings"]
    assert "the acceleration jumps at 1 of 1 inner points" in warning
    assert f"warning: {warning}" in result.stderr


@pytest.mark.parametrize(("formats", "files"), [("csv", ["csv"]), ("mcap", ["mcap"]), (" mcap, csv,", ["csv", "mcap"])])
def test_choice_of_formats(modrob: Modrob, plan: Path, tmp_path: Path, formats: str, files: list[str]) -> None:
    assert modrob("trajectory", plan, "--format", formats, "-o", tmp_path / "out").exit_code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "plan.png",
        "plan.trajectory.json",
        *(f"plan.{ending}" for ending in files),
    }


@pytest.mark.parametrize("formats", ["", ",", "csv,bag", "CSV"])
def test_formats_that_are_none(modrob: Modrob, plan: Path, tmp_path: Path, formats: str) -> None:
    result = modrob("trajectory", plan, "--format", formats, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert "--format" in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("rate", "wanted"), [(1e7, "at most 2000000 are possible"), (2e-3, "")])
def test_motions_that_mcap_cannot_hold(modrob: Modrob, plan: Path, tmp_path: Path, rate: float, wanted: str) -> None:
    result = modrob("trajectory", plan, "--rate", rate, "-o", tmp_path / "out")
    assert result.exit_code == (2 if wanted else 0)
    assert wanted in result.stderr
    slow = {**PLAN, "points": [{**p, "time_from_start": 2e9 * k} for k, p in enumerate(PLAN["points"])]}
    plan.write_text(json.dumps(slow))
    assert modrob("trajectory", plan, "--rate", 1e-9, "-o", tmp_path / "slow").exit_code == 2
    assert modrob("trajectory", plan, "--rate", 1e-9, "--format", "csv", "-o", tmp_path / "slow").exit_code == 0


def test_long_messages_are_left_out(
    modrob: Modrob, plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trajectory_mcap, "MOST_POINTS", 10)
    result = modrob("trajectory", plan, "-o", tmp_path / "out")
    assert result.exit_code == 0
    assert "warning: /joint_trajectory was left out" in result.stderr
    assert load_trajectory(tmp_path / "out" / "plan.mcap").kind == "joint-states"


@pytest.mark.parametrize("ending", ["csv", "mcap"])
def test_the_trajectory_itself_is_not_replaced(modrob: Modrob, plan: Path, tmp_path: Path, ending: str) -> None:
    assert modrob("trajectory", plan, "-o", tmp_path / "out").exit_code == 0
    source = tmp_path / "out" / f"plan.{ending}"
    before = source.read_bytes()
    result = modrob("trajectory", source, "-o", tmp_path / "out", "--overwrite")
    assert result.exit_code == 2
    assert "an output would replace it" in result.stderr
    assert source.read_bytes() == before


def test_bounds_takes_them_all(modrob: Modrob, plan: Path, workspace: Path) -> None:
    robot = workspace / "planar.yaml"
    assert modrob("trajectory", plan, "--robot", robot, "--rate", 40, "-o", workspace / "out").exit_code == 0
    wanted = None
    for source in (workspace / "out" / "plan.csv", plan, workspace / "out" / "plan.mcap"):
        rate = [] if source.suffix == ".csv" else ["--rate", 40]
        out = workspace / f"bounds-{source.suffix[1:]}"
        result = modrob("bounds", robot, source, *rate, "-o", out)
        assert result.exit_code == 0, result.stderr
        rows = np.loadtxt(out / "plan.bounds.csv", delimiter=",", skiprows=1)
        wanted = rows if wanted is None else wanted
        # Times of messages are rounded to ns; the torques change by less than 100 Nm/s.
        np.testing.assert_allclose(rows, wanted, rtol=0, atol=1e-7)


def test_bounds_names_joints_that_do_not_match(modrob: Modrob, plan: Path, workspace: Path) -> None:
    plan.write_text(plan.read_text().replace('"j2"', '"elbow"'))
    result = modrob("bounds", workspace / "planar.yaml", plan, "-o", workspace / "out")
    assert result.exit_code == 3
    assert "plan.json:2:2: $.joint_names: found the joints elbow, j1, expected j1, j2; missing: j2" in result.stderr
    assert "not in the robot: elbow" in result.stderr


def test_schema_knows_which_keys_a_kind_has(modrob: Modrob) -> None:
    """The rules of the schema agree with the reader on documents that have or lack one key."""
    schema = json.loads(modrob("schema", "trajectory").stdout)

    def allows(document: dict[str, Any]) -> bool:
        rules = [rule for rule in schema["allOf"] if rule["if"]["properties"]["kind"]["const"] == document["kind"]]
        assert len(rules) == 1
        then = rules[0]["then"]
        null = {key for key, part in then["properties"].items() if part == {"type": "null"}}
        assert null == set(then["properties"])
        return set(then["required"]) <= set(document) and not any(document.get(key) is not None for key in null)

    points: list[dict[str, Any]] = [{"t": 0, "q": [0]}, {"t": 1, "q": [1]}]
    sines: dict[str, Any] = {"duration": 1, "joints": [{}]}
    assert allows({"kind": "waypoints", "order": 5, "points": points})
    assert allows({"kind": "spline", "points": points, "order": None})
    assert not allows({"kind": "spline", "points": points, "order": 5})
    assert not allows({"kind": "waypoints", "points": points})
    assert allows({"kind": "sines", **sines, "base_frequency": 1})
    assert not allows({"kind": "sine-products", **sines, "base_frequency": 1, "factors": []})
    assert not allows({"kind": "sin2", "points": points, "velocity": [1]})
