"""``modrob check``: verdicts, places, output."""

import json
import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from modrob_cli.interval import Interval
from modrob_cli.model.body import RigidBody, tensor, tensor_entries
from modrob_cli.model.realizable import realizability
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import from_xyz_rpy, parallel_axis

Modrob = Callable[..., Result]
ROOT = Path(__file__).resolve().parents[2]


def link(body: str, connections: str = "{out: {a: 0.3}}") -> str:
    return f"modrob: module/1\nname: X\nkind: link\nconnections: {connections}\nbody:\n  {body}\n"


def joint(keys: str) -> str:
    return f"modrob: module/1\nname: X\nkind: joint\nunits:\n- joint:\n    type: revolute\n{keys}\n"


def test_good_documents_pass(modrob: Modrob, workspace: Path) -> None:
    result = modrob("check", workspace, "--strict")
    assert result.exit_code == 0, result.output
    assert "6 documents checked, 0 warnings" in result.stderr
    assert result.stdout == ""


def test_shipped_documents_pass_and_published_tensors_warn(modrob: Modrob) -> None:
    result = modrob("check", ROOT / "modules", ROOT / "assemblies", "--json")
    assert result.exit_code == 0, result.output
    files = {Path(item["file"]): item["warnings"] for item in json.loads(result.stdout)["files"]}
    warned = {path.stem for path, warnings in files.items() if warnings and path.parent.name == "schunk-lwa4p"}
    # by hand, about the centre of mass: m c^2 = 154e-6, 300e-6, 514e-6 leaves 20, 28, 41 (1e-6 kg m^2) for Ixx = Iyy,
    # while Izz is 64, 743, 85: more than twice as much
    assert warned == {"L4", "L5", "L6"}


def test_a_module_of_an_assembly_is_checked_too_and_once(modrob: Modrob, workspace: Path) -> None:
    part = workspace / "parts" / "L.yaml"
    part.write_text(part.read_text().replace("xx: 0.002", "xx: 0.2"))
    result = modrob("check", workspace / "arm.yaml", "--json")
    found = json.loads(result.stdout)
    assert [Path(item["file"]).name for item in found["files"]] == ["arm.yaml", "B.yaml", "J.yaml", "L.yaml", "E.yaml"]
    assert len(found["files"][3]["warnings"]) == 1
    assert "5 documents checked, 1 warning" in result.stderr


def test_strict_turns_warnings_into_exit_code_3(modrob: Modrob, workspace: Path) -> None:
    path = workspace / "x.yaml"
    path.write_text(link("mass: 1.0\n  inertia: {xx: 1, yy: 1, zz: 3}"))
    assert modrob("check", path).exit_code == 0
    assert modrob("check", path, "--strict").exit_code == 3


def test_json_lists_place_and_verdict(modrob: Modrob, workspace: Path) -> None:
    path = workspace / "x.yaml"
    path.write_text(link("mass: 1.0\n  inertia: {xx: 1, yy: 1, zz: 3}"))
    found = json.loads(modrob("check", path, "--strict", "--json").stdout)
    assert found["ok"] is False
    (item,) = found["files"]
    assert (item["file"], item["kind"], item["faults"]) == (str(path), "module/1", [])
    (warning,) = item["warnings"]
    assert (warning["line"], warning["column"], warning["path"]) == (7, 3, "$.body.inertia")
    assert warning["level"] == "impossible"
    path.write_text(link("mass: -1.0"))
    (item,) = json.loads(modrob("check", path, "--json").stdout)["files"]
    assert [fault["path"] for fault in item["faults"]] == ["$.body.mass"]
    assert item["faults"][0]["line"] == 6


@pytest.mark.parametrize(
    ("text", "path", "words"),
    [
        (link("mass: 0\n  inertia: {xx: 1, yy: 1, zz: 1}"), "$.body.mass", "mass 0 with"),
        (link("mass: 0\n  com: [0.1, 0, 0]"), "$.body.mass", "mass 0 with"),
        (link("mass: 1500000"), "$.body.mass", "unit is kg"),
        (link("mass: 1\n  com: [0, 47.7, 0]"), "$.body.com", "unit is m"),
        (link("mass: 1\n  inertia: {xx: 1, yy: 1, zz: 1, xy: 1.1}"), "$.body.inertia", "expected none below 0"),
        (link("mass: 1\n  inertia: {xx: 1, yy: 1, zz: 2.1}"), "$.body.inertia", "sum of the other two"),
        (link("mass: 1\n  com: [1, 0, 0]\n  inertia_about: frame"), "$.body.inertia", "expected none below 0"),
        (link("mass: 1\n  inertia: {xx: 1390, yy: 1390, zz: 1390}"), "$.body.inertia", "1 g mm^2 = 1e-9"),
        (link("mass: 5\n  inertia: {xx: 1e-8, yy: 1e-8, zz: 1e-8}"), "$.body.inertia", "kg/m^3"),
        (link("mass: 1e300\n  com: [1e300, 1e300, 1e300]"), "$.body", "SI units"),
        (link("mass: 1", "{out: {a: 350}}"), "$.connections.out", "use m"),
        (joint("    limits: {position: [-170, 170]}"), "$.units[0].joint.limits.position", "'170 deg'"),
        (joint("    limits: {velocity: [1, 2]}"), "$.units[0].joint.limits.velocity", "stand still"),
        (joint("    limits: {position: [1, 1]}"), "$.units[0].joint.limits.position", "lower < upper"),
        (joint("    gear_ratio: 0"), "$.units[0].joint.gear_ratio", "motor turns per joint turn"),
        (joint("    gear_ratio: 160\n    rotor_inertia: 1.34"), "$.units[0].joint.rotor_inertia", "before the gear"),
        (
            joint("    friction: {coulomb: 9}\n    limits: {torque: 8}"),
            "$.units[0].joint.limits.torque",
            "friction of 9",
        ),
        (
            joint("    gear_ratio: 160\n    torque_constant: 0.0429\n    limits: {torque: 80, current: 11}"),
            "$.units[0].joint.limits.torque",
            "the 75.504 that the motor gives",
        ),
    ],
)
def test_implausible_data_give_one_warning_at_its_place(
    modrob: Modrob, workspace: Path, text: str, path: str, words: str
) -> None:
    file = workspace / "x.yaml"
    file.write_text(text)
    result = modrob("check", file, "--json")
    (item,) = json.loads(result.stdout)["files"]
    assert [warning["path"] for warning in item["warnings"]][:1] == [path], item
    assert words in item["warnings"][0]["message"]
    assert len({warning["path"].rsplit(".", 1)[0] for warning in item["warnings"]}) == 1


def test_assembly_and_robot_remarks(modrob: Modrob, workspace: Path) -> None:
    arm, robot = workspace / "arm.yaml", workspace / "planar.yaml"
    extra = "gravity: [0, 0, -9810]\nlimits: {J.1: {torque: 90}}\n"
    arm.write_text(arm.read_text().replace("com: [0, 0, 0.05]", "com: [0, 0, 1.5]") + extra)
    robot.write_text(robot.read_text().replace("xx: 0.01, yy: 0.03", "xx: 9, yy: 0.03"))
    found = json.loads(modrob("check", arm, robot, "--json").stdout)["files"]
    assert [w["path"] for w in found[0]["warnings"]] == ["$.gravity", "$.payload.com", "$.limits['J.1'].torque"]
    assert [w["path"] for w in found[1]["warnings"]] == ["$.bodies[1].inertia"]


def test_idealised_bodies_pass(modrob: Modrob, workspace: Path) -> None:
    for tensor_text in ("{}", "{yy: 1, zz: 1}", "{xx: 1, yy: 1, zz: 2}"):  # point, rod, plate
        path = workspace / "x.yaml"
        path.write_text(link(f"mass: 1\n  inertia: {tensor_text}"))
        assert modrob("check", path, "--strict").exit_code == 0


def test_folder_without_documents_is_a_fault(modrob: Modrob, tmp_path: Path) -> None:
    (tmp_path / ".hidden.yaml").write_text("not: a document")
    result = modrob("check", tmp_path)
    assert result.exit_code == 3
    assert "found no document in this folder" in result.stderr


def test_examples_of_the_documentation_pass(modrob: Modrob, tmp_path: Path) -> None:
    text = (ROOT / "docs" / "documents.md").read_text(encoding="utf-8")
    examples = re.findall(r"```yaml\n(.*?)```", text, flags=re.DOTALL)
    names = [re.findall(r"name: (\S+)", example)[0] for example in examples]
    assert names == ["elbow-link", "ball", "two-axes", "planar"]
    for name, example in zip(names, examples, strict=True):
        (tmp_path / f"{name}.yaml").write_text(example)
    result = modrob("check", tmp_path, "--strict")
    assert result.exit_code == 0, result.stderr


def test_loops_of_links_and_hidden_files(modrob: Modrob, workspace: Path) -> None:
    (workspace / "parts" / "up").symlink_to(workspace)
    (workspace / "parts" / "self.yml").symlink_to("self.yml")
    (workspace / ".git").mkdir()
    (workspace / ".git" / "bad.yaml").write_text("[")
    result = modrob("check", workspace)
    assert result.exit_code == 3
    assert result.stderr.count("self.yml: file not found") == 1
    assert "7 documents checked" in result.stderr
    assert ".git" not in result.stderr


def test_all_files_with_faults_are_reported(modrob: Modrob, workspace: Path) -> None:
    (workspace / "a.yaml").write_text("[")
    (workspace / "b.yml").write_text("modrob: module/2\n")
    (workspace / "c.yaml").write_text(link("mass: -1\n  color: red"))
    result = modrob("check", workspace, workspace / "none.yaml")
    places = [line.split(": ")[1].rsplit(os.sep, 1)[-1] for line in result.stderr.splitlines() if "error:" in line]
    assert places == ["a.yaml:2:1", "b.yml:1:1", "c.yaml:6:3", "c.yaml:7:3", "none.yaml"]
    assert result.exit_code == 3


def body(mass: Interval, com: Interval, inertia: Interval, about: str) -> RigidBody:
    parts = [Uncertain(part.mid, part) for part in (mass, com, inertia)]
    return RigidBody("x", parts[0], parts[1], parts[2], "frame" if about == "frame" else "com")


def random_body(rng: np.random.Generator, about: str, width: float) -> RigidBody:
    """A body of point masses, its values shifted by some noise and widened to a box."""
    points, masses = rng.normal(size=(4, 3)) * rng.uniform(0.01, 1.0, 3), rng.uniform(0.1, 1.0, 4)
    points += rng.normal(size=3) * 0.3
    mass, com = masses.sum(), masses @ points / masses.sum()
    inertia = np.einsum("k,kij->ij", masses, parallel_axis(points))
    if about == "com":
        inertia = inertia - mass * parallel_axis(com)
    noise = rng.normal(size=6) * np.abs(inertia).max() * rng.choice([0.0, 0.05, 0.3])
    entries = tensor_entries(inertia) + noise
    spread = rng.uniform(0.0, width, 6) * np.abs(inertia).max()
    box = Interval(mass * (1 - width / 2), mass * (1 + width / 2))
    return body(box, Interval(com - width / 20, com + width / 20), Interval(entries - spread, entries + spread), about)


def is_real(mass: float, com: np.ndarray, entries: np.ndarray, about: str, slack: float) -> bool:
    """Principal moments non-negative and within the triangle inequality, straight from the definition."""
    inertia = tensor(entries) - (mass * parallel_axis(com) if about == "frame" else 0.0)
    moments = np.linalg.eigvalsh(inertia)
    return bool(moments[0] >= -slack and moments[2] <= moments[0] + moments[1] + slack)


@pytest.mark.parametrize("about", ["com", "frame"])
def test_box_verdicts_against_sampled_members(about: str) -> None:
    rng = np.random.default_rng(3)
    counts = {"every": 0, "some": 0, "none": 0}
    for _ in range(150):
        sample_of = random_body(rng, about, float(rng.choice([0.01, 0.1, 0.4])))
        verdict = realizability(sample_of)
        corners = rng.integers(0, 2, (300, 10)) if rng.random() < 0.5 else rng.random((300, 10))
        ends = [np.atleast_1d(part) for box in (sample_of.mass, sample_of.com, sample_of.inertia)
                for part in (box.interval.inf, box.interval.sup)]  # fmt: skip
        lower, upper = np.concatenate(ends[0::2]), np.concatenate(ends[1::2])
        members = lower + corners * (upper - lower)
        slack = 1e-7 * float(np.abs(members).max())  # the verdict's own tolerance is 1e-9 of the data
        real = [is_real(x[0], x[1:4], x[4:], about, slack) for x in members]
        strictly = [is_real(x[0], x[1:4], x[4:], about, -slack) for x in members]
        assert not verdict.every or all(real)
        assert verdict.some or not any(strictly)
        counts["every" if verdict.every else "some" if verdict.some else "none"] += 1
    assert min(counts.values()) >= 10, counts


def test_the_interval_of_the_mass_decides_tensors_about_the_frame() -> None:
    # a sphere's tensor 0.4 about the frame, centre at x = 0.5: yy and zz about the centre of mass are 0.4 - m / 4, so
    # that xx = 0.4 is at most their sum up to m = 0.8
    def verdict(low: float, nominal: float, high: float, com: Interval) -> tuple[bool, bool, bool]:
        mass = Uncertain(np.asarray(nominal), Interval(low, high))
        inertia = Uncertain.exact([0.4, 0.0, 0.0, 0.4, 0.0, 0.4])
        found = realizability(RigidBody("x", mass, Uncertain(com.mid, com), inertia, "frame"))
        return found.nominal, found.every, found.some

    exact, box = Interval([0.5, 0.0, 0.0]), Interval([0.25, 0.0, 0.0], [0.75, 0.0, 0.0])
    assert verdict(0.5, 0.7, 0.79, exact) == (True, True, True)
    assert verdict(0.5, 0.7, 0.81, exact) == (True, False, True)
    assert verdict(0.5, 0.9, 1.0, exact) == (False, False, True)
    assert verdict(0.81, 0.9, 1.0, exact) == (False, False, False)
    assert verdict(0.81, 0.9, 1.0, box) == (False, False, True)  # down to x = 0.25, up to m = 3.2
    assert verdict(3.3, 3.4, 3.5, box) == (False, False, False)


@pytest.mark.parametrize("about", ["com", "frame"])
def test_a_planted_member_is_found_and_its_neighbourhood_is_not(about: str) -> None:
    rng = np.random.default_rng(4)
    for _ in range(60):
        R = from_xyz_rpy(np.zeros(3), rng.uniform(-3, 3, 3))[:3, :3]
        second = R @ np.diag([0.0, *rng.uniform(0.1, 1.0, 2)]) @ R.T  # a plate: on the edge of what is possible
        normal = R[:, 0]
        mass, com = rng.uniform(0.5, 2.0), rng.normal(size=3) * 0.2
        inertia = np.trace(second) * np.eye(3) - second + (mass * parallel_axis(com) if about == "frame" else 0.0)
        entries = tensor_entries(inertia)
        # a box that touches the plate with the corner that is best along the plate's normal, and one just beyond
        gain = np.einsum("kij,i,j->k", 0.5 * np.trace(tensor(np.eye(6)), axis1=1, axis2=2)[:, None, None] * np.eye(3)
                         - tensor(np.eye(6)), normal, normal)  # fmt: skip
        width = rng.uniform(0.01, 0.2, 6)
        inside = Interval(np.minimum(entries, entries - np.sign(gain) * width),
                          np.maximum(entries, entries - np.sign(gain) * width))  # fmt: skip
        exact_mass, exact_com = Interval(mass), Interval(com)
        nudge = 1e-4 * np.sign(gain)
        assert realizability(body(exact_mass, exact_com, inside + nudge, about)).some
        assert not realizability(body(exact_mass, exact_com, inside - nudge, about)).some
