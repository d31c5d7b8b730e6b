"""``modrob simulate``: an arm that follows a motion under a controller, without the arm."""

from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from modrob_cli.cli.console import print_json, say, table
from modrob_cli.cli.options import AsJson, Overwrite
from modrob_cli.cli.progress import progress_bar

if TYPE_CHECKING:
    from modrob_cli.model.scenario import BoundsMethod

_HELP = """Simulate an arm that follows a motion, and log it as a real robot would.

ROBOT is an assembly, a robot file or a URDF; TRAJECTORY a planned motion (modrob trajectory --help). The controller
knows the nominal robot; the true one may be drawn from the intervals of the file, carry a payload, be pushed, and be
measured badly: a scenario/1 document says so. Writes an MCAP log (ROS 2 joint states, controller state, truth,
contacts), a picture and a JSON summary beside it. The exit code is 4 if the closed loop runs away.
"""

_EPILOG = "Example: modrob simulate assemblies/lwa4p-6.yaml trajectories/table-b1.yaml --controller id -o out/run.mcap"

_CONTROLLER_HELP = (
    "feedforward-pd, pid, id (inverse dynamics), pb (passivity-based), pb-afc (with adaptive friction compensation), "
    "robust: ia-id, ia-pb (interval arithmetic), cr (classical), r-alpha; "
    "or your own: FILE.py or FILE.py:NAME, a function that makes one."
)

_SHOWN = 8


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("simulate", help=_HELP, epilog=_EPILOG, no_args_is_help=True)(_simulate)


def _simulate(
    robot: Annotated[Path, typer.Argument(metavar="ROBOT", help="Assembly, robot file or URDF.")],
    trajectory: Annotated[Path, typer.Argument(metavar="TRAJECTORY", help="Planned motion.")],
    controller: Annotated[str | None, typer.Option(metavar="NAME", help=_CONTROLLER_HELP)] = None,
    scenario: Annotated[Path | None, typer.Option(metavar="FILE", help="scenario/1 document.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Of all that is drawn; the scenario's, or 0.")] = None,
    sweep: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="N runs, each with a robot drawn from the intervals.")
    ] = None,
    bounds: Annotated[
        str | None, typer.Option(metavar="exact|ianea", help="How ia-id and ia-pb bound what their model lacks.")
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="FILE", help="Log to write; other files get names beside it.")
    ] = Path("out/run.mcap"),
    as_json: AsJson = False,
    overwrite: Overwrite = False,
) -> None:
    import sys

    from modrob_cli.errors import NegativeAnswerError, UsageError
    from modrob_cli.workflows.simulate import simulate
    from modrob_cli.workflows.simulation_study import SimulateOptions

    if bounds is not None and bounds not in ("exact", "ianea"):
        raise UsageError(f"--bounds: found {bounds}, expected exact or ianea")
    method = cast("BoundsMethod | None", bounds)
    options = SimulateOptions(controller, scenario, seed, sweep, method)
    # A user's controller may print; stdout is for JSON.
    with progress_bar("Simulating") as report, redirect_stdout(sys.stderr):
        result = simulate(robot, trajectory, options, out, overwrite, report)
    say_result(result)
    if as_json:
        print_json(result)
    runs = result.get("runs", [result])
    gone = [run for run in runs if run["diverged"] is not None]
    if gone:
        where = f"after {gone[0]['diverged']:.4g} s" if len(runs) == 1 else f"in {len(gone)} of {len(runs)} runs"
        raise NegativeAnswerError(f"the closed loop of {result['controller']} ran away {where}")


def say_result(result: dict[str, Any]) -> None:
    """Print the tables of a run or of a sweep."""
    for warning in result["warnings"]:
        say(f"warning: {warning}")
    rates = f"{result['control_rate']:g} Hz, logged at {result['log_rate']:g} Hz"
    head = f"{result['robot']}: {result['controller']} on {result['trajectory']}, {result['duration']:g} s at {rates}"
    say(f"\n{head}; scenario {result['scenario']}, seed {result['seed']}\n")
    if "runs" in result:
        _say_runs(result["runs"])
    else:
        _say_run(result)
    say("")
    for path in result["files"].values():
        say(f"wrote {path}")


def _say_run(result: dict[str, Any]) -> None:
    header = ("joint", "RMS error", "max error", "unit", "at [s]", "RMS torque", "max torque", "unit", "cut off")
    keys = ("rms_error", "max_error", "unit", "max_error_time", "rms_torque", "max_torque", "torque_unit")
    rows = [
        (joint["name"], *(_short(joint[key]) for key in keys), f"{joint['saturated']:.1%}")
        for joint in result["joints"]
    ]
    say(table(header, rows))
    for hit in result["end_stops"][:_SHOWN]:
        say(f"  {hit['joint']} met its end stop at t = {hit['time']:.4g} s with {hit['speed']:.3g}/s")
    for contact in result["contacts"]:
        joint, torque = max(contact["largest_torque"].items(), key=lambda item: item[1])
        span = f"{contact['start']:g} .. {contact['end']:g} s"
        unit = next(item["torque_unit"] for item in result["joints"] if item["name"] == joint)
        say(f"  contact {contact['name']}: {contact['force']:.3g} N, {span}; up to {torque:.3g} {unit} at {joint}")
    _say_perturbation(result["perturbation"])
    for name in result["truth"]["kept_nominal"]:
        say(f"  note: {name} kept its nominal values: hardly any member of its box is a real body")
    if result["real_time_factor"] is not None:
        speed = f"{result['real_time_factor']:.3g} times faster than real time"
        say(f"  {speed}; energy balance closes to {result['energy_error']:.1e}")


def _say_perturbation(found: dict[str, Any] | None) -> None:
    """How the bounds of the perturbation did."""
    if found is None:
        return
    widths = ", ".join(f"{joint['name']} {_short(joint['mean_width'])}" for joint in found["joints"])
    say(f"  perturbation outside its {found['bounds']} bounds: {found['violations']} samples; mean widths: {widths}")


def _say_runs(runs: list[dict[str, Any]]) -> None:
    worst = sorted(runs, key=lambda run: run["error_norm"]["max"] or float("inf"), reverse=True)
    rows = [
        (run["run"], _short(run["error_norm"]["rms"]), _short(run["error_norm"]["max"]), _short(run["diverged"]))
        for run in worst[:_SHOWN]
    ]
    say(table(("run", "RMS error", "max error", "ran away at [s]"), rows))
    if len(runs) > _SHOWN:
        say(f"  the worst {_SHOWN} of {len(runs)} runs")


def _short(value: float | str | None) -> float | str:
    if isinstance(value, str):
        return value
    return "-" if value is None else float(f"{value:.3g}")
