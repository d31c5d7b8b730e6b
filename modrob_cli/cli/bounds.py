"""``modrob bounds``: torque bounds over a motion, and where their width comes from."""

import enum
from pathlib import Path
from typing import Annotated, Any

import typer

from modrob_cli.cli.console import print_json, say, table
from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite, numbers
from modrob_cli.cli.progress import progress_bar

_HELP = """Bound the joint torques along a motion, for every admissible value of every uncertain parameter.

ROBOT is an assembly, a robot file or a URDF. MOTION is a CSV file t,q1..qN,dq1..dqN,ddq1..ddqN in joint order, or with
q.NAME, dq.NAME, ddq.NAME for joints by name; or another motion as modrob trajectory takes it (*.yaml, *.json, *.mcap),
which is sampled. The bounds are exact (no admissible parameters give more, some give as much) and hold in spite of
rounding. Writes MOTION.bounds.csv, .bounds.json, .bounds.png, and MOTION.shares.csv: which parameters make the bounds
wide, so which to measure better first.
"""

_EPILOG = "Example: modrob bounds assemblies/lwa4p-6-payload.yaml motion.csv --ddq-tolerance 0.1 -o out/bounds"

_SHOWN = 3


class Method(enum.StrEnum):
    """Ways to bound."""

    exact = "exact"
    ianea = "ianea"


_METHOD_HELP = "exact = the exact range; ianea = the published interval Newton-Euler algorithm, wider, to compare with."
_ONE_OR_EACH = "one number, or one for each joint separated by commas"


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("bounds", help=_HELP, epilog=_EPILOG, no_args_is_help=True)(_bounds)


def _bounds(
    robot: Annotated[Path, typer.Argument(metavar="ROBOT", help="Assembly, robot file or URDF.")],
    motion: Annotated[Path, typer.Argument(metavar="MOTION", help="Motion: CSV, YAML, JSON or MCAP.")],
    out: OutDir = DEFAULT_OUT,
    method: Annotated[Method, typer.Option(help=_METHOD_HELP)] = Method.exact,
    ddq_tolerance: Annotated[
        str | None,
        typer.Option(metavar="A", help=f"Accelerations are known to +-A [rad/s^2, m/s^2]: {_ONE_OR_EACH}."),
    ] = None,
    q_noise: Annotated[
        str | None, typer.Option(metavar="Q", help=f"Positions are known to +-Q [rad, m]: {_ONE_OR_EACH}.")
    ] = None,
    dq_noise: Annotated[
        str | None, typer.Option(metavar="V", help=f"Velocities are known to +-V [rad/s, m/s]: {_ONE_OR_EACH}.")
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Samples per second of a MOTION that is not CSV; 100 where left out."),
    ] = None,
    topic: Annotated[str | None, typer.Option(metavar="NAME", help="Topic of an MCAP file with several.")] = None,
    as_json: AsJson = False,
    overwrite: Overwrite = False,
) -> None:
    from modrob_cli.workflows.bounds import bounds
    from modrob_cli.workflows.bounds_method import BoundsOptions

    options = BoundsOptions(
        method.value,
        numbers(ddq_tolerance, "--ddq-tolerance"),
        numbers(q_noise, "--q-noise"),
        numbers(dq_noise, "--dq-noise"),
    )
    with progress_bar("Bounding") as report:
        result = bounds(robot, motion, options, out, overwrite, lambda fraction: report("", fraction), rate, topic)
    say_result(result)
    if as_json:
        print_json(result)


def say_result(result: dict[str, Any]) -> None:
    """Print the table of joints and what makes their bounds wide."""
    for text in result["motion_warnings"]:
        say(f"warning: {text}")
    for warning in result["warnings"]:
        say(f"warning: {warning['message']}")
    span = f"t = {result['start']:.6g} .. {result['end']:.6g} s"
    say(f"\n{result['robot']}: {result['samples']} samples, {span}, method {result['method']}\n")
    header = ("joint", "mean width", "max width", "min lower", "max upper", "unit", "torque limits", "beyond them")
    say(table(header, [_joint_row(joint, result["samples"]) for joint in result["joints"]]))
    rows = [
        (joint["name"], part["parameter"], float(f"{part['width']:.3g}"), joint["unit"], f"{part['share']:.1%}")
        for joint in result["shares"]
        for part in joint["parameters"][:_SHOWN]
    ]
    if rows:
        of = " (of the exact range)" if result["method"] == "ianea" else ""
        say(f"\n  where the width comes from{of}: the range that each parameter alone gives, mean over the motion\n")
        say(table(("joint", "parameter", "width", "unit", "share"), rows))
    else:
        say("\n  nothing in the robot file is uncertain: the width is the allowance for rounding")
    say("")
    for path in result["files"].values():
        say(f"wrote {path}")


def _joint_row(joint: dict[str, Any], samples: int) -> tuple[object, ...]:
    figures = [float(f"{joint[key]:.4g}") for key in ("mean_width", "max_width", "min_lower", "max_upper")]
    limits = joint["torque_limits"]
    known = f"{limits[0]:.4g} .. {limits[1]:.4g}" if limits else "-"
    beyond = f"{joint['samples_beyond_limits'] / samples:.1%}" if limits else "-"
    return (joint["name"], *figures, joint["unit"], known, beyond)
