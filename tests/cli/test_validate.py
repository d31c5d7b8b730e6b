"""``modrob validate`` as a user runs it."""

import csv
import hashlib
import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

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


def record(
    path: Path,
    scale: float = 1.0,
    noise: float = 0.0,
    names: tuple[str, str] = ("slide", "shoulder"),
    samples: int = 1500,
) -> Path:
    """A log of the robot with known friction, by Pinocchio; joints in another order than the robot's."""
    model = pin.buildModelFromXML(URDF)
    data = model.createData()
    t, q, dq, ddq = motion()
    tau = np.array([pin.rnea(model, data, *sample) for sample in zip(q, dq, ddq, strict=True)])
    tau += OFFSET + COULOMB * np.sign(dq) + VISCOUS * dq + INERTIA * ddq
    tau = scale * tau + noise * np.random.default_rng(1).normal(size=tau.shape)
    rows = [
        joint_state(50.0 + t[k], names, q[k, ::-1], dq[k, ::-1], tau[k, ::-1]) for k in range(samples)
    ]  # fmt: skip
    return write_mcap(path, {"/joint_states": rows})


def modrob(*arguments: object, drawn: bool = False) -> Result:
    """Run the command; picture and page, which are slow, only if they are wanted."""
    extra = [] if drawn or "--details" in arguments else ["--details", "0"]
    return CliRunner().invoke(app, ["validate", *(str(argument) for argument in arguments), *extra])


def test_known_terms_come_out_and_files_are_written(robot: Path, tmp_path: Path) -> None:
    """A URDF without friction: fitted to the first part of the log, judged on the rest."""
    out = tmp_path / "out"
    done = modrob(robot, record(tmp_path / "run.mcap"), "--effort", "torque", "-o", out, "--json", drawn=True)
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert (result["passed"], result["friction"]) == (None, "held-out")
    names = {f"run.validate.{kind}" for kind in ("csv", "json", "png")}
    names |= {"two.validate.html", "two.validate.junit.xml"}
    assert {path.name for path in out.iterdir()} == names
    assert {Path(path).name for path in result["files"].values()} == names
    assert set(result["provenance"]["inputs"]) == {"two.urdf", "run.mcap"}
    (log,) = result["logs"]
    assert [joint["name"] for joint in log["joints"]] == ["shoulder", "slide"]
    assert [joint["unit"] for joint in log["joints"]] == ["N m", "N"]
    # The last 40 % of 1500 samples, less the filter's edge.
    assert 550 < log["samples_used"] <= 600
    for k, joint in enumerate(log["joints"]):
        fit = joint["fit"]
        terms = [fit["offset"], fit["coulomb"], fit["viscous"], fit["reflected_inertia"]]
        # No noise: what remains is the share of the filter where friction jumps.
        np.testing.assert_allclose(terms, [OFFSET[k], COULOMB[k], VISCOUS[k], INERTIA[k]], rtol=0, atol=0.02)
        assert joint["nrmse"] < 0.1
        assert 0.0 <= joint["inside"] <= 1.0
    written = json.loads((out / "run.validate.json").read_text())
    assert written["logs"] == result["logs"]
    assert (out / "run.validate.png").read_bytes().startswith(b"\x89PNG")
    page = (out / "two.validate.html").read_text()
    assert page.count("<svg") == 2
    assert "No verdict was asked for" in page
    assert "did not see" in done.stderr


def test_series_tell_the_same_as_the_figures(robot: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = modrob(robot, record(tmp_path / "run.mcap", noise=0.3), "--effort", "torque", "-o", out, "--json")
    joints = json.loads(done.stdout)["logs"][0]["joints"]
    with (out / "run.validate.csv").open(newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if float(row["used"])]
    for joint in joints:
        kinds = ("recorded", "predicted", "lower", "upper")
        recorded, predicted, lower, upper = (
            np.array([float(row[f"{joint['name']}.{kind}"]) for row in rows]) for kind in kinds
        )
        error = np.sqrt(np.mean((recorded - predicted) ** 2))
        assert error == pytest.approx(joint["rmse"], rel=1e-9)
        assert error / np.sqrt(np.mean(recorded**2)) == pytest.approx(joint["nrmse"], rel=1e-9)
        assert np.mean((lower <= recorded) & (recorded <= upper)) == pytest.approx(joint["inside"], abs=1e-12)


def known_robot(robot: Path, tmp_path: Path, extra: str = "", tolerance: float = 0.0, unknown: float = 2.0) -> Path:
    """The robot of the URDF as a document, with its true friction in it."""
    from modrob_cli.io.urdf_reader import read_urdf
    from modrob_cli.io.yaml_writer import yaml_text
    from modrob_cli.schema.from_model import robot_data

    data = robot_data(read_urdf(robot))
    for k, joint in enumerate(data["joints"]):
        for key, value in (("viscous", VISCOUS[k]), ("coulomb", COULOMB[k])):
            part = {"nominal": float(value), "tol": float(tolerance * value)} if tolerance else float(value)
            joint["friction"][key] = part
        joint["rotor_inertia"] = float(INERTIA[k])
    data["disturbance"] = [[-unknown, unknown]]
    path = tmp_path / "known.yaml"
    path.write_text(yaml_text(data) + extra)
    return path


def test_the_file_is_judged_as_it_is(robot: Path, tmp_path: Path) -> None:
    known, log = known_robot(robot, tmp_path, tolerance=0.05), record(tmp_path / "run.mcap")
    done = modrob(known, log, "--effort", "torque", "--min-inside", 0.97, "-o", tmp_path / "out", "--json")
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert (result["friction"], result["passed"]) == ("file", True)
    # The offset of the record is not in the nominal model, but inside the disturbance.
    for k, joint in enumerate(result["logs"][0]["joints"]):
        assert joint["rmse"] == pytest.approx(abs(OFFSET[k]), rel=0.2)
        assert joint["inside"] > 0.97
    narrow = known_robot(robot, tmp_path, unknown=0.01)
    bad = modrob(narrow, log, "--effort", "torque", "--min-inside", 0.97, "-o", tmp_path / "bad")
    assert bad.exit_code == 4
    assert "inside the bounds" in bad.stderr


def test_data_that_a_file_was_fitted_to_cannot_validate_it(robot: Path, tmp_path: Path) -> None:
    log = record(tmp_path / "run.mcap")
    digest = hashlib.sha256(log.read_bytes()).hexdigest()
    options = ("--effort", "torque", "--max-nrmse", 0.9)
    used = f"identified_from:\n- {{log: run.mcap, sha256: {digest}"
    part = known_robot(robot, tmp_path, f"{used}, end: 9.0}}\n")
    done = modrob(part, log, *options, "-o", tmp_path / "part", "--json")
    assert done.exit_code == 0, done.output
    (entry,) = json.loads(done.stdout)["logs"]
    assert 500 < entry["samples_used"] < 600
    assert entry["seconds_left_out"] == pytest.approx(9.0, abs=1.0)
    whole = known_robot(robot, tmp_path, f"{used}}}\n")
    done = modrob(whole, log, *options, "-o", tmp_path / "whole", "--json")
    assert done.exit_code == 4
    assert json.loads(done.stdout)["passed"] is None
    assert "--accept-fitted" in done.stderr
    assert 'skipped="2"' in (tmp_path / "whole" / "two.validate.junit.xml").read_text()
    assert modrob(whole, log, *options, "--accept-fitted", "-o", tmp_path / "told").exit_code == 0
    other = record(tmp_path / "other.mcap", noise=0.1)
    assert modrob(whole, other, *options, "-o", tmp_path / "other").exit_code == 0
    refused = modrob(robot, log, *options, "--friction", "in-sample", "-o", tmp_path / "in")
    assert refused.exit_code == 2
    assert "on the data it was fitted to" in refused.stderr


def test_one_short_log_does_not_stop_the_others(robot: Path, tmp_path: Path) -> None:
    """Long enough to be read, too short to be fitted to its first part and judged on the rest."""
    short, good = record(tmp_path / "short.mcap", samples=100), record(tmp_path / "good.mcap")
    options = ("--effort", "torque", "--max-nrmse", 0.5, "--json", "--details", 0)
    done = modrob(robot, short, good, *options, "-o", tmp_path / "out")
    assert done.exit_code == 4, done.output
    result = json.loads(done.stdout)
    assert [Path(log["log"]).name for log in result["logs"]] == ["good.mcap"]
    assert [Path(log["log"]).name for log in result["skipped"]] == ["short.mcap"]
    assert result["passed"] is False
    assert "short.mcap: " in done.stderr
    root = ElementTree.parse(tmp_path / "out" / "two.validate.junit.xml").getroot()
    failed = [case.get("classname") for case in root.iter("testcase") if case.find("failure") is not None]
    assert failed == [str(short)]
    assert modrob(robot, short, *options, "-o", tmp_path / "alone").exit_code == 5


def test_junit_lists_each_joint(robot: Path, tmp_path: Path) -> None:
    log = record(tmp_path / "run.mcap", noise=0.5)
    done = modrob(robot, log, "--effort", "torque", "--max-nrmse", 0.05, "-o", tmp_path / "out", "--json")
    joints = json.loads(done.stdout)["logs"][0]["joints"]
    root = ElementTree.parse(tmp_path / "out" / "two.validate.junit.xml").getroot()
    cases = {case.get("name"): case for case in root.iter("testcase")}
    assert set(cases) == {"shoulder", "slide"}
    for joint in joints:
        assert (cases[joint["name"]].find("failure") is not None) == (joint["nrmse"] > 0.05)
    failed = sum(joint["nrmse"] > 0.05 for joint in joints)
    assert [suite.get("failures") for suite in root.iter("testsuite")] == [str(failed)]


def test_the_table_goes_to_stderr_only(robot: Path, tmp_path: Path) -> None:
    done = modrob(robot, record(tmp_path / "run.mcap"), "--effort", "torque", "-o", tmp_path / "out")
    assert done.stdout == ""
    assert "shoulder" in done.stderr


def test_verdict_decides_the_exit_code_after_the_files_are_written(robot: Path, tmp_path: Path) -> None:
    log = record(tmp_path / "run.mcap", noise=0.5)
    good = modrob(robot, log, "--effort", "torque", "--max-nrmse", 0.5, "-o", tmp_path / "good", "--json")
    assert (good.exit_code, json.loads(good.stdout)["passed"]) == (0, True)
    options = ("--effort", "torque", "--max-nrmse", 0.001, "-o", tmp_path / "bad", "--json")
    bad = modrob(robot, log, *options, drawn=True)
    assert (bad.exit_code, json.loads(bad.stdout)["passed"]) == (4, False)
    assert (tmp_path / "bad" / "run.validate.png").exists()
    assert "run.mcap: shoulder: NRMSE" in bad.stderr


def test_without_details_there_is_no_page_and_none_is_listed(robot: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = modrob(robot, record(tmp_path / "run.mcap"), "--effort", "torque", "--details", 0, "-o", out, "--json")
    listed = {Path(path).name for path in json.loads(done.stdout)["files"].values()}
    assert listed == {path.name for path in out.iterdir()}
    assert listed == {"two.validate.junit.xml", "run.validate.json", "run.validate.csv"}


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


@pytest.mark.parametrize(
    "option",
    [
        ("--cutoff", "-1"), ("--cutoff", "nan"), ("--cutoff", "60"), ("--max-nrmse", "0"), ("--min-inside", "1.5"),
        ("--holdout", "1"), ("--friction", "none"),
    ],
)  # fmt: skip
def test_options_out_of_range_are_usage_errors(robot: Path, tmp_path: Path, option: tuple[str, str]) -> None:
    log = record(tmp_path / "run.mcap")
    assert modrob(robot, log, "--effort", "torque", "-o", tmp_path / "out", *option).exit_code == 2
    assert not (tmp_path / "out").exists()


def test_the_faults_of_all_logs_are_reported_and_the_good_one_is_judged(robot: Path, tmp_path: Path) -> None:
    good, bad = record(tmp_path / "good.mcap"), tmp_path / "bad.mcap"
    bad.write_bytes(good.read_bytes()[:5000])
    logs = (bad, good, tmp_path / "none.mcap")
    options = ("--effort", "torque", "--strict", "--details", 0)
    done = modrob(robot, *logs, *options, "-o", tmp_path / "all")
    assert done.exit_code == 3
    assert (tmp_path / "all" / "good.validate.json").exists()
    done = modrob(robot, bad, tmp_path / "none.mcap", *options, "-o", tmp_path / "out")
    assert done.exit_code == 3
    assert "bad.mcap: --strict refuses a file that is damaged: damaged: the file ends in the middle" in done.stderr
    assert "none.mcap: file not found" in done.stderr
    assert "Traceback" not in done.output
    assert not (tmp_path / "out").exists()


def test_a_cut_log_is_used_and_what_was_lost_is_said(robot: Path, tmp_path: Path) -> None:
    raw = record(tmp_path / "run.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(raw[: len(raw) * 2 // 3])
    done = modrob(robot, cut, "--effort", "torque", "-o", tmp_path / "out", "--json")
    assert done.exit_code == 0, done.output
    (log,) = json.loads(done.stdout)["logs"]
    assert 700 < log["samples"] < 1100
    assert "damaged: the file ends in the middle" in log["notes"][0]
    assert "note: damaged: the file ends in the middle" in done.stderr


def test_net_torque_is_compared_without_gravity(robot: Path, tmp_path: Path) -> None:
    model = pin.buildModelFromXML(URDF)
    data = model.createData()
    model.gravity.setZero()
    t, q, dq, ddq = motion()
    tau = np.array([pin.rnea(model, data, *sample) for sample in zip(q, dq, ddq, strict=True)])
    rows = [joint_state(1.0 + t[k], ("shoulder", "slide"), q[k], dq[k], tau[k]) for k in range(len(t))]
    log = write_mcap(tmp_path / "run.mcap", {"/joint_states": rows})
    nrmse = {}
    for effort in ("torque", "net-torque"):
        done = modrob(robot, log, "--effort", effort, "-o", tmp_path / effort, "--json")
        assert done.exit_code == 0, done.output
        nrmse[effort] = [joint["nrmse"] for joint in json.loads(done.stdout)["logs"][0]["joints"]]
    # The model is exact then; with gravity left in, friction terms cannot explain it.
    assert max(nrmse["net-torque"]) < 0.02
    assert max(nrmse["torque"]) > 0.2


def test_options_of_logs(robot: Path, tmp_path: Path) -> None:
    log = record(tmp_path / "run.mcap", names=("j2", "j1"))
    common = (robot, log, "--effort", "torque", "-o", tmp_path / "out", "--json")
    done = modrob(*common, "--map", "j1=shoulder,j2=slide")
    assert done.exit_code == 0, done.output
    assert [joint["name"] for joint in json.loads(done.stdout)["logs"][0]["joints"]] == ["shoulder", "slide"]
    for wrong in ("j1", "j1=", "j1=a,j1=b"):
        assert modrob(*common, "--map", wrong).exit_code == 2
    assert modrob(*common, "--time", "arrival").exit_code == 2


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
    done = modrob(robot, *logs, "--effort", "torque", "--details", 1, "-o", tmp_path / "out", "--json")
    assert [Path(name).name for name in json.loads(done.stdout)["files"].values()] == [
        "two.validate.html", "two.validate.junit.xml", "two.validate.summary.json", "two.validate.logs.csv",
        "two.validate.logs.parquet", "run.validate.json", "run.validate.csv",
        "run-2.validate.json", "run-2.validate.csv", "run-2.validate.png", "run-2.validate.html",
    ]  # fmt: skip
    assert json.loads((tmp_path / "out" / "run-2.validate.json").read_text())["logs"][0]["log"] == str(logs[1])


def test_help_shows_an_example() -> None:
    done = CliRunner().invoke(app, ["validate", "--help"])
    assert "modrob validate robot.urdf run.mcap --effort torque" in " ".join(done.stdout.split())
