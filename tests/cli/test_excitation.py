"""``modrob trajectory --optimize-excitation`` as a user runs it."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from modrob_cli.identify.base_parameters import base_model
from modrob_cli.workflows.robots import load_robot

Modrob = Callable[..., Result]

ROOT = Path(__file__).parents[2]
QUICK = ("--iterations", 4, "--duration", 8, "--harmonics", 3, "--rate", 50)
LIMITS = ("--position-limits", "-90 deg:pi/2,1.5", "--velocity-limits", 2, "--acceleration-limits", "6,8")


@pytest.fixture
def planar(workspace: Path) -> Path:
    return workspace / "planar.yaml"


def test_files_and_result(modrob: Modrob, planar: Path, workspace: Path) -> None:
    out = workspace / "out"
    result = modrob("trajectory", "--optimize-excitation", planar, *LIMITS, *QUICK, "--seed", 7, "-o", out, "--json")
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    name = "planar-excitation"
    files = [f"{name}.{ending}" for ending in ("csv", "excitation.json", "mcap", "png", "trajectory.json", "yaml")]
    assert sorted(path.name for path in out.iterdir()) == files
    assert sorted(Path(path).name for path in data["files"].values()) == files
    assert (data["trajectory"], data["robot"], data["seed"], data["periods"]) == (name, "planar", 7, 1)
    assert data["base_parameters"] == base_model(load_robot(planar).robot).count
    assert data["log_det"] < data["random"]["log_det"]["best"]
    assert data["stderr_ratio"] < 1.0
    assert [joint["used"]["jerk"] for joint in data["joints"]] == [None, None]
    for joint in data["joints"]:
        assert 0.5 < max(value for value in joint["used"].values() if value is not None) <= 0.9 + 1e-9
    stored = json.loads((out / f"{name}.excitation.json").read_text())
    assert stored == {key: value for key, value in data.items() if key not in ("files", "motion")}
    for words in ("condition number", "median random motion", "self-collision", "part of each limit"):
        assert words in result.stderr


def test_the_document_is_a_trajectory(modrob: Modrob, planar: Path, workspace: Path) -> None:
    out = workspace / "out"
    assert (
        modrob("trajectory", "--optimize-excitation", planar, *LIMITS, *QUICK, "--periods", 2, "-o", out).exit_code == 0
    )
    text = (out / "planar-excitation.yaml").read_text()
    for words in ("seed 0", "objective log-det", "planar", "condition number", "modrob 0."):
        assert words in text.replace("\n  ", " ")
    assert modrob("check", out / "planar-excitation.yaml").exit_code == 0
    again = modrob("trajectory", out / "planar-excitation.yaml", "-o", workspace / "b", "--rate", 50, "--json")
    data = json.loads(again.stdout)
    assert (data["kind"], data["duration"], data["dof"]) == ("sines", 8.0, 2)
    rows = np.loadtxt(out / "planar-excitation.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[[0, 200, -1], 3:7], 0.0, atol=1e-9)  # at rest at both ends of both periods
    np.testing.assert_allclose(rows[0, 1:3], rows[200, 1:3], atol=1e-12)
    for column, low, high in ((1, -np.pi / 2, np.pi / 2), (2, -1.5, 1.5)):
        assert (np.abs(rows[:, column] - 0.5 * (low + high)) <= 0.45 * (high - low) + 1e-9).all()
    assert (np.abs(rows[:, 3:5]) <= 1.8 + 1e-9).all()
    assert (np.abs(rows[:, 5:7]) <= np.array([5.4, 7.2]) + 1e-9).all()


def test_same_seed_same_bytes(modrob: Modrob, planar: Path, workspace: Path) -> None:
    for name in ("a", "b"):
        command = ("trajectory", "--optimize-excitation", planar, *LIMITS, *QUICK, "-o", workspace / name)
        assert modrob(*command).exit_code == 0
    for path in (workspace / "a").iterdir():
        assert path.read_bytes() == (workspace / "b" / path.name).read_bytes(), path.name


def test_some_joints_of_a_shipped_arm(modrob: Modrob, tmp_path: Path) -> None:
    arm = ROOT / "assemblies" / "lwa4p-6-payload.yaml"
    chosen = ("--joints", "wrist_pitch,wrist_roll", "--objective", "condition", "--name", "wrist")
    result = modrob("trajectory", "--optimize-excitation", arm, *QUICK, *chosen, "-o", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    assert [joint["moves"] for joint in data["joints"]] == [False] * 4 + [True] * 2
    assert data["motion"]["joints"][0]["velocity"] == {"min": 0.0, "min_time": 0.0, "max": 0.0, "max_time": 0.0}
    assert (tmp_path / "out" / "wrist.yaml").exists()


def test_missing_limits_are_named(modrob: Modrob, planar: Path, workspace: Path) -> None:
    result = modrob("trajectory", "--optimize-excitation", planar, "-o", workspace / "out")
    assert result.exit_code == 2
    assert "planar lacks limits" in result.stderr
    assert "position for j1, j2; velocity for j1, j2; acceleration (or torque) for j1, j2" in result.stderr
    assert "--position-limits" in result.stderr
    assert not (workspace / "out").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--position-limits", "1:-1"), "--position-limits: found 1:-1, expected lower < upper"),
        (("--position-limits", "1:2:3"), "--position-limits: found '1:2:3'"),
        (("--position-limits", "x"), "--position-limits: found 'x'"),
        (("--velocity-limits", "1,2,3"), "--velocity-limits: found 3 ranges, expected 2"),
        (("--velocity-limits", "1:2"), "expected lower < 0 < upper"),
        (("--acceleration-limits", "0"), "expected lower < 0 < upper"),
        (("--harmonics", 1), "--harmonics: found 1, expected 2 to 40"),
        (("--duration", 0), "--duration: found 0"),
        (("--duration", "nan"), "--duration: found nan"),
        (("--margin", 1.1), "--margin: found 1.1"),
        (("--seconds", -1), "--seconds: found -1"),
        (("--periods", 0), "--periods: found 0"),
        (("--iterations", 0), "--iterations: found 0"),
        (("--seed", -1), "--seed: found -1"),
        (("--objective", "size"), "--objective: found 'size', expected log-det or condition"),
        (("--joints", "j1,j9"), "--joints: found j9, expected names among j1, j2"),
        (("--joints", ","), "--joints: found nothing"),
        (("--name", "a/b"), "--name: found 'a/b'"),
        (("--robot", "planar.yaml"), "--robot is for TRAJECTORY"),
        (("--format", "xls"), "--format: found 'xls'"),
        (("--rate", 0), "--rate"),
    ],
)
def test_options_that_make_no_sense(
    modrob: Modrob, planar: Path, workspace: Path, options: tuple[object, ...], words: str
) -> None:
    given: dict[object, object] = {"--iterations": 1, **dict(zip(LIMITS[::2], LIMITS[1::2], strict=True))}
    given[options[0]] = options[1]
    flat = [part for pair in given.items() for part in pair]
    result = modrob("trajectory", "--optimize-excitation", planar, *flat, "-o", workspace / "out")
    assert result.exit_code == 2, result.stderr
    assert words in result.stderr
    assert not (workspace / "out").exists()


def test_exactly_one_thing_to_do(modrob: Modrob, planar: Path, workspace: Path) -> None:
    motion = ROOT / "trajectories" / "table-b1.yaml"
    both = modrob("trajectory", motion, "--optimize-excitation", planar, "-o", workspace / "out")
    assert both.exit_code == 2
    assert "either TRAJECTORY or --optimize-excitation ROBOT" in both.stderr
    lost = modrob("trajectory", motion, "--seed", 3, "--position-limits", 1, "-o", workspace / "out")
    assert lost.exit_code == 2
    assert "--seed, --position-limits: only with --optimize-excitation" in lost.stderr


def test_existing_files_are_seen_before_the_search(modrob: Modrob, planar: Path, workspace: Path) -> None:
    out = workspace / "out"
    out.mkdir()
    (out / "planar-excitation.png").write_text("mine")
    result = modrob("trajectory", "--optimize-excitation", planar, *LIMITS, "-o", out)
    assert result.exit_code == 6
    assert [path.name for path in out.iterdir()] == ["planar-excitation.png"]


def test_torque_limits_that_cannot_hold_the_arm(modrob: Modrob, planar: Path, workspace: Path) -> None:
    command = ("trajectory", "--optimize-excitation", planar, *LIMITS, *QUICK, "--torque-limits", "1,1")
    folded = modrob(*command, "-o", workspace / "out")
    # The arm lies in a horizontal plane of its own file's gravity, so nothing pulls: the search only gets slower.
    assert folded.exit_code == 0, folded.stderr
    tilted = planar.read_text().replace("name: planar", "name: planar\ngravity: [0, -9.81, 0]")
    planar.write_text(tilted)
    result = modrob(*command, "-o", workspace / "out2")
    assert result.exit_code == 5
    assert "needs more than the torque limits of j1" in result.stderr
    assert not (workspace / "out2").exists()
