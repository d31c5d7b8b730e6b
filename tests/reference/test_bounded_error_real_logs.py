"""Bounded-error identification on recordings of real arms: all samples inside, and how many of a held-out part."""

from pathlib import Path

import pytest

from modrob_cli.identify.run import prepare_run
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.workflows.bounded_options import BoundedOptions
from modrob_cli.workflows.identify_bounds import identify_bounds
from modrob_cli.workflows.robots import load_robot
from tests.shared_data import shared

UR10 = ("ur10", "ur10_exciting_trajectory.mcap")
TX40 = ("staubli_tx40", "ident.mcap")


@pytest.mark.parametrize(
    ("recording", "least_inside"),
    [
        # Measured: .971 .892 .753 .931 .916 .919. A log of one slow sweep: joints 2 and 3 carry masses that err, which
        # shows at other combinations of postures.
        (UR10, (0.96, 0.88, 0.74, 0.92, 0.90, 0.90)),
        # Measured: 1.000 .9999 .9994 .9996 .991 .960; joints 5 and 6 are coupled, which friction of a joint cannot be.
        (TX40, (0.999, 0.999, 0.998, 0.998, 0.98, 0.95)),
    ],
    ids=["ur10", "tx40"],
)
def test_intervals_from_sixty_percent_hold_most_of_the_rest(
    recording: tuple[str, str], least_inside: tuple[float, ...], tmp_path: Path
) -> None:
    folder = shared(recording[0])
    robot = load_robot(folder / "model.urdf")
    run = prepare_run(robot.robot, read_joint_log(folder / recording[1], robot.robot.joint_names), "torque", 10.0)
    split = 0.6 * run.duration
    train, test = run.between(0.0, split), run.between(split, run.duration + 1.0)
    with OutputFolder(tmp_path) as out:
        result = identify_bounds(robot, [train], BoundedOptions(growth=False), out, [test])
    assert all(joint["inside"] == 1.0 for joint in result["joints"])
    found = [joint["inside"] for joint in result["held_out"]["joints"]]
    assert all(share >= least for share, least in zip(found, least_inside, strict=True)), found
    # No wider than with one value each, up to what the unknown sign near standstill adds.
    assert all(joint["mean_width"] < 2.2 * joint["least_disturbance"] for joint in result["joints"])
