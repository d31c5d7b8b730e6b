"""``modrob bounds`` as a user runs it."""

import csv
import hashlib
import json
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics
from modrob_cli.io import motion_csv
from modrob_cli.model.body import RigidBody
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.workflows.robots import load_robot

Modrob = Callable[..., Result]

ROOT = Path(__file__).parents[2]
PAYLOAD = ROOT / "assemblies" / "lwa4p-6-payload.yaml"


def sines(dof: int, count: int = 500, step: float = 0.01, size: float = 0.4) -> dict[str, Array]:
    t: Array = np.arange(count, dtype=float) * step
    w = np.linspace(0.7, 1.9, dof)
    phase = t[:, None] * w + 0.3
    q, dq, ddq = size * np.sin(phase), size * w * np.cos(phase), -size * w**2 * np.sin(phase)
    return {"t": t, "q": q, "dq": dq, "ddq": ddq}


def write_motion(path: Path, motion: dict[str, Array], names: tuple[str, ...] = ()) -> Path:
    dof = motion["q"].shape[1]
    labels = [f".{name}" for name in names] or [str(k + 1) for k in range(dof)]
    order = ("q", "dq", "ddq")
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(["t", *(f"{kind}{label}" for kind in order for label in labels)])
        writer.writerows(np.column_stack([motion["t"], *(motion[kind] for kind in order)]).tolist())
    return path


def read_bounds(path: Path) -> dict[str, Array]:
    with path.open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    table = np.array(rows, dtype=float)
    return {name: table[:, k] for k, name in enumerate(header)}


def member(robot: Robot, rng: np.random.Generator) -> Robot:
    """The rigid bodies with parameters somewhere in their boxes, every other one at an end."""

    def drawn(value: Uncertain) -> Uncertain:
        low, high = value.interval.inf, value.interval.sup
        part = np.where(rng.random(low.shape) < 0.5, rng.integers(0, 2, size=low.shape), rng.random(low.shape))
        return Uncertain.exact(np.clip(low + part * (high - low), low, high))

    def body(body: RigidBody) -> RigidBody:
        return replace(body, mass=drawn(body.mass), com=drawn(body.com), inertia=drawn(body.inertia))

    return replace(robot, bodies=tuple(replace(placed, body=body(placed.body)) for placed in robot.bodies))


def friction(robot: Robot, dq: Array, ddq: Array) -> Array:
    """Friction and rotor of a robot that knows its own exactly, away from standstill."""
    viscous = np.array([float(joint.friction.viscous.nominal) for joint in robot.joints])
    coulomb = np.array([float(joint.friction.coulomb.nominal) for joint in robot.joints])
    drives = [joint.drive for joint in robot.joints]
    armature = np.array([float(drive.rotor_inertia.nominal) * drive.gear_ratio**2 for drive in drives])
    return np.asarray(viscous * dq + coulomb * np.sign(dq) + armature * ddq)


def stacked(table: dict[str, Array], robot: Robot, part: str) -> Array:
    return np.stack([table[f"{name}.{part}"] for name in robot.joint_names], axis=1)


def test_bounds_hold_for_sampled_payloads(tmp_path: Path, modrob: Modrob) -> None:
    """Torques by Pinocchio of 200 arms with payloads in the box; the nominal one; the figures of the summary."""
    robot = load_robot(PAYLOAD).robot
    motion = sines(6)
    path = write_motion(tmp_path / "sines.csv", motion)
    result = modrob("bounds", PAYLOAD, path, "-o", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    table = read_bounds(tmp_path / "out" / "sines.bounds.csv")
    nominal, lower, upper = (stacked(table, robot, part) for part in ("nominal", "lower", "upper"))
    assert np.array_equal(table["t"], motion["t"])
    states = (motion["q"], motion["dq"], motion["ddq"])
    drives = friction(robot, *states[1:])
    np.testing.assert_allclose(nominal, inverse_dynamics(robot, *states) + drives, rtol=1e-10, atol=1e-11)
    rng = np.random.default_rng(3)
    reached = np.full((2, 6), np.inf)
    for _ in range(200):
        tau = inverse_dynamics(member(robot, rng), *states) + drives
        assert (tau >= lower - 1e-11).all()  # Pinocchio's own rounding
        assert (tau <= upper + 1e-11).all()
        reached = np.minimum(reached, [(tau - lower).min(axis=0), (upper - tau).min(axis=0)])
    # Some sample comes near every bound somewhere, or the bounds would be too wide.
    assert (reached < 0.1 * (upper - lower).max(axis=0)).all()
    found = json.loads(result.stdout)
    assert found["samples"] == 500
    assert found["method"] == "exact"
    for i, joint in enumerate(found["joints"]):
        width = upper[:, i] - lower[:, i]
        figures = (joint["mean_width"], joint["max_width"], joint["min_lower"], joint["max_upper"])
        expected = (width.mean(), width.max(), lower[:, i].min(), upper[:, i].max())
        assert figures == pytest.approx(expected, rel=1e-12)
        assert joint["name"] == robot.joint_names[i]


def test_files_and_json(tmp_path: Path, modrob: Modrob) -> None:
    path = write_motion(tmp_path / "sines.csv", sines(6))
    out = tmp_path / "out"
    result = modrob("bounds", PAYLOAD, path, "-o", out, "--json")
    found = json.loads(result.stdout)
    names = ["sines.bounds.csv", "sines.bounds.json", "sines.bounds.png", "sines.shares.csv"]
    assert sorted(p.name for p in out.iterdir()) == names
    assert sorted(Path(p).name for p in found["files"].values()) == names
    saved = json.loads((out / "sines.bounds.json").read_text())
    assert saved == {key: value for key, value in found.items() if key != "files"}
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert found["provenance"]["inputs"]["sines.csv"] == f"sha256:{digest}"
    assert (out / "sines.bounds.png").read_bytes().startswith(b"\x89PNG")
    assert found["options"] == {"method": "exact", "ddq_tolerance": None, "q_noise": None, "dq_noise": None}
    with (out / "sines.shares.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    shares = [
        (joint["name"], part["parameter"], part["share"]) for joint in found["shares"] for part in joint["parameters"]
    ]
    assert [(row["joint"], row["parameter"], float(row["share"])) for row in rows] == shares
    for joint in found["shares"]:
        parts = [part["share"] for part in joint["parameters"]]
        assert sum(parts) == pytest.approx(1.0)
        assert parts == sorted(parts, reverse=True)
        assert all(part["parameter"].startswith("payload ") for part in joint["parameters"])
    assert "payload mass" in result.stderr
    assert "wrote" in result.stderr


def test_existing_files_need_overwrite(tmp_path: Path, workspace: Path, modrob: Modrob) -> None:
    path = write_motion(tmp_path / "sines.csv", sines(2, 20))
    assert modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path / "out").exit_code == 0
    before = {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()}
    refused = modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path / "out")
    assert refused.exit_code == 6
    assert "--overwrite" in refused.stderr
    again = modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path / "out", "--overwrite")
    assert again.exit_code == 0
    assert {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()} == before


def test_columns_by_name_in_any_order_give_the_same(tmp_path: Path, workspace: Path, modrob: Modrob) -> None:
    names = load_robot(workspace / "arm.yaml").robot.joint_names
    motion = sines(2, 50)
    back = {key: value if key == "t" else value[:, ::-1] for key, value in motion.items()}
    first = write_motion(tmp_path / "numbered.csv", motion)
    second = write_motion(tmp_path / "named.csv", back, names[::-1])
    for path in (first, second):
        assert modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path).exit_code == 0
    assert (tmp_path / "numbered.bounds.csv").read_bytes() == (tmp_path / "named.bounds.csv").read_bytes()


def test_pieces_do_not_show(tmp_path: Path, workspace: Path, modrob: Modrob, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_motion(tmp_path / "sines.csv", sines(2, 300))
    whole = json.loads(modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path / "a", "--json").stdout)
    monkeypatch.setattr(motion_csv, "BLOCK", 3000)
    parts = json.loads(modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path / "b", "--json").stdout)
    first, second = (read_bounds(tmp_path / folder / "sines.bounds.csv") for folder in "ab")
    for name, column in first.items():  # equal but for the order of sums in vectorised code
        np.testing.assert_allclose(second[name], column, rtol=1e-13, atol=1e-13)
    for one, two in zip(whole["joints"], parts["joints"], strict=True):
        for key in ("mean_width", "max_width", "min_lower", "max_upper"):
            assert one[key] == pytest.approx(two[key], rel=1e-9)


def widths(result: Result) -> Array:
    assert result.exit_code == 0, result.output
    return np.array([joint["mean_width"] for joint in json.loads(result.stdout)["joints"]])


def test_options_widen(tmp_path: Path, workspace: Path, modrob: Modrob) -> None:
    """Tolerances and noise add width; the published algorithm is never narrower."""
    path = write_motion(tmp_path / "sines.csv", sines(2, 60))

    def run(name: str, *options: str) -> Result:
        return modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path / name, "--json", *options)

    plain = widths(run("plain"))
    ianea = widths(run("ianea", "--method", "ianea"))
    tolerant = widths(run("ddq", "--ddq-tolerance", "0.1"))
    both = widths(run("both", "--method", "ianea", "--ddq-tolerance", "0.1"))
    noisy = run("noise", "--q-noise", "0.001,1 deg", "--dq-noise", "0.01")
    everything = run("all", "--q-noise", "0.001", "--dq-noise", "0.01", "--ddq-tolerance", "0.1")
    assert (ianea >= plain - 1e-11).all()
    assert ianea[0] > 1.1 * plain[0]
    assert (tolerant > plain).all()
    assert (both >= tolerant - 1e-11).all()
    assert (both > ianea).all()
    assert (widths(noisy) > plain).all()
    assert (widths(everything) > tolerant).all()
    named = {part["parameter"] for joint in json.loads(everything.stdout)["shares"] for part in joint["parameters"]}
    assert {"J.1 acceleration tolerance", "J#2.1 position noise", "J.1 velocity noise"} <= named


@pytest.mark.parametrize("kind", ["q", "dq", "ddq"])
def test_noise_holds_for_states_within_it(tmp_path: Path, modrob: Modrob, kind: str) -> None:
    """States at corners of the noise: inside the bounds, and outside those that know of no noise."""
    robot = load_robot(PAYLOAD).robot
    motion = sines(6, 60)
    path = write_motion(tmp_path / "sines.csv", motion)
    option = {"q": "--q-noise", "dq": "--dq-noise", "ddq": "--ddq-tolerance"}[kind]
    found = []
    for folder, options in (("plain", ()), ("noisy", (option, "0.05"))):
        assert modrob("bounds", PAYLOAD, path, "-o", tmp_path / folder, *options).exit_code == 0
        table = read_bounds(tmp_path / folder / "sines.bounds.csv")
        found.append([stacked(table, robot, part) for part in ("lower", "upper")])
    rng = np.random.default_rng(4)
    outside = np.zeros(6, dtype=bool)
    for _ in range(30):
        states = {key: motion[key] + (0.05 * rng.choice([-1.0, 1.0], size=(60, 6)) if key == kind else 0.0) for key in
                  ("q", "dq", "ddq")}  # fmt: skip
        tau = inverse_dynamics(member(robot, rng), *states.values()) + friction(robot, states["dq"], states["ddq"])
        assert (tau >= found[1][0] - 1e-11).all()  # Pinocchio's own rounding
        assert (tau <= found[1][1] + 1e-11).all()
        outside |= ((tau < found[0][0]) | (tau > found[0][1])).any(axis=0)
    assert outside.all()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--method", "ianea", "--q-noise", "0.01"), "need --method exact"),
        (("--method", "ianea", "--dq-noise", "0.01"), "need --method exact"),
        (("--method", "best"), "'exact', 'ianea'"),
        (("--ddq-tolerance", "1,2"), "--ddq-tolerance: found 2 numbers, expected one, or one for each of the 6 joints"),
        (("--ddq-tolerance=-1",), "--ddq-tolerance: found -1, expected half-widths >= 0"),
        (("--q-noise", "nan"), "--q-noise: found 'nan'"),
        (("--dq-noise", "wide"), "--dq-noise: found 'wide'"),
    ],
)
def test_options_that_do_not_fit(tmp_path: Path, modrob: Modrob, options: tuple[str, ...], words: str) -> None:
    path = write_motion(tmp_path / "sines.csv", sines(6, 10))
    result = modrob("bounds", PAYLOAD, path, "-o", tmp_path / "out", *options)
    assert result.exit_code == 2
    assert words in " ".join(result.stderr.replace("│", " ").split())
    assert not (tmp_path / "out").exists()


def test_faulty_motion_leaves_nothing_behind(tmp_path: Path, workspace: Path, modrob: Modrob) -> None:
    """A fault far behind the first blocks, after rows were written already."""
    path = write_motion(tmp_path / "sines.csv", sines(2, 20_000))
    with path.open("a") as stream:
        stream.write("0,0\n")
    result = modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path / "out", "--json")
    assert result.exit_code == 3
    assert result.stdout == ""
    assert f"error: {path}:20002: found 2 columns, expected 7" in result.stderr
    assert not (tmp_path / "out").exists()


def test_robot_and_motion_that_do_not_fit(tmp_path: Path, modrob: Modrob) -> None:
    path = write_motion(tmp_path / "two.csv", sines(2, 10))
    result = modrob("bounds", PAYLOAD, path, "-o", tmp_path / "out")
    assert result.exit_code == 3
    assert f"error: {path}:1: the columns q3, q4, q5, q6, dq3" in result.stderr
    assert modrob("bounds", tmp_path / "no.yaml", path, "-o", tmp_path / "out").exit_code == 3
    assert modrob("bounds", PAYLOAD, tmp_path / "no.csv", "-o", tmp_path / "out").exit_code == 3
    assert modrob("bounds", PAYLOAD, tmp_path, "-o", tmp_path / "out").exit_code == 3
    assert not (tmp_path / "out").exists()


def test_absurd_motion(tmp_path: Path, workspace: Path, modrob: Modrob) -> None:
    motion = sines(2, 10)
    motion["dq"][4] = 1e300
    path = write_motion(tmp_path / "absurd.csv", motion)
    result = modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path / "out")
    assert result.exit_code == 5
    assert "absurd values" in result.stderr
    assert not (tmp_path / "out").exists()


def test_outside_limits_is_a_warning(tmp_path: Path, workspace: Path, modrob: Modrob) -> None:
    """Limits of joint J.1: +-170 deg, 2 rad/s, 40 N m."""
    motion = sines(2, 200)
    motion["q"][120:130, 0] = 3.5
    motion["q"][125, 0] = 4.0
    motion["dq"][7, 1] = -2.5
    motion["dq"][8, 1] = -2.0  # at the limit
    path = write_motion(tmp_path / "far.csv", motion)
    result = modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    first, second = json.loads(result.stdout)["warnings"]
    assert (first["joint"], first["quantity"], first["count"]) == ("J.1", "position", 10)
    assert (first["first_time"], first["worst_time"]) == (1.2, 1.25)
    assert first["worst"] == pytest.approx(4.0 - np.radians(170.0))
    assert (second["joint"], second["quantity"], second["count"]) == ("J#2.1", "velocity", 1)
    assert second["worst"] == pytest.approx(0.5)
    assert "warning: J.1: position outside -2.9671 .. 2.9671 rad in 10 of 200 samples" in result.stderr


def test_torque_limits_are_counted(tmp_path: Path, workspace: Path, modrob: Modrob) -> None:
    motion = sines(2, 200)
    motion["ddq"] *= 1000.0
    path = write_motion(tmp_path / "hard.csv", motion)
    result = modrob("bounds", workspace / "arm.yaml", path, "-o", tmp_path, "--json")
    table = read_bounds(tmp_path / "hard.bounds.csv")
    counts = []
    for joint in json.loads(result.stdout)["joints"]:
        outside = (table[f"{joint['name']}.lower"] < -40.0) | (table[f"{joint['name']}.upper"] > 40.0)
        assert joint["torque_limits"] == [-40.0, 40.0]
        assert joint["samples_beyond_limits"] == outside.sum()
        counts.append(joint["samples_beyond_limits"])
    assert 0 < max(counts) < 200


def test_exact_robot_and_single_sample(tmp_path: Path, workspace: Path, modrob: Modrob) -> None:
    path = write_motion(tmp_path / "one.csv", sines(2, 1))
    result = modrob("bounds", workspace / "planar.yaml", path, "-o", tmp_path, "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert [joint["parameters"] for joint in found["shares"]] == [[], []]
    assert all(0.0 < joint["max_width"] < 1e-10 for joint in found["joints"])  # room for rounding, no more
    assert all(joint["torque_limits"] is None for joint in found["joints"])
    assert "nothing in the robot file is uncertain" in result.stderr
    assert (tmp_path / "one.bounds.png").stat().st_size > 5000


def test_example_of_the_documentation(tmp_path: Path, modrob: Modrob, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (ROOT / "docs" / "bounds.md").read_text(encoding="utf-8")
    blocks = dict(re.findall(r"```(python|sh|text)\n(.*?)```", page, flags=re.DOTALL))
    subprocess.run([sys.executable, "-c", blocks["python"]], cwd=tmp_path, check=True, timeout=60)
    for folder in ("assemblies", "modules"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    result = modrob(*shlex.split(blocks["sh"])[1:])
    assert result.exit_code == 0, result.output
    assert [line.split() for line in result.stderr.split("\n") if line] == [
        line.split() for line in blocks["text"].split("\n") if line
    ]
