"""``modrob validate`` as a user runs it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from typer.testing import CliRunner, Result

from modrob_cli.cli.app import app
from tests.mcap_samples import joint_state, write_mcap

URDF = """<?xml version="1.0"?>
<robot name="two">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.1 0 0.05"/><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit effort="50" velocity="3" lower="-3" upper="3"/></joint>
  <joint name="slide" type="prismatic"><origin xyz="0.4 0 0"/><parent link="upper"/><child link="lower"/>
    <axis xyz="1 0 0"/><limit effort="50" velocity="3" lower="-3" upper="3"/></joint>
</robot>
"""

OFFSET, COULOMB, VISCOUS, INERTIA = np.array([[0.5, -1.0], [2.0, 3.0], [4.0, 10.0], [0.3, 0.7]])


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "two.urdf"
    path.write_text(URDF)
    return path


def motion() -> tuple[np.ndarray[Any, Any], ...]:
    t = np.arange(1500) / 100.0
    w = np.array([1.3, 2.1])
    phase = t[:, None] * w
    return t, 0.5 * np.sin(phase), 0.5 * w * np.cos(phase), -0.5 * w**2 * np.sin(phase)


def record(path: Path, scale: float = 1.0, noise: float = 0.0, names: tuple[str, str] = ("slide", "shoulder")) -> Path:
    """A log of the robot with known friction, by Pinocchio; joints in another order than the robot's."""
    model = pin.buildModelFromXML(URDF)
    data = model.createData()
    t, q, dq, ddq = motion()
    tau = np.array([pin.rnea(model, data, *sample) for sample in zip(q, dq, ddq, strict=True)])
    tau += OFFSET + COULOMB * np.sign(dq) + VISCOUS * dq + INERTIA * ddq
    tau = scale * tau + noise * np.random.default_rng(1).normal(size=tau.shape)
    rows = [
        joint_state(50.0 + t[k], names, q[k, ::-1], dq[k, ::-1], tau[k, ::-1]) for k in range(len(t))
    ]  # fmt: skip
    return write_mcap(path, {"/joint_states": rows})


def modrob(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["validate", *(str(argument) for argument in arguments)])


def test_known_terms_come_out_and_files_are_written(robot: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = modrob(robot, record(tmp_path / "run.mcap"), "--effort", "torque", "-o", out, "--json")
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert result["passed"] is None
    assert sorted(path.name for path in out.iterdir()) == ["run.validate.json", "run.validate.png"]
    assert set(result["files"]) == {"run.validate.json", "run.validate.png"}
    assert result["scope"].startswith("In-sample fit")
    assert set(result["provenance"]["inputs"]) == {"two.urdf", "run.mcap"}
    (log,) = result["logs"]
    assert [joint["name"] for joint in log["joints"]] == ["shoulder", "slide"]
    assert [joint["unit"] for joint in log["joints"]] == ["N m", "N"]
    for k, joint in enumerate(log["joints"]):
        fit = joint["fit"]
        terms = [fit["offset"], fit["coulomb"], fit["viscous"], fit["reflected_inertia"]]
        # No noise: what remains is the filter's share near the ends of the log.
        np.testing.assert_allclose(terms, [OFFSET[k], COULOMB[k], VISCOUS[k], INERTIA[k]], rtol=0, atol=0.01)
        assert joint["nrmse"] < 0.1
        assert joint["inside"] is None
    written = json.loads((out / "run.validate.json").read_text())
    assert written["logs"] == result["logs"]
    assert (out / "run.validate.png").read_bytes().startswith(b"\x89PNG")
    assert "NRMSE" in done.stderr
    assert "In-sample fit" in done.stderr


def test_the_table_goes_to_stderr_only(robot: Path, tmp_path: Path) -> None:
    done = modrob(robot, record(tmp_path / "run.mcap"), "--effort", "torque", "-o", tmp_path / "out")
    assert done.stdout == ""
    assert "shoulder" in done.stderr


def test_verdict_decides_the_exit_code_after_the_files_are_written(robot: Path, tmp_path: Path) -> None:
    log = record(tmp_path / "run.mcap", noise=0.5)
    good = modrob(robot, log, "--effort", "torque", "--max-nrmse", 0.5, "-o", tmp_path / "good", "--json")
    assert (good.exit_code, json.loads(good.stdout)["passed"]) == (0, True)
    bad = modrob(robot, log, "--effort", "torque", "--max-nrmse", 0.001, "-o", tmp_path / "bad", "--json")
    assert (bad.exit_code, json.loads(bad.stdout)["passed"]) == (4, False)
    assert (tmp_path / "bad" / "run.validate.png").exists()
    assert "above the 0.001 of --max-nrmse" in bad.stderr


def test_robot_document_with_drive_constants(robot: Path, tmp_path: Path) -> None:
    from modrob_cli.io.urdf_reader import read_urdf

    arm = read_urdf(robot)
    lines = ["modrob: robot/1", "name: two", "joints:"]
    for joint, placed in zip(arm.joints, ("{xyz: [0, 0, 0], rpy: [-pi/2, 0, 0]}", "{xyz: [0, 0, 0]}"), strict=True):
        lines += [f"- name: {joint.name}", f"  type: {joint.type}", f"  placement: {placed}"]
        lines += ["  gear_ratio: 50", "  torque_constant: 0.1"]
    path = tmp_path / "two.yaml"
    path.write_text("\n".join(lines) + "\n")
    log = record(tmp_path / "run.mcap")
    rmse = {}
    for effort in ("torque", "motor-torque", "current"):
        done = modrob(path, log, "--effort", effort, "-o", tmp_path / effort, "--json")
        assert done.exit_code == 0, done.output
        rmse[effort] = json.loads(done.stdout)["logs"][0]["joints"][1]["rmse"]
    # Without bodies everything is linear in the effort: factors 50 and 50 * 0.1.
    assert rmse["motor-torque"] == pytest.approx(50 * rmse["torque"])
    assert rmse["current"] == pytest.approx(5 * rmse["torque"])


def test_effort_is_required_and_its_constants_too(robot: Path, tmp_path: Path) -> None:
    log = record(tmp_path / "run.mcap")
    assert modrob(robot, log).exit_code == 2
    assert modrob(robot, log, "--effort", "guess").exit_code == 2
    done = modrob(robot, log, "--effort", "current", "-o", tmp_path / "out")
    assert done.exit_code == 2
    assert "lacks for: shoulder, slide" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("option", [("--cutoff", "-1"), ("--cutoff", "nan"), ("--cutoff", "60"), ("--max-nrmse", "0")])
def test_options_out_of_range_are_usage_errors(robot: Path, tmp_path: Path, option: tuple[str, str]) -> None:
    log = record(tmp_path / "run.mcap")
    assert modrob(robot, log, "--effort", "torque", "-o", tmp_path / "out", *option).exit_code == 2
    assert not (tmp_path / "out").exists()


def test_the_faults_of_all_logs_are_reported_and_nothing_is_written(robot: Path, tmp_path: Path) -> None:
    good, bad = record(tmp_path / "good.mcap"), tmp_path / "bad.mcap"
    bad.write_bytes(good.read_bytes()[:5000])
    logs = (bad, good, tmp_path / "none.mcap")
    done = modrob(robot, *logs, "--effort", "torque", "-o", tmp_path / "out")
    assert done.exit_code == 3
    assert "bad.mcap: the MCAP file is damaged" in done.stderr
    assert "none.mcap: file not found" in done.stderr
    assert "Traceback" not in done.output
    assert not (tmp_path / "out").exists()


def test_other_joint_names_say_what_to_do(robot: Path, tmp_path: Path) -> None:
    log = record(tmp_path / "run.mcap", names=("j2", "j1"))
    done = modrob(robot, log, "--effort", "torque", "-o", tmp_path / "out")
    assert done.exit_code == 3
    assert "the robot has shoulder, slide; the log has j1, j2" in done.stderr


def test_existing_outputs_are_kept(robot: Path, tmp_path: Path) -> None:
    arguments = (robot, record(tmp_path / "run.mcap"), "--effort", "torque", "-o", tmp_path / "out")
    assert modrob(*arguments).exit_code == 0
    assert modrob(*arguments).exit_code == 6
    assert modrob(*arguments, "--overwrite").exit_code == 0


def test_logs_of_one_name_get_outputs_of_their_own(robot: Path, tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    logs = (record(tmp_path / "a" / "run.mcap"), record(tmp_path / "b" / "run.mcap", scale=2.0))
    done = modrob(robot, *logs, "--effort", "torque", "-o", tmp_path / "out", "--json")
    assert [Path(name).name for name in json.loads(done.stdout)["files"]] == [
        "run.validate.json", "run.validate.png", "run-2.validate.json", "run-2.validate.png",
    ]  # fmt: skip
    assert json.loads((tmp_path / "out" / "run-2.validate.json").read_text())["logs"][0]["log"] == str(logs[1])


def test_help_shows_an_example() -> None:
    done = CliRunner().invoke(app, ["validate", "--help"])
    assert "modrob validate robot.urdf run.mcap --effort torque" in " ".join(done.stdout.split())
