"""Torque bounds over a motion, and where their width comes from."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import TorqueBounds
from modrob_cli.io.number_csv import NumberCsv
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.model.motion import LimitWatch, ThinnedMotion
from modrob_cli.model.robot import Robot
from modrob_cli.plot.bounds import BoundsCurves
from modrob_cli.workflows.bounds_method import BoundsOptions, Tolerances, bounder, shares
from modrob_cli.workflows.bounds_summary import Summary, share_json, shares_csv, warning_json
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.trajectory_motion import TrajectoryMotion, motion_reader

SHARE_SAMPLES = 4000
"""Of a longer motion, between half as many and as many evenly picked samples tell where the width comes from."""

Reporter = Callable[[float], None]


def bounds(
    robot_path: Path,
    motion_path: Path,
    options: BoundsOptions,
    out: Path,
    overwrite: bool = False,
    report: Reporter = lambda fraction: None,
    rate: float | None = None,
    topic: str | None = None,
) -> dict[str, Any]:
    """Bound the torques over a motion; tables, JSON and a picture.

    Memory does not grow with the motion.

    Parameters
    ----------
    report : called with the fraction that is done
    rate : samples per second of a motion that is not sampled as CSV
    topic : where the motion is in an MCAP file

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/bounds.md``

    Raises
    ------
    InputFileError
        If the robot or the motion cannot be used; nothing is written then.
    UsageError
        If options do not fit together or the robot.
    NumericalError
        If a bound is not finite.
    OutputExistsError
        If a file is there already and ``overwrite`` is false.
    """
    loaded = load_robot(robot_path)
    robot = loaded.robot
    tolerances = Tolerances.of(options, robot.dof)
    compute = bounder(robot, options.method, tolerances)
    stem = motion_path.stem
    names = {"bounds": f"{stem}.bounds.csv", "shares": f"{stem}.shares.csv", "json": f"{stem}.bounds.json"}
    names["picture"] = f"{stem}.bounds.png"
    watch, thinned, summary = LimitWatch(robot), ThinnedMotion(SHARE_SAMPLES), Summary(robot)
    curves = BoundsCurves(robot.dof)
    reader = motion_reader(motion_path, robot, rate, topic)
    with OutputFolder(out, overwrite) as folder:
        folder.claim(list(names.values()))
        with NumberCsv(folder.stage(names["bounds"]), _header(robot)) as table:
            for piece in reader:
                with np.errstate(over="ignore", invalid="ignore"):  # of absurd values; what is not finite is refused
                    found = compute(piece)
                table.write(_rows(piece.t, found))
                watch.add(piece)
                thinned.add(piece)
                summary.add(piece.t, found)
                curves.add(piece.t, found.nominal, found.lower, found.upper)
                report(reader.done)
        ranking = shares(robot, thinned.motion(), tolerances)
        result = {
            **summary.to_json(options),
            "rate": reader.rate if isinstance(reader, TrajectoryMotion) else None,
            "motion_warnings": list(reader.warnings) if isinstance(reader, TrajectoryMotion) else [],
            "shares": [share_json(robot, i, ranking[i]) for i in range(robot.dof)],
            "share_samples": len(thinned.motion().t),
            "warnings": [warning_json(robot, excess, summary.samples) for excess in watch.found()],
            "provenance": provenance([*loaded.files, motion_path]),
        }
        folder.write(names["shares"], shares_csv(robot, ranking))
        folder.write(names["json"], json.dumps(result, indent=2, allow_nan=False) + "\n")
        curves.draw(summary.labels(motion_path.name, options), folder.stage(names["picture"]))
    return {**result, "files": {kind: str(out / name) for kind, name in names.items()}}


def _header(robot: Robot) -> list[str]:
    return ["t", *(f"{name}.{part}" for name in robot.joint_names for part in ("nominal", "lower", "upper"))]


def _rows(t: Array, found: TorqueBounds) -> Array:
    """Columns in the order of the header, shape (T, 1 + 3 n)."""
    values = np.stack([found.nominal, found.lower, found.upper], axis=2)
    return np.concatenate([t[:, None], values.reshape(len(t), -1)], axis=1)
