"""``modrob trajectory`` as a user runs it."""

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import Result

from modrob_cli.arrays import Array

Modrob = Callable[..., Result]

ROOT = Path(__file__).parents[2]
TABLE_B1 = ROOT / "trajectories" / "table-b1.yaml"
MOVE = """\
modrob: trajectory/1
name: move
kind: waypoints
order: 5
points:
- {t: 0, q: [0, 0]}
- {t: 1, q: [1, 0.5]}
"""


def read_csv(path: Path) -> tuple[list[str], Array]:
    with path.open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    return header, np.array(rows, dtype=float)


def with_limits(workspace: Path, limits: str) -> Path:
    path = workspace / "planar.yaml"
    path.write_text(path.read_text().replace("dh: {a: 0.5}", f"dh: {{a: 0.5}}, limits: {limits}"))
    return path


@pytest.fixture
def move(workspace: Path) -> Path:
    path = workspace / "move.yaml"
    path.write_text(MOVE)
    return path


def test_files_and_result(modrob: Modrob, tmp_path: Path) -> None:
    result = modrob("trajectory", TABLE_B1, "--rate", 50, "-o", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.stderr
    header, rows = read_csv(tmp_path / "out" / "table-b1.csv")
    assert header == ["t", *(f"{kind}{j}" for kind in ("q", "dq", "ddq") for j in range(1, 7))]
    assert rows.shape == (901, 19)
    np.testing.assert_array_equal(rows[:, 0], np.arange(901) / 50)
    # Joint 1 of Table B.1: from 0 to -pi/2 in the first 3 s; half way at 1.5 s with 15/8 of the mean velocity.
    np.testing.assert_allclose(rows[75, [1, 7]], [-np.pi / 4, -15 / 8 * np.pi / 6], rtol=1e-14)
    np.testing.assert_allclose(rows[75, 13], 0.0, atol=1e-14)
    data = json.loads(result.stdout)
    assert (data["trajectory"], data["kind"], data["dof"]) == ("table-b1", "waypoints", 6)
    assert (data["duration"], data["rate"], data["samples"]) == (18.0, 50.0, 901)
    assert (data["robot"], data["within_limits"], data["violations"]) == (None, None, [])
    first = data["joints"][0]["velocity"]
    # From -pi/4 at 9 s ... the fastest move of joint 1 is 5 pi/8 in 3 s.
    assert first["max"] == pytest.approx(15 / 8 * 5 * np.pi / 8 / 3, rel=1e-12)
    assert first["max_time"] == pytest.approx(4.5, abs=1e-7)
    assert set(data["files"]) == {"samples", "mcap", "picture", "json"}
    stored = json.loads((tmp_path / "out" / "table-b1.trajectory.json").read_text())
    assert stored == {key: value for key, value in data.items() if key != "files"}
    assert (tmp_path / "out" / "table-b1.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("rate", "times"),
    [
        (4, [0, 0.25, 0.5, 0.75, 1]),
        (3, [0, 1 / 3, 2 / 3, 1]),
        (0.3, [0, 1]),
        (1.5, [0, 1 / 1.5, 1]),
        (1e-9, [0, 1]),
    ],
)
def test_times_begin_at_zero_and_end_at_the_end(
    modrob: Modrob, move: Path, tmp_path: Path, rate: float, times: list[float]
) -> None:
    assert modrob("trajectory", move, "--rate", rate, "-o", tmp_path / "out").exit_code == 0
    np.testing.assert_array_equal(read_csv(tmp_path / "out" / "move.csv")[1][:, 0], times)


def test_bounds_reads_the_samples_or_the_document(modrob: Modrob, move: Path, workspace: Path) -> None:
    robot = workspace / "planar.yaml"
    assert modrob("trajectory", move, "-o", workspace / "out", "--rate", 30).exit_code == 0
    sampled = modrob("bounds", robot, workspace / "out" / "move.csv", "-o", workspace / "a", "--json")
    direct = modrob("bounds", robot, move, "--rate", 30, "-o", workspace / "b", "--json")
    assert (sampled.exit_code, direct.exit_code) == (0, 0), direct.stderr
    assert (workspace / "a" / "move.bounds.csv").read_bytes() == (workspace / "b" / "move.bounds.csv").read_bytes()
    first, second = json.loads(sampled.stdout), json.loads(direct.stdout)
    assert (first["rate"], second["rate"]) == (None, 30.0)
    assert first["joints"] == second["joints"]
    assert "move.yaml" in second["provenance"]["inputs"]


def test_bounds_refuses_what_does_not_fit(modrob: Modrob, move: Path, workspace: Path) -> None:
    robot = workspace / "planar.yaml"
    result = modrob("bounds", robot, TABLE_B1, "-o", workspace / "b")
    assert result.exit_code == 3
    assert "found a motion of 6 joints, expected 2 as the robot planar has" in result.stderr
    assert modrob("trajectory", move, "-o", workspace / "out").exit_code == 0
    result = modrob("bounds", robot, workspace / "out" / "move.csv", "--rate", 10, "-o", workspace / "b")
    assert result.exit_code == 2
    assert "--rate is for trajectory documents" in result.stderr
    assert not (workspace / "b").exists()


def test_within_limits(modrob: Modrob, move: Path, workspace: Path) -> None:
    robot = with_limits(workspace, "{position: 1, velocity: 1.875, acceleration: 5.7735027, jerk: 60}")
    result = modrob("trajectory", move, "--robot", robot, "-o", workspace / "out", "--json")
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    assert (data["robot"], data["within_limits"], data["limits_checked"]) == ("planar", True, 4)
    assert data["joints"][1]["unit"] == "rad"
    assert "within all 4 limits of planar" in result.stderr


def test_exceeded_limits_are_written_and_said(modrob: Modrob, move: Path, workspace: Path) -> None:
    robot = with_limits(workspace, "{position: [0, 0.5], velocity: 1.5, acceleration: 6, jerk: [-29, 61]}")
    result = modrob("trajectory", move, "--robot", robot, "-o", workspace / "out", "--json", "--rate", 7)
    assert result.exit_code == 4
    found: list[dict[str, Any]] = json.loads(result.stdout)["violations"]
    assert [(v["joint"], v["quantity"]) for v in found] == [("j1", key) for key in ("position", "velocity", "jerk")]
    # Peaks of the unit move: 1 at its end, 15/8 and jerk -30 half way, whatever the rate of the samples is.
    assert [v["value"] for v in found] == pytest.approx([1.0, 1.875, -30.0])
    assert [v["time"] for v in found] == pytest.approx([1.0, 0.5, 0.5], abs=1e-7)
    assert [v["excess"] for v in found] == pytest.approx([0.5, 0.375, 1.0])
    assert [v["unit"] for v in found] == ["rad", "rad/s", "rad/s^3"]
    assert "j1: velocity 1.875 rad/s at t = 0.5 s, 0.375 outside of -1.5 .. 1.5" in result.stderr
    assert sorted(path.name for path in (workspace / "out").iterdir()) == [
        "move.csv",
        "move.mcap",
        "move.png",
        "move.trajectory.json",
    ]


def test_robot_without_limits(modrob: Modrob, move: Path, workspace: Path) -> None:
    result = modrob("trajectory", move, "--robot", workspace / "planar.yaml", "-o", workspace / "out", "--json")
    assert result.exit_code == 0
    assert json.loads(result.stdout)["within_limits"] is None
    assert "nothing was checked" in result.stderr


def test_joints_that_do_not_match(modrob: Modrob, workspace: Path) -> None:
    result = modrob("trajectory", TABLE_B1, "--robot", workspace / "planar.yaml", "-o", workspace / "out")
    assert result.exit_code == 3
    assert "table-b1.yaml:6:1: $.points: found a motion of 6 joints, expected 2 as the robot planar has: j1, j2" in (
        result.stderr
    )
    assert not (workspace / "out").exists()


@pytest.mark.parametrize("rate", ["0", "-1", "nan", "inf", "1e12"])
def test_rates_that_make_no_sense(modrob: Modrob, move: Path, tmp_path: Path, rate: str) -> None:
    result = modrob("trajectory", move, f"--rate={rate}", "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert "--rate" in result.stderr
    assert not (tmp_path / "out").exists()


def test_values_beyond_the_range_of_numbers(modrob: Modrob, tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(MOVE.replace("1, 0.5", "1e300, 0.5").replace("t: 1,", "t: 1e-9,"))
    result = modrob("trajectory", path, "-o", tmp_path / "out")
    assert result.exit_code == 5
    assert "beyond the range" in result.stderr
    assert not (tmp_path / "out").exists()


def test_existing_files_are_kept(modrob: Modrob, move: Path, tmp_path: Path) -> None:
    assert modrob("trajectory", move, "-o", tmp_path / "out").exit_code == 0
    before = (tmp_path / "out" / "move.csv").read_bytes()
    assert modrob("trajectory", move, "-o", tmp_path / "out", "--rate", 10).exit_code == 6
    assert (tmp_path / "out" / "move.csv").read_bytes() == before
    assert modrob("trajectory", move, "-o", tmp_path / "out", "--rate", 10, "--overwrite").exit_code == 0
    assert (tmp_path / "out" / "move.csv").read_bytes() != before


def test_same_input_same_bytes(modrob: Modrob, move: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        assert modrob("trajectory", move, "-o", tmp_path / name).exit_code == 0
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


def test_faults_have_their_place(modrob: Modrob, move: Path, tmp_path: Path) -> None:
    move.write_text(MOVE.replace("order: 5", "order: 4\nspeed: 3").replace("t: 1,", "t: x,"))
    for command in (("trajectory", move, "-o", tmp_path / "out"), ("check", move)):
        result = modrob(*command)
        assert result.exit_code == 3
        for place in ("move.yaml:4:1: $.order", "move.yaml:5:1: $.speed", "move.yaml:8:4: $.points[1].t"):
            assert re.search(re.escape(place), result.stderr), result.stderr


def test_a_motion_that_is_no_trajectory(modrob: Modrob, workspace: Path) -> None:
    result = modrob("trajectory", workspace / "planar.yaml", "-o", workspace / "out")
    assert result.exit_code == 3
    assert "expected trajectory/1" in result.stderr


def test_check_and_schema_know_trajectories(modrob: Modrob) -> None:
    assert modrob("check", ROOT / "trajectories").exit_code == 0
    schema = json.loads(modrob("schema", "trajectory").stdout)
    assert schema["title"] == "modrob trajectory/1"
    assert {"points", "joints", "factors"} <= set(schema["properties"])


def test_examples_of_the_documentation(modrob: Modrob, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every document on the page is good, and the example says what the page shows."""
    page = (ROOT / "docs" / "trajectories.md").read_text(encoding="utf-8")
    documents = re.findall(r"```yaml\n(.*?)```", page, flags=re.DOTALL)
    assert len(documents) == 5
    monkeypatch.chdir(tmp_path)
    for k, text in enumerate(documents):
        (tmp_path / f"{k}.yaml").write_text(text, encoding="utf-8")
        assert modrob("trajectory", f"{k}.yaml", "-o", "all").exit_code == 0
    (message,) = re.findall(r"```json\n(.*?)```", page, flags=re.DOTALL)
    (tmp_path / "plan.json").write_text(message, encoding="utf-8")
    assert modrob("trajectory", "plan.json", "-o", "all").exit_code == 0
    (tmp_path / "pick.yaml").write_text(documents[0], encoding="utf-8")
    robot = ROOT / "assemblies" / "lwa4p-6-payload.yaml"
    result = modrob("trajectory", "pick.yaml", "--robot", robot, "-o", "out")
    assert result.exit_code == 4
    (shown,) = re.findall(r"```text\n(.*?)```", page, flags=re.DOTALL)
    assert result.stderr.strip() == shown.strip()
    (tmp_path / "slow.yaml").write_text(documents[0].replace("t: 4,", "t: 4.5,").replace("t: 8,", "t: 8.5,"))
    assert modrob("trajectory", "slow.yaml", "--robot", robot, "-o", "slow").exit_code == 0
