"""Compare the torques that a model predicts with recorded ones."""

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics
from modrob_cli.errors import Fault, InputFileError
from modrob_cli.identify.effort import EffortKind, effort_factors
from modrob_cli.identify.friction_fit import TERMS, JointFit, fit_friction
from modrob_cli.identify.prediction import PredictionError, prediction_errors
from modrob_cli.identify.signals import Signals, prepare
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from modrob_cli.plot.validation import TorquePicture, draw_torques
from modrob_cli.workflows.robots import load_robot

SCOPE = (
    "In-sample fit: offset, Coulomb and viscous friction and reflected rotor inertia of each joint were fitted to the "
    "same samples that the errors count, on top of the given rigid-body model. It shows how well the model can "
    "explain this log, not how well it predicts another one."
)

Tracker = Callable[[Sequence[Path]], Iterable[Path]]


@dataclass(frozen=True)
class ValidateOptions:
    """How logs are read and judged.

    Attributes
    ----------
    effort : what the logs call effort
    topic : topic of the joint states; None if there is only one
    cutoff : [Hz]; None for the default
    max_nrmse : largest NRMSE that passes; None for no verdict
    """

    effort: EffortKind
    topic: str | None = None
    cutoff: float | None = None
    max_nrmse: float | None = None


def validate(
    robot_path: Path,
    logs: Sequence[Path],
    options: ValidateOptions,
    out: Path,
    overwrite: bool = False,
    track: Tracker = iter,
) -> dict[str, Any]:
    """Compare predicted with recorded torque, log by log; a JSON file and a picture for each.

    Parameters
    ----------
    track : wraps the list of logs, to show progress

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/validate.md``

    Raises
    ------
    InputFileError
        With the faults of all logs; nothing is written then.
    UsageError
        If the robot lacks constants that ``effort`` needs, or the cut-off does not fit.
    NumericalError
        If a log is too short.
    OutputExistsError
        If a file is there already and ``overwrite`` is false.
    """
    loaded = load_robot(robot_path)
    factors = effort_factors(loaded.robot, options.effort)
    names = dict(zip(_unique_stems(logs), logs, strict=True))
    results: list[dict[str, Any]] = []
    faults: list[Fault] = []
    with OutputFolder(out, overwrite) as folder:
        folder.claim([f"{stem}.validate.{kind}" for stem in names for kind in ("json", "png")])
        stems = iter(names)
        for path in track(list(logs)):
            stem = next(stems)
            try:
                log = read_joint_log(path, loaded.robot.joint_names, options.topic)
            except InputFileError as error:
                faults.extend(error.faults)
                continue
            run = _run(loaded.robot, log, factors, options)
            result = _log_result(loaded.robot, path, log, run, options)
            _draw(loaded.robot, log, run, folder.stage(f"{stem}.validate.png"))
            head = {**_head([result], options), "provenance": provenance([*loaded.files, path])}
            folder.write(
                f"{stem}.validate.json", json.dumps({**head, "logs": [result]}, indent=2, allow_nan=False) + "\n"
            )
            results.append(result)
        if faults:
            raise InputFileError(faults)
    files = {name: str(out / name) for stem in names for name in (f"{stem}.validate.json", f"{stem}.validate.png")}
    origin = provenance([*loaded.files, *logs])
    return {**_head(results, options), "logs": results, "files": files, "provenance": origin}


@dataclass(frozen=True)
class _Run:
    """What one log came to: torques of shape (N, n)."""

    signals: Signals
    recorded: Array
    predicted: Array
    fits: list[JointFit]
    errors: list[PredictionError]


def _run(robot: Robot, log: JointLog, factors: Array, options: ValidateOptions) -> _Run:
    signals = prepare(log, options.cutoff)
    recorded = signals.effort * factors
    rigid = inverse_dynamics(robot, signals.q, signals.dq, signals.ddq)
    fits, extra = fit_friction(signals, recorded - rigid)
    predicted = rigid + extra
    return _Run(signals, recorded, predicted, fits, prediction_errors(signals, recorded, predicted))


def _head(results: list[dict[str, Any]], options: ValidateOptions) -> dict[str, Any]:
    passed = None
    if options.max_nrmse is not None:
        passed = all(_passes(joint, options.max_nrmse) for result in results for joint in result["joints"])
    return {"passed": passed, "scope": SCOPE, "options": asdict(options)}


def _passes(joint: dict[str, Any], limit: float) -> bool:
    """Judge one joint; without any recorded torque it cannot pass."""
    return joint["nrmse"] is not None and bool(joint["nrmse"] <= limit)


def _log_result(robot: Robot, path: Path, log: JointLog, run: _Run, options: ValidateOptions) -> dict[str, Any]:
    signals = run.signals
    joints = []
    for joint, fit, error in zip(robot.joints, run.fits, run.errors, strict=True):
        entry: dict[str, Any] = {"name": joint.name, **asdict(error), "inside": None}
        entry["unit"] = "N m" if joint.type == "revolute" else "N"
        entry["fit"] = {term: getattr(fit, term) for term in TERMS}
        entry["notes"] = list(fit.notes)
        joints.append(entry)
    return {
        "log": str(path),
        "joints": joints,
        "duration": float(log.t[-1]),
        "samples": len(log.t),
        "samples_used": int(signals.used.sum()),
        "repeated_stamps": log.repeated,
        "rate": signals.rate,
        "resampled": signals.resampled,
        "longest_gap": signals.gap,
        "cutoff": signals.cutoff,
        "velocity": "recorded" if log.dq is not None else "differentiated",
        "effort": options.effort,
    }


def _draw(robot: Robot, log: JointLog, run: _Run, path: Path) -> None:
    units = tuple("N m" if joint.type == "revolute" else "N" for joint in robot.joints)
    captions = tuple(
        f"RMSE {error.rmse:.3g} {unit}"
        + (f", NRMSE {error.nrmse:.3f}" if error.nrmse is not None else ", no torque recorded")
        for error, unit in zip(run.errors, units, strict=True)
    )
    subtitle = (
        "rigid bodies + fitted viscous, Coulomb, offset, rotor inertia (in-sample); "
        f"low-pass {run.signals.cutoff:.3g} Hz; grey: not counted"
    )
    title = f"{robot.name}: {log.name}"
    series = (run.signals.t, run.recorded, run.predicted, run.signals.used)
    draw_torques(TorquePicture(title, subtitle, *series, robot.joint_names, units, captions), path)


def _unique_stems(logs: Sequence[Path]) -> list[str]:
    """Names for the outputs; logs of one name in different folders get -2, -3, ..."""
    stems: list[str] = []
    for path in logs:
        stem, count = path.stem, 1
        while stem in stems:
            count += 1
            stem = f"{path.stem}-{count}"
        stems.append(stem)
    return stems
