"""``modrob trajectory``: sample and draw a planned motion, and check it against the limits of a robot."""

from pathlib import Path
from typing import Annotated, Any

import typer

from modrob_cli.cli import excitation as ex
from modrob_cli.cli.console import print_json, say, table
from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite

_HELP = """Sample a planned motion, draw it, and check it against the limits of a robot.

TRAJECTORY is a trajectory/1 document (rest-to-rest way points, quintic splines, sin^2 profiles, sums and products of
sines), a ROS JointTrajectory as YAML or JSON, samples as CSV (t,q1..qN with or without dq1..dqN and ddq1..ddqN), or an
MCAP file with a JointTrajectory or joint states. Writes NAME.csv (t,q1..qN,dq1..dqN,ddq1..ddqN, as modrob bounds reads
it), NAME.mcap (ROS 2), NAME.png and NAME.trajectory.json.
With --robot, position, velocity, acceleration and jerk are compared with its limits; the exit code is 4 if one is
exceeded.
With --optimize-excitation ROBOT in place of TRAJECTORY, a Fourier motion within the limits of ROBOT is searched that
tells its friction and dynamic parameters apart as well as possible; NAME.yaml and NAME.excitation.json are written too.
"""

_EPILOG = "Example: modrob trajectory trajectories/table-b1.yaml --robot assemblies/lwa4p-6.yaml -o out"

_ROUNDING = 1e-12
"""Smaller values in the table are left over from rounding; the files have them."""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("trajectory", help=_HELP, epilog=_EPILOG, no_args_is_help=True)(_trajectory)


def _trajectory(
    trajectory: Annotated[
        Path | None, typer.Argument(metavar="TRAJECTORY", help="Motion: YAML, JSON, CSV or MCAP.", show_default=False)
    ] = None,
    robot: Annotated[
        Path | None, typer.Option(metavar="ROBOT", help="Assembly, robot file or URDF with the limits.")
    ] = None,
    rate: Annotated[float, typer.Option(metavar="HZ", help="Samples per second.")] = 100.0,
    topic: Annotated[str | None, typer.Option(metavar="NAME", help="Topic of an MCAP file with several.")] = None,
    formats: Annotated[
        str, typer.Option("--format", metavar="F,...", help="Files of samples to write: csv, mcap.")
    ] = "csv,mcap",
    optimize_excitation: ex.OptimizeExcitation = None,
    duration: ex.Duration = None,
    periods: ex.Periods = None,
    harmonics: ex.Harmonics = None,
    margin: ex.Margin = None,
    objective: ex.Objective = None,
    seed: ex.Seed = None,
    iterations: ex.Iterations = None,
    seconds: ex.Seconds = None,
    joints: ex.Joints = None,
    name: ex.ExcitationName = None,
    position_limits: ex.PositionLimits = None,
    velocity_limits: ex.VelocityLimits = None,
    acceleration_limits: ex.AccelerationLimits = None,
    torque_limits: ex.TorqueLimits = None,
    out: OutDir = DEFAULT_OUT,
    as_json: AsJson = False,
    overwrite: Overwrite = False,
) -> None:
    search = {
        "duration": duration, "periods": periods, "harmonics": harmonics, "margin": margin, "objective": objective,
        "seed": seed, "iterations": iterations, "seconds": seconds, "joints": joints, "name": name,
        "position_limits": position_limits, "velocity_limits": velocity_limits,
        "acceleration_limits": acceleration_limits, "torque_limits": torque_limits,
    }  # fmt: skip
    ex.check_alternatives(trajectory, optimize_excitation, robot, search)
    chosen = [part.strip() for part in formats.split(",") if part.strip()]
    if optimize_excitation is not None:
        ex.run_excitation(optimize_excitation, search, out, rate, overwrite, chosen, as_json)
    elif trajectory is not None:
        _sample(trajectory, robot, out, rate, overwrite, topic, chosen, as_json)


def _sample(
    trajectory: Path, robot: Path | None, out: Path, rate: float, overwrite: bool, topic: str | None,
    formats: list[str], as_json: bool,
) -> None:  # fmt: skip
    from modrob_cli.errors import NegativeAnswerError
    from modrob_cli.workflows.trajectory import trajectory as workflow

    result = workflow(trajectory, robot, out, rate, overwrite, topic, formats)
    _say_result(result)
    if as_json:
        print_json(result)
    if result["violations"]:
        raise NegativeAnswerError("\n".join(violation["message"] for violation in result["violations"]))


def _say_result(result: dict[str, Any]) -> None:
    for warning in result["warnings"]:
        say(f"warning: {warning}")
    size = f"{result['samples']} samples at {result['rate']:.6g} Hz"
    kind = f"{result['kind']}, {result['detail']}" if result["detail"] else result["kind"]
    say(f"\n{result['trajectory']} ({kind}): {result['duration']:.6g} s, {size}\n")
    quantities = ("position", "velocity", "acceleration", "jerk")
    rows = [
        (joint["name"], *(f"{_short(joint[key]['min'])} .. {_short(joint[key]['max'])}" for key in quantities))
        for joint in result["joints"]
    ]
    say(table(("joint", *quantities), rows))
    say("")
    for path in result["files"].values():
        say(f"wrote {path}")
    if result["robot"] is None:
        return
    if result["within_limits"] is None:
        say(f"{result['robot']} has no limits of position, velocity, acceleration or jerk: nothing was checked")
    elif result["within_limits"]:
        say(f"within all {result['limits_checked']} limits of {result['robot']}")


def _short(value: float) -> str:
    return "0" if abs(value) < _ROUNDING else f"{value:.4g}"
