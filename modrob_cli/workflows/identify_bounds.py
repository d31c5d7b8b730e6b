"""Bounded-error identification over logs: intervals into a robot file, tables and a picture (docs/bounded-error.md)."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from modrob_cli.dynamics.exact_bounds import TorqueBounds
from modrob_cli.errors import NumericalError
from modrob_cli.identify.bounded_error import JointBounds, bound_joint
from modrob_cli.identify.bounded_ranges import MotionNoise, RecordedMotion, rigid_bodies_of
from modrob_cli.identify.bounded_robot import bounded_robot
from modrob_cli.identify.bounded_samples import JointSamples, Mask
from modrob_cli.identify.run import Run
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.model.log import UsedLog
from modrob_cli.model.robot import Robot
from modrob_cli.plot.bounded import draw_bounded
from modrob_cli.schema import RobotDocument
from modrob_cli.schema.from_model import identified_from_data, robot_data
from modrob_cli.workflows.bounded_growth import growth_result
from modrob_cli.workflows.bounded_options import BoundedOptions, requests, with_velocity_bands
from modrob_cli.workflows.bounded_overlay import write_overlay
from modrob_cli.workflows.bounded_picture import bounded_picture
from modrob_cli.workflows.bounded_summary import held_out_result, joint_result, parameters_csv, samples_csv
from modrob_cli.workflows.robots import LoadedRobot


def identify_bounds(
    robot: LoadedRobot,
    runs: Sequence[Run],
    options: BoundedOptions,
    folder: OutputFolder,
    held_out: Sequence[Run] = (),
    made_from: dict[str, Any] | None = None,
    used: Sequence[UsedLog] = (),
) -> dict[str, Any]:
    """Find the smallest intervals of friction, rotor and disturbance that put every sample inside the torque bounds.

    Parameters
    ----------
    runs : contact-free; their used samples count
    folder : open; all files go there
    held_out : runs that the intervals are not found from; how many of their samples lie inside is reported
    made_from : provenance of the outputs; None for the robot alone
    used : stretches of them that ``runs`` cover, for the robot file

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/bounded-error.md``, with the paths of the files

    Raises
    ------
    UsageError
        If an option does not fit.
    NumericalError
        If there are no samples, the solver fails, or the written robot does not hold a sample that it should.
    """
    arm = robot.robot
    names = _names(arm)
    folder.claim([name for kind, name in names.items() if kind != "overlay"])
    noise = options.motion_noise(arm.dof)
    motion = RecordedMotion.of(runs, options.torque == "filtered")
    if not len(motion):
        raise NumericalError("no samples are left to find bounds from; use longer logs or a smaller held-out part")
    search = _search(robot, runs, options, motion, noise)
    samples, found = search.samples, search.found
    inside = (search.bounds.lower <= motion.tau) & (motion.tau <= search.bounds.upper)
    _check(arm, found, inside)
    result = {
        "robot": arm.name,
        "samples": len(motion),
        "logs": [run.name for run in runs],
        "options": asdict(options),
        "joints": [joint_result(arm, j, runs, motion, samples[j], found[j], inside[:, j]) for j in range(arm.dof)],
        "held_out": held_out_result(search.written, held_out, options.torque == "filtered", noise),
        "growth": growth_result(arm, motion, noise, samples, found, options) if options.growth else None,
        "overlay": write_overlay(robot, search.written, folder, names["overlay"], names["assembly"]),
        "provenance": made_from or provenance(robot.files),
    }
    if result["overlay"] is None:
        names = {kind: name for kind, name in names.items() if kind not in ("overlay", "assembly")}
    folder.write(names["robot"], yaml_text(search.data | identified_from_data(used)))
    folder.write(names["parameters"], parameters_csv(arm, found))
    folder.write(names["samples"], samples_csv(arm, runs, motion, samples, found))
    draw_bounded(bounded_picture(arm, motion, samples, found, search.bounds), folder.stage(names["picture"]))
    folder.write(names["json"], json.dumps(result, indent=2, allow_nan=False) + "\n")
    return {**result, "files": {kind: str(folder.folder / name) for kind, name in names.items()}}


@dataclass(frozen=True)
class _Search:
    """What was found.

    Attributes
    ----------
    samples, found : per joint
    data : of the robot file;  written : the robot that a reader of the file gets;  bounds : its torque bounds
    """

    samples: list[JointSamples]
    found: list[JointBounds]
    data: dict[str, Any]
    written: Robot
    bounds: TorqueBounds


def _search(
    robot: LoadedRobot, runs: Sequence[Run], options: BoundedOptions, motion: RecordedMotion, noise: MotionNoise
) -> _Search:
    arm = robot.robot
    asked = requests(arm, runs, options, len(motion))
    rigid = motion.bounds(rigid_bodies_of(arm), noise)
    plain = [motion.of_joint(j, rigid, noise) for j in range(arm.dof)]
    samples = with_velocity_bands(arm, runs, options, plain, asked)
    found = [bound_joint(part, request) for part, request in zip(samples, asked, strict=True)]
    bands = np.array([part.velocity_band for part in samples])
    data = robot_data(bounded_robot(arm, found, bands), source=f"modrob identify --bounds, from {robot.files[0].name}")
    written = RobotDocument.model_validate(data).to_model()
    return _Search(samples, found, data, written, motion.bounds(written, noise))


def bounded_names(arm: Robot) -> list[str]:
    """Names of the files and folders that may be written."""
    return list(_names(arm).values())


def _names(arm: Robot) -> dict[str, str]:
    stem = f"{arm.name}.bounded"
    names = {"robot": "robot.yaml", "json": "json", "parameters": "csv", "samples": "samples.csv", "picture": "png"}
    more = {"overlay": f"{stem}.modules", "assembly": f"{stem}.assembly.yaml"}
    return {**{kind: f"{stem}.{suffix}" for kind, suffix in names.items()}, **more}


def _check(arm: Robot, found: Sequence[JointBounds], inside: Mask) -> None:
    """Hold the promise of the result: every sample that was not left out lies inside the bounds of the written robot.

    Raises
    ------
    NumericalError
        If it does not.
    """
    for j, joint in enumerate(found):
        outside = np.setdiff1d(np.flatnonzero(~inside[:, j]), joint.left_out)
        if len(outside):
            raise NumericalError(
                f"{arm.joints[j].name}: {len(outside)} samples lie outside the bounds that were found; the torques or "
                "the model may hold absurd values"
            )
