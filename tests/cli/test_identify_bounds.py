"""``modrob identify --bounds``: what it writes is read by the other commands and holds every sample."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.errors import OutputExistsError, UsageError
from modrob_cli.identify.run import Run, prepare_run
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.model.log import JointLog
from modrob_cli.workflows.bounded_options import BoundedOptions
from modrob_cli.workflows.identify_bounds import identify_bounds
from modrob_cli.workflows.robots import LoadedRobot, load_robot

Command = Callable[..., Result]

VISCOUS, COULOMB, NOISE = np.array([2.0, 4.0]), np.array([1.0, 1.5]), 0.2


def recording(robot: LoadedRobot, seed: int, hit: float = 0.0) -> JointLog:
    """A run of 12 s with constant friction, bounded noise, and perhaps a knock on joint 2 between 5 and 5.2 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 12.0, 0.008)
    rate, phase = np.array([1.3, 1.9]), rng.uniform(0.0, 6.0, 2)
    angle = t[:, None] * rate + phase
    q, dq, ddq = np.sin(angle), rate * np.cos(angle), -(rate**2) * np.sin(angle)
    tau = rnea(robot.robot, q, dq, ddq) + VISCOUS * dq + COULOMB * np.sign(dq)
    tau += rng.uniform(-NOISE, NOISE, tau.shape)
    tau[(t > 5.0) & (t < 5.2), 1] += hit
    return JointLog(f"run{seed}", robot.robot.joint_names, t, q, dq, tau)


def runs_of(robot: LoadedRobot, seeds: tuple[int, ...], hit: float = 0.0) -> list[Run]:
    return [prepare_run(robot.robot, recording(robot, seed, hit), "torque", 10.0) for seed in seeds]


def inside(path: Path, run: Run) -> Array:
    """Share of the samples of each joint inside the bounds of a robot, as another command sees it."""
    robot = load_robot(path).robot
    bounds = exact_bounds(robot, run.q[run.used], run.dq[run.used], run.ddq[run.used])
    tau = run.tau[run.used]
    return np.asarray(np.mean((bounds.lower <= tau) & (tau <= bounds.upper), axis=0))


def test_the_robot_file_holds_every_sample_and_most_of_another_run(workspace: Path, modrob: Command) -> None:
    robot = load_robot(workspace / "planar.yaml")
    runs = runs_of(robot, (1, 2))
    held = runs_of(robot, (3,))
    with OutputFolder(workspace / "out") as folder:
        result = identify_bounds(robot, runs, BoundedOptions(), folder, held)
    for run in runs:
        assert np.all(inside(Path(result["files"]["robot"]), run) == 1.0)
    assert np.all(inside(Path(result["files"]["robot"]), held[0]) > 0.98)
    for j, joint in enumerate(result["held_out"]["joints"]):
        assert joint["inside"] == pytest.approx(inside(Path(result["files"]["robot"]), held[0])[j])
    for j, joint in enumerate(result["joints"]):
        assert joint["inside"] == 1.0
        assert joint["spread"] == "least"
        # The filter blurs the reversals, which widens the disturbance beyond the noise.
        assert joint["viscous"]["lower"] == pytest.approx(VISCOUS[j], rel=0.2)
        assert joint["reliability"]["outside_at_most"] < 0.2
    assert json.loads(Path(result["files"]["json"]).read_text())["joints"] == result["joints"]
    assert Path(result["files"]["picture"]).read_bytes().startswith(b"\x89PNG")
    header, *rows = Path(result["files"]["parameters"]).read_text().splitlines()
    assert header == "joint,quantity,nominal,lower,upper"
    assert len(rows) == 8
    # What is written is a robot/1 that other commands take.
    assert modrob("check", result["files"]["robot"]).exit_code == 0
    assert result["overlay"] is None
    assert not (workspace / "out" / "planar.bounded.modules").exists()


def test_a_stated_noise_gives_intervals_that_hold_the_truth(workspace: Path) -> None:
    robot = load_robot(workspace / "planar.yaml")
    # The noise has to cover what the filter does to the reversals, too: ask for twice the noise.
    options = BoundedOptions(effort_noise=[2.0 * NOISE], velocity_band=[0.15])
    with OutputFolder(workspace / "out") as folder:
        result = identify_bounds(robot, runs_of(robot, (1, 2)), options, folder)
    for j, joint in enumerate(result["joints"]):
        assert joint["spread"] == "consistent"
        assert joint["agrees_with_noise"] is True
        assert joint["reliability"] is None
        assert joint["viscous"]["lower"] <= VISCOUS[j] <= joint["viscous"]["upper"]
        assert joint["coulomb"]["lower"] <= COULOMB[j] <= joint["coulomb"]["upper"]
        assert joint["reflected_inertia"]["lower"] == 0.0
    too_small = BoundedOptions(effort_noise=[0.01])
    with OutputFolder(workspace / "out", overwrite=True) as folder:
        result = identify_bounds(robot, runs_of(robot, (1,)), too_small, folder)
    assert all("within the stated noise" in joint["notes"][0] for joint in result["joints"])


def test_a_knock_is_left_out_and_named(workspace: Path) -> None:
    robot = load_robot(workspace / "planar.yaml")
    runs = runs_of(robot, (1,), hit=20.0)
    with OutputFolder(workspace / "out") as folder:
        result = identify_bounds(robot, runs, BoundedOptions(outliers=40), folder)
    struck = result["joints"][1]
    event = max(struck["left_out"], key=lambda item: item["samples"])
    assert event["log"] == "run1"
    assert 4.9 < event["start"] < event["end"] < 5.3
    assert event["samples"] >= 20
    assert event["peak"] == pytest.approx(20.0, abs=2.0)
    assert struck["inside"] < 1.0
    assert struck["mean_width_with_all"] > 3.0 * struck["mean_width"]
    kinds = {row.split(",")[-2] for row in Path(result["files"]["samples"]).read_text().splitlines()[1:]}
    assert kinds == {"upper", "lower", "left out"}


def test_modules_get_the_hull_of_their_uses(workspace: Path, modrob: Command) -> None:
    """The assembly uses module J twice; the overlay's J holds both joints' intervals, and the rest is unchanged."""
    robot = load_robot(workspace / "arm.yaml")
    with OutputFolder(workspace / "out") as folder:
        result = identify_bounds(robot, runs_of(robot, (1, 2)), BoundedOptions(growth=False), folder)
    assert result["overlay"]["joined"] == [{"module": "J", "unit": 1, "joints": ["J.1", "J#2.1"]}]
    assert result["growth"] is None
    assert modrob("check", workspace / "out").exit_code == 0
    found = load_robot(Path(result["files"]["robot"])).robot
    overlay = load_robot(Path(result["files"]["assembly"])).robot
    for one, other in zip(overlay.joints, found.joints, strict=True):
        assert one.friction.viscous.interval.encloses(other.friction.viscous.interval)
        assert one.friction.coulomb.interval.encloses(other.friction.coulomb.interval)
        assert one.drive.rotor_inertia.interval.encloses(other.drive.rotor_inertia.interval)
        assert one.friction.velocity_band >= other.friction.velocity_band
    np.testing.assert_array_equal(overlay.disturbance.inf, found.disturbance.inf)
    np.testing.assert_array_equal(overlay.disturbance.sup, found.disturbance.sup)
    for placed, before in zip(overlay.bodies, robot.robot.bodies, strict=True):
        np.testing.assert_array_equal(placed.pose, before.pose)
        np.testing.assert_array_equal(placed.body.mass.interval.sup, before.body.mass.interval.sup)
    for run in runs_of(robot, (1, 2)):
        assert np.all(inside(Path(result["files"]["assembly"]), run) == 1.0)


def test_noise_of_the_motion_widens_the_rigid_bodies_range(workspace: Path) -> None:
    robot = load_robot(workspace / "planar.yaml")
    runs = runs_of(robot, (1,))
    with OutputFolder(workspace / "out", overwrite=True) as folder:
        plain = identify_bounds(robot, runs, BoundedOptions(growth=False), folder)
    for noise in (
        BoundedOptions(growth=False, ddq_noise=[0.2]),
        BoundedOptions(growth=False, q_noise=[0.001], dq_noise=[0.01], ddq_noise=[0.2]),
    ):
        with OutputFolder(workspace / "out", overwrite=True) as folder:
            noisy = identify_bounds(robot, runs, noise, folder)
        for one, other in zip(noisy["joints"], plain["joints"], strict=True):
            assert one["inside"] == 1.0
            assert one["mean_width_rigid"] > other["mean_width_rigid"]
            assert one["least_disturbance"] < other["least_disturbance"]


def test_other_torques_and_bands(workspace: Path) -> None:
    robot = load_robot(workspace / "planar.yaml")
    runs = runs_of(robot, (1,))
    widths = {}
    for name, options in (
        ("usual", BoundedOptions(growth=False)),
        ("auto", BoundedOptions(growth=False, velocity_band="auto")),
        ("filtered", BoundedOptions(growth=False, torque="filtered", velocity_band="auto")),
        ("one value", BoundedOptions(growth=False, spread="disturbance")),
    ):
        with OutputFolder(workspace / "out", overwrite=True) as folder:
            result = identify_bounds(robot, runs, options, folder)
        assert all(joint["inside"] == 1.0 for joint in result["joints"])
        widths[name] = sum(joint["mean_width"] for joint in result["joints"])
    assert widths["auto"] <= widths["usual"] <= widths["one value"] * 1.001


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (BoundedOptions(outliers=-1.0), "--outliers"),
        (BoundedOptions(outliers=1.5), "whole number"),
        (BoundedOptions(outliers=float("nan")), "--outliers"),
        (BoundedOptions(outliers=0.9), "more than half"),
        (BoundedOptions(effort_noise=[1.0, 2.0, 3.0]), "--effort-noise"),
        (BoundedOptions(effort_noise=[-1.0]), "--effort-noise"),
        (BoundedOptions(effort_noise=[1.0, 0.0]), "for every joint"),
        (BoundedOptions(spread="consistent"), "--effort-noise"),
        (BoundedOptions(velocity_band=[-0.1]), "--velocity-band"),
    ],
)
def test_bad_options_are_refused_and_nothing_is_written(workspace: Path, options: BoundedOptions, message: str) -> None:
    robot = load_robot(workspace / "planar.yaml")
    with pytest.raises(UsageError, match=message), OutputFolder(workspace / "out") as folder:
        identify_bounds(robot, runs_of(robot, (1,)), options, folder)
    assert not (workspace / "out").exists()


def test_outputs_that_exist_are_kept(workspace: Path) -> None:
    robot = load_robot(workspace / "planar.yaml")
    runs = runs_of(robot, (1,))
    with OutputFolder(workspace / "out") as folder:
        identify_bounds(robot, runs, BoundedOptions(growth=False), folder)
    with pytest.raises(OutputExistsError), OutputFolder(workspace / "out") as folder:
        identify_bounds(robot, runs, BoundedOptions(growth=False), folder)


def save_csv(log: JointLog, path: Path) -> Path:
    """The log as a CSV file with columns by joint names."""
    names = log.joint_names
    header = ["t", *(f"{part}.{name}" for part in ("q", "dq", "effort") for name in names)]
    assert log.dq is not None
    np.savetxt(
        path, np.column_stack([log.t, log.q, log.dq, log.effort]), delimiter=",", header=",".join(header), comments=""
    )  # fmt: skip
    return path


def test_the_command_says_what_was_found_and_what_was_left_out(workspace: Path, modrob: Command) -> None:
    robot = load_robot(workspace / "planar.yaml")
    log = save_csv(recording(robot, 1, hit=20.0), workspace / "run.csv")
    common = (workspace / "planar.yaml", log, "--effort", "torque", "--cutoff", "10", "--bounds")
    done = modrob("identify", *common, "--outliers", "40", "-o", workspace / "out", "--json")
    assert done.exit_code == 0, done.output
    assert "smallest intervals that put every sample inside the torque bounds" in done.stderr
    assert "samples left out, mean width" in done.stderr
    assert "least width" in done.stderr
    found = json.loads(done.stdout)["bounds"]
    assert found["held_out"]["samples"] > 0
    noisy = modrob(
        "identify", *common, "--effort-noise", "30", "--ddq-tolerance", "0.1", "--velocity-band", "auto", "-o",
        workspace / "noisy",
    )  # fmt: skip
    assert noisy.exit_code == 0, noisy.output
    assert "all consistent" in noisy.stderr
    one = modrob("identify", *common, "--spread", "disturbance", "--filtered-torque", "-o", workspace / "one")
    assert one.exit_code == 0, one.output
    assert "one value" in one.stderr
    for options in (["--spread", "all"], ["--spread", "consistent"], ["--ddq-tolerance", "1,2,3"]):
        bad = modrob("identify", *common, *options, "-o", workspace / "bad")
        assert bad.exit_code == 2, bad.output
        assert options[0] in bad.stderr or "--effort-noise" in bad.stderr
    assert not (workspace / "bad").exists()
