"""``modrob scale``: published figures, certificates and what harms them, scaled motions, bad input."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import Result

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.io.certificate import certificate_text
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.scale_verify import verify
from modrob_cli.workflows.trajectory_motion import load_trajectory

Modrob = Callable[..., Result]
ROOT = Path(__file__).parents[2]
ARM = ROOT / "assemblies" / "lwa4p-table34.yaml"
HEAVY = ROOT / "assemblies" / "lwa4p-3kg.yaml"
MOTION = ROOT / "trajectories" / "s-iv-a.yaml"
LIFT = ROOT / "trajectories" / "lift-folded.yaml"
PAPER = ("--current-limits", "8,8,8,8,2,2", "--velocity-limits", "none", "--acceleration-limits", "none")
FAST = ("--rate", "100")

RULE = """\
modrob: robot/1
name: slider
gravity: [0, 0, -9.81]
joints:
- {name: lift, type: prismatic, placement: {xyz: [0, 0, 0.1]}, friction: {viscous: 20}, limits: LIMITS}
bodies:
- {name: load, link: 1, mass: {nominal: 2, min: 1, max: 3}, com: [0, 0, 0], inertia: {xx: 0.1, yy: 0.1, zz: 0.1}}
"""


def result_of(run: Result) -> dict[str, Any]:
    assert run.exit_code == 0, run.output
    return dict(json.loads(run.stdout))


@pytest.fixture(scope="module")
def certified(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The certificate of the published motion; the factor at fewer samples is a little larger, but not the proof."""
    from typer.testing import CliRunner

    from modrob_cli.cli.app import app

    out = tmp_path_factory.mktemp("scaled")
    arguments = ["scale", ARM, MOTION, *PAPER, *FAST, "--certify", "-o", out]
    run = CliRunner().invoke(app, [str(item) for item in arguments])
    assert run.exit_code == 0, run.output
    return out / "s-iv-a.certificate.json"


def test_published_motion_by_all_methods(modrob: Modrob, tmp_path: Path) -> None:
    """[S] IV.A with [D] Table 3.4: nominal factor 2.64, joint 2 decides; exact bounds allow more than IANEA*."""
    run = modrob("scale", ARM, MOTION, *PAPER, *FAST, "--method", "nominal", "-o", tmp_path, "--json")
    nominal = result_of(run)
    assert nominal["factor"] == pytest.approx(2.64, abs=0.005)
    assert nominal["critical"]["joint"] == "q2"
    assert nominal["compared"]["ianea"] < nominal["compared"]["exact"] < nominal["factor"]
    exact = result_of(modrob("scale", ARM, MOTION, *PAPER, *FAST, "-o", tmp_path, "--overwrite", "--json"))
    assert exact["factor"] == nominal["compared"]["exact"]
    assert exact["critical"]["parameters"][0]["parameter"] == "link6 mass"
    assert exact["gaps"] == []
    assert exact["new_duration"] == pytest.approx(5.0 / exact["factor"])
    assert {Path(path).is_file() for path in exact["files"].values()} == {True}
    # The answer is just within the limits, and a little more is not.
    x = load_trajectory(MOTION).trajectory.sample(np.linspace(0.0, 5.0, 501), 2)
    high = np.array([8, 8, 8, 8, 2, 2]) * np.array([0.0429 * 160] * 4 + [0.1 * 100] * 2)
    beyond = []
    for c in (exact["factor"], exact["factor"] * (1 + 1e-6)):
        bounds = exact_bounds(load_robot(ARM).robot, x[:, 0], c * x[:, 1], c * c * x[:, 2])
        beyond.append(bool((np.maximum(bounds.upper, -bounds.lower) > high).any()))
    assert beyond == [False, True]


def peak_torque(robot: Path, motion: Path, c: float) -> Array:
    """Largest nominal torque of each joint at a factor, the joints moving."""
    trajectory = load_trajectory(motion).trajectory
    x = trajectory.sample(np.linspace(0.01, trajectory.duration - 0.01, 2000), 2)
    found = exact_bounds(load_robot(robot).robot, x[:, 0], c * x[:, 1], c * c * x[:, 2])
    return np.asarray(np.abs(found.nominal).max(axis=0))


def test_the_published_rule_fails_where_viscous_friction_brakes(modrob: Modrob, tmp_path: Path) -> None:
    """A known arm, so only the rule is to blame: its factor asks for far more than 8 A; ours does not."""
    found = result_of(modrob("scale", HEAVY, LIFT, *FAST, "-o", tmp_path, "--json"))
    limit = 8 * 0.0429 * 160
    assert found["compared"]["published_rule"] > 1.3 * found["factor"]
    assert peak_torque(HEAVY, LIFT, found["compared"]["published_rule"])[1] > 1.05 * limit
    assert peak_torque(HEAVY, LIFT, found["factor"])[1] == pytest.approx(limit, rel=1e-3)


def test_a_simulated_arm_saturates_at_the_published_factor_only(modrob: Modrob, tmp_path: Path) -> None:
    document = LIFT.read_text(encoding="utf-8")
    found = result_of(modrob("scale", HEAVY, LIFT, *FAST, "--certify", "-o", tmp_path, "--json"))
    cut = []
    for name, c in (("rule", found["compared"]["published_rule"]), ("proven", found["certified_factor"])):
        scaled = document.replace("t: 1.5,", f"t: {1.5 / c!r},").replace("t: 5, ", f"t: {5 / c!r}, ")
        path = tmp_path / f"{name}.yaml"
        path.write_text(scaled.replace("-0.71", repr(-0.71 * c)), encoding="utf-8")
        log = tmp_path / f"{name}.mcap"
        run = result_of(modrob("simulate", HEAVY, path, "--controller", "id", "-o", log, "--json"))
        cut.append(run["joints"][1]["saturated"])
    assert cut[0] > 0.2
    assert cut[1] == 0.0


@pytest.mark.parametrize("name", ["s-iv-a", "lift-folded", "table-b1", "fourier-6", "r-13", "half-b1-6"])
def test_scaled_documents_are_the_scaled_motion(name: str, modrob: Modrob, tmp_path: Path) -> None:
    path = ROOT / "trajectories" / f"{name}.yaml"
    found = result_of(modrob("scale", ARM, path, *FAST, "-o", tmp_path, "--json"))
    c, new = found["factor"], load_trajectory(Path(found["files"]["trajectory"])).trajectory
    assert_scaled(load_trajectory(path).trajectory, new, c)


def assert_scaled(old: Any, new: Any, c: float, rtol: float = 1e-9) -> None:
    t = np.linspace(0.0, old.duration, 301)[1:-1]
    x, y = old.sample(t, 2), new.sample(t / c, 2)
    assert new.duration == pytest.approx(old.duration / c, rel=1e-12)
    for k in range(3):
        # Times at which polynomials meet are rounded, and quantities with them.
        assert np.abs(y[:, k] - c**k * x[:, k]).max() <= rtol * (1.0 + np.abs(c**k * x[:, k]).max())


def test_sampled_motions_become_splines(modrob: Modrob, tmp_path: Path) -> None:
    t = np.linspace(0.0, 3.0, 31)
    rows = [f"{a!r},{float(np.sin(a))!r},{float(np.cos(a))!r},{float(-np.sin(a))!r}" for a in t.tolist()]
    motion = tmp_path / "wave.csv"
    motion.write_text("\n".join(["t,q1,dq1,ddq1", *rows]) + "\n", encoding="utf-8")
    robot = slider(tmp_path, "{torque: [-10, 60]}")
    found = result_of(modrob("scale", robot, motion, "-o", tmp_path / "out", "--json"))
    assert found["files"]["trajectory"].endswith("wave-scaled.yaml")
    new = load_trajectory(Path(found["files"]["trajectory"])).trajectory
    assert_scaled(load_trajectory(motion).trajectory, new, found["factor"])


def test_jumps_of_acceleration_are_told_and_such_motions_become_samples(modrob: Modrob, tmp_path: Path) -> None:
    motion = tmp_path / "ramp.csv"
    motion.write_text("t,q1,dq1\n0,0,0\n1,0.5,1\n2,1.5,1\n3,2,0\n", encoding="utf-8")
    robot = slider(tmp_path, "{torque: [-10, 60]}")
    found = result_of(modrob("scale", robot, motion, "--certify", "-o", tmp_path / "out", "--json"))
    assert any("jumps" in text and "t = 1" in text for text in found["warnings"])
    assert found["files"]["trajectory"].endswith("ramp-scaled.csv")
    # Closed form, at most 3 kg: m (g + c^2 a) + 20 c v <= 60, largest where the ramp ends: a = 1, v = 1.
    c = (-20 + np.sqrt(400 + 4 * 3 * (60 - 3 * 9.81))) / 6
    assert found["factor"] == pytest.approx(c, rel=1e-8)
    assert c * (1 - 0.005) <= found["certified_factor"] <= c
    assert verify(Path(found["files"]["certificate"])).faults == ()


def slider(folder: Path, limits: str) -> Path:
    path = folder / "slider.yaml"
    path.write_text(RULE.replace("LIMITS", limits), encoding="utf-8")
    return path


STEP = "modrob: trajectory/1\nname: step\nkind: waypoints\norder: 5\npoints:\n- {t: 0, q: [0]}\n- {t: 1, q: [1]}\n"


def step(folder: Path) -> Path:
    path = folder / "step.yaml"
    path.write_text(STEP, encoding="utf-8")
    return path


def test_asymmetric_limits_and_velocity(modrob: Modrob, tmp_path: Path) -> None:
    """The peak velocity of the polynomial is 15/8; torque limits from the command line go before the file's."""
    robot = slider(tmp_path, "{torque: 1, velocity: [-9, 3]}")
    run = modrob("scale", robot, step(tmp_path), "--torque-limits", "-500:800", "-o", tmp_path / "o", "--json")
    found = result_of(run)
    assert found["factor"] == pytest.approx(3 / (15 / 8), rel=1e-9)
    assert (found["critical"]["quantity"], found["critical"]["side"]) == ("velocity", "upper")
    assert found["critical"]["time"] == pytest.approx(0.5)


def test_the_largest_factor_that_was_asked_for(modrob: Modrob, tmp_path: Path) -> None:
    robot = slider(tmp_path, "{torque: 1e6}")
    found = result_of(modrob("scale", robot, step(tmp_path), "--max-factor", "2.5", "-o", tmp_path / "o", "--json"))
    assert (found["factor"], found["critical"]) == (2.5, None)


def test_static_torque_is_explained(modrob: Modrob, tmp_path: Path) -> None:
    run = modrob("scale", slider(tmp_path, "{torque: 25}"), step(tmp_path), "-o", tmp_path / "o", "--json")
    assert run.exit_code == 4
    found = json.loads(run.stdout)
    assert not found["feasible"]
    assert found["factor"] is None
    # 3 kg weigh 29.43 N, the nominal 2 kg 19.62 N.
    for word in ("infeasible at any speed", "lift", "29.43", "19.62", "25 N", "load mass"):
        assert word in run.stderr


def test_other_infeasible_ranges_are_explained(modrob: Modrob, tmp_path: Path) -> None:
    arguments = ("scale", slider(tmp_path, "{torque: 60, velocity: 1}"), step(tmp_path), "-o", tmp_path / "o")
    run = modrob(*arguments, "--min-factor", "1", "--overwrite")
    assert run.exit_code == 4
    assert "velocity of 1.875 m/s" in run.stderr
    run = modrob(*arguments, "--velocity-limits", "none", "--min-factor", "3", "--overwrite")
    assert run.exit_code == 4
    assert "no factor from 3 to 10 is safe" in run.stderr


@pytest.mark.parametrize(
    ("limits", "options", "code", "words"),
    [
        ("{velocity: 3}", [], 3, "no torque or current limit for lift"),
        ("{current: 3}", [], 3, "lift has a current limit but no torque_constant"),
        ("{torque: 0}", [], 3, "a limit of zero"),
        ("{torque: [3, 8]}", [], 3, "swapped"),
        ("{torque: 60, jerk: 0}", [], 3, "jerk limit of lift: found a limit of zero"),
        ("{torque: 60}", ["--torque-limits", "8:-8"], 2, "swapped"),
        ("{torque: 60}", ["--torque-limits", "0"], 2, "a limit of zero"),
        ("{torque: 60}", ["--torque-limits", "-5"], 2, "expected a limit > 0"),
        ("{torque: 60}", ["--torque-limits", "1:2:3"], 2, "LOW:HIGH"),
        ("{torque: 60}", ["--torque-limits", "8,8"], 2, "found 2 limits"),
        ("{torque: 60}", ["--torque-limits", "much"], 2, "expected comma-separated"),
        ("{torque: 60}", ["--min-factor", "2", "--max-factor", "1"], 2, "smallest < largest"),
        ("{torque: 60}", ["--min-factor", "nan"], 2, "smallest < largest"),
        ("{torque: 60}", ["--gap", "0"], 2, "--gap"),
        ("{torque: 60}", ["--rate", "0"], 2, "--rate"),
        ("{torque: 60}", ["--rate", "1e15"], 2, "--rate"),
        ("{torque: 60}", ["--method", "nominal", "--certify"], 2, "--certify"),
    ],
)
def test_bad_limits_and_options(
    limits: str, options: list[str], code: int, words: str, modrob: Modrob, tmp_path: Path
) -> None:
    run = modrob("scale", slider(tmp_path, limits), step(tmp_path), *options, "-o", tmp_path / "o")
    assert run.exit_code == code, run.output
    assert words in run.stderr
    assert not (tmp_path / "o").exists()


def test_other_joints_and_missing_arguments(modrob: Modrob, tmp_path: Path) -> None:
    run = modrob("scale", slider(tmp_path, "{torque: 60}"), MOTION, "-o", tmp_path / "o")
    assert run.exit_code == 3
    assert "found a motion of 6 joints, expected 1" in run.stderr
    assert modrob("scale", ARM).exit_code == 2
    assert modrob("scale", "--verify", tmp_path / "nothing.json").exit_code == 3
    assert modrob("scale", "--verify", MOTION).exit_code == 3


def test_outputs_are_not_replaced_unasked(modrob: Modrob, tmp_path: Path) -> None:
    arguments = ("scale", slider(tmp_path, "{torque: 60}"), step(tmp_path), "-o", tmp_path / "o")
    assert modrob(*arguments).exit_code == 0
    assert modrob(*arguments).exit_code == 6
    assert modrob(*arguments, "--overwrite").exit_code == 0


def test_a_certificate_is_true(certified: Path, modrob: Modrob) -> None:
    run = modrob("scale", "--verify", certified, "--json")
    found = result_of(run)
    assert found["verified"]
    assert found["faults"] == []


def numbers_of(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths to all numbers of a certificate."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        return [found for key, item in items for found in numbers_of(item, (*path, key))]
    return [path] if isinstance(value, int | float) and not isinstance(value, bool) else []


def changed(content: dict[str, Any], path: tuple[Any, ...], factor: float) -> dict[str, Any]:
    out = copy.deepcopy(content)
    node: Any = out
    for key in path[:-1]:
        node = node[key]
    node[path[-1]] = node[path[-1]] * factor if node[path[-1]] else factor - 1.0
    return out


def test_every_changed_number_is_noticed(certified: Path) -> None:
    """The last digit of any number, by the digest; nothing else needs to be computed for that."""
    from modrob_cli.io.certificate import digest

    content = json.loads(certified.read_text(encoding="utf-8"))
    places = numbers_of(content)
    assert len(places) > 1000
    for path in places:
        assert digest(changed(content, path, 1.0 + 2.0**-50)) != content["digest"], path


@pytest.mark.parametrize(
    "where",
    [
        ("factor",), ("sampled_factor",), ("duration",), ("proven", 0, 1), ("critical", "time"), ("critical", "joint"),
        ("cells", "edges", 7), ("cells", "edges", -1), ("cells", "lower", 20, 1), ("cells", "upper", 30, 2),
        ("limits", "torque_upper", 1), ("speed", "upper", 0, 1), ("options", "limits", "current", 0, 1),
    ],
    ids=str,
)  # fmt: skip
def test_changes_are_noticed_though_the_digest_was_made_anew(where: tuple[Any, ...], certified: Path) -> None:
    """A forger who knows the digest: numbers are computed again from the files."""
    content = json.loads(certified.read_text(encoding="utf-8"))
    content.pop("digest")
    forged = certified.parent / "forged.json"
    forged.write_text(certificate_text(changed(content, where, 1.001)), encoding="utf-8")
    assert verify(forged).faults, where


def test_another_robot_file_is_noticed(certified: Path, tmp_path: Path, modrob: Modrob) -> None:
    other = tmp_path / ARM.name
    other.write_text(ARM.read_text(encoding="utf-8").replace("max: 3}", "max: 3.1}"), encoding="utf-8")
    run = modrob("scale", "--verify", certified, other, MOTION)
    assert run.exit_code == 4
    assert f"changed since the certificate was written: {ARM.name}" in run.stderr
    assert "do not prove the factor" in run.stderr


def test_damaged_certificates_are_told(certified: Path, tmp_path: Path, modrob: Modrob) -> None:
    content = json.loads(certified.read_text(encoding="utf-8"))
    path = tmp_path / "damaged.json"
    harms: list[Callable[[Any], Any]] = [
        lambda c: c.pop("cells"), lambda c: c["cells"]["lower"].pop(), lambda c: c.update(factor="fast"),
        lambda c: c["options"].pop("limits"), lambda c: c.update(more=1), lambda c: c["cells"].update(edges=[[0]]),
        lambda c: c["speed"].update(lower=None), lambda c: c.update(joints=[]),
    ]  # fmt: skip
    for harm in harms:
        harmed = copy.deepcopy(content)
        harm(harmed)
        path.write_text(json.dumps(harmed), encoding="utf-8")
        run = modrob("scale", "--verify", path, ARM, MOTION)
        assert run.exit_code == 3, run.output
    path.write_text("[" * 100_000, encoding="utf-8")
    assert modrob("scale", "--verify", path, ARM, MOTION).exit_code == 3
