"""``modrob identify --rigid-body`` as a user runs it: a robot file with too light a link, a log of the true arm."""

import csv
import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from modrob_cli.cli.app import app
from modrob_cli.model.realizable import realizability
from modrob_cli.workflows.robots import load_robot
from tests.identify_samples import URDF, record
from tests.mcap_samples import joint_state, write_mcap


def test_the_wrong_link_is_named_and_a_better_robot_is_written(tmp_path: Path) -> None:
    """The second mass of the file is too small, the true one 20 % larger: 0.5 kg at 0.2 m, so the noise is little."""
    log = record(7, duration=40.0, rate=100.0, noise=0.1).log
    rows = [joint_state(10.0 + log.t[k], log.joint_names, log.q[k], effort=log.effort[k]) for k in range(len(log.t))]
    run = write_mcap(tmp_path / "run.mcap", {"/joint_states": rows})
    masses = re.findall(r'<mass value="([0-9.]+)"', URDF)
    true = float(masses[-2])
    model = tmp_path / "three.urdf"
    model.write_text(URDF.replace(f'<mass value="{masses[-2]}"', f'<mass value="{true / 1.2!r}"'))
    names = [placed.link for placed in load_robot(model).robot.bodies if placed.body.mass.nominal == true / 1.2]
    command = ["identify", str(model), str(run), "--effort", "torque", "--rigid-body", "-o", str(tmp_path), "--json"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)["rigid_body"]
    first = found["suspects"][0]
    assert [first["link"]] == names
    assert first["mass_factor"] == pytest.approx(1.2, abs=0.06)  # standard error 0.015
    assert first["text"] in result.stderr
    assert found["physical"]["links"][first["link"] - 1]["mass"] == pytest.approx(true, rel=0.1)
    robot = load_robot(tmp_path / "three.rigid-body.robot.yaml").robot
    assert all(realizability(placed.body).nominal for placed in robot.bodies if placed.link)
    with (tmp_path / "three.identify.rigid-body.csv").open(newline="", encoding="utf-8") as stream:
        assert [row["parameter"] for row in csv.DictReader(stream)] == [item["name"] for item in found["parameters"]]
