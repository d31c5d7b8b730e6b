"""The options of ``modrob trajectory --optimize-excitation`` and what they do."""

from pathlib import Path
from typing import Annotated, Any

import typer

from modrob_cli.cli.console import print_json, say, table
from modrob_cli.cli.progress import progress_bar

_ONLY = "With --optimize-excitation: "

OptimizeExcitation = Annotated[
    Path | None,
    typer.Option(metavar="ROBOT", help="Search a motion that excites the parameters of ROBOT, instead of TRAJECTORY."),
]
Duration = Annotated[float | None, typer.Option(metavar="S", help=f"{_ONLY}length of the motion [s], 20.")]
Periods = Annotated[int | None, typer.Option(metavar="N", help=f"{_ONLY}how often it repeats within, 1.")]
Harmonics = Annotated[int | None, typer.Option(metavar="K", help=f"{_ONLY}of the Fourier series, 5.")]
Margin = Annotated[float | None, typer.Option(metavar="F", help=f"{_ONLY}part of each limit to use, 0.9.")]
Objective = Annotated[str | None, typer.Option(metavar="O", help=f"{_ONLY}log-det or condition.")]
Seed = Annotated[int | None, typer.Option(metavar="N", help=f"{_ONLY}of the random starts, 0.")]
Iterations = Annotated[int | None, typer.Option(metavar="N", help=f"{_ONLY}at most, for each start, 100.")]
Seconds = Annotated[float | None, typer.Option(metavar="S", help=f"{_ONLY}end of the search (not repeatable then).")]
Joints = Annotated[str | None, typer.Option(metavar="NAME,...", help=f"{_ONLY}joints that move; the others rest.")]
ExcitationName = Annotated[str | None, typer.Option("--name", metavar="NAME", help=f"{_ONLY}name of the motion.")]
PositionLimits = Annotated[
    str | None,
    typer.Option(metavar="LOW:HIGH,...", help=f"{_ONLY}in joint order, or one for all; override the file's."),
]
VelocityLimits = Annotated[str | None, typer.Option(metavar="V,...", help=f"{_ONLY}likewise.")]
AccelerationLimits = Annotated[str | None, typer.Option(metavar="A,...", help=f"{_ONLY}likewise.")]
TorqueLimits = Annotated[str | None, typer.Option(metavar="T,...", help=f"{_ONLY}likewise, for the nominal robot.")]


def check_alternatives(
    trajectory: Path | None, excited: Path | None, robot: Path | None, given: dict[str, Any]
) -> None:
    """Make sure that there is exactly one thing to do.

    Parameters
    ----------
    given : options of the search by their names

    Raises
    ------
    UsageError
        If there are none or two, or options that belong to the other.
    """
    from modrob_cli.errors import UsageError

    if (trajectory is None) == (excited is None):
        raise UsageError("expected either TRAJECTORY or --optimize-excitation ROBOT")
    if excited is not None and robot is not None:
        raise UsageError("--robot is for TRAJECTORY; --optimize-excitation names the robot itself")
    extra = [f"--{key.replace('_', '-')}" for key, value in given.items() if value is not None]
    if excited is None and extra:
        raise UsageError(f"{', '.join(extra)}: only with --optimize-excitation ROBOT")


def run_excitation(
    robot: Path, given: dict[str, Any], out: Path, rate: float, overwrite: bool, formats: list[str], as_json: bool
) -> None:
    """Search, write, print."""
    from modrob_cli.errors import UsageError
    from modrob_cli.workflows.excitation import ExcitationRequest, excitation

    limits = {
        key: ranges(given[f"{key}_limits"], f"--{key}-limits")
        for key in ("position", "velocity", "acceleration", "torque")
        if given[f"{key}_limits"] is not None
    }
    plain = {key: value for key, value in given.items() if value is not None and not key.endswith("_limits")}
    if "joints" in plain:
        plain["joints"] = [name.strip() for name in plain["joints"].split(",") if name.strip()]
    if plain.get("objective", "log-det") not in ("log-det", "condition"):
        raise UsageError(f"--objective: found {plain['objective']!r}, expected log-det or condition")
    request = ExcitationRequest(**plain, limits=limits)
    with progress_bar("Searching") as report:
        result = excitation(robot, request, out, rate, overwrite, formats, lambda fraction: report("", fraction))
    _say(result)
    if as_json:
        print_json(result)


def ranges(text: str, option: str) -> list[tuple[float, float]]:
    """Comma-separated ranges ``low:high``, or numbers r for -r:r.

    Raises
    ------
    UsageError
        If a part is neither.
    """
    from modrob_cli.cli.options import numbers
    from modrob_cli.errors import UsageError

    out = []
    for part in text.split(","):
        ends = [value for end in part.split(":") for value in numbers(end, option) or []]
        if len(ends) > 2:
            raise UsageError(f"{option}: found {part.strip()!r}, expected low:high or one number")
        out.append((ends[0], ends[1]) if len(ends) == 2 else (-ends[0], ends[0]))
    return out


def _say(result: dict[str, Any]) -> None:
    size = f"{result['duration']:.6g} s, {result['harmonics']} harmonics, {result['base_parameters']} base parameters"
    say(f"\n{result['trajectory']} for {result['robot']}: {size}\n")
    random = result["random"]
    rows = [("this motion", result["condition"], result["log_det"])]
    if random["count"]:
        rows += [(f"{which} random motion", random["condition"][which], random["log_det"][which]) for which in ("best", "median")]  # fmt: skip  # noqa: E501
    say(table(("", "condition number", "-log det"), rows))
    if result["stderr_ratio"] is not None:
        say(
            f"\n  standard errors {result['stderr_ratio']:.2f} times those of the median random motion (geometric mean)"
        )
    quantities = ("position", "velocity", "acceleration", "jerk", "torque")
    used = [
        (joint["name"], *("-" if (value := joint["used"][key]) is None else f"{value:.1%}" for key in quantities))
        for joint in result["joints"]
    ]
    say("\n  part of each limit that is used\n")
    say(table(("joint", *quantities), used))
    if result["stopped"]:
        say("\n  the search ended because the time was over")
    say(
        "\n  self-collision, floor and surroundings were not considered: look at the motion before the robot makes it\n"
    )
    for path in result["files"].values():
        say(f"wrote {path}")
