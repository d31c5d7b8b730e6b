"""``modrob scale``: as fast as is safe, with a certificate."""

import enum
from pathlib import Path
from typing import Annotated, Any

import typer

from modrob_cli.cli.console import print_json, say, table
from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite, numbers
from modrob_cli.cli.progress import progress_bar

_HELP = """Find the largest constant factor by which a motion may be sped up (or has to be slowed down).

ROBOT is an assembly, a robot file or a URDF with limits; TRAJECTORY a planned motion (modrob trajectory --help). At the
factor, no admissible value of any uncertain parameter makes a joint exceed its torque, current, velocity, acceleration
or jerk limits: at the samples, and with --certify at every time, proven. Writes the scaled motion, pictures, an HTML
report, JSON, and the certificate, which --verify checks again. The exit code is 4 if no factor is safe, or a
certificate is not true.
"""

_EPILOG = (
    "Example: modrob scale assemblies/lwa4p-table34.yaml trajectories/s-iv-a.yaml --current-limits 8,8,8,8,2,2 "
    "--velocity-limits none --acceleration-limits none --certify -o out/scaled"
)

_METHOD_HELP = (
    "exact = all admissible parameters; ianea = the published interval algorithm, to compare with; nominal = nothing "
    "is uncertain."
)
_LIMIT_FORM = "L for -L..L, LOW:HIGH, or none; one for all joints, or one each separated by commas"


class Method(enum.StrEnum):
    """Ways to bound torques."""

    exact = "exact"
    ianea = "ianea"
    nominal = "nominal"


def _limit_option(what: str, unit: str) -> Any:
    return typer.Option(metavar="LIST", help=f"{what} limits {unit} in place of those of the file: {_LIMIT_FORM}.")


TorqueLimits = Annotated[str | None, _limit_option("Torque", "[N m, N]")]
CurrentLimits = Annotated[str | None, _limit_option("Motor current", "[A]")]
VelocityLimits = Annotated[str | None, _limit_option("Velocity", "[rad/s, m/s]")]
AccelerationLimits = Annotated[str | None, _limit_option("Acceleration", "[rad/s^2, m/s^2]")]
JerkLimits = Annotated[str | None, _limit_option("Jerk", "[rad/s^3, m/s^3]")]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("scale", help=_HELP, epilog=_EPILOG, no_args_is_help=True)(_scale)


def _scale(
    robot: Annotated[
        Path | None, typer.Argument(metavar="ROBOT", help="Assembly, robot file or URDF.", show_default=False)
    ] = None,
    trajectory: Annotated[
        Path | None, typer.Argument(metavar="TRAJECTORY", help="Planned motion.", show_default=False)
    ] = None,
    out: OutDir = DEFAULT_OUT,
    method: Annotated[Method, typer.Option(help=_METHOD_HELP)] = Method.exact,
    certify: Annotated[
        bool, typer.Option("--certify", help="Prove a factor for all times; write a certificate.")
    ] = False,
    gap: Annotated[
        float, typer.Option(metavar="X", help="The proven factor may be below that of the samples by this part.")
    ] = 1e-4,
    verify: Annotated[
        Path | None,
        typer.Option(metavar="CERT", help="Check a certificate again; ROBOT and TRAJECTORY only if they have moved."),
    ] = None,
    torque_limits: TorqueLimits = None,
    current_limits: CurrentLimits = None,
    velocity_limits: VelocityLimits = None,
    acceleration_limits: AccelerationLimits = None,
    jerk_limits: JerkLimits = None,
    min_factor: Annotated[float, typer.Option(metavar="C", help="Smallest factor of interest.")] = 0.01,
    max_factor: Annotated[float, typer.Option(metavar="C", help="Largest factor of interest.")] = 10.0,
    rate: Annotated[float, typer.Option(metavar="HZ", help="Samples per second of TRAJECTORY.")] = 1000.0,
    topic: Annotated[str | None, typer.Option(metavar="NAME", help="Topic of an MCAP file with several.")] = None,
    as_json: AsJson = False,
    overwrite: Overwrite = False,
) -> None:
    from modrob_cli.errors import NegativeAnswerError, UsageError
    from modrob_cli.workflows.scale import scale
    from modrob_cli.workflows.scale_problem import ScaleOptions

    if verify is not None:
        _verify(verify, robot, trajectory, as_json)
        return
    if robot is None or trajectory is None:
        raise UsageError("found no TRAJECTORY, expected ROBOT and TRAJECTORY (or --verify CERT)")
    given = {
        "torque": torque_limits, "current": current_limits, "velocity": velocity_limits,
        "acceleration": acceleration_limits, "jerk": jerk_limits,
    }  # fmt: skip
    limits = tuple((name, _ranges(text, f"--{name}-limits")) for name, text in given.items() if text is not None)
    options = ScaleOptions(method.value, certify, gap, min_factor, max_factor, rate, limits)
    with progress_bar("Scaling") as report:
        result = scale(robot, trajectory, options, out, overwrite, report, topic)
    say_result(result)
    if as_json:
        print_json(result)
    if not result["feasible"]:
        raise NegativeAnswerError(result["explanation"])


def _verify(path: Path, robot: Path | None, trajectory: Path | None, as_json: bool) -> None:
    """Check a certificate and say what came out."""
    from modrob_cli.errors import NegativeAnswerError
    from modrob_cli.workflows.scale_verify import verify

    with progress_bar("Scaling") as report:
        found = verify(path, robot, trajectory, lambda done: report("Checking", done))
    if as_json:
        print_json(found.data)
    if found.faults:
        raise NegativeAnswerError("\n".join(f"{path}: {fault}" for fault in found.faults))
    proven = f"{found.robot} may run {found.trajectory} {found.factor:.6g} times as fast"
    say(f"{path}: true, {proven}; {found.cells} cells checked")


def _ranges(text: str, option: str) -> tuple[tuple[float, float] | None, ...]:
    """Limits of an option: comma-separated L, LOW:HIGH or none.

    Raises
    ------
    UsageError
        If a part is none of these.
    """
    from modrob_cli.errors import UsageError

    out: list[tuple[float, float] | None] = []
    for part in text.split(","):
        if part.strip() == "none":
            out.append(None)
            continue
        ends = [value for piece in part.split(":") for value in numbers(piece, option) or ()]
        if len(ends) > 2:
            raise UsageError(f"{option}: found {part.strip()!r}, expected {_LIMIT_FORM}")
        if len(ends) == 1 and ends[0] < 0.0:
            raise UsageError(f"{option}: found {part.strip()!r}, expected a limit > 0, or LOW:HIGH")
        out.append((ends[0], ends[1]) if len(ends) == 2 else (-ends[0], ends[0]))
    return tuple(out)


def say_result(result: dict[str, Any]) -> None:
    """Print the factor, what decides, and the other ways to bound."""
    for text in result["warnings"]:
        say(f"warning: {text}")
    say(f"\n{result['robot']}, {result['trajectory']}: {result['samples']} samples, method {result['method']}\n")
    if result["feasible"]:
        certified = result["certified_factor"]
        say(f"  safe at the samples up to  {result['factor']:.6g} times as fast")
        if certified is not None:
            below = 1.0 - certified / result["factor"]
            say(
                f"  proven for all times up to {certified:.6g} ({100.0 * below:.2g} % less), by {result['cells']} cells"
            )
        say(f"  duration                   {result['duration']:.6g} s -> {result['new_duration']:.6g} s")
    if result["critical"] is not None:
        say(f"\n  {result['critical']['message']}")
        rows = [
            (part["parameter"], float(f"{part['width']:.3g}"), f"{part['share']:.1%}")
            for part in result["critical"]["parameters"]
        ]
        if rows:
            say("\n" + table(("parameter", f"width [{result['critical']['unit']}]", "share"), rows, indent="    "))
    if result["gaps"]:
        parts = ", ".join(f"{low:.6g} .. {high:.6g}" for low, high in result["gaps"])
        say(f"\n  not every smaller factor is safe: {parts} break a limit")
    say("\n  " + "; ".join(f"{name} {_factor(value)}" for name, value in result["compared"].items()) + "\n")
    for path in result["files"].values():
        say(f"wrote {path}")


def _factor(value: float | None) -> str:
    return "none" if value is None else f"{value:.5g}"
