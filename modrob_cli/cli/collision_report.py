"""What ``modrob collision`` tells people."""

from typing import TYPE_CHECKING, Any

from modrob_cli.cli.batch_end import end_batch
from modrob_cli.cli.console import say, table

if TYPE_CHECKING:
    from modrob_cli.workflows.collision_options import CollisionOptions

_SHOWN = 12


def measure(record: dict[str, Any]) -> tuple[float, str]:
    """How bad a log is: events first, then the largest share of its band that was used; in words too."""
    (log,) = record["logs"]
    if log["closest"] is None:
        return -1.0, "planned motion"
    worst = max(log["closest"], key=lambda joint: float(joint["share"]))
    share, where = worst["share"], f"share of the band used {worst['share']:.2f} ({worst['joint']})"
    count = len(log["events"])
    if not count:
        return share, where
    return share + 1e12, f"{count} event{'' if count == 1 else 's'}, {where}"


def end(result: dict[str, Any], fail_on_collision: bool) -> None:
    """Exit code and message of a run that has results.

    Raises
    ------
    FailedLogsError
        If logs have no result, or some have events and that counts.
    """
    negative = fail_on_collision and bool(result["collision"])
    end_batch(result["skipped"], negative, _events(result) if negative else ())


def _events(result: dict[str, Any]) -> list[str]:
    """What was found, log by log."""
    lines = []
    for log in result["logs"]:
        for event in log["events"]:
            what = f"{event['joint']} {event['side']}, {event['peak']:.3g} {event['unit']} beyond its band"
            lines.append(f"collision: {log['log']}: {event['start']:.4g} .. {event['end']:.4g} s: {what}")
    return lines


def say_log(log: dict[str, Any], options: "CollisionOptions") -> None:
    """Print events, methods side by side and sensitivity of one log."""
    say(f"\n{log['log']}: {log['samples']} samples, {log['duration']:.5g} s, filter {options.filter}")
    say(f"  acceleration: {log['acceleration']}")
    for note in log["notes"]:
        say(f"  note: {note}")
    _say_events(log)
    _say_sensitivity(log)


def say_files(result: dict[str, Any]) -> None:
    """Print where the results are."""
    say("")
    files = list(result["files"].values())
    for path in files[:7]:
        say(f"wrote {path}")
    if len(files) > 7:
        say(f"and {len(files) - 7} more files beside them")


def _say_events(log: dict[str, Any]) -> None:
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
