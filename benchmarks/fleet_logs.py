"""Make the logs of a fleet: ``python -m benchmarks.fleet_logs FOLDER [--count 900]``.

Simulated runs of the shipped 6-axis arm, one for each day from 2025-01-01 on: true parameters drawn from the intervals,
six short motions in turn, bounded noise, 250 Hz, friction of the first joint that grows by a third over the days. The
arm (FOLDER/arm.yaml) has no gravity, as torque logs beside a gravity compensation have none, and joints called
joint_1 ..., so that one call can take these logs and recordings of the real arm (``--effort net-torque``).
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import joint_state
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.workflows.simulation_study import SimulateOptions, Study, read_study, run_one

ROOT = Path(__file__).parents[1]
FIRST_DAY = 1_735_689_600
DAY = 86_400
GROWTH = 1.0 / 3.0
MOTIONS = 6

ARM = """modrob: assembly/1
name: fleet-arm
catalogue: {catalogue}
modules: [PB1, L1, PB2, L2, PB3, L3]
joint_names: [joint_1, joint_2, joint_3, joint_4, joint_5, joint_6]
gravity: [0, 0, 0]
"""

SCENARIO = """modrob: scenario/1
name: fleet
control: {name: id, rate: 250}
truth: {draw: uniform}
sensors:
  noise: uniform
  position: {noise: 2e-5}
  velocity: {noise: 5e-4}
  effort: {noise: 0.3}
"""


def write_inputs(folder: Path) -> tuple[Path, Path, list[Path]]:
    """Arm, scenario and motions of 4 s there and back."""
    arm, scenario = folder / "arm.yaml", folder / "scenario.yaml"
    arm.write_text(ARM.format(catalogue=ROOT / "modules" / "schunk-lwa4p"), encoding="utf-8")
    scenario.write_text(SCENARIO, encoding="utf-8")
    rng, motions = np.random.default_rng(7), []
    for k in range(MOTIONS):
        via = rng.uniform(0.3, 0.9, 6) * rng.choice([-1.0, 1.0], 6)
        points = "".join(f"- {{t: {t}, q: {(part * via).round(4).tolist()}}}\n" for t, part in ((0, 0), (2, 1), (4, 0)))
        path = folder / f"motion-{k}.yaml"
        path.write_text(f"modrob: trajectory/1\nname: motion-{k}\nkind: waypoints\norder: 5\npoints:\n{points}")
        motions.append(path)
    return arm, scenario, motions


def aged(robot: Robot, factor: float) -> Robot:
    """The robot with other friction at its first joint."""
    first, *others = robot.joints
    friction = first.friction
    values = [Uncertain.exact(part.nominal * factor) for part in (friction.viscous, friction.coulomb)]
    grown = replace(friction, viscous=values[0], coulomb=values[1])
    return replace(robot, joints=(replace(first, friction=grown), *others))


def write_run(study: Study, index: int, count: int, path: Path) -> None:
    """Simulate and log one day."""
    robot = aged(study.robot.robot, 1.0 + GROWTH * index / count)
    run, _ = run_one(replace(study, robot=replace(study.robot, robot=robot)), index, lambda done: None)
    values = run.recording.values
    stamps = (FIRST_DAY + DAY * index) * 10**9 + np.round(run.recording.stamps * 1e9).astype(np.int64)
    measured = np.hstack([values["q_measured"], values["dq_measured"], values["effort"]])
    write_mcap(path, [Series("/joint_states", joint_state(robot.joint_names), stamps, measured)])


def main() -> None:
    """Write all logs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=900)
    given = parser.parse_args()
    logs = given.folder / "logs"
    logs.mkdir(parents=True, exist_ok=True)
    arm, scenario, motions = write_inputs(given.folder)
    studies = [read_study(arm, motion, SimulateOptions(scenario=scenario)) for motion in motions]
    for k in range(given.count):
        write_run(studies[k % MOTIONS], k, given.count, logs / f"day_{k + 1:04d}.mcap")


if __name__ == "__main__":
    main()
