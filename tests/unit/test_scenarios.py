"""Scenario documents: every key reaches the model, and every fault is found at its place."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli.errors import InputFileError
from modrob_cli.io.documents import read_document
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Scenario
from modrob_cli.schema import ScenarioDocument
from modrob_cli.simulate.controllers.shipped import CONTROLLERS
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.scenarios import load_scenario

ROBOT = """\
modrob: robot/1
name: two
joints:
- name: j1
  type: revolute
  dh: {a: 0.5}
  friction: {viscous: {nominal: 2, tol: 10%}, coulomb: {nominal: 1, min: 0.5, max: 2}, coulomb_band: 0.3}
  rotor_inertia: {nominal: 1e-4, tol: 1e-5}
  gear_ratio: 50
  torque_constant: 0.1
  limits: {position: [-90 deg, 90 deg]}
- {name: j2, type: revolute, dh: {a: 0.4}, torque_constant: 0.1}
bodies:
- name: upper
  link: 1
  mass: {nominal: 3, tol: 10%}
  com: [{nominal: -0.25, tol: 0.01}, 0, 0]
  inertia: {xx: 0.01, yy: 0.06, zz: {nominal: 0.06, tol: 5%}}
- {name: lower, link: 2, mass: 2, com: [-0.2, 0, 0], inertia: {xx: 0.01, yy: 0.03, zz: 0.03}}
tool_transform: {xyz: [0.1, 0.2, 0.3], rpy: [0, 0, 90 deg]}
disturbance: [[-1, 2], 0.5]
"""

EVERYTHING = """\
modrob: scenario/1
name: all
source: here
description: every key
seed: 12
control:
  name: pb
  gains: {error: 40, damping: [20, 10]}
  rate: 800
  friction: desired
  friction_band: 2 deg
  bounds: ianea
input_disturbance: [1, 2.5]
truth:
  draw: vertices
  breakaway: 1.25
  bodies:
    upper: {mass: 3.2, com: [-0.245, 0, 0], inertia: {xx: 0.01, yy: 0.06, zz: 0.061}}
    lower: {inertia: [[0.01, 0, 0], [0, 0.03, 0], [0, 0, 0.03]]}
  joints:
    j1: {viscous: 2.1, coulomb: 0.7, rotor_inertia: 9.5e-5, friction_offset: -0.2, disturbance: 1.5}
payload:
  {mass: 1.5, com: [0, 0.1, 0.2], inertia: {xx: 2, yy: 2.5, zz: 3, xy: 0.1, xz: 0.2, yz: 0.3}, inertia_about: frame}
contacts:
- {name: a, link: j2, point: [0.1, 0.2, 0.3], force: [1, 2, 3], start: 1, duration: 0.5, frame: link, shape: half-sine}
- {name: b, link: 1, force: [4, 5, 6], start: 100, duration: 1e-3}
- {name: c, link: base, force: [0, 0, 0], start: 0, duration: 1}
- {name: d, link: tool, point: [1, 0, 0], force: [0, 7, 0], start: 0, duration: 1, frame: link}
- {name: e, link: tool, point: [0, 1, 0], force: [0, 7, 0], start: 0, duration: 1}
sensors:
  rate: 200
  noise: uniform
  position: {noise: 0.01 deg, resolution: [1e-4, 2e-4]}
  velocity: {noise: [1e-3, 2e-3], resolution: 1e-5}
  effort: {noise: 0.3, resolution: [0.01, 0.02]}
  velocity_source: differentiated
  effort_kind: current
  delay: 0.01
  jitter: 2e-4
sub_steps: 3
end_stops: false
saturation: false
initial: {q: [0.1, -5 deg], dq: [0.2, 0]}
"""


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    path = tmp_path / "two.yaml"
    path.write_text(ROBOT)
    return load_robot(path).robot


@pytest.fixture
def load(tmp_path: Path, robot: Robot) -> Any:
    def of(text: str) -> Scenario:
        path = tmp_path / "scenario.yaml"
        path.write_text(text)
        loaded = load_scenario(path, robot)
        assert loaded.files == [path]
        return loaded.scenario

    return of


def test_every_key_reaches_the_model(load: Any) -> None:
    found = load(EVERYTHING)
    assert (found.name, found.seed, found.sub_steps, found.end_stops, found.saturation) == ("all", 12, 3, False, False)
    control = found.control
    assert (control.name, control.rate, control.friction) == ("pb", 800.0, "desired")
    assert control.gains == {"error": 40.0, "damping": (20.0, 10.0)}
    assert control.friction_band == pytest.approx(2 * np.pi / 180, rel=1e-15)
    assert control.bounds == "ianea"
    assert load(EVERYTHING).input_disturbance == (1.0, 2.5)
    truth = found.truth
    assert (truth.draw, truth.breakaway) == ("vertices", 1.25)
    assert truth.bodies["upper"]["mass"] == 3.2
    np.testing.assert_array_equal(truth.bodies["upper"]["com"], [-0.245, 0, 0])
    np.testing.assert_array_equal(truth.bodies["upper"]["inertia"], [0.01, 0, 0, 0.06, 0, 0.061])
    assert list(truth.bodies["lower"]) == ["inertia"]
    np.testing.assert_array_equal(truth.bodies["lower"]["inertia"], [0.01, 0, 0, 0.03, 0, 0.03])
    wanted = {"viscous": 2.1, "coulomb": 0.7, "rotor_inertia": 9.5e-5, "friction_offset": -0.2, "disturbance": 1.5}
    assert truth.joints == {"j1": wanted}
    payload = found.payload
    assert (float(payload.mass.nominal), payload.inertia_about) == (1.5, "frame")
    np.testing.assert_array_equal(payload.com.nominal, [0, 0.1, 0.2])
    np.testing.assert_array_equal(payload.inertia.nominal, [2, 0.1, 0.2, 2.5, 0.3, 3])
    sensors = found.sensors
    assert (sensors.rate, sensors.noise, sensors.velocity_source) == (200.0, "uniform", "differentiated")
    assert (sensors.effort_kind, sensors.delay, sensors.jitter) == ("current", 0.01, 2e-4)
    assert sensors.position.noise == pytest.approx(0.01 * np.pi / 180, rel=1e-15)
    assert (sensors.position.resolution, sensors.velocity.noise) == ((1e-4, 2e-4), (1e-3, 2e-3))
    assert (sensors.velocity.resolution, sensors.effort.noise) == (1e-5, 0.3)
    assert sensors.effort.resolution == (0.01, 0.02)
    np.testing.assert_allclose(found.initial_q, [0.1, -np.pi / 36], rtol=1e-15)
    np.testing.assert_array_equal(found.initial_dq, [0.2, 0])


def test_contacts_are_in_the_frame_of_their_link(load: Any) -> None:
    a, b, c, d, e = load(EVERYTHING).contacts
    assert [contact.name for contact in (a, b, c, d, e)] == ["a", "b", "c", "d", "e"]
    assert [contact.link for contact in (a, b, c, d, e)] == [2, 1, 0, 2, 2]
    np.testing.assert_array_equal(a.point, [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(a.force, [1, 2, 3])
    assert (a.start, a.duration, a.frame, a.shape) == (1.0, 0.5, "link", "half-sine")
    np.testing.assert_array_equal(b.point, [0, 0, 0])
    assert (b.start, b.duration, b.frame, b.shape) == (100.0, 1e-3, "base", "constant")
    # The link's frame is that of the joint: dh.a = 0.4 away; the tool is turned by 90 deg about z.
    # Tolerances: one rounding of the cosine of 90 deg, 6e-17, and of sums below 2.
    np.testing.assert_allclose(d.point, [0.4 + 0.1, 0.2 + 1.0, 0.3], atol=1e-15)
    np.testing.assert_allclose(d.force, [-7, 0, 0], atol=1e-14)
    np.testing.assert_allclose(e.point, [0.4 + 0.1 - 1.0, 0.2, 0.3], atol=1e-15)
    np.testing.assert_array_equal(e.force, [0, 7, 0])


def test_the_point_of_a_tool_contact_is_where_the_arm_has_it(load: Any, robot: Robot) -> None:
    contact = load(EVERYTHING).contacts[3]
    q = np.array([0.3, -0.8])
    frames = robot.link_frames(q)
    tip = (frames[-1] @ [1.0, 0.0, 0.0, 1.0])[:3]
    np.testing.assert_allclose((frames[contact.link - 1] @ [*contact.point, 1.0])[:3], tip, atol=1e-14)


def test_a_joint_of_that_name_goes_before_tool_and_base(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text(ROBOT.replace("name: j1", "name: tool").replace("name: j2", "name: base"))
    contacts = "".join(
        f"- {{name: {x}, link: {x}, force: [1, 0, 0], start: 0, duration: 1}}\n" for x in ("tool", "base")
    )
    (tmp_path / "s.yaml").write_text(f"modrob: scenario/1\nname: s\ncontacts:\n{contacts}")
    found = load_scenario(tmp_path / "s.yaml", load_robot(tmp_path / "arm.yaml").robot).scenario
    assert [contact.link for contact in found.contacts] == [1, 2]


def test_defaults_are_those_of_the_model(load: Any, robot: Robot) -> None:
    assert load_scenario(None, robot).files == []
    assert load_scenario(None, robot).scenario == Scenario()
    assert load("modrob: scenario/1\nname: default\n") == Scenario()
    shipped = load_scenario(shipped_folder("scenarios") / "default.yaml", robot).scenario
    assert shipped == Scenario()


def keys_of(schema: dict[str, Any], node: dict[str, Any]) -> set[str]:
    """All keys of a JSON schema and of the objects inside, as paths; bodies stand for themselves."""
    node = schema["$defs"][node["$ref"].rsplit("/", 1)[-1]] if "$ref" in node else node
    out = set()
    for key, below in node.get("properties", {}).items():
        out |= {key, *(f"{key}.{inner}" for inner in keys_of(schema, below))}
    return out


def test_shipped_examples_say_every_key() -> None:
    schema = ScenarioDocument.model_json_schema()
    wanted = keys_of(schema, schema)
    assert {"control.friction_band", "sensors.position.noise", "truth.breakaway", "initial.q"} <= wanted

    def said(value: Any, prefix: str = "") -> set[str]:
        if not isinstance(value, dict):
            return set()
        return {f"{prefix}{key}" for key in value} | {
            path for key, below in value.items() for path in said(below, f"{prefix}{key}.")
        }

    for name in ("default", "everything"):
        _, text = read_document(shipped_folder("scenarios") / f"{name}.yaml", ScenarioDocument)
        assert wanted <= said(text.data), name


@pytest.mark.parametrize("path", sorted(shipped_folder("scenarios").glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_scenarios_fit(path: Path) -> None:
    assemblies = shipped_folder("assemblies")
    document, _ = read_document(path, ScenarioDocument)
    of_six = path.stem in ("everything", "hit-and-push")
    of_six = of_six or any(isinstance(gain, list) for gain in document.control.gains.values())
    names = ["lwa4p-6-tol5"] if of_six else ["lwa4p-6-tol5", "scara", "2r-side"]
    if path.stem.startswith(("r-v", "d-3-5")):  # published studies: their own arms
        names = ["lwa4p-rtable1"] if path.stem.startswith("r-v") else ["planar-2r", "planar-2r-printed"]
    for name in names:
        assert load_scenario(path, load_robot(assemblies / f"{name}.yaml").robot).scenario.name == path.stem


HEAD = "modrob: scenario/1\nname: s\n"
CONTACT = "{name: a, link: tool, force: [1, 0, 0], start: 1, duration: 1}"


@pytest.mark.parametrize(
    ("text", "where", "message"),
    [
        ("seed: -1", "3:1: $.seed", "greater than or equal to 0"),
        ("seed: 1.5", "3:1: $.seed", "integer"),
        ("seed: 9223372036854775808", "3:1: $.seed", "valid integer"),
        ("sub_steps: 0", "$.sub_steps", "greater than or equal to 1"),
        ("sub_steps: 1001", "$.sub_steps", "less than or equal to 1000"),
        ("end_stops: 1", "$.end_stops", "boolean"),
        ("contact: []", "$.contact", "did you mean contacts?"),
        ("control: {rate: 0}", "$.control.rate", "greater than or equal to 1"),
        ("control: {rate: .inf}", "$.control.rate", "finite"),
        ("control: {gain: {}}", "$.control.gain", "did you mean gains?"),
        ("control: {gains: {error: a}}", "$.control.gains.error", "valid number"),
        ("control: {gains: {error: []}}", "$.control.gains.error", "at least 1"),
        ("control: {gains: {error: [1, .nan]}}", "$.control.gains.error", "finite"),
        ("control: {gains: {error: [1, 2, 3]}}", "$.control.gains.error", "found 3 values, expected 2: j1, j2"),
        ("control: {friction: always}", "$.control.friction", "'measured', 'desired' or 'none'"),
        ("control: {friction_band: -1 deg}", "$.control.friction_band", "greater than or equal to 0"),
        ("control: {name: pd}", "3:11: $.control.name", "'pd', expected feedforward-pd, pid, id, pb, pb-afc, ia-id"),
        ("control: {bounds: tight}", "$.control.bounds", "'exact' or 'ianea'"),
        ("input_disturbance: -1", "$.input_disturbance", "greater than or equal to 0"),
        ("input_disturbance: [1, 2, 3]", "$.input_disturbance", "found 3 values, expected 2: j1, j2"),
        ("control: {name: none.py}", "3:11: $.control.name", "none.py: file not found"),
        ("control: {name: 'none.py:a b'}", "$.control.name", "expected FILE.py or FILE.py:NAME"),
        ("control: {name: ''}", "$.control.name", "at least 1 character"),
        ("truth: {draw: normal}", "$.truth.draw", "'nominal', 'uniform' or 'vertices'"),
        ("truth: {breakaway: 0.99}", "$.truth.breakaway", "greater than or equal to 1"),
        ("truth:\n  bodies:\n    uper: {mass: 3}", "5:5: $.truth.bodies.uper", "did you mean upper?"),
        ("truth: {bodies: {upper: {mass: 3.4}}}", "$.truth.bodies.upper.mass", "found 3.4, the robot's file admits"),
        ("truth: {bodies: {upper: {mass: -1}}}", "$.truth.bodies.upper.mass", "greater than or equal to 0"),
        ("truth: {bodies: {upper: {com: [-0.2, 0, 0]}}}", "$.truth.bodies.upper.com[0]", "admits -0.26 to -0.24"),
        ("truth: {bodies: {upper: {com: [-0.25, 0]}}}", "$.truth.bodies.upper.com", "at least 3"),
        (
            "truth: {bodies: {upper: {inertia: {xx: 0.01, yy: 0.06, zz: 0.07}}}}",
            "$.truth.bodies.upper.inertia.zz",
            "found 0.07, the robot's file admits 0.057 to 0.063",
        ),
        ("truth: {bodies: {upper: {inertia: {zz: {nominal: 1, tol: 1}}}}}", "$.truth.bodies.upper.inertia", "exact"),
        ("truth: {bodies: {upper: {weight: 1}}}", "$.truth.bodies.upper.weight", "known keys: com, inertia, mass"),
        ("truth: {joints: {j3: {viscous: 1}}}", "$.truth.joints.j3", "expected one of the robot two: j1, j2"),
        ("truth: {joints: {j1: {viscous: 3}}}", "$.truth.joints.j1.viscous", "admits 1.8 to 2.2"),
        ("truth: {joints: {j1: {friction_offset: 0.4}}}", "$.truth.joints.j1.friction_offset", "admits -0.3 to 0.3"),
        ("truth: {joints: {j1: {disturbance: -1.5}}}", "$.truth.joints.j1.disturbance", "admits -1 to 2"),
        ("truth: {joints: {j2: {coulomb: 1}}}", "$.truth.joints.j2.coulomb", "admits 0 to 0"),
        ("payload: {mass: {nominal: 2, tol: 5%}}", "3:11: $.payload.mass", "leave out min, max and tol"),
        ("payload: {mass: 2, com: [0, 0, {nominal: 1, min: 0, max: 1}]}", "$.payload.com", "leave out min"),
        ("payload: {mass: 2, inertia: {xx: 1, yy: 1, zz: 9}}", "3:1: $.payload", "others, but they are 1, 1, 9 kg m^2"),
        ("payload: {mass: 0, inertia: {xx: 1, yy: 1, zz: 1}}", "$.payload", "expected a mass > 0, because it has an"),
        ("payload: {mass: 1e300}", "$.payload", "expected values up to 1e+06 in SI units"),
        ("initial: {dq: [1001, 0]}", "$.initial.dq[0]", "less than or equal to 1000"),
        ("control: {gains: {error: 1e13}}", "$.control.gains.error", "less than or equal to 1000000000000"),
        (f"contacts: [{CONTACT.replace('[1, 0, 0]', '[1e7, 0, 0]')}]", "$.contacts[0].force[0]", "less than or equal"),
        ("truth: {breakaway: 1e7}", "$.truth.breakaway", "less than or equal to 1000000"),
        ("payload: {com: [0, 0, 0]}", "$.payload", "mass: required key is missing"),
        (f"contacts: [{CONTACT}, {CONTACT}]", "3:1: $.contacts", "found again: a"),
        (f"contacts: [{CONTACT.replace('name: a', 'name: a-b')}]", "$.contacts[0].name", "it names a topic"),
        (f"contacts: [{CONTACT.replace('tool', 'j9')}]", "3:22: $.contacts[0].link", "expected one of the robot two"),
        (f"contacts: [{CONTACT.replace('tool', '3')}]", "$.contacts[0].link", "links 0 (base) to 2"),
        (f"contacts: [{CONTACT.replace('tool', '-1')}]", "$.contacts[0].link", "greater than or equal to 0"),
        (f"contacts: [{CONTACT.replace('tool', '1.5')}]", "$.contacts[0].link", "integer"),
        (f"contacts: [{CONTACT.replace('duration: 1', 'duration: 0')}]", "$.contacts[0].duration", "greater than 0"),
        (f"contacts: [{CONTACT.replace('duration: 1', 'duration: 1e-17')}]", "$.contacts[0].duration", "long enough"),
        (f"contacts: [{CONTACT.replace('start: 1', 'start: -1')}]", "$.contacts[0].start", "greater than or equal"),
        (f"contacts: [{CONTACT.replace('[1, 0, 0]', '[1, 0]')}]", "$.contacts[0].force", "at least 3"),
        ("sensors: {rate: 0}", "$.sensors.rate", "greater than 0"),
        ("sensors: {rate: 300}", "3:1: $.sensors", "divides that of the controller, 1000 Hz; found 300 Hz"),
        ("sensors: {rate: 2000}", "$.sensors", "found 2000 Hz"),
        ("sensors: {noise: pink}", "$.sensors.noise", "'gaussian' or 'uniform'"),
        ("sensors: {position: {noise: -1e-5}}", "$.sensors.position.noise", "greater than or equal to 0"),
        ("sensors: {position: {noise: [1e-5]}}", "$.sensors.position.noise", "found 1 values, expected 2"),
        ("sensors: {velocity: {resolution: [0, -1]}}", "$.sensors.velocity.resolution", "greater than or equal to 0"),
        ("sensors: {effort: {noise: 1 deg}}", "$.sensors.effort.noise", "valid number"),
        ("sensors: {effort: {kind: current}}", "$.sensors.effort.kind", "known keys: noise, resolution"),
        ("sensors: {delay: -0.1}", "$.sensors.delay", "greater than or equal to 0"),
        ("sensors: {delay: 1e300}", "$.sensors.delay", "less than or equal to 60"),
        ("sensors: {jitter: -1}", "$.sensors.jitter", "greater than or equal to 0"),
        ("initial: {q: [0]}", "$.initial.q", "found 1 values, expected 2: j1, j2"),
        ("initial: {q: [2, 0]}", "3:15: $.initial.q[0]", "the end stops of j1 are at -1.5708 and 1.5708"),
        ("initial: {dq: [0, 0, 0]}", "$.initial.dq", "found 3 values"),
    ],
)  # fmt: skip
def test_faults_are_at_their_place(load: Any, text: str, where: str, message: str) -> None:
    with pytest.raises(InputFileError) as caught:
        load(HEAD + text + "\n")
    (fault,) = caught.value.faults
    assert where in str(fault)
    assert message in str(fault)


def test_all_faults_of_the_robot_at_once(load: Any) -> None:
    text = "control: {name: pd}\ntruth: {bodies: {a: {}}, joints: {b: {}}}\ninitial: {q: [0]}\n"
    with pytest.raises(InputFileError) as caught:
        load(HEAD + text)
    assert [fault.line for fault in caught.value.faults] == [3, 4, 4, 5]


def test_start_beyond_the_end_stops_without_end_stops(load: Any) -> None:
    found = load(HEAD + "end_stops: false\ninitial: {q: [2, 0]}\n")
    np.testing.assert_array_equal(found.initial_q, [2, 0])


def test_current_needs_torque_constants(tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(ROBOT.replace("dh: {a: 0.4}, torque_constant: 0.1", "dh: {a: 0.4}"))
    (tmp_path / "s.yaml").write_text(HEAD + "sensors: {effort_kind: current}\n")
    with pytest.raises(InputFileError, match=r"s.yaml:3:11: .*no torque_constant for j2"):
        load_scenario(tmp_path / "s.yaml", load_robot(tmp_path / "two.yaml").robot)


def test_a_controller_file_is_relative_to_the_document(tmp_path: Path, robot: Robot) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "mine.py").write_text("make = None\nraise SystemExit('must not run')\n")
    (tmp_path / "sub" / "s.yaml").write_text(HEAD + "control: {name: 'mine.py:make'}\n")
    found = load_scenario(tmp_path / "sub" / "s.yaml", robot).scenario
    assert found.control.name == f"{tmp_path / 'sub' / 'mine.py'}:make"
    (tmp_path / "sub" / "mine.py").write_text("x = 1\ndef (\n")
    with pytest.raises(InputFileError, match=r"s.yaml:3:11: \$.control.name: .*mine.py:2:5: not valid Python"):
        load_scenario(tmp_path / "sub" / "s.yaml", robot)


def test_controllers_are_known_by_name(load: Any) -> None:
    for name in CONTROLLERS:
        assert load(HEAD + f"control: {{name: {name}}}\n").control.name == name


def test_another_kind_is_refused(load: Any) -> None:
    with pytest.raises(InputFileError, match="found 'robot/1', expected scenario/1"):
        load(ROBOT)


def test_documents_are_values(load: Any) -> None:
    """Two readings are equal field by field, so that a study can be compared with another."""
    one, other = load(HEAD + "seed: 3\n"), load(HEAD + "seed: 3\n")
    assert asdict(one) == asdict(other)
    assert replace(one, seed=4) != other
