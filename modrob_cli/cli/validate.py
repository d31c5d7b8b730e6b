"""``modrob validate``: predicted against recorded torque."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modrob_cli.cli.batch_options import Dask, Details, Jobs, KeepGoing, Logs, Resume, batch_options
from modrob_cli.cli.log_options import Effort, JointMap, Publisher, StrictLog, TimeOption, Topic, log_options, positive
from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite

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
    logs: Logs,
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
    jobs: Jobs = None,
    resume: Resume = False,
    keep_going: KeepGoing = True,
    dask: Dask = None,
    details: Details = None,
    out: OutDir = DEFAULT_OUT,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    from modrob_cli.cli.batch_progress import FEW, batch_progress
    from modrob_cli.cli.console import print_json
    from modrob_cli.cli.validate_report import end, measure, say_end, say_log
    from modrob_cli.io.log_sources import find_logs
    from modrob_cli.workflows.validate import validate
    from modrob_cli.workflows.validate_options import ValidateOptions

    kind: EffortKind = effort  # type: ignore[assignment]
    source: FrictionFrom | None = friction  # type: ignore[assignment]
    reading = log_options(topic, joint_map, time, strict, publisher)
    options = ValidateOptions(kind, reading, cutoff, source, holdout, max_nrmse, min_inside, accept_fitted)
    batch = batch_options(jobs, resume, keep_going, dask, details, overwrite)
    sources = find_logs(logs)
    with batch_progress("validate", len(sources), measure) as listener:
        result = validate(robot, sources, options, out, overwrite, batch, listener)
    if len(sources) <= FEW:
        for log in result["logs"]:
            say_log(log)
    listener.say_summary()
    say_end(result)
    if as_json:
        print_json(result)
    end(result, options.wants_verdict)
