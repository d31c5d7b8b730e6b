"""An exciting motion for a robot: searched, checked, written as a trajectory document, sampled and drawn."""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli import __version__
from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError, UsageError
from modrob_cli.identify.excitation import ExcitationOptions, ExcitationResult, optimize_excitation
from modrob_cli.identify.excitation_information import Measure
from modrob_cli.identify.excitation_limits import MotionLimits
from modrob_cli.identify.excitation_series import FourierMotion
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory_extremes import violations
from modrob_cli.schema import TrajectoryDocument
from modrob_cli.workflows.excitation_limits import Ranges, limited_robot, motion_limits, used_limits
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.trajectory import FORMATS, trajectory
from modrob_cli.workflows.trajectory_mcap import check_fits
from modrob_cli.workflows.trajectory_motion import DEFAULT_RATE, TrajectoryMotion

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_+-]{0,63}\Z", re.ASCII)
_MOST = {"harmonics": 40, "periods": 1000, "iterations": 100_000}


@dataclass(frozen=True)
class ExcitationRequest:
    """What the user asks for.

    Attributes
    ----------
    duration : of the whole motion, [s];  periods : how often the series repeats in it
    margin : part of each limit that may be used, 0 < margin <= 1
    objective : ``log-det`` or ``condition``
    iterations : for each start; None for the default;  seconds : end of the search, None for none
    joints : names of those that move, None for all
    limits : by quantity (position, velocity, acceleration, jerk, torque), in place of the robot's
    name : of the motion, None for that of the robot with ``-excitation``
    """

    duration: float = 20.0
    periods: int = 1
    harmonics: int = 5
    margin: float = 0.9
    objective: Measure = "log-det"
    seed: int = 0
    iterations: int | None = None
    seconds: float | None = None
    joints: Sequence[str] | None = None
    limits: Mapping[str, Ranges] = field(default_factory=dict)
    name: str | None = None


def excitation(
    robot_path: Path,
    request: ExcitationRequest,
    out: Path,
    rate: float = DEFAULT_RATE,
    overwrite: bool = False,
    formats: Sequence[str] = FORMATS,
    report: Callable[[float], None] = lambda fraction: None,
) -> dict[str, Any]:
    """Search an exciting motion for a robot and write it.

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/excitation.md``

    Raises
    ------
    InputFileError
        If the robot cannot be used.
    UsageError
        If an option makes no sense, or limits are missing.
    NumericalError
        If no motion tells the parameters apart, or the arm cannot be held.
    OutputExistsError
        If a file is there already and ``overwrite`` is false.
    """
    _check(request)
    loaded = load_robot(robot_path)
    robot = loaded.robot
    name = request.name or re.sub(r"[^A-Za-z0-9_+-]", "-", robot.name)[:53].lstrip("-_+") + "-excitation"
    moving = _moving(robot, request.joints)
    _check_samples(robot, request, rate, formats)
    given, limits = motion_limits(robot, request.limits, request.margin, moving)
    rest = _rest(limits, moving)
    defaults = ExcitationOptions()
    options = ExcitationOptions(
        request.duration / request.periods, request.harmonics, request.objective, request.seed,
        iterations=request.iterations or defaults.iterations, seconds=request.seconds,
    )  # fmt: skip
    names = {"trajectory": f"{name}.yaml", "excitation": f"{name}.excitation.json"}
    later = [f"{name}.{ending}" for ending in ("png", "trajectory.json", *formats)]
    with OutputFolder(out, overwrite) as folder:
        folder.claim([*names.values(), *later])
        found = optimize_excitation(robot, limits, options, moving, rest, report)
        data = _document(name, robot, request, found)
        _verify(data, limited_robot(robot, limits))
        result = {**_result(name, robot, request, found, moving, given), "provenance": provenance(loaded.files)}
        folder.write(names["trajectory"], yaml_text(data))
        folder.write(names["excitation"], json.dumps(result, indent=2, allow_nan=False) + "\n")
    limits_of = None if request.limits else robot_path
    motion = trajectory(out / names["trajectory"], limits_of, out, rate, overwrite, formats=formats)
    files = {**{kind: str(out / file) for kind, file in names.items()}, **motion["files"]}
    return {**result, "motion": {key: motion[key] for key in ("joints", "samples", "rate")}, "files": files}


def _check(request: ExcitationRequest) -> None:
    """Refuse options that make no sense.

    Raises
    ------
    UsageError
        Naming the option.
    """
    for option in ("duration", "seconds"):
        value = getattr(request, option)
        if value is not None and not 0.0 < value < 1e6:
            raise UsageError(f"--{option}: found {value:g}, expected a number > 0 [s]")
    if not 0.0 < request.margin <= 1.0:
        raise UsageError(f"--margin: found {request.margin:g}, expected more than 0 and at most 1 (0.9 uses 90 %)")
    for option, least in (("harmonics", 2), ("periods", 1), ("iterations", 1)):
        value = getattr(request, option)
        if value is not None and not least <= value <= _MOST[option]:
            raise UsageError(f"--{option}: found {value}, expected {least} to {_MOST[option]}")
    if request.seed < 0:
        raise UsageError(f"--seed: found {request.seed}, expected a number >= 0")
    if request.name is not None and not _NAME.match(request.name):
        raise UsageError(f"--name: found {request.name!r}, expected letters, digits, _, + or -, at most 64")


def _check_samples(robot: Robot, request: ExcitationRequest, rate: float, formats: Sequence[str]) -> None:
    """Refuse rates and formats before the search, with an arm that does not move.

    Raises
    ------
    UsageError
        If one makes no sense.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown or not formats:
        raise UsageError(f"--format: found {', '.join(map(ascii, unknown))}, expected some of {','.join(FORMATS)}")
    none = np.zeros((robot.dof, 1))
    still = FourierMotion(request.duration, none[:, 0], none, none)
    samples = TrajectoryMotion(still.trajectory("still"), rate)
    if "mcap" in formats:
        check_fits(samples)


def _moving(robot: Robot, names: Sequence[str] | None) -> tuple[int, ...]:
    if names is None:
        return tuple(range(robot.dof))
    unknown = [name for name in names if name not in robot.joint_names]
    if unknown or not names:
        found = ", ".join(unknown) or "nothing"
        raise UsageError(f"--joints: found {found}, expected names among {', '.join(robot.joint_names)}")
    return tuple(k for k, name in enumerate(robot.joint_names) if name in names)


def _rest(limits: MotionLimits, moving: Sequence[int]) -> Array:
    """Where joints rest that do not move: at 0, or in the middle of a range without it."""
    low, high = limits.position[:, 0], limits.position[:, 1]
    inside = (low <= 0.0) & (high >= 0.0)
    rest = np.zeros(len(low))
    rest[~inside] = 0.5 * (low + high)[~inside]
    rest[list(moving)] = 0.0
    return rest


def _document(name: str, robot: Robot, request: ExcitationRequest, found: ExcitationResult) -> dict[str, Any]:
    motion = found.motion
    description = (
        f"Exciting motion for the identification of {robot.name}: Fourier series of {request.harmonics} harmonics, at "
        f"rest at both ends; objective {request.objective}, condition number {found.condition:.4g} of the regressor of "
        f"{found.model.count} base parameters (columns of equal length); margin {request.margin:g}, "
        f"seed {request.seed}."
    )
    joints = [
        {"offset": float(offset), "sin": sin.tolist(), "cos": cos.tolist()}
        for offset, sin, cos in zip(motion.offset, motion.sin, motion.cos, strict=True)
    ]
    return {
        "modrob": "trajectory/1",
        "name": name,
        "kind": "sines",
        "source": f"modrob {__version__}, trajectory --optimize-excitation",
        "description": description,
        "duration": request.periods * motion.period,
        "base_frequency": motion.base_frequency,
        "joints": joints,
    }


def _verify(data: dict[str, Any], robot: Robot) -> None:
    """Check the document as it will be read, against the limits and the margin.

    Raises
    ------
    NumericalError
        If a limit is exceeded in spite of the search.
    """
    beyond = violations(TrajectoryDocument.model_validate(data).to_model(), robot)
    if beyond:
        first = beyond[0]
        raise NumericalError(
            f"the motion leaves the {first.quantity} range of {robot.joint_names[first.joint]} by {first.excess:.3g}; "
            "nothing was written"
        )


def _result(
    name: str, robot: Robot, request: ExcitationRequest, found: ExcitationResult, moving: Sequence[int],
    given: MotionLimits,
) -> dict[str, Any]:  # fmt: skip
    count = found.model.count
    random: dict[str, Any] = {"count": len(found.random_condition)}
    ratio = None
    if random["count"]:
        random["condition"] = {"best": _low(found.random_condition), "median": _middle(found.random_condition)}
        random["log_det"] = {"best": _low(found.random_log_det), "median": _middle(found.random_log_det)}
        ratio = float(np.exp((found.log_det - random["log_det"]["median"]) / (2.0 * count)))
    return {
        "trajectory": name,
        "robot": robot.name,
        "objective": request.objective,
        "duration": request.periods * found.motion.period,
        "periods": request.periods,
        "harmonics": request.harmonics,
        "base_frequency": found.motion.base_frequency,
        "margin": request.margin,
        "seed": request.seed,
        "base_parameters": count,
        "condition": found.condition,
        "log_det": found.log_det,
        "random": random,
        "stderr_ratio": ratio,
        "iterations": found.iterations,
        "stopped": found.stopped,
        "joints": [
            {"name": joint.name, "moves": j in moving, "used": used_limits(robot, found.motion, given, j)}
            for j, joint in enumerate(robot.joints)
        ],
    }


def _low(x: Array) -> float:
    return float(np.min(x))


def _middle(x: Array) -> float:
    return float(np.median(x))
