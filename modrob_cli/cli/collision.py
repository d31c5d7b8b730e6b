"""``modrob collision``: thresholds, events, sensitivity."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modrob_cli.cli.log_options import JointMap, Publisher, StrictLog, TimeOption, Topic, log_options
from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite, numbers
from modrob_cli.cli.progress import track

if TYPE_CHECKING:
    from modrob_cli.workflows.collision_options import CollisionOptions

_HELP = """Collision thresholds that no admissible parameter passes without contact, and how sensitive they are.

ROBOT is an assembly, a robot file or a URDF. LOG is an MCAP or CSV file with positions, velocities and efforts; a
*.yaml or *.json file is a planned motion, for thresholds and sensitivity alone. For every sample the band of torques
without contact is computed over all admissible parameters, the stated noise and the acceleration's tolerance; both
are filtered so that inclusion holds. Writes an HTML report, a table of events, constant thresholds (YAML), and for
each log JSON, CSV, picture and MCAP (measured, lower, upper).
"""

_EPILOG = (
    "Example: modrob collision assemblies/lwa4p-6-payload.yaml run.mcap --effort torque --ddq-tolerance 2 "
    "--filter butterworth2:20 -o out/collision"
)
_KINDS = ("torque", "current", "motor-torque", "net-torque")
_SOURCES = ("desired", "measured", "smoothed")
_EACH = "one number, or one for each joint separated by commas"
_SHOWN = 12


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
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs, or planned motions (*.yaml, *.json).")],
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
    out: OutDir = DEFAULT_OUT,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    from modrob_cli.cli.console import print_json
    from modrob_cli.errors import NegativeAnswerError, UsageError
    from modrob_cli.workflows.collision import collision
    from modrob_cli.workflows.collision_options import CollisionOptions, parse_filter
    from modrob_cli.workflows.collision_runs import PLANNED

    if effort is None and any(path.suffix.lower() not in PLANNED for path in [*logs, *(train or [])]):
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
    result = collision(robot, logs, options, out, overwrite, track)
    say_result(result, options)
    if as_json:
        print_json(result)
    if fail_on_collision and result["collision"]:
        raise NegativeAnswerError("\n".join(_against(result)))


def _against(result: dict[str, Any]) -> list[str]:
    """What was found, log by log."""
    lines = []
    for log in result["logs"]:
        for event in log["events"]:
            what = f"{event['joint']} {event['side']}, {event['peak']:.3g} {event['unit']} beyond its band"
            lines.append(f"collision: {log['log']}: {event['start']:.4g} .. {event['end']:.4g} s: {what}")
    return lines[:_SHOWN] + ([f"and {len(lines) - _SHOWN} more"] if len(lines) > _SHOWN else [])


def say_result(result: dict[str, Any], options: "CollisionOptions") -> None:
    """Print events, methods side by side and sensitivity of each log."""
    from modrob_cli.cli.console import say

    for log in result["logs"]:
        say(f"\n{log['log']}: {log['samples']} samples, {log['duration']:.5g} s, filter {options.filter}")
        say(f"  acceleration: {log['acceleration']}")
        for note in log["notes"]:
            say(f"  note: {note}")
        _say_events(log)
        _say_sensitivity(log)
    say("")
    files = list(result["files"].values())
    for path in files[:7]:
        say(f"wrote {path}")
    if len(files) > 7:
        say(f"and {len(files) - 7} more files beside them")


def _say_events(log: dict[str, Any]) -> None:
    from modrob_cli.cli.console import say, table

    for event in log["events"][:_SHOWN]:
        peak = f"{event['peak']:.3g} {event['unit']} beyond the band"
        say(f"  event {event['start']:.4f} .. {event['end']:.4f} s: {event['joint']}, {event['side']} side, {peak}")
    if len(log["events"]) > _SHOWN:
        say(f"  and {len(log['events']) - _SHOWN} more events")
    if not log["planned"] and not log["events"]:
        say("  no event: the measured torque never left its band")
    for contact in log["contacts"] or ():
        delays = ", ".join(f"{name} {_delay(value)}" for name, value in contact["delays"].items())
        say(f"  contact {contact['name']} {contact['start']:.4g} .. {contact['end']:.4g} s: {delays}")
    if log["methods"]:
        rows = [
            (one["method"], one["events"], _dash(one["false_alarms"]), f"{one['detected']} of {one['contacts']}")
            for one in log["methods"]
        ]
        say(table(("method", "events", "false alarms", "contacts found"), rows))


def _delay(value: float | None) -> str:
    return "missed" if value is None else f"after {1e3 * value:.0f} ms"


def _dash(value: int | None) -> str | int:
    return "-" if value is None else value


def _say_sensitivity(log: dict[str, Any]) -> None:
    from modrob_cli.cli.console import say, table

    say("  certain to be found: external torque of each joint, least, median and worst over the motion")
    rows = [
        (
            joint["joint"],
            *(float(f"{joint[key]:.3g}") for key in ("least", "median", "min_detectable")),
            joint["unit"],
            f"{joint['shares'][0]['parameter']} {joint['shares'][0]['share']:.0%}" if joint["shares"] else "-",
        )
        for joint in log["sensitivity"]
    ]
    say(table(("joint", "least", "median", "worst", "unit", "costs most"), rows))
    for point in log["contact_forces"]:
        say(f"  contact force at {point['point']} [N], median over the motion: {_forces(point)}")


def _forces(point: dict[str, Any]) -> str:
    names = {"x": "x", "y": "y", "z": "z", "best_direction": "best", "worst_direction": "worst"}
    values = {label: point[key]["median"] for key, label in names.items()}
    return ", ".join(f"{label} {'never' if value is None else f'{value:.3g}'}" for label, value in values.items())
