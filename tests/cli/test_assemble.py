"""``modrob assemble`` as a user meets it."""

import csv
import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from modrob_cli.cli.app import app

ROOT = Path(__file__).parents[2]
ARM = ROOT / "assemblies" / "lwa4p-6.yaml"
KINDS = ("robot.yaml", "dh.csv", "dynpar.csv", "intervals.csv", "urdf", "svg", "manifest.json")


def run(*arguments: object) -> Any:
    return CliRunner().invoke(app, ["assemble", *map(str, arguments)])


def test_writes_every_file_and_prints_tables_on_stderr(tmp_path: Path) -> None:
    result = run(ARM, "-o", tmp_path)
    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(f"lwa4p-6.{kind}" for kind in KINDS)
    assert result.stdout == ""
    assert "extended D-H parameters" in result.stderr
    assert "PB3.2" in result.stderr


def test_json_has_the_stable_keys_and_is_alone_on_stdout(tmp_path: Path) -> None:
    result = run(ARM, "-o", tmp_path, "--json")
    robot = json.loads(result.stdout)["robots"][0]
    assert robot["name"] == "lwa4p-6"
    assert robot["dof"] == 6
    assert set(robot["dh"][0]) == {"joint", "type", "a", "alpha", "d", "theta", "gamma", "p", "n"}
    link_keys = {"mass", "com", "inertia_com", "viscous", "coulomb", "rotor_inertia", "gear_ratio", "torque_constant"}
    assert link_keys <= set(robot["links"][0])
    assert {"mass", "com", "inertia_com"} <= set(robot["intervals"][0])
    assert np.shape(robot["intervals"][0]["inertia_com"]) == (6, 2)
    assert np.shape(robot["base_transform"]) == np.shape(robot["tool_transform"]) == (4, 4)
    assert all(Path(path).is_file() for path in robot["files"].values())
    assert result.stderr == ""


def test_tables_agree_with_the_json(tmp_path: Path) -> None:
    robot: dict[str, Any] = json.loads(run(ARM, "-o", tmp_path, "--json").stdout)["robots"][0]
    with (tmp_path / "lwa4p-6.dh.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["alpha"]) for row in rows] == [row["alpha"] for row in robot["dh"]]
    with (tmp_path / "lwa4p-6.intervals.csv").open(encoding="utf-8") as stream:
        bounds = {(row["joint"], row["quantity"]): row for row in csv.DictReader(stream)}
    assert float(bounds["PB3.2", "mass"]["nominal"]) == robot["links"][5]["mass"]
    assert float(bounds["PB3.2", "com_z"]["lower"]) == robot["intervals"][5]["com"][2][0]


def test_manifest_names_version_inputs_and_outputs(tmp_path: Path) -> None:
    run(ARM, "-o", tmp_path)
    manifest = json.loads((tmp_path / "lwa4p-6.manifest.json").read_text(encoding="utf-8"))
    assert set(manifest["inputs"]) == {f"{name}.yaml" for name in ("lwa4p-6", "PB1", "PB2", "PB3", "L1", "L2", "L3")}
    assert manifest["outputs"]["lwa4p-6.urdf"].startswith("sha256:")
    assert manifest["modrob"]


def test_refuses_to_overwrite_before_anything_is_written(tmp_path: Path) -> None:
    (tmp_path / "lwa4p-6.urdf").write_text("mine", encoding="utf-8")
    result = run(ARM, "-o", tmp_path)
    assert result.exit_code == 6
    assert "--overwrite" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["lwa4p-6.urdf"]
    assert (tmp_path / "lwa4p-6.urdf").read_text(encoding="utf-8") == "mine"
    assert run(ARM, "-o", tmp_path, "--overwrite").exit_code == 0


def test_one_bad_assembly_of_several_leaves_nothing(tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("modrob: assembly/1\nname: bad\ncatalogue: nowhere\nmodules: [X]\n", encoding="utf-8")
    out = tmp_path / "deep" / "out"
    result = run(ARM, bad, "-o", out)
    assert result.exit_code == 3
    assert str(bad) in result.stderr
    assert not (tmp_path / "deep").exists()


def test_two_robots_of_one_name_are_refused(tmp_path: Path) -> None:
    data = yaml.safe_load(ARM.read_text(encoding="utf-8"))
    data["catalogue"] = str(ROOT / "modules" / "schunk-lwa4p")
    twin = tmp_path / "twin.yaml"
    twin.write_text(yaml.safe_dump(data), encoding="utf-8")
    result = run(ARM, twin, "-o", tmp_path / "out")
    assert result.exit_code == 3
    assert "rename one of them" in result.stderr


def test_a_robot_file_is_taken_like_an_assembly(tmp_path: Path) -> None:
    first = json.loads(run(ARM, "-o", tmp_path / "a", "--json").stdout)["robots"][0]
    again = json.loads(run(tmp_path / "a" / "lwa4p-6.robot.yaml", "-o", tmp_path / "b", "--json").stdout)["robots"][0]
    for key in ("alpha", "a", "d", "theta"):
        np.testing.assert_allclose([r[key] for r in first["dh"]], [r[key] for r in again["dh"]], atol=1e-12)


@pytest.mark.parametrize("q", ["1,2", "a,b,c,d,e,f", "1,,3,4,5,6", "nan,0,0,0,0,0", "inf,0,0,0,0,0"])
def test_a_wrong_q_is_a_usage_error(tmp_path: Path, q: str) -> None:
    result = run(ARM, "-o", tmp_path / "out", "--q", q)
    assert result.exit_code == 2
    assert not (tmp_path / "out").exists()


def test_picture_is_xml_and_shows_the_pose(tmp_path: Path) -> None:
    run(ARM, "-o", tmp_path, "--q", "0.3,-pi/4,90deg,0,pi/4,0")
    root = ElementTree.parse(tmp_path / "lwa4p-6.svg").getroot()
    texts = [element.text or "" for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert any("q = (0.3, -0.785, 1.57, 0, 0.785, 0)" in text for text in texts)
    assert "PB1.1" in texts


def test_png_and_no_picture(tmp_path: Path) -> None:
    assert run(ARM, "-o", tmp_path / "png", "--picture", "png").exit_code == 0
    assert (tmp_path / "png" / "lwa4p-6.png").read_bytes().startswith(b"\x89PNG")
    assert run(ARM, "-o", tmp_path / "none", "--picture", "none").exit_code == 0
    assert not list((tmp_path / "none").glob("*.svg"))


def test_mounting_and_gravity(tmp_path: Path) -> None:
    """An arm on the ceiling: the base pose turns the arm, gravity stays in the base frame."""
    data = yaml.safe_load(ARM.read_text(encoding="utf-8"))
    data |= {"catalogue": str(ROOT / "modules" / "schunk-lwa4p"), "base_pose": {"xyz": [0, 0, 2], "rpy": ["pi", 0, 0]}}
    path = tmp_path / "ceiling.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    robot = json.loads(run(path, "-o", tmp_path / "out", "--json").stdout)["robots"][0]
    np.testing.assert_allclose(robot["base_transform"][2], [0.0, 0.0, -1.0, 2.0], atol=1e-12)
    assert robot["gravity"] == [0.0, 0.0, -9.81]


def test_repeated_modules_joint_names_and_limits(tmp_path: Path) -> None:
    data = {
        "modrob": "assembly/1",
        "name": "twice",
        "catalogue": str(ROOT / "modules" / "schunk-lwa4p"),
        "modules": ["PB1", "L1", "PB1", {"module": "L3", "output": "out"}],
        "limits": {"PB1#2.1": {"torque": 30}},
    }
    path = tmp_path / "twice.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    robot = json.loads(run(path, "-o", tmp_path / "a", "--json").stdout)["robots"][0]
    assert robot["joints"] == ["PB1.1", "PB1.2", "PB1#2.1", "PB1#2.2"]
    written = yaml.safe_load((tmp_path / "a" / "twice.robot.yaml").read_text(encoding="utf-8"))
    assert written["joints"][2]["limits"]["torque"] == [-30.0, 30.0]
    data |= {"joint_names": ["a", "b", "c", "d"], "limits": {}}
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    robot = json.loads(run(path, "-o", tmp_path / "b", "--json").stdout)["robots"][0]
    assert robot["joints"] == ["a", "b", "c", "d"]
