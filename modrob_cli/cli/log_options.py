"""Options of all commands that read logs."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from modrob_cli.io.log_options import LogOptions


def _time(value: str) -> str:
    if value not in ("header", "log"):
        raise typer.BadParameter(f"found {value!r}, expected header or log")
    return value


def _effort(value: str) -> str:
    kinds = ("torque", "current", "motor-torque", "net-torque")
    if value not in kinds:
        raise typer.BadParameter(f"found {value!r}, expected {', '.join(kinds)}")
    return value


def positive(value: float | None) -> float | None:
    """Refuse numbers that are not positive and finite.

    Raises
    ------
    BadParameter
        Saying what was found.
    """
    # Written so that NaN fails too.
    if value is not None and not 0.0 < value < float("inf"):
        raise typer.BadParameter(f"found {value}, expected a number > 0")
    return value


_EFFORT_HELP = (
    "What the log calls effort (required, never guessed): torque = at the joint [N m] (prismatic: [N]); "
    "motor-torque = at the motor [N m], times gear_ratio; current = of the motor [A], times torque_constant and "
    "gear_ratio. Both constants come from ROBOT. net-torque = at the joint, without gravity (as commanded on top of a "
    "gravity compensation): predictions leave gravity out."
)
Effort = Annotated[str, typer.Option(callback=_effort, metavar="KIND", help=_EFFORT_HELP)]
Topic = Annotated[str | None, typer.Option("--topic", metavar="NAME", help="Topic of the joint states.")]
JointMap = Annotated[
    str | None, typer.Option("--map", metavar="LOG=ROBOT,...", help="Joints of the log and what the robot calls them.")
]
TimeOption = Annotated[
    str,
    typer.Option(
        "--time",
        metavar="header|log",
        callback=_time,
        help="Which times count: header = stamps in the messages, log = when the recorder got them.",
    ),
]
StrictLog = Annotated[
    bool, typer.Option("--strict", help="Refuse damaged logs (exit code 3) instead of using what can be read.")
]
Publisher = Annotated[
    int | None, typer.Option("--publisher", metavar="K", help="Which of several publishers on the topic, from 1.")
]


def log_options(
    topic: str | None, joint_map: str | None, time: str, strict: bool, publisher: int | None
) -> "LogOptions":
    """How logs are read, from the options above.

    Raises
    ------
    UsageError
        If ``--map`` is not a list of LOG=ROBOT.
    """
    from modrob_cli.io.log_options import LogOptions

    source: Any = time
    return LogOptions(topic, _pairs(joint_map), source, strict, publisher)


def _pairs(text: str | None) -> dict[str, str]:
    from modrob_cli.errors import UsageError

    out: dict[str, str] = {}
    for part in text.split(",") if text else ():
        left, sign, right = (piece.strip() for piece in part.partition("="))
        if not (left and sign and right):
            raise UsageError(f"--map: found {part.strip()!r}, expected LOG=ROBOT,... with two names for each joint")
        if left in out:
            raise UsageError(f"--map: {left} comes twice")
        out[left] = right
    return out
