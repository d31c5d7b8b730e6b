"""Scenarios and a user's own controllers on the command line."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

Modrob = Callable[..., Result]

ROOT = Path(__file__).parents[2]
ARM = ROOT / "assemblies" / "lwa4p-6.yaml"
MOTION = """\
modrob: trajectory/1
name: short
kind: waypoints
order: 5
points:
- {t: 0, q: [0, 0, 0, 0, 0, 0]}
- {t: 0.1, q: [0.01, 0, 0, 0, 0, 0]}
"""
PD = """\
class Pd:
    def __init__(self, task):
        self.task = task
        print("made")

    def torque(self, t, q, dq, desired):
        print("torque at", t)
        {body}
        return 3000.0 * (desired.q - q) + 150.0 * (desired.dq - dq)

make_controller = Pd
"""


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    path = tmp_path / "short.yaml"
    path.write_text(MOTION)
    return path


def test_examples_of_the_documentation(modrob: Modrob, tmp_path: Path, motion: Path) -> None:
    page = (ROOT / "docs" / "scenarios.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```yaml\n(.*?)```", page, flags=re.DOTALL)
    (controller,) = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    (tmp_path / "example.yaml").write_text(example, encoding="utf-8")
    (tmp_path / "own.py").write_text(controller, encoding="utf-8")
    result = modrob("check", tmp_path / "example.yaml", "--strict")
    assert result.exit_code == 0, result.stderr
    for option in (("--scenario", tmp_path / "example.yaml"), ("--controller", tmp_path / "own.py")):
        result = modrob("simulate", ARM, motion, *option, "-o", tmp_path / "run.mcap", "--overwrite")
        assert result.exit_code == 0, result.stderr


def test_every_key_of_the_documentation_is_one_and_the_other_way_round(modrob: Modrob) -> None:
    page = (ROOT / "docs" / "scenarios.md").read_text(encoding="utf-8")
    schema = json.loads(modrob("schema", "scenario").stdout)
    parts = {"ControlSpec": "control", "TruthSpec": "truth", "ContactSpec": "contacts", "SensorsSpec": "sensors"}
    for name, title in parts.items():
        section = page.split(f"## `{title}`")[1].split("\n## ")[0]
        said = {
            key for row in re.findall(r"^\| (`.*?) \|", section, flags=re.MULTILINE) for key in row.split("`")[1::2]
        }
        assert said == set(schema["$defs"][name]["properties"]), title


def test_check_finds_what_is_wrong(modrob: Modrob, tmp_path: Path) -> None:
    head = "modrob: scenario/1\nname: s\n"
    (tmp_path / "payload.yaml").write_text(head + "payload: {mass: 2, com: [0, 0, 1.5]}\n")
    (tmp_path / "mine.py").write_text("def (\n")
    (tmp_path / "control.yaml").write_text(head + "control: {name: mine.py}\n")
    (tmp_path / "both.yaml").write_text(head + "seed: -1\nsensors: {rate: 0}\n")
    result = modrob("check", tmp_path)
    assert result.exit_code == 3
    assert (
        f"warning: {tmp_path / 'payload.yaml'}:3:20: $.payload.com: the centre of mass is up to 1.5 m from"
        in result.stderr
    )
    assert "control.yaml:3:11: $.control.name" in result.stderr
    assert "mine.py:1:5: not valid Python" in result.stderr
    assert "both.yaml:3:1: $.seed" in result.stderr
    assert "both.yaml:4:11: $.sensors.rate" in result.stderr
    assert "3 documents checked" in result.stderr


def test_check_does_not_run_the_controller(modrob: Modrob, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine.py").write_text("open('ran', 'w')\n")
    (tmp_path / "s.yaml").write_text("modrob: scenario/1\nname: s\ncontrol: {name: mine.py}\n")
    monkeypatch.chdir(tmp_path)
    assert modrob("check", "s.yaml").exit_code == 0
    assert not (tmp_path / "ran").exists()


def test_a_controller_that_prints_leaves_stdout_to_json(modrob: Modrob, tmp_path: Path, motion: Path) -> None:
    (tmp_path / "mine.py").write_text(PD.format(body="pass"))
    result = modrob("simulate", ARM, motion, "--controller", tmp_path / "mine.py", "-o", tmp_path / "a.mcap", "--json")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["diverged"] is None
    assert "made" in result.stderr
    assert "torque at 0.05" in result.stderr


def test_a_scenario_names_its_controller(
    modrob: Modrob, tmp_path: Path, motion: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its path is relative to the document, its content is part of the provenance."""
    folder = tmp_path / "study"
    folder.mkdir()
    (folder / "mine.py").write_text(PD.format(body="pass"))
    (folder / "s.yaml").write_text("modrob: scenario/1\nname: s\ncontrol: {name: 'mine.py:Pd'}\n")
    monkeypatch.chdir(tmp_path)
    result = modrob("simulate", ARM, motion, "--scenario", "study/s.yaml", "-o", "a.mcap", "--json")
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    assert data["controller"] == "study/mine.py:Pd"
    assert {"mine.py", "s.yaml", "short.yaml"} <= set(data["provenance"]["inputs"])


def test_a_controller_that_fails_leaves_nothing(modrob: Modrob, tmp_path: Path, motion: Path) -> None:
    (tmp_path / "mine.py").write_text(PD.format(body="if t >= 0.05: [][1]"))
    out = tmp_path / "out" / "a.mcap"
    result = modrob("simulate", ARM, motion, "--controller", tmp_path / "mine.py", "-o", out)
    assert result.exit_code == 3
    assert "mine.py:8: IndexError: list index out of range (at t = 0.05 s)" in result.stderr
    assert "Traceback" not in result.stderr
    assert not out.parent.exists()


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("truth: {bodies: {L9: {mass: 1}}}", 3, "s.yaml:3:18: $.truth.bodies.L9: found the body 'L9', expected one of"),
        ("control: {gains: {frequency: [1, 2]}}", 3, "found 2 values, expected 6: PB1.1"),
        ("control: {gains: {frequencies: 1}}", 2, "found the gain frequencies, expected some of frequency"),
        ("contacts: [{name: a, link: PB9.1, force: [1, 0, 0], start: 0, duration: 1}]", 3, "'PB9.1', expected one of"),
        ("control: {name: './no.py'}", 3, "s.yaml:3:11: $.control.name"),
    ],
)
def test_faults_of_scenarios(modrob: Modrob, tmp_path: Path, motion: Path, text: str, code: int, message: str) -> None:
    (tmp_path / "s.yaml").write_text(f"modrob: scenario/1\nname: s\n{text}\n")
    options = ("--scenario", tmp_path / "s.yaml", "-o", tmp_path / "a.mcap")
    result = modrob("simulate", ARM, motion, "--controller", "id", *options)
    assert result.exit_code == code, result.stderr
    assert message in result.stderr
    assert not (tmp_path / "a.mcap").exists()


def test_the_shipped_controller_follows(modrob: Modrob, tmp_path: Path) -> None:
    """Gravity and PD: the error is at most friction and inertia torque over kp, a few hundredths of a rad."""
    mine = ROOT / "scenarios" / "my_controller.py"
    motion = ROOT / "trajectories" / "table-b1.yaml"
    result = modrob("simulate", ARM, motion, "--controller", mine, "-o", tmp_path / "run.mcap", "--json")
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    assert data["diverged"] is None
    # Viscous friction up to 17.9 N m s/rad at 1.3 rad/s and Coulomb up to 7.1 N m, over kp = 3000, with a margin of 2
    # for inertia torques that this controller does not know of.
    assert data["error_norm"]["max"] < 2 * 6**0.5 * (17.9 * 1.3 + 7.1) / 3000
    assert max(joint["max_error"] for joint in data["joints"]) > 1e-3
