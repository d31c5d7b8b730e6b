"""``modrob identify`` as a user runs it, on simulated logs with known friction."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from modrob_cli.arrays import Array
from modrob_cli.cli.app import app
from modrob_cli.model.log import JointLog
from modrob_cli.workflows.robots import load_robot
from tests.identify_samples import TERMS, TRUTH, URDF, record, rigid_torque
from tests.mcap_samples import joint_state, write_mcap

NAMES = ("waist", "shoulder", "elbow")
FILES = {
    "three.identified.robot.yaml", "three.identify.json", "three.identify.csv", "three.identify.friction.png",
    "three.identify.torques.png", "three.identify.filter.png", "three.identify.html",
}  # fmt: skip


def modrob(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["identify", *(str(argument) for argument in arguments)])


def save(path: Path, log: JointLog, effort: Array | None = None) -> Path:
    """A log as MCAP, joints in another order than the robot's."""
    order = [2, 0, 1]
    names = [NAMES[k] for k in order]
    values = log.effort if effort is None else effort
    rows = [
        joint_state(10.0 + log.t[k], names, log.q[k, order], effort=values[k, order]) for k in range(len(log.t))
    ]  # fmt: skip
    return write_mcap(path, {"/joint_states": rows})


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a robot and logs; tests write into folders of their own."""
    folder = tmp_path_factory.mktemp("identify")
    (folder / "three.urdf").write_text(URDF)
    for k in range(2):
        save(folder / f"run{k}.mcap", record(100 + k, rate=100.0).log)
    return folder


@pytest.fixture(scope="module")
def done(place: Path) -> dict[str, Any]:
    """One log identified, as JSON, with the folder of its outputs."""
    out = place / "one"
    result = modrob(place / "three.urdf", place / "run0.mcap", "--effort", "torque", "-o", out, "--json")
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def test_result_has_the_documented_keys(done: dict[str, Any]) -> None:
    assert {"joints", "condition", "samples", "files"} <= set(done)
    for j, joint in enumerate(done["joints"]):
        assert joint["name"] == NAMES[j]
        for key in ("viscous", "coulomb", "rotor_inertia", "offset"):
            low, high = joint["interval"][key]
            assert low < joint[key] < high
            assert 0.0 < joint["stderr"][key] < high - low
        for k, term in enumerate(TERMS):
            low, high = joint["interval"][term]
            # A 95 % interval may miss; by its own width it does so once in thousands.
            assert low - (high - low) < TRUTH[j, k] < high + (high - low)
        assert joint["explained"]
        assert joint["holdout"]["nrmse"] < 0.2
        assert joint["not_excited"] == {}
        matrix = np.array(joint["correlation"]["matrix"])
        np.testing.assert_allclose(np.diag(matrix), 1.0)
    assert done["condition"] == max(joint["condition"] for joint in done["joints"])
    assert "did not see" in done["scope"]
    assert done["gravity"]["share"] == pytest.approx(1.0, abs=0.1)


def test_files_are_written_and_agree(done: dict[str, Any], place: Path) -> None:
    out = place / "one"
    assert {path.name for path in out.iterdir()} == FILES
    written = json.loads((out / "three.identify.json").read_text())
    assert written == {key: value for key, value in done.items() if key != "files"}
    for path in out.glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((out / "three.identify.csv").read_text().splitlines()))
    viscous = next(row for row in rows if (row["joint"], row["parameter"]) == ("shoulder", "viscous"))
    assert float(viscous["value"]) == done["joints"][1]["viscous"]
    assert viscous["unit"] == "N m s/rad"
    assert set(written["provenance"]["inputs"]) == {"three.urdf", "run0.mcap"}


def test_the_robot_file_holds_estimates_and_intervals(done: dict[str, Any], place: Path) -> None:
    arm = load_robot(place / "one" / "three.identified.robot.yaml").robot
    for j, (joint, found) in enumerate(zip(arm.joints, done["joints"], strict=True)):
        for key, quantity in (("viscous", joint.friction.viscous), ("coulomb", joint.friction.coulomb)):
            assert float(quantity.nominal) == found[key]
            assert [float(quantity.interval.inf), float(quantity.interval.sup)] == found["interval"][key]
        assert float(joint.drive.rotor_inertia.nominal) == pytest.approx(found["reflected_inertia"])
        ends = [float(arm.disturbance[j].inf), float(arm.disturbance[j].sup)]
        np.testing.assert_allclose(ends, found["interval"]["offset"], rtol=1e-12)
        assert joint.friction.velocity_band == pytest.approx(2.0 * found["transition_width"])
    assert len(arm.bodies) == 3
    checked = CliRunner().invoke(app, ["check", str(place / "one" / "three.identified.robot.yaml")])
    assert checked.exit_code == 0, checked.output


def test_rotor_inertia_at_the_motor_and_at_the_joint(place: Path, tmp_path: Path) -> None:
    from modrob_cli.io.yaml_writer import yaml_text
    from modrob_cli.schema.from_model import robot_data

    arm = load_robot(place / "three.urdf").robot
    geared = tuple(replace(joint, drive=replace(joint.drive, gear_ratio=-50.0)) for joint in arm.joints)
    path = tmp_path / "geared.yaml"
    path.write_text(yaml_text(robot_data(replace(arm, joints=geared))))
    result = modrob(path, place / "run0.mcap", "--effort", "torque", "-o", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    for joint in json.loads(result.stdout)["joints"]:
        assert joint["rotor_inertia_side"] == "motor"
        assert joint["rotor_inertia"] == pytest.approx(joint["reflected_inertia"] / 2500.0)
        assert joint["interval"]["rotor_inertia"][1] == pytest.approx(joint["interval"]["reflected_inertia"][1] / 2500)
    written = load_robot(tmp_path / "out" / "three.identified.robot.yaml").robot
    assert float(written.joints[0].drive.rotor_inertia.nominal) * 2500.0 == pytest.approx(TRUTH[0, 3], rel=0.3)


def test_several_logs_are_fitted_together_and_alone(place: Path, tmp_path: Path) -> None:
    logs = [place / "run0.mcap", place / "run1.mcap"]
    result = modrob(place / "three.urdf", *logs, "--effort", "torque", "-o", tmp_path, "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert [log["log"] for log in found["logs"]] == [str(path) for path in logs]
    for log in found["logs"]:
        assert log["fit"][0]["coulomb"] == pytest.approx(TRUTH[0, 1], rel=0.2)
        assert log["prediction"][2]["nrmse"] < 0.3
    names = {row["log"] for row in csv.DictReader((tmp_path / "three.identify.csv").read_text().splitlines())}
    assert names == {"pooled", "run0", "run1"}
    again = modrob(
        place / "three.urdf", *logs, "--effort", "torque", "-o", tmp_path / "b", "--json", "--pooled-only",
        "--offset-per-log", "--holdout", 0,
    )  # fmt: skip
    found = json.loads(again.stdout)
    assert "fit" not in found["logs"][0]
    assert set(found["joints"][0]["offsets"]) == {"run0", "run1"}
    assert found["joints"][0]["holdout"] is None
    assert "say nothing about another log" in found["scope"]


def test_missing_gravity_is_named(place: Path, tmp_path: Path) -> None:
    recording = record(5, rate=100.0)
    still = np.zeros_like(recording.q)
    log = save(
        tmp_path / "net.mcap", recording.log, recording.log.effort - rigid_torque(recording.q, still, still)
    )  # fmt: skip
    wrong = modrob(place / "three.urdf", log, "--effort", "torque", "-o", tmp_path / "a", "--json")
    assert wrong.exit_code == 0
    found = json.loads(wrong.stdout)
    assert (found["passed"], found["explained"]) == (None, False)
    assert found["reasons"][0].startswith("gravity is missing")
    assert "verdict: no" in wrong.stderr
    assert "say --effort net-torque" in wrong.stderr
    right = modrob(place / "three.urdf", log, "--effort", "net-torque", "-o", tmp_path / "b", "--json")
    assert right.exit_code == 0, right.stderr
    found = json.loads(right.stdout)
    assert found["explained"] is True
    # Twelve seconds of noisy torque: friction and gravity are told apart to about 0.2.
    assert found["gravity"]["share"] == pytest.approx(0.0, abs=0.4)
    present = modrob(place / "three.urdf", place / "run0.mcap", "--effort", "net-torque", "-o", tmp_path / "c")
    assert "gravity is in the record" in present.stderr


def test_the_largest_nrmse_decides_the_exit_code(place: Path, tmp_path: Path) -> None:
    arguments = (place / "three.urdf", place / "run0.mcap", "--effort", "torque", "--json")
    good = modrob(*arguments, "-o", tmp_path / "a", "--max-nrmse", 0.5)
    assert (good.exit_code, json.loads(good.stdout)["passed"]) == (0, True)
    bad = modrob(*arguments, "-o", tmp_path / "b", "--max-nrmse", 0.001)
    assert (bad.exit_code, json.loads(bad.stdout)["passed"]) == (4, False)
    assert (tmp_path / "b" / "three.identify.json").exists()


def test_drive_gain_becomes_the_torque_constant(place: Path, tmp_path: Path) -> None:
    recording = record(6, rate=100.0, duration=40.0)
    gain = np.array([4.0, 8.0, 16.0])
    log = save(tmp_path / "amps.mcap", recording.log, recording.log.effort / gain)
    arguments = (place / "three.urdf", log, "--effort", "current", "-o", tmp_path / "out", "--json")
    assert modrob(*arguments).exit_code == 2  # the URDF has no torque constants
    result = modrob(*arguments, "--drive-gain")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    for j in (1, 2):
        assert found["joints"][j]["drive_gain"] == pytest.approx(gain[j], rel=0.15)
        assert found["joints"][j]["viscous"] == pytest.approx(TRUTH[j, 2], rel=0.25)
    arm = load_robot(tmp_path / "out" / "three.identified.robot.yaml").robot
    assert arm.joints[1].drive.torque_constant == pytest.approx(found["joints"][1]["drive_gain"])


def test_bounds_and_rigid_bodies_come_along(place: Path, tmp_path: Path) -> None:
    result = modrob(
        place / "three.urdf", place / "run0.mcap", "--effort", "torque", "--bounds", "--rigid-body", "-o", tmp_path,
        "--json",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert len(found["bounds"]["joints"]) == 3
    assert all(joint["inside"] == 1.0 for joint in found["bounds"]["joints"])
    assert found["rigid_body"]["count"] == len(found["rigid_body"]["parameters"])
    for path in found["files"].values():
        assert Path(path).exists(), path
    load_robot(tmp_path / "three.bounded.robot.yaml")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--holdout", "1"], "--holdout"),
        (["--holdout", "nan"], "--holdout"),
        (["--confidence", "1.5"], "--confidence"),
        (["--friction", "magic"], "--friction"),
        (["--cutoff", "-3"], "expected a number > 0"),
        (["--cutoff", "49.9999999"], None),
        (["--cutoff", "60"], "half the sampling rate"),
        (["--drive-gain"], "--effort current"),
        (["--outliers", "3"], "--bounds"),
        (["--bounds", "--outliers", "-1"], "--outliers"),
        (["--holdout", "0.999"], None),
    ],
)
def test_options_out_of_range(place: Path, tmp_path: Path, options: list[str], said: str | None) -> None:
    result = modrob(
        place / "three.urdf", place / "run0.mcap", "--effort", "torque", "-o", tmp_path / "out", *options
    )  # fmt: skip
    assert "Traceback" not in result.output
    if said is None:
        assert result.exit_code in (0, 5)
    else:
        assert result.exit_code == 2
        assert said in " ".join(result.output.split())
        assert not (tmp_path / "out").exists()


def test_effort_is_never_guessed(place: Path) -> None:
    assert modrob(place / "three.urdf", place / "run0.mcap").exit_code == 2
    assert modrob(place / "three.urdf", place / "run0.mcap", "--effort", "amps").exit_code == 2


def test_existing_outputs_are_kept(place: Path, tmp_path: Path, done: dict[str, Any]) -> None:
    arguments = (place / "three.urdf", place / "run0.mcap", "--effort", "torque", "-o", place / "one")
    before = (place / "one" / "three.identify.json").read_bytes()
    assert modrob(*arguments, "--holdout", "0.2").exit_code == 6
    assert (place / "one" / "three.identify.json").read_bytes() == before


def test_faults_of_all_logs_and_short_logs(place: Path, tmp_path: Path) -> None:
    short = record(7, duration=0.2).log
    log = save(tmp_path / "short.mcap", short)
    result = modrob(place / "three.urdf", log, "--effort", "torque", "-o", tmp_path / "out")
    assert result.exit_code == 5
    assert "short lasts" in result.stderr
    both = modrob(
        place / "three.urdf", place / "run0.mcap", log, "--effort", "torque", "-o", tmp_path / "out", "--json"
    )
    assert both.exit_code == 5
    assert json.loads(both.stdout)["skipped"][0]["log"] == str(log)
    missing = modrob(place / "three.urdf", tmp_path / "none.mcap", tmp_path / "nor.mcap", "--effort", "torque")
    assert missing.exit_code == 3
    assert "none.mcap: file not found" in missing.stderr
    assert "nor.mcap: file not found" in missing.stderr
