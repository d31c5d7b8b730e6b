"""``modrob collision``: thresholds, events, sensitivity."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from modrob_cli.cli.batch_options import Dask, Details, Jobs, KeepGoing, Logs, Resume, batch_options
from modrob_cli.cli.log_options import JointMap, Publisher, StrictLog, TimeOption, Topic, log_options
from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite, numbers

_HELP = """Collision thresholds that no admissible parameter passes without contact, and how sensitive they are.

ROBOT is an assembly, a robot file or a URDF. LOG is an MCAP or CSV file with positions, velocities and efforts, or many
of them; a *.yaml or *.json file is a planned motion, for thresholds and sensitivity alone. For every sample the band of
torques without contact is computed over all admissible parameters, the stated noise and the acceleration's tolerance;
both are filtered so that inclusion holds. Writes an HTML report, a table of events, constant thresholds (YAML), and for
each log JSON, CSV and MCAP (measured, lower, upper); pictures and pages of the worst logs.
"""

_EPILOG = (
    "Example: modrob collision assemblies/lwa4p-6-payload.yaml run.mcap --effort torque --ddq-tolerance 2 "
    "--filter butterworth2:20 -o out/collision"
)
_KINDS = ("torque", "current", "motor-torque", "net-torque")
_SOURCES = ("desired", "measured", "smoothed")
_EACH = "one number, or one for each joint separated by commas"


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("collision", help=_HELP, epilog=_EPILOG, no_args_is_help=True)(_collision)


def _one_of(kinds: Sequence[str], value: str | None) -> str | None:
    if value is not None and value not in kinds:
        raise typer.BadParameter(f"found {value!r}, expected {', '.join(kinds)}")
    return value


def _effort(value: str | None) -> str | None:
    return _one_of(_KINDS, value)


def _source(value: str | None) -> str | None:
    return _one_of(_SOURCES, value)


def _method(value: str) -> str:
    return str(_one_of(("exact", "ianea"), value))


def _option(help_text: str, metavar: str) -> Any:
    return typer.Option(metavar=metavar, help=help_text)


def _collision(
    robot: Annotated[Path, typer.Argument(metavar="ROBOT", help="Assembly, robot file or URDF.")],
    logs: Logs,
    effort: Annotated[
        str | None,
        typer.Option(
            callback=_effort,
            metavar="KIND",
            help="What the log calls effort, never guessed: torque, motor-torque, current or net-torque (as for "
            "validate). Not needed for planned motions.",
        ),
    ] = None,
    method: Annotated[
        str, typer.Option(callback=_method, metavar="exact|ianea", help="Bands that make the events.")
    ] = "exact",
    filter_text: Annotated[
        str,
        typer.Option(
            "--filter",
            metavar="FILTER",
            help="Causal low-pass of the measurement: none, first-order:HZ, first-order:HZxN, butterworthN:HZ.",
        ),
    ] = "none",
    acceleration: Annotated[
        str | None,
        typer.Option(
            callback=_source,
            metavar="FROM",
            help="desired = planned (with --ddq-tolerance); measured = differences of the measured velocity (with "
            "--dq-noise and --jerk); smoothed = low-passed without phase shift. Left out: desired.",
        ),
    ] = None,
    desired: Annotated[
        Path | None, _option("Planned motion; left out: the controller's topic in the log.", "TRAJECTORY")
    ] = None,
    desired_start: Annotated[float, _option("Time of the log at which the planned motion starts [s].", "S")] = 0.0,
    ddq_tolerance: Annotated[str | None, _option(f"Real accelerations are within +-A: {_EACH}.", "A")] = None,
    q_noise: Annotated[str | None, _option(f"Positions are known to +-Q [rad, m]: {_EACH}.", "Q")] = None,
    dq_noise: Annotated[str | None, _option(f"Velocities are known to +-V [rad/s, m/s]: {_EACH}.", "V")] = None,
    effort_noise: Annotated[
        str | None, _option(f"Efforts are known to +-E, in the unit of the log: {_EACH}.", "E")
    ] = None,
    jerk: Annotated[
        str | None, _option(f"Largest jerk, for measured accelerations; else that of ROBOT: {_EACH}.", "J")
    ] = None,
    reversal_jump: Annotated[
        str | None, _option(f"Largest sudden change of measured accelerations where a joint reverses: {_EACH}.", "A")
    ] = None,
    reversal_speed: Annotated[
        str | None, _option(f"Speed below which a joint may reverse; else the velocity bands of ROBOT: {_EACH}.", "V")
    ] = None,
    cutoff: Annotated[float | None, _option("Low-pass of a smoothed motion; else by its spectrum.", "HZ")] = None,
    train: Annotated[
        list[Path] | None,
        _option("Log without contact to learn the usual thresholds from, to compare with; may be repeated.", "LOG"),
    ] = None,
    margin: Annotated[float, _option("Part of the largest training residual that is added to it.", "SHARE")] = 0.2,
    point: Annotated[
        list[str] | None,
        _option("Point of contact besides the end effector, LINK:x,y,z [m]; may be repeated.", "POINT"),
    ] = None,
    merge: Annotated[float, _option("Stretches closer than this are one event [s].", "S")] = 0.05,
    min_duration: Annotated[float, _option("Shorter events do not count [s].", "S")] = 0.0,
    settle: Annotated[float, _option("An event so long behind a known contact belongs to it [s].", "S")] = 0.3,
    skip: Annotated[float, _option("Leave out the start of each log, while it settles [s].", "S")] = 0.0,
    rate: Annotated[float, _option("Samples per second of planned motions.", "HZ")] = 250.0,
    compare: Annotated[
        bool,
        typer.Option("--compare/--no-compare", help="Also the other kind of bands (IANEA or exact), side by side."),
    ] = True,
    fail_on_collision: Annotated[
        bool, typer.Option("--fail-on-collision", help="Exit code 4 if any log has an event.")
    ] = False,
    topic: Topic = None,
    joint_map: JointMap = None,
    time: TimeOption = "header",
    strict: StrictLog = False,
    publisher: Publisher = None,
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
    from modrob_cli.cli.collision_report import end, measure, say_files, say_log
    from modrob_cli.cli.console import print_json
    from modrob_cli.errors import UsageError
    from modrob_cli.io.log_sources import find_logs
    from modrob_cli.workflows.collision import collision
    from modrob_cli.workflows.collision_options import CollisionOptions, parse_filter
    from modrob_cli.workflows.collision_runs import PLANNED

    sources = find_logs(logs)
    if effort is None and any(
        Path(source).suffix.lower() not in PLANNED for source in [*sources, *map(str, train or [])]
    ):
        raise UsageError(f"--effort is missing: say what the logs call effort ({', '.join(_KINDS)})")
    kind: Any = effort or "torque"
    source: Any = acceleration
    bands: Any = method
    options = CollisionOptions(
        effort=kind,
        reading=log_options(topic, joint_map, time, strict, publisher),
        method=bands,
        filter=parse_filter(filter_text),
        acceleration=source,
        desired=desired,
        desired_start=desired_start,
        ddq_tolerance=numbers(ddq_tolerance, "--ddq-tolerance"),
        q_noise=numbers(q_noise, "--q-noise"),
        dq_noise=numbers(dq_noise, "--dq-noise"),
        effort_noise=numbers(effort_noise, "--effort-noise"),
        jerk=numbers(jerk, "--jerk"),
        jump=numbers(reversal_jump, "--reversal-jump"),
        still=numbers(reversal_speed, "--reversal-speed"),
        train=tuple(train or ()),
        margin=margin,
        merge=merge,
        shortest=min_duration,
        settle=settle,
        skip=skip,
        points=tuple(point or ()),
        rate=rate,
        cutoff=cutoff,
        compare=compare,
    )
    batch = batch_options(jobs, resume, keep_going, dask, details, overwrite)
    with batch_progress("collision", len(sources), measure) as listener:
        result = collision(robot, sources, options, out, overwrite, batch, listener)
    if len(sources) <= FEW:
        for log in result["logs"]:
            say_log(log, options)
    listener.say_summary()
    say_files(result)
    if as_json:
        print_json(result)
    end(result, fail_on_collision)
