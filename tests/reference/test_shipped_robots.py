"""Every shipped assembly: the files it gives describe one and the same robot, with Pinocchio as the judge."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from typer.testing import CliRunner

from modrob_cli.cli.app import app
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.io.urdf_reader import read_urdf
from modrob_cli.workflows.robots import load_robot

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "assemblies").glob("*.yaml"))
STATES = 20


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """JSON of all shipped robots by name."""
    out = tmp_path_factory.mktemp("shipped")
    result = CliRunner().invoke(app, ["assemble", *map(str, SHIPPED), "-o", str(out), "--json"], catch_exceptions=False)
    assert result.exit_code == 0, result.stderr
    return {robot["name"]: robot for robot in json.loads(result.stdout)["robots"]}


def torques(model: Any, states: Any) -> Any:
    data = model.createData()
    return np.stack([pin.rnea(model, data, *state).copy() for state in states])


def tool(model: Any, q: Any, frame: str) -> Any:
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId(frame)].homogeneous


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_urdf_loads_in_pinocchio_with_equal_torques_and_poses(path: Path, built: dict[str, Any]) -> None:
    robot = load_robot(path).robot
    rng = np.random.default_rng(34)
    states = rng.uniform(-2.0, 2.0, (STATES, 3, robot.dof))
    urdf = pin.buildModelFromUrdf(built[robot.name]["files"]["urdf"])
    urdf.gravity = pin.Motion(robot.gravity, np.zeros(3))  # URDF cannot say it
    assert urdf.nq == robot.dof
    assert list(urdf.names)[1:] == list(robot.joint_names)
    expected = torques(build_model(robot), states)
    scale = max(1.0, float(np.abs(expected).max()))
    assert np.abs(torques(urdf, states) - expected).max() < 1e-9 * scale
    for q in states[:, 0]:
        np.testing.assert_allclose(tool(urdf, q, "tool0"), robot.link_frames(q)[-1], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_robot_file_and_urdf_read_back_as_the_same_robot(path: Path, built: dict[str, Any]) -> None:
    robot = load_robot(path).robot
    files = built[robot.name]["files"]
    again = load_robot(Path(files["robot"])).robot
    rng = np.random.default_rng(35)
    states = rng.uniform(-2.0, 2.0, (STATES, 3, robot.dof))
    expected = torques(build_model(robot), states)
    scale = max(1.0, float(np.abs(expected).max()))
    assert np.abs(torques(build_model(again), states) - expected).max() < 1e-12 * scale
    assert again.joint_names == robot.joint_names
    for mine, theirs in zip(robot.bodies, again.bodies, strict=True):
        assert mine.link == theirs.link
        for quantity in ("mass", "com", "inertia"):
            before, after = getattr(mine.body, quantity), getattr(theirs.body, quantity)
            np.testing.assert_array_equal(before.nominal, after.nominal)
            np.testing.assert_array_equal(before.interval.inf, after.interval.inf)
            np.testing.assert_array_equal(before.interval.sup, after.interval.sup)
    for joint, same in zip(robot.joints, again.joints, strict=True):
        assert joint.limits == same.limits
        assert float(joint.friction.viscous.nominal) == float(same.friction.viscous.nominal)
        assert joint.drive.gear_ratio == same.drive.gear_ratio
    from_urdf = read_urdf(Path(files["urdf"]))
    model = build_model(from_urdf)
    model.gravity = pin.Motion(robot.gravity, np.zeros(3))
    assert np.abs(torques(model, states) - expected).max() < 1e-9 * scale


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_intervals_hold_the_nominal_values(path: Path, built: dict[str, Any]) -> None:
    robot = built[load_robot(path).robot.name]
    for link, tight, published in zip(robot["links"], robot["intervals"], robot["intervals_published"], strict=True):
        values = [link["mass"], *link["com"], *link["inertia_com"]]
        inner = [tight["mass"], *tight["com"], *tight["inertia_com"]]
        outer = [published["mass"], *published["com"], *published["inertia_com"]]
        for value, (low, high), (below, above) in zip(values, inner, outer, strict=True):
            assert low <= value <= high
            # A published end is null where the recursion divides by a mass that may be zero. Where both forms are
            # exact they differ by what each adds for rounding and for the search: 1e-9 of terms up to 10 kg m^2.
            assert below is None or below <= low + 1e-9
            assert above is None or above >= high - 1e-9


def test_power_balls_alone_have_no_nan(built: dict[str, Any]) -> None:
    """Table 3.4's modules without links: every second link is massless."""
    balls = built["lwa4p-4-balls"]
    assert [link["mass"] for link in balls["links"]] == [3.9, 0.0, 3.9, 0.0]
    numbers = np.array([[*link["com"], *link["inertia_com"]] for link in balls["links"]])
    assert np.isfinite(numbers).all()
    assert np.all(numbers[[1, 3]] == 0.0)
