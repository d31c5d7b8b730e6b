"""``modrob trajectory``: sample and draw a planned motion, and check it against the limits of a robot."""

from pathlib import Path
from typing import Annotated, Any

import typer

from modrob_cli.cli.console import print_json, say, table
from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite

_HELP = """Sample a planned motion, draw it, and check it against the limits of a robot.

TRAJECTORY is a trajectory/1 document: rest-to-rest way points, quintic splines, sin^2 profiles, sums and products of
sines. Writes NAME.csv (t,q1..qN,dq1..dqN,ddq1..ddqN, as modrob bounds reads it), NAME.png and NAME.trajectory.json.
With --robot, position, velocity, acceleration and jerk are compared with its limits; the exit code is 4 if one is
exceeded.
"""

_EPILOG = "Example: modrob trajectory trajectories/table-b1.yaml --robot assemblies/lwa4p-6.yaml -o out"

_ROUNDING = 1e-12
"""Smaller values in the table are left over from rounding; the files have them."""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("trajectory", help=_HELP, epilog=_EPILOG, no_args_is_help=True)(_trajectory)


def _trajectory(
    trajectory: Annotated[Path, typer.Argument(metavar="TRAJECTORY", help="trajectory/1 document.")],
    robot: Annotated[
        Path | None, typer.Option(metavar="ROBOT", help="Assembly, robot file or URDF with the limits.")
    ] = None,
    rate: Annotated[float, typer.Option(metavar="HZ", help="Samples per second.")] = 100.0,
    out: OutDir = DEFAULT_OUT,
    as_json: AsJson = False,
    overwrite: Overwrite = False,
) -> None:
    from modrob_cli.errors import NegativeAnswerError
    from modrob_cli.workflows.trajectory import trajectory as workflow

    result = workflow(trajectory, robot, out, rate, overwrite)
    _say_result(result)
    if as_json:
        print_json(result)
    if result["violations"]:
        raise NegativeAnswerError("\n".join(violation["message"] for violation in result["violations"]))


def _say_result(result: dict[str, Any]) -> None:
    size = f"{result['samples']} samples at {result['rate']:.6g} Hz"
    say(f"\n{result['trajectory']} ({result['kind']}): {result['duration']:.6g} s, {size}\n")
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
