"""``modrob validate``: predicted against recorded torque."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modrob_cli.cli.log_options import Effort, JointMap, Publisher, StrictLog, TimeOption, Topic, log_options, positive
from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite
from modrob_cli.cli.progress import track

if TYPE_CHECKING:
    from modrob_cli.identify.effort import EffortKind
    from modrob_cli.workflows.validate_options import FrictionFrom

_HELP = """Compare the torque that the model predicts with the recorded one.

ROBOT is a URDF, a robot/1 or an assembly/1 file. LOG is an MCAP file with joint states, or a CSV file. Friction and
rotors are those of the robot file (--friction file), or are fitted to the first part of each log and judged on the rest
(held-out), or fitted to the very samples that are judged (in-sample). Stretches of logs that a robot file says it was
identified from do not count. Writes an HTML report, JUnit XML, and for each log JSON, CSV and a picture.
"""

_EPILOG = "Example: modrob validate robot.urdf run.mcap --effort torque --max-nrmse 0.2 -o out/validate"


_SHOWN = 8


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("validate", help=_HELP, epilog=_EPILOG, no_args_is_help=True)(_validate)


def _friction(value: str | None) -> str | None:
    kinds = ("file", "held-out", "in-sample")
    if value is not None and value not in kinds:
        raise typer.BadParameter(f"found {value!r}, expected {', '.join(kinds)}")
    return value


def _validate(
    robot: Annotated[Path, typer.Argument(metavar="ROBOT", help="URDF, robot/1 or assembly/1 file.")],
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="MCAP or CSV files.")],
    effort: Effort,
    topic: Topic = None,
    joint_map: JointMap = None,
    time: TimeOption = "header",
    strict: StrictLog = False,
    publisher: Publisher = None,
    cutoff: Annotated[
        float | None,
        typer.Option(callback=positive, metavar="HZ", help="Low-pass of the motion; else chosen from the spectrum."),
    ] = None,
    friction: Annotated[
        str | None,
        typer.Option(
            callback=_friction,
            metavar="FROM",
            help="file, held-out or in-sample; left out: file if it has any friction, else held-out.",
        ),
    ] = None,
    holdout: Annotated[
        float, typer.Option(metavar="SHARE", help="Part of each log, at its end, that a held-out fit does not see.")
    ] = 0.4,
    max_nrmse: Annotated[
        float | None,
        typer.Option(callback=positive, metavar="X", help="Largest NRMSE of any joint that passes; else exit code 4."),
    ] = None,
    min_inside: Annotated[
        float | None,
        typer.Option(callback=positive, metavar="Y", help="Least fraction of samples inside the bounds that passes."),
    ] = None,
    accept_fitted: Annotated[
        bool, typer.Option("--accept-fitted", help="Give a verdict also on data that values were fitted to.")
    ] = False,
    out: OutDir = DEFAULT_OUT,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    from modrob_cli.cli.console import print_json
    from modrob_cli.errors import NegativeAnswerError
    from modrob_cli.workflows.validate import validate
    from modrob_cli.workflows.validate_options import ValidateOptions

    kind: EffortKind = effort  # type: ignore[assignment]
    source: FrictionFrom | None = friction  # type: ignore[assignment]
    reading = log_options(topic, joint_map, time, strict, publisher)
    options = ValidateOptions(kind, reading, cutoff, source, holdout, max_nrmse, min_inside, accept_fitted)
    result = validate(robot, logs, options, out, overwrite, track)
    for log in result["logs"]:
        say_log(log)
    _say_end(result)
    if as_json:
        print_json(result)
    if result["passed"] is False:
        raise NegativeAnswerError("\n".join(_against(result)))
    if options.wants_verdict and result["passed"] is None:
        raise NegativeAnswerError(
            "no verdict: all samples are among those that the values were fitted to; give another log, or say "
            "--accept-fitted"
        )


def _against(result: dict[str, Any]) -> list[str]:
    """What does not pass, worst first, at most a few lines."""
    failed = [(log["log"], joint) for log in result["logs"] for joint in log["joints"] if joint["passed"] is False]
    failed.sort(key=lambda pair: pair[1]["nrmse"] or float("inf"), reverse=True)
    lines = [f"{skipped['log']}: {skipped['reason']}" for skipped in result["skipped"]]
    for log, joint in failed:
        ratio = "no torque recorded" if joint["nrmse"] is None else f"NRMSE {joint['nrmse']:.3f}"
        lines.append(f"{log}: {joint['name']}: {ratio}, {joint['inside']:.1%} inside the bounds")
    return lines[:_SHOWN] + ([f"and {len(lines) - _SHOWN} more"] if len(lines) > _SHOWN else [])


def say_log(log: dict[str, Any]) -> None:
    """Print the table of one log."""
    from modrob_cli.cli.console import say, table

    used = f"{log['samples_used']} of {log['samples']} samples at {log['rate']:.6g} Hz"
    say(f"{log['log']}: {used}, {log['velocity']} velocity, low-pass {log['cutoff']:.4g} Hz")
    for note in log["notes"]:
        say(f"  note: {note}")
    if log["resampled"]:
        say(f"  note: resampled, the times are not even (longest gap {log['longest_gap']:.4g} s)")
    if log["seconds_left_out"]:
        say(f"  note: {log['seconds_left_out']:.4g} s were left out, because the robot file was identified from them")
    if log["fitted_to_these_samples"]:
        say("  note: the values were fitted to these very samples")
    header = ("joint", "NRMSE", "below cut-off", "RMSE", "max error", "inside", "unit")
    keys = ("nrmse", "nrmse_low_passed", "rmse", "max_error")
    fitted = [key for key in ("viscous", "coulomb", "reflected_inertia", "offset") if "fit" in log["joints"][0]]
    rows = [
        (
            joint["name"],
            *(_short(joint[key]) for key in keys),
            f"{joint['inside']:.1%}",
            joint["unit"],
            *(_short(joint["fit"][key]) for key in fitted),
        )
        for joint in log["joints"]
    ]
    say(table((*header, *("viscous", "Coulomb", "inertia", "offset")[: len(fitted)]), rows))
    for joint in log["joints"]:
        for note in joint["notes"]:
            say(f"  note: {joint['name']}: {note}")


def _short(value: float | None) -> float | str:
    return "-" if value is None else float(f"{value:.3g}")


def _say_end(result: dict[str, Any]) -> None:
    from modrob_cli.cli.console import say

    for skipped in result["skipped"]:
        say(f"{skipped['log']}: not judged: {skipped['reason']}")
    say("  NRMSE: RMS error / RMS of the torque as recorded; below cut-off: both low-passed like the motion.")
    say("  inside: samples inside the bounds of the model, intervals of the robot file or of the fit.")
    if result["friction"] != "file":
        say("  Fitted, link side: viscous [N m s/rad], Coulomb [N m], rotor at the joint [kg m^2], offset [N m].")
    say(result["scope"])
    if result["passed"] is not None:
        say(f"Verdict: {'passed' if result['passed'] else 'failed'}")
    files = list(result["files"].values())
    for path in files[:6]:
        say(f"wrote {path}")
    if len(files) > 6:
        say(f"and {len(files) - 6} more files beside them")
