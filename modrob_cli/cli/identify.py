"""``modrob identify``: friction, rotor inertia and offset from logs, with their uncertainty."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modrob_cli.cli.batch_options import Dask, Jobs, KeepGoing, Logs, Resume, batch_options
from modrob_cli.cli.log_options import Effort, JointMap, Publisher, StrictLog, TimeOption, Topic, log_options, positive
from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite, numbers

if TYPE_CHECKING:
    from modrob_cli.workflows.bounded_options import BoundedOptions

_HELP = """Identify friction, rotor inertia and offset of each joint from logs, and say how sure that is.

ROBOT is a URDF, a robot/1 or an assembly/1 file; its nominal rigid bodies are taken as they are. LOG is an MCAP or CSV
file without contacts; several logs are fitted each alone, then all together. The last part of each log is held out:
the fit does not see it and is judged on it. Writes NAME.identified.robot.yaml (the estimates with their confidence
intervals, for every other command), NAME.identify.json, .csv, a report (does friction drift?) and pictures. With
--bounds also the smallest intervals that hold every sample; with --rigid-body also base parameters, and which link's
data are wrong.
"""

_EPILOG = "Example: modrob identify robot.urdf run.mcap --effort torque -o out/identify"

_FRICTION_HELP = (
    "Friction terms: viscous, coulomb, asymmetric (another viscous friction in each direction), stribeck (more "
    "friction at low speed), load (Coulomb friction that grows with the load)."
)
_OUTLIERS_HELP = (
    "With --bounds: at most so many samples of a joint (whole number), or this share of them, are left out."
)
_NOISE_HELP = "With --bounds: the recorded torque is known to +-T [N m, N]: one number, or one for each joint."
_BAND_HELP = (
    "With --bounds: speed up to which the sign of the friction is unknown: one number, one for each joint, or auto."
)
_SPREAD_HELP = (
    "With --bounds: disturbance = one value for each parameter, the rest is disturbance; least = the narrowest bounds; "
    "consistent = all constant values that agree with --effort-noise (the usual answer with it, else least)."
)
_DDQ_HELP = "With --bounds: accelerations are known to +-A [rad/s^2, m/s^2]: one number, or one for each joint."


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("identify", help=_HELP, epilog=_EPILOG, no_args_is_help=True)(_identify)


def _identify(
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
        typer.Option(callback=positive, metavar="HZ", help="Low-pass; where left out, chosen from the spectra."),
    ] = None,
    holdout: Annotated[
        float, typer.Option(metavar="SHARE", help="Share of each log at its end that the fit does not see; 0 for none.")
    ] = 0.4,
    friction: Annotated[str, typer.Option(metavar="TERMS", help=_FRICTION_HELP)] = "viscous,coulomb",
    confidence: Annotated[float, typer.Option(metavar="P", help="Confidence of the intervals.")] = 0.95,
    robust: Annotated[bool, typer.Option(help="Outliers get less weight (Huber).")] = True,
    offset_per_log: Annotated[bool, typer.Option("--offset-per-log", help="Each log has its own offset.")] = False,
    drive_gain: Annotated[
        bool,
        typer.Option(
            "--drive-gain", help="Fit joint torque per ampere too; needs --effort current, not the constants."
        ),
    ] = False,
    per_log: Annotated[
        bool, typer.Option("--per-log/--pooled-only", help="Of several logs, fit each alone too.")
    ] = True,
    max_nrmse: Annotated[
        float | None,
        typer.Option(callback=positive, metavar="X", help="Largest NRMSE of any joint that passes; else exit code 4."),
    ] = None,
    bounds: Annotated[
        bool, typer.Option("--bounds", help="Also find the smallest intervals that hold every sample.")
    ] = False,
    effort_noise: Annotated[str | None, typer.Option(metavar="T", help=_NOISE_HELP)] = None,
    outliers: Annotated[float | None, typer.Option(metavar="K", help=_OUTLIERS_HELP)] = None,
    velocity_band: Annotated[str | None, typer.Option(metavar="V", help=_BAND_HELP)] = None,
    spread: Annotated[str | None, typer.Option(metavar="ANSWER", help=_SPREAD_HELP)] = None,
    ddq_tolerance: Annotated[str | None, typer.Option(metavar="A", help=_DDQ_HELP)] = None,
    filtered_torque: Annotated[
        bool, typer.Option("--filtered-torque", help="With --bounds: low-pass the torque like the motion first.")
    ] = False,
    rigid_body: Annotated[
        bool, typer.Option("--rigid-body", help="Also estimate base parameters and name links whose data are wrong.")
    ] = False,
    jobs: Jobs = None,
    resume: Resume = False,
    keep_going: KeepGoing = True,
    dask: Dask = None,
    out: OutDir = DEFAULT_OUT,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    from modrob_cli.cli.console import print_json
    from modrob_cli.cli.identify_progress import identify_progress
    from modrob_cli.cli.identify_report import end, say_result
    from modrob_cli.io.log_sources import find_logs
    from modrob_cli.workflows.identify import identify
    from modrob_cli.workflows.identify_options import IdentifyOptions, regression_options

    kind: Any = effort
    options = IdentifyOptions(
        effort=kind,
        reading=log_options(topic, joint_map, time, strict, publisher),
        cutoff=cutoff,
        holdout=holdout,
        regression=regression_options(friction, confidence, robust, offset_per_log, drive_gain),
        max_nrmse=max_nrmse,
        fit_per_log=per_log,
        bounds=_bounded(bounds, effort_noise, outliers, velocity_band, spread, ddq_tolerance, filtered_torque),
        rigid_body=rigid_body,
    )
    batch = batch_options(jobs, resume, keep_going, dask, None, overwrite)
    sources = find_logs(logs)
    with identify_progress(len(sources)) as progress:
        result = identify(robot, sources, options, out, overwrite, batch, progress.listener, progress.stage)
    if per_log:
        progress.listener.say_summary()
    say_result(result)
    if as_json:
        print_json(result)
    end(result)


def _bounded(
    wanted: bool,
    effort_noise: str | None,
    outliers: float | None,
    velocity_band: str | None,
    spread: str | None,
    ddq_tolerance: str | None,
    filtered_torque: bool,
) -> "BoundedOptions | None":
    """Options of ``--bounds``; those that need it are refused without."""
    from modrob_cli.errors import UsageError
    from modrob_cli.workflows.bounded_options import BoundedOptions

    given: dict[str, Any] = {"--effort-noise": effort_noise, "--outliers": outliers, "--velocity-band": velocity_band}
    given |= {"--spread": spread, "--ddq-tolerance": ddq_tolerance, "--filtered-torque": filtered_torque or None}
    if not wanted:
        useless = [name for name, value in given.items() if value is not None]
        if useless:
            raise UsageError(f"{', '.join(useless)} belong to --bounds; add it or leave them out")
        return None
    band: Any = velocity_band if velocity_band == "auto" else numbers(velocity_band, "--velocity-band")
    answers = ("disturbance", "least", "consistent")
    if spread is not None and spread not in answers:
        raise UsageError(f"--spread: found {spread!r}, expected {', '.join(answers)}")
    answer: Any = spread
    return BoundedOptions(
        effort_noise=numbers(effort_noise, "--effort-noise"),
        velocity_band=band,
        ddq_noise=numbers(ddq_tolerance, "--ddq-tolerance"),
        outliers=outliers or 0.0,
        spread=answer,
        torque="filtered" if filtered_torque else "recorded",
    )
