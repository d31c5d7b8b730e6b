"""``modrob simulate`` as a user runs it."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from typer.testing import Result

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.trajectory_motion import load_trajectory

Modrob = Callable[..., Result]
Columns = dict[str, dict[str, Array]]

ROOT = Path(__file__).parents[2]
ARM = ROOT / "assemblies" / "lwa4p-6.yaml"
UNSURE = ROOT / "assemblies" / "lwa4p-6-tol5.yaml"
MOVE = """\
modrob: trajectory/1
name: move
kind: waypoints
order: 5
points:
- {t: 0, q: [0.2, -0.5, 1.2, 0, 0.6, 0]}
- {t: 1, q: [0.6, -0.9, 0.8, 0.3, 0.2, 0.5]}
"""
PUSHED = """\
modrob: scenario/1
name: pushed
control: {name: id}
payload: {mass: 1, com: [0, 0, 0.05]}
contacts:
- {name: push, link: PB3.1, point: [0, 0, 0.1], force: [0, 0, -30], start: 0.3, duration: 0.2}
"""


@pytest.fixture
def move(tmp_path: Path) -> Path:
    path = tmp_path / "move.yaml"
    path.write_text(MOVE)
    return path


def run(modrob: Modrob, move: Path, *options: object, robot: Path = ARM, log: str = "out/run.mcap") -> Result:
    return modrob("simulate", robot, move, *options, "-o", move.parent / log)


def scenario(move: Path, text: str) -> Path:
    path = move.parent / "scenario.yaml"
    path.write_text(text)
    return path


def by_mcap(path: Path) -> tuple[Columns, dict[str, Array]]:
    """Lists of numbers by topic and field, and log times, by mcap's own reader."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return collected((c.topic, m.log_time, d) for _, c, m, d in reader.iter_decoded_messages())


def by_rosbags(path: Path) -> tuple[Columns, dict[str, Array]]:
    from rosbags.highlevel import AnyReader

    with AnyReader([path]) as reader:
        return collected((c.topic, time, reader.deserialize(raw, c.msgtype)) for c, time, raw in reader.messages())


def collected(messages: Any) -> tuple[Columns, dict[str, Array]]:
    fields = {
        "/joint_states": ("position", "velocity", "effort"),
        "/truth": (
            "position", "velocity", "acceleration", "motor_torque", "friction_torque", "external_torque",
        ),
        "/perturbation": ("perturbation", "lower", "upper"),
        "/controller_state": ("reference.positions", "reference.velocities", "reference.accelerations",
                              "feedback.positions", "error.velocities", "output.effort"),
    }  # fmt: skip
    found: dict[str, dict[str, list[Any]]] = {}
    times: dict[str, list[int]] = {}
    for topic, time, message in messages:
        times.setdefault(topic, []).append(time)
        for name in fields.get(topic, ()):
            value = message
            for part in name.split("."):
                value = getattr(value, part)
            found.setdefault(topic, {}).setdefault(name, []).append(value)
        if topic.startswith("/contacts/"):
            force = message.wrench.force
            found.setdefault(topic, {}).setdefault("force", []).append([force.x, force.y, force.z])
    arrays = {topic: {name: np.array(rows) for name, rows in columns.items()} for topic, columns in found.items()}
    return arrays, {topic: np.array(stamps) for topic, stamps in times.items()}


def test_log_holds_together_and_two_readers_agree(modrob: Modrob, move: Path) -> None:
    result = run(modrob, move, "--scenario", scenario(move, PUSHED), "--json")
    assert result.exit_code == 0, result.stderr
    path = move.parent / "out" / "run.mcap"
    log, times = by_mcap(path)
    other, other_times = by_rosbags(path)
    for topic, columns in log.items():
        np.testing.assert_array_equal(times[topic], other_times[topic])
        for name, values in columns.items():
            np.testing.assert_array_equal(values, other[topic][name])
    # Ideal sensors: what is measured is true. 1001 samples, 1 ms apart.
    np.testing.assert_array_equal(np.diff(times["/joint_states"]), np.full(1000, 10**6))
    truth, measured, control = log["/truth"], log["/joint_states"], log["/controller_state"]
    np.testing.assert_array_equal(measured["position"], truth["position"])
    np.testing.assert_array_equal(measured["velocity"], truth["velocity"])
    np.testing.assert_array_equal(measured["effort"][1:], truth["motor_torque"][:-1])
    desired = load_trajectory(move).trajectory.sample(np.arange(1001) * 1e-3, 2)
    for k, name in enumerate(("positions", "velocities", "accelerations")):
        np.testing.assert_array_equal(control[f"reference.{name}"], desired[:, k])
    force = log["/contacts/push"]["force"]
    inside = (np.arange(1001) >= 300) & (np.arange(1001) < 500)
    np.testing.assert_array_equal(force[:, 2], np.where(inside, -30.0, 0.0))
    data = json.loads(result.stdout)
    assert data["diverged"] is None
    assert data["contacts"][0]["start"] == 0.3
    # Fourth order at 1 ms: the balance closes far below this.
    assert data["energy_error"] < 1e-7


def test_truth_obeys_newton_and_euler(modrob: Modrob, move: Path) -> None:
    """Motor torque less friction plus contacts is what Pinocchio's inverse dynamics asks for, payload included."""
    assert run(modrob, move, "--scenario", scenario(move, PUSHED)).exit_code == 0
    truth = by_mcap(move.parent / "out" / "run.mcap")[0]["/truth"]
    robot = load_robot(ARM).robot
    model = build_model(robot)
    payload = pin.Inertia(1.0, np.array([0.0, 0.0, 0.05]), np.zeros((3, 3)))
    model.appendBodyToJoint(6, payload, pin.SE3(robot.tool_transform))
    model.armature = np.array([j.drive.gear_ratio**2 * float(j.drive.rotor_inertia.nominal) for j in robot.joints])
    data = model.createData()
    net = truth["motor_torque"] - truth["friction_torque"] + truth["external_torque"]
    for k in range(0, 1001, 10):
        state = (truth[key][k] for key in ("position", "velocity", "acceleration"))
        np.testing.assert_allclose(pin.rnea(model, data, *state), net[k], rtol=0.0, atol=1e-9)  # of some 50 N m
    # A joint that moves has its viscous and Coulomb torque against it.
    dq = truth["velocity"]
    friction = [joint.friction for joint in robot.joints]
    viscous, coulomb = ([float(getattr(part, key).nominal) for part in friction] for key in ("viscous", "coulomb"))
    moving = dq != 0.0
    assert moving.mean() > 0.8
    np.testing.assert_allclose(truth["friction_torque"][moving], (dq * viscous + np.sign(dq) * coulomb)[moving])


def test_same_seed_same_bytes(modrob: Modrob, move: Path) -> None:
    noisy = scenario(
        move,
        "modrob: scenario/1\nname: noisy\ncontrol: {name: pb}\ntruth: {draw: uniform}\n"
        "sensors: {position: {noise: 1.0e-5}, velocity: {noise: 1.0e-3}, effort: {noise: 0.1}, jitter: 1.0e-5}\n",
    )
    raw = []
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        result = run(modrob, move, "--scenario", noisy, "--seed", seed, robot=UNSURE, log=f"{name}/run.mcap")
        assert result.exit_code == 0, result.stderr
        raw.append([(move.parent / name / f"run.{end}").read_bytes() for end in ("mcap", "simulate.json")])
    assert raw[0] == raw[1]
    assert raw[0][0] != raw[2][0]


def test_sweep_draws_members_of_the_box(modrob: Modrob, move: Path) -> None:
    result = run(modrob, move, "--controller", "id", "--sweep", 3, "--json", robot=UNSURE)
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    assert [Path(entry["log"]).name for entry in data["runs"]] == ["run-1.mcap", "run-2.mcap", "run-3.mcap"]
    bodies = {placed.body.name: placed.body for placed in load_robot(UNSURE).robot.bodies}
    masses = set()
    for entry in data["runs"]:
        assert Path(entry["log"]).is_file()
        for true in entry["truth"]["bodies"]:
            assert bodies[true["name"]].mass.interval.contains(np.array(true["mass"]))
            masses.add(true["mass"])
    assert len(masses) == 3 * len(data["runs"][0]["truth"]["bodies"])
    with (move.parent / "out" / "run.sweep.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["log"] for row in rows] == ["run-1.mcap", "run-2.mcap", "run-3.mcap"]
    assert (move.parent / "out" / "run.sweep.png").read_bytes()[:4] == b"\x89PNG"
    # Run k is the same in a sweep of another length.
    assert run(modrob, move, "--controller", "id", "--sweep", 2, robot=UNSURE, log="two/run.mcap").exit_code == 0
    assert (move.parent / "two" / "run-2.mcap").read_bytes() == (move.parent / "out" / "run-2.mcap").read_bytes()


def test_loop_that_runs_away_leaves_its_log(modrob: Modrob, move: Path) -> None:
    wild = "modrob: scenario/1\nname: wild\nsaturation: false\nend_stops: false\n"
    own = move.parent / "pushes.py"
    own.write_text(
        "class Pushes:\n"
        "    def torque(self, t, q, dq, desired):\n"
        "        return 1e6 * (1.0 + q - desired.q)\n\n\n"
        "def make_controller(task):\n    return Pushes()\n"
    )
    result = run(modrob, move, "--scenario", scenario(move, wild), "--controller", own, "--json")
    assert result.exit_code == 4
    assert "ran away after" in result.stderr
    data = json.loads(result.stdout)
    assert 0.0 < data["diverged"] < 1.0
    assert len(by_mcap(move.parent / "out" / "run.mcap")[1]["/truth"]) == data["samples"]


def moved(change: Callable[[str], str]) -> Callable[[Path], list[object]]:
    """Options for the motion after a change of its text."""

    def make(move: Path) -> list[object]:
        move.write_text(change(MOVE))
        return ["--controller", "id"]

    return make


def with_scenario(text: str) -> Callable[[Path], list[object]]:
    return lambda move: ["--scenario", scenario(move, f"modrob: scenario/1\nname: s\n{text}\n")]


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (moved(lambda text: text.replace(", 0.6, 0]", ", 0.6]").replace(", 0.5]", "]")), 3, ("5 joints", "PB3.2")),
        (moved(lambda text: text.replace("t: 1,", "t: 0,")), 3, ("points[1].t", "times increase")),
        (moved(lambda text: text[: text.rindex("- {t: 1")]), 3, ("at least 2",)),
        (moved(lambda text: text.replace("[0.6,", "[3.6,")), 4, ("PB1.1", "position 3.6", "2.9671")),
        (lambda move: [], 2, ("--controller", "feedforward-pd")),
        (lambda move: ["--controller", "best"], 2, ("best", "pb-afc")),
        (with_scenario("control: {name: pb, gains: {error: [1, 2]}}"), 3, ("gains.error", "2 values, expected 6")),
        (with_scenario("control: {name: id, gains: {kp: 3}}"), 2, ("kp", "frequency")),
        (with_scenario("control: {name: id, rate: 1000}\nsensors: {rate: 300}"), 3, ("$.sensors", "300 Hz")),
        (with_scenario("control: {name: pid, gains: {inertia: 0}}"), 2, ("the gain inertia is missing: PB1.1",)),
        (with_scenario("control: {name: id}\ntruth: {bodies: {L1: {mass: 9}}}"), 3, ("L1", "mass", "9")),
    ],
)
def test_bad_input_is_named(
    modrob: Modrob, move: Path, options: Callable[[Path], list[object]], code: int, words: tuple[str, ...]
) -> None:
    result = run(modrob, move, *options(move))
    assert result.exit_code == code, result.stderr
    for word in words:
        assert word in result.stderr
    assert not (move.parent / "out").exists()


def test_names_of_outputs(modrob: Modrob, move: Path) -> None:
    assert run(modrob, move, "--controller", "id", log="run.bag").exit_code == 2
    assert run(modrob, move, "--controller", "id").exit_code == 0
    assert run(modrob, move, "--controller", "id").exit_code == 6
    assert run(modrob, move, "--controller", "id", "--overwrite").exit_code == 0


def test_log_is_validated_without_naming_a_topic(modrob: Modrob, move: Path) -> None:
    assert run(modrob, move, "--controller", "id").exit_code == 0
    result = modrob(
        "validate", ARM, move.parent / "out" / "run.mcap", "--effort", "torque", "--json", "-o", move.parent / "v"
    )
    assert result.exit_code == 0, result.stderr
    joints = json.loads(result.stdout)["logs"][0]["joints"]
    assert max(joint["nrmse"] for joint in joints) < 0.5


@pytest.mark.parametrize("bounds", ["exact", "ianea"])
def test_interval_controllers_log_their_bounds(modrob: Modrob, move: Path, bounds: str) -> None:
    result = run(modrob, move, "--controller", "ia-pb", "--bounds", bounds, "--sweep", 1, "--json", robot=UNSURE)
    assert result.exit_code == 0, result.output
    single = run(modrob, move, "--controller", "ia-id", "--bounds", bounds, "--json", robot=UNSURE, log="one/run.mcap")
    assert single.exit_code == 0, single.output
    for text in (json.loads(result.stdout)["runs"][0], json.loads(single.stdout)):
        found = text["perturbation"]
        assert found["bounds"] == bounds
        assert found["violations"] == 0
        assert all(joint["mean_width"] > 0.0 and joint["violations"] == 0 for joint in found["joints"])
    assert (move.parent / "one" / "run.perturbation.png").stat().st_size > 10_000
    read = by_mcap(move.parent / "one" / "run.mcap")[0]["/perturbation"]
    inside = (read["lower"] <= read["perturbation"]) & (read["perturbation"] <= read["upper"])
    assert read["perturbation"].shape == (1001, 6)
    assert inside.all()
    # the true robot is the nominal one; only near standstill its friction is not the straight line of friction_band
    assert np.median(np.abs(read["perturbation"])) < 1e-9


def test_unknown_bounds_are_refused(modrob: Modrob, move: Path) -> None:
    result = run(modrob, move, "--controller", "ia-pb", "--bounds", "best", robot=UNSURE)
    assert result.exit_code == 2
    assert "found best, expected exact or ianea" in result.output


def test_controllers_without_bounds_have_no_perturbation(modrob: Modrob, move: Path) -> None:
    result = run(modrob, move, "--controller", "id", "--json")
    assert json.loads(result.stdout)["perturbation"] is None
    assert not (move.parent / "out" / "run.perturbation.png").exists()


def test_a_task_of_the_tool_is_simulated(modrob: Modrob, tmp_path: Path) -> None:
    task = "modrob: task/1\nname: t\nstart: [0, -1.7, -1.8, 0.4, -1.4, 0]\nframe: start\n"
    (tmp_path / "task.yaml").write_text(f"{task}moves:\n- {{duration: 0.5, xyz: [0, 0.01, 0]}}\n")
    log = tmp_path / "out" / "run.mcap"
    result = modrob("simulate", ARM, tmp_path / "task.yaml", "--controller", "id", "-o", log, "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["duration"] == 1.0  # half a second to come to rest
