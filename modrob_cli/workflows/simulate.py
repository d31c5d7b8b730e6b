"""Simulate an arm that follows a motion under a controller, and log it."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.dynamics.drive_torque import torque_limits
from modrob_cli.errors import UsageError
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.plot.perturbation import PerturbationPicture, draw_perturbation
from modrob_cli.plot.simulation import SimulationPicture, draw_simulation
from modrob_cli.simulate.recording import Run
from modrob_cli.workflows.simulation_log import write_log
from modrob_cli.workflows.simulation_study import (
    SimulateOptions,
    Study,
    header,
    log_notes,
    read_study,
    run_one,
    study_provenance,
)
from modrob_cli.workflows.simulation_summary import run_summary
from modrob_cli.workflows.simulation_sweep import Progress, sweep


def simulate(
    robot_path: Path,
    motion_path: Path,
    options: SimulateOptions,
    log: Path,
    overwrite: bool = False,
    progress: Progress = lambda _what, _done: None,
) -> dict[str, Any]:
    """Simulate one run, or one for each robot drawn from the box.

    Parameters
    ----------
    log : MCAP file to write; summary and picture get names beside it
    progress : is told what is done and which part of it

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/simulate.md``

    Raises
    ------
    InputFileError
        If a file cannot be used or does not fit the robot; nothing is written then.
    UsageError
        If options, gains or clocks do not fit together.
    NegativeAnswerError
        If the motion leaves the position limits of the robot.
    OutputExistsError
        If a file is there already and ``overwrite`` is false.
    """
    study = read_study(robot_path, motion_path, options)
    if log.suffix.lower() != ".mcap":
        raise UsageError(f"-o: found {log}, expected the name of an MCAP file, such as run.mcap")
    with OutputFolder(log.parent, overwrite) as folder:
        if options.sweep is None:
            return _single(study, folder, log, progress)
        return sweep(study, options.sweep, folder, log, progress)


def _single(study: Study, folder: OutputFolder, log: Path, progress: Progress) -> dict[str, Any]:
    names = {"log": log.name, "json": f"{log.stem}.simulate.json", "picture": f"{log.stem}.simulate.png"}
    if study.bounds_perturbation:
        names["perturbation"] = f"{log.stem}.perturbation.png"
    folder.claim(list(names.values()))
    run, seconds = run_one(study, 0, lambda done: progress("Simulating", done))
    robot, scenario = study.robot.robot, study.scenario.scenario
    write_log(robot, run, scenario, log_notes(study, run), folder.stage(names["log"]))
    result = {**header(study), **run_summary(robot, run, scenario), "provenance": study_provenance(study)}
    folder.write(names["json"], json.dumps(result, indent=2, allow_nan=False) + "\n")
    draw_simulation(_picture(study, run), folder.stage(names["picture"]))
    if "perturbation" not in run.recording.values:
        names.pop("perturbation", None)
    else:
        draw_perturbation(_perturbation_picture(study, run), folder.stage(names["perturbation"]))
    speed = run.recording.t[-1] / seconds if len(run.recording.t) > 1 and seconds > 0.0 else None
    files = {kind: str(log.parent / name) for kind, name in names.items()}
    return {**result, "real_time_factor": speed, "files": files}


def _perturbation_picture(study: Study, run: Run) -> PerturbationPicture:
    robot, control, recording = study.robot.robot, study.scenario.scenario.control, run.recording
    values = recording.values
    precision = control.gains.get("precision")
    return PerturbationPicture(
        f"{robot.name}: {study.controller} on {study.motion.name}",
        f"scenario {study.scenario.scenario.name}; bounds of the perturbation: {control.bounds}",
        recording.t,
        np.linalg.norm(values["q"] - recording.desired[:, 0], axis=1),
        np.linalg.norm(values["commanded"], axis=1),
        values["perturbation"],
        values["phi_lower"],
        values["phi_upper"],
        robot.joint_names,
        tuple("N m" if joint.type == "revolute" else "N" for joint in robot.joints),
        None if precision is None else float(np.min(precision)),
    )


def _picture(study: Study, run: Run) -> SimulationPicture:
    robot, scenario = study.robot.robot, study.scenario.scenario
    low, high = torque_limits(robot)
    end = f"ran away at {run.diverged:.4g} s" if run.diverged is not None else f"{study.motion.trajectory.duration:g} s"
    recording = run.recording
    return SimulationPicture(
        f"{robot.name}: {study.controller} on {study.motion.name}",
        f"scenario {scenario.name}, seed {scenario.seed}; {end}; shaded: contacts",
        recording.t,
        recording.values["q"],
        recording.desired[:, 0],
        recording.values["applied"],
        np.stack([low, high]) if scenario.saturation else np.full((2, robot.dof), np.nan),
        robot.joint_names,
        tuple(joint.type == "revolute" for joint in robot.joints),
        tuple((contact.start, contact.end) for contact in scenario.contacts),
    )
