"""``modrob validate``: predicted against recorded torque."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite

if TYPE_CHECKING:
    from modrob_cli.identify.effort import EffortKind

_HELP = """Compare the torque that the model predicts with the recorded one.

ROBOT is a URDF, a robot/1 or an assembly/1 file. LOG is an MCAP file with sensor_msgs/msg/JointState (ROS 2).
Viscous and Coulomb friction, rotor inertia and an offset of each joint are fitted on top of the rigid bodies, on the
same samples that the errors count. Writes a picture and a JSON file for each log.
"""

_EPILOG = "Example: modrob validate robot.urdf run.mcap --effort torque --max-nrmse 0.2 -o out/validate"

_EFFORT_HELP = (
    "What the log calls effort (required, never guessed): torque = at the joint [N m] (prismatic: [N]); "
    "motor-torque = at the motor [N m], times gear_ratio; current = of the motor [A], times torque_constant and "
    "gear_ratio. Both constants come from ROBOT."
)


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("validate", help=_HELP, epilog=_EPILOG, no_args_is_help=True)(_validate)


def _effort(value: str) -> str:
    kinds = ("torque", "current", "motor-torque")
    if value not in kinds:
        raise typer.BadParameter(f"found {value!r}, expected {', '.join(kinds)}")
    return value


def _positive(value: float | None) -> float | None:
    # Written so that NaN fails too.
    if value is not None and not 0.0 < value < float("inf"):
        raise typer.BadParameter(f"found {value}, expected a number > 0")
    return value


def _validate(
    robot: Annotated[Path, typer.Argument(metavar="ROBOT", help="URDF, robot/1 or assembly/1 file.")],
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="MCAP files.")],
    effort: Annotated[str, typer.Option(callback=_effort, metavar="KIND", help=_EFFORT_HELP)],
    topic: Annotated[str | None, typer.Option(help="Topic of the joint states, if there are several.")] = None,
    cutoff: Annotated[
        float | None,
        typer.Option(callback=_positive, metavar="HZ", help="Low-pass of the motion; 10 Hz, or a quarter of the rate."),
    ] = None,
    max_nrmse: Annotated[
        float | None,
        typer.Option(callback=_positive, metavar="X", help="Largest NRMSE of any joint that passes; else exit code 4."),
    ] = None,
    out: OutDir = DEFAULT_OUT,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    from modrob_cli.cli.console import print_json
    from modrob_cli.errors import NegativeAnswerError
    from modrob_cli.workflows.validate import ValidateOptions, validate

    kind: EffortKind = effort  # type: ignore[assignment]
    options = ValidateOptions(kind, topic, cutoff, max_nrmse)
    result = validate(robot, logs, options, out, overwrite, _track)
    for log in result["logs"]:
        _say_log(log)
    _say_end(result)
    if as_json:
        print_json(result)
    if result["passed"] is False:
        worst = max(joint["nrmse"] or float("inf") for log in result["logs"] for joint in log["joints"])
        raise NegativeAnswerError(f"the largest NRMSE is {worst:.3f}, above the {max_nrmse:g} of --max-nrmse")


def _track(paths: Sequence[Path]) -> Iterable[Path]:
    """Show a progress bar if there is something to wait for and somebody to see it."""
    import sys

    if len(paths) < 2 or not sys.stderr.isatty():
        return paths
    from rich.console import Console
    from rich.progress import track

    return track(paths, "Validating", console=Console(stderr=True), transient=True)


def _say_log(log: dict[str, Any]) -> None:
    from modrob_cli.cli.console import say, table

    used = f"{log['samples_used']} of {log['samples']} samples at {log['rate']:.6g} Hz"
    say(f"{log['log']}: {used}, {log['velocity']} velocity, low-pass {log['cutoff']:.4g} Hz")
    if log["repeated_stamps"]:
        say(f"  note: {log['repeated_stamps']} messages repeated the stamp before and were left out")
    if log["resampled"]:
        say(f"  note: resampled, the times are not even (longest gap {log['longest_gap']:.4g} s)")
    header = ("joint", "NRMSE", "below cut-off", "RMSE", "max error", "unit", "viscous", "Coulomb", "inertia", "offset")
    rows = []
    for joint in log["joints"]:
        fit = [_short(joint["fit"][key]) for key in ("viscous", "coulomb", "reflected_inertia", "offset")]
        ratios = [_short(joint[key]) for key in ("nrmse", "nrmse_low_passed")]
        rows.append((joint["name"], *ratios, _short(joint["rmse"]), _short(joint["max_error"]), joint["unit"], *fit))
    say(table(header, rows))
    for joint in log["joints"]:
        for note in joint["notes"]:
            say(f"  note: {joint['name']}: {note}")


def _short(value: float | None) -> float | str:
    return "-" if value is None else float(f"{value:.3g}")


def _say_end(result: dict[str, Any]) -> None:
    from modrob_cli.cli.console import say

    say("  NRMSE: RMS error / RMS of the torque as recorded; below cut-off: both low-passed like the motion.")
    say("  Fitted, link side: viscous [N m s/rad], Coulomb [N m], rotor inertia at the joint [kg m^2], offset [N m].")
    say(result["scope"])
    if result["passed"] is not None:
        say(f"Verdict: {'passed' if result['passed'] else 'failed'}")
    files = list(result["files"].values())
    for path in files[:6]:
        say(f"wrote {path}")
    if len(files) > 6:
        say(f"and {len(files) - 6} more files beside them")
