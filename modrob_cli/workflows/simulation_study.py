"""What a simulation is made from: read, checked, run once."""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.interval_tight import tight_intervals
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.errors import NegativeAnswerError, UsageError
from modrob_cli.identify.effort import effort_factors
from modrob_cli.io.outputs import provenance
from modrob_cli.io.python_controller import controller_file
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import BoundsMethod
from modrob_cli.model.trajectory_extremes import Violation, violations
from modrob_cli.simulate.closed_loop import ClosedLoop
from modrob_cli.simulate.control_model import ControlModel
from modrob_cli.simulate.controllers.interface import Controller, ControlTask
from modrob_cli.simulate.controllers.shipped import CONTROLLERS, bounds_perturbation
from modrob_cli.simulate.recording import Run
from modrob_cli.simulate.truth import true_robot
from modrob_cli.workflows.robots import LoadedRobot, load_robot
from modrob_cli.workflows.scenarios import LoadedScenario, load_scenario
from modrob_cli.workflows.simulation_summary import truth_text
from modrob_cli.workflows.trajectory_motion import LoadedTrajectory, load_trajectory
from modrob_cli.workflows.user_controller import load_user_controller

MOST_RUNS = 10_000


@dataclass(frozen=True)
class SimulateOptions:
    """What the command line says beside the files; None leaves it to the scenario.

    Attributes
    ----------
    controller : name of a shipped controller, or a Python file with one
    scenario : scenario document
    seed : of all that is drawn
    sweep : number of robots drawn from the box; None for one run
    bounds : how interval controllers bound their perturbation
    """

    controller: str | None = None
    scenario: Path | None = None
    seed: int | None = None
    sweep: int | None = None
    bounds: BoundsMethod | None = None


@dataclass(frozen=True)
class Study:
    """Everything that was read."""

    robot: LoadedRobot
    motion: LoadedTrajectory
    scenario: LoadedScenario
    controller: str
    warnings: list[str]

    @property
    def bounds_perturbation(self) -> bool:
        """Whether the controller bounds its perturbation."""
        return bounds_perturbation(self.controller)

    def task(self) -> ControlTask:
        """What a controller is made from."""
        robot, control = self.robot.robot, self.scenario.scenario.control
        links = published_links(robot) if control.bounds == "ianea" else None
        return ControlTask(ControlModel(robot), self.motion.trajectory, 1.0 / control.rate, control, links)

    def make(self) -> Controller:
        """A controller without memory of earlier runs."""
        return load_user_controller(self.controller, self.task())


def published_links(robot: Robot) -> LinkBoxes:
    """Link parameters for the published algorithm: tight, in the D-H frames."""
    frames = dh_table(robot).frames
    tight = tight_intervals(robot, frames)
    return LinkBoxes(tight.mass, tight.com, tight.inertia_com, frames)


def read_study(robot_path: Path, motion_path: Path, options: SimulateOptions) -> Study:
    """Read all files and make sure that they fit together."""
    robot = load_robot(robot_path)
    motion = load_trajectory(motion_path, robot.robot)
    loaded = load_scenario(options.scenario, robot.robot)
    scenario = loaded.scenario
    if options.seed is not None:
        scenario = replace(scenario, seed=options.seed)
    if options.bounds is not None:
        scenario = replace(scenario, control=replace(scenario.control, bounds=options.bounds))
    warnings = list(motion.warnings)
    if options.sweep is not None:
        if not 1 <= options.sweep <= MOST_RUNS:
            raise UsageError(f"--sweep: found {options.sweep}, expected 1 .. {MOST_RUNS}")
        if scenario.truth.draw == "nominal":
            scenario = replace(scenario, truth=replace(scenario.truth, draw="uniform"))
            warnings.append("true parameters are drawn uniformly (truth: draw in the scenario says otherwise)")
    controller = options.controller or scenario.control.name
    if controller is None:
        raise UsageError(f"--controller is missing; expected {', '.join(CONTROLLERS)} or a Python file")
    found = violations(motion.trajectory, robot.robot)
    beyond = [_violation(robot.robot, one) for one in found if one.quantity == "position"]
    if beyond and scenario.end_stops:
        advice = "change the motion, or say end_stops: false in a scenario"
        raise NegativeAnswerError("\n".join(f"{text}; {advice}" for text in beyond))
    warnings += [_violation(robot.robot, one) for one in found if one.quantity != "position" or not scenario.end_stops]
    return Study(robot, motion, LoadedScenario(scenario, loaded.files), controller, warnings)


def _violation(robot: Robot, violation: Violation) -> str:
    name, (low, high) = robot.joint_names[violation.joint], violation.limit
    value = f"{violation.quantity} {violation.value:.6g} at t = {violation.time:.6g} s"
    return f"the motion exceeds a limit: {name}: {value}, expected {low:.6g} .. {high:.6g}"


def run_one(study: Study, index: int, progress: Callable[[float], None]) -> tuple[Run, float]:
    """One run and the seconds of processor time that it took. Each index has random numbers of its own."""
    robot, scenario = study.robot.robot, study.scenario.scenario
    truth_rng, sensor_rng = (np.random.default_rng([scenario.seed, index, use]) for use in range(2))
    truth = true_robot(robot, scenario.truth, truth_rng, scenario.payload)
    factor = 1.0 / effort_factors(robot, scenario.sensors.effort_kind)
    loop = ClosedLoop(robot, truth, study.motion.trajectory, study.make(), scenario, factor, sensor_rng)
    start = time.process_time()
    run = loop.run(progress)
    return run, time.process_time() - start


def header(study: Study) -> dict[str, Any]:
    """What was simulated, as plain data."""
    scenario = study.scenario.scenario
    return {
        "robot": study.robot.robot.name,
        "trajectory": study.motion.name,
        "scenario": scenario.name,
        "controller": study.controller,
        "seed": scenario.seed,
        "duration": study.motion.trajectory.duration,
        "control_rate": scenario.control.rate,
        "log_rate": scenario.sensors.rate or scenario.control.rate,
        "effort": scenario.sensors.effort_kind,
        "warnings": study.warnings,
    }


def study_provenance(study: Study) -> dict[str, object]:
    """Version of the tool, and hashes of everything that was read."""
    files = [*study.robot.files, study.motion.path, *study.scenario.files]
    own = controller_file(study.controller)
    return provenance([*files, own[0]] if own is not None else files)


def log_notes(study: Study, run: Run) -> dict[str, str]:
    """What the log itself says of its origin."""
    told = {key: str(value) for key, value in header(study).items() if key != "warnings"}
    return {**told, "truth": truth_text(run.truth), "provenance": json.dumps(study_provenance(study))}
