"""``modrob log``: what is in a log, and logs from one format to another."""

from pathlib import Path
from typing import Annotated, Any

import typer

from modrob_cli.cli.batch_options import Logs
from modrob_cli.cli.log_options import JointMap, Publisher, StrictLog, TimeOption, Topic, log_options
from modrob_cli.cli.options import AsJson, Overwrite
from modrob_cli.cli.progress import track

_HELP = "Look into recorded logs (log info), and convert them between MCAP and CSV (log convert)."

_EPILOG = "Example: modrob log info run.mcap"

_INFO_HELP = """Show what is in logs: topics, joints, rates, gaps, ranges, damage, and which topic would be read.

LOG is an MCAP file or a CSV file with the columns t,q..,dq..,effort...
"""

_INFO_EPILOG = "Example: modrob log info runs/*.mcap --json"

_CONVERT_HELP = """Convert a log between MCAP and CSV, by the endings of IN and OUT.

MCAP is written as sensor_msgs/msg/JointState on /joint_states, as PlotJuggler and Foxglove open it; CSV with the
columns t,q.NAME..,dq.NAME..,effort.NAME.. MCAP to MCAP turns other message types and damaged files into that form.
"""

_CONVERT_EPILOG = "Example: modrob log convert run.mcap run.csv"


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
    group.command("info", help=_INFO_HELP, epilog=_INFO_EPILOG, no_args_is_help=True)(_info)
    group.command("convert", help=_CONVERT_HELP, epilog=_CONVERT_EPILOG, no_args_is_help=True)(_convert)
    app.add_typer(group, name="log", help=_HELP, epilog=_EPILOG)


def _info(
    logs: Logs,
    topic: Topic = None,
    joint_map: JointMap = None,
    time: TimeOption = "header",
    strict: StrictLog = False,
    publisher: Publisher = None,
    as_json: AsJson = False,
) -> None:
    from modrob_cli.cli.console import print_json
    from modrob_cli.errors import FailedLogsError, InputFileError
    from modrob_cli.io.log_sources import find_logs
    from modrob_cli.workflows.log_info import log_info

    result = log_info(find_logs(logs), log_options(topic, joint_map, time, strict, publisher), track)
    for log in result["logs"]:
        _say_log(log)
    if as_json:
        print_json(result)
    if result["skipped"]:
        raise FailedLogsError("\n".join(entry["reason"] for entry in result["skipped"]), InputFileError.exit_code)


def _convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help="MCAP or CSV file.")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="File to write: .mcap or .csv.")],
    joints: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Joints to write, comma-separated, in this order; else all.")
    ] = None,
    from_zero: Annotated[bool, typer.Option("--from-zero", help="Count times from the first sample.")] = False,
    topic: Topic = None,
    joint_map: JointMap = None,
    time: TimeOption = "header",
    strict: StrictLog = False,
    publisher: Publisher = None,
    as_json: AsJson = False,
    overwrite: Overwrite = False,
) -> None:
    from modrob_cli.cli.console import print_json, say
    from modrob_cli.workflows.log_convert import log_convert

    names = [name.strip() for name in joints.split(",")] if joints else None
    options = log_options(topic, joint_map, time, strict, publisher)
    result = log_convert(source, target, options, names, from_zero, overwrite)
    clock = {"header": "header stamps", "log": "log times"}[result["time"]] if result["topic"] else "t"
    say(
        f"{source}: {result['samples']} samples of {len(result['joints'])} joints, {result['duration']:.6g} s ({clock})"
    )
    for note in result["notes"]:
        say(f"  note: {note}")
    say(f"wrote {target}")
    if as_json:
        print_json(result)


def _say_log(log: dict[str, Any]) -> None:
    from modrob_cli.cli.console import say, table

    say(f"\n{log['log']}")
    if log["topics"]:
        rows = [(one["topic"], one["type"] or "-", one["encoding"], one["messages"]) for one in log["topics"]]
        say(table(("topic", "type", "encoding", "messages"), rows))
    for topic in log["joint_topics"]:
        _say_topic(topic)
    if log["kind"] == "csv":
        _say_times("times", log["time"])
        _say_joints(log["joints"])
    for words in (log["damage"] or {}).get("words", []):
        say(f"  damaged: {words}")
    unchecked = (log["damage"] or {}).get("unchecked_messages")
    if unchecked:
        say(f"\n  {unchecked} messages have no checksum: damage of their values would not show")
    _say_reading(log)


def _say_topic(topic: dict[str, Any]) -> None:
    from modrob_cli.cli.console import say

    say(f"\n  {topic['topic']}: {topic['messages']} messages about {len(topic['joints'])} joints")
    if topic["problem"]:
        say(f"    cannot be decoded: {topic['problem']}")
    if topic["undecoded"]:
        say(f"    {topic['undecoded']} messages could not be decoded")
    _say_times("header stamps", topic["header_time"])
    _say_times("log times", topic["log_time"])
    if topic["publisher_count"] > 1:
        for one in topic["publishers"][:8]:
            say(
                f"    publisher {one['number']}: {one['messages']} messages, channel {one['channel']}, "
                f"{'+'.join(one['quantities']) or 'no values'}, joints {', '.join(one['joints'][:12])}"
            )
    _say_joints(topic["joints"])


def _say_times(title: str, times: dict[str, Any]) -> None:
    from modrob_cli.cli.console import say

    if times["start"] is None:
        say(f"    {title}: none")
        return
    parts = [f"{times['duration']:.6g} s from {times['start']:.6f}"]
    if times["rate"] is not None:
        parts.append(f"{times['rate']:.6g} Hz")
    if times["gap_count"]:
        listed = ", ".join(f"{length:.4g} s after {start:.4g} s" for start, length in times["gaps"][:3])
        parts.append(f"{times['gap_count']} gaps ({listed}{', ..' if times['gap_count'] > 3 else ''})")
    parts += [f"{times[key]} {word}" for key, word in (("repeated", "repeated"), ("missing", "missing")) if times[key]]
    if times["backward"]:
        parts.append(f"{times['backward']} backward (by {times['worst_back']:.4g} s at most)")
    say(f"    {title}: {', '.join(parts)}")


def _say_joints(joints: list[dict[str, Any]]) -> None:
    from modrob_cli.cli.console import say, table

    keys = ("position", "velocity", "effort")
    rows = [(joint["name"], *(_span(joint[key]) for key in keys)) for joint in joints[:40]]
    say(table(("joint", *keys), rows, indent="    "))


def _span(found: dict[str, Any]) -> str:
    if found["min"] is None:
        return "-"
    missing = f" ({found['missing']} missing)" if found["missing"] else ""
    return f"{found['min']:.4g} .. {found['max']:.4g}{missing}"


def _say_reading(log: dict[str, Any]) -> None:
    from modrob_cli.cli.console import say

    if log["problem"]:
        say(f"\n  cannot be read as it is: {log['problem']}")
        return
    read = log["read"]
    clock = "header stamps" if read["time"] == "header" else "log times"
    where = f" from {read['topic']}, {clock}" if read["topic"] else ""
    say(f"\n  is read{where}: {read['samples']} samples at {read['rate']:.6g} Hz, {read['duration']:.6g} s")
    for note in read["notes"]:
        say(f"    note: {note}")
