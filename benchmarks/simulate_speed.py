"""Speed of closed-loop simulation on one thread: ``python -m benchmarks.simulate_speed [--runs 5]``.

Every shipped controller drives the 6-axis arm through the motion of [D] Table B.1 (18 s) at 1 kHz, and the interval
controllers also one whose bodies are all uncertain. Times are those of
the processor (``time.process_time``); the runs of all cases are interleaved, so that a busy minute hits them all. The
last column is the time per command in calls of ``pin.aba`` in a plain Python loop that keeps its results, in the same
run: the fourth-order method alone needs four of them. The work is done in a process of its own, with the thread pools
of BLAS and OpenMP set to one thread.
"""

import argparse
import itertools
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import BoundsMethod, Control, Scenario
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.simulate.closed_loop import ClosedLoop
from modrob_cli.simulate.control_model import ControlModel
from modrob_cli.simulate.controllers.interface import ControlTask
from modrob_cli.simulate.controllers.shipped import CONTROLLERS, make_controller
from modrob_cli.simulate.truth import true_robot
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.simulation_study import published_links
from modrob_cli.workflows.trajectory_motion import load_trajectory

ROOT = Path(__file__).parents[1]
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
RATE = 1000.0
REFERENCE = "pin.aba in a Python loop"
Case = Callable[[], object]


def closed_loop(robot: Robot, trajectory: Trajectory, name: str, bounds: BoundsMethod = "exact") -> Case:
    """A run with a new controller."""

    def case() -> object:
        scenario = Scenario(control=Control(rate=RATE, bounds=bounds))
        task = ControlTask(ControlModel(robot), trajectory, 1.0 / RATE, scenario.control, published_links(robot))
        truth = true_robot(robot, scenario.truth, np.random.default_rng(0))
        controller, rng = make_controller(name, task), np.random.default_rng(1)
        return ClosedLoop(robot, truth, trajectory, controller, scenario, np.ones(robot.dof), rng).run()

    return case


def pinocchio_loop(robot: Robot, count: int) -> Case:
    """The reference: as many forward dynamics as there are commands."""
    import pinocchio as pin

    model = build_model(robot)
    data = model.createData()
    states = np.random.default_rng(1).uniform(-1.0, 1.0, (count, 3, robot.dof))
    return lambda: [pin.aba(model, data, *state).copy() for state in states]


def measured(cases: dict[str, Case], runs: int) -> dict[str, list[float]]:
    """Seconds of the processor for each case over interleaved runs, after one warm-up."""
    seconds: dict[str, list[float]] = {name: [] for name in cases}
    for k in range(runs + 1):
        for name, case in cases.items():
            start = time.process_time()
            case()
            if k:
                seconds[name].append(time.process_time() - start)
    return seconds


def main() -> None:
    """Run and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5, help="runs of each case")
    runs = parser.parse_args().runs
    if any(os.environ.get(name) != "1" for name in THREADS):
        command = [sys.executable, "-m", "benchmarks.simulate_speed", *sys.argv[1:]]
        sys.exit(subprocess.run(command, env=os.environ | dict.fromkeys(THREADS, "1"), check=False).returncode)
    robot = load_robot(ROOT / "assemblies" / "lwa4p-6.yaml").robot
    trajectory = load_trajectory(ROOT / "trajectories" / "table-b1.yaml").trajectory
    commands = round(trajectory.duration * RATE)
    cases: dict[str, Case] = {name: closed_loop(robot, trajectory, name) for name in CONTROLLERS}
    uncertain = load_robot(ROOT / "assemblies" / "lwa4p-6-tol5.yaml").robot
    bounds: tuple[BoundsMethod, ...] = ("exact", "ianea")
    for name, method in itertools.product(("ia-id", "ia-pb"), bounds):
        cases[f"{name} {method}, 5 %"] = closed_loop(uncertain, trajectory, name, method)
    found = measured({REFERENCE: pinocchio_loop(robot, commands)} | cases, runs)
    unit = statistics.median(found[REFERENCE])
    print(f"{f'{commands} commands, 6 joints':26}{'x real time: median':>20}{'most':>7}{'us/command':>12}{'calls':>7}")
    for name, seconds in found.items():
        median = statistics.median(seconds)
        factors = f"{trajectory.duration / median:20.1f}{trajectory.duration / min(seconds):7.1f}"
        blank = f"{'':27}" if name == REFERENCE else factors
        print(f"{name:26}{blank}{1e6 * median / commands:12.1f}{median / unit:7.1f}")


if __name__ == "__main__":
    main()
