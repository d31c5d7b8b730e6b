"""Speed of the torque bounds on one thread: ``python -m benchmarks.bounds_speed [--samples 100000]``.

Machines differ and are shared: compare the ratios to a Python loop over ``pin.rnea`` that keeps its results, on the
same samples in the same run. Each figure is the median of five runs, in CPU time; the runs of all cases of a table are
interleaved, so that a busy minute hits them all. The work is done in a process of its own, with the thread pools of
BLAS and OpenMP set to one thread.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.bounds_width import ASSEMBLIES, link_boxes, widened
from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.ianea import ianea
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, RigidBody
from modrob_cli.model.joint import Joint
from modrob_cli.model.robot import STANDARD_GRAVITY, Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import rotation, translation
from modrob_cli.workflows.robots import load_robot

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
RUNS = 5
JOINTS = (2, 4, 8, 16, 32)
Case = Callable[[], object]
States = tuple[Array, Array, Array]


def medians(cases: dict[str, Case]) -> dict[str, float]:
    """Median CPU seconds of each case over interleaved runs, after one warm-up."""
    seconds: dict[str, list[float]] = {name: [] for name in cases}
    for k in range(RUNS + 1):
        for name, case in cases.items():
            start = time.process_time()
            case()
            if k:
                seconds[name].append(time.process_time() - start)
    return {name: statistics.median(found) for name, found in seconds.items()}


def random_states(samples: int, dof: int) -> States:
    """Random q, dq, ddq within +-2, shape (samples, dof) each."""
    q, dq, ddq = np.random.default_rng(1).uniform(-2.0, 2.0, (3, samples, dof))
    return q, dq, ddq


def pinocchio_loop(robot: Robot, states: States) -> Case:
    """The reference: nominal torques, sample by sample."""
    import pinocchio as pin

    model = build_model(robot)
    data = model.createData()
    return lambda: [pin.rnea(model, data, *sample) for sample in zip(*states, strict=True)]


def chain(dof: int) -> Robot:
    """A synthetic arm of revolute joints at right angles, 0.2 m apart, every body parameter within +-10 %."""
    turns = [rotation("x", (-1.0) ** k * np.pi / 2) @ translation("z", 0.2) for k in range(dof)]
    joints = tuple(Joint(f"q{k}", "revolute", turn) for k, turn in enumerate(turns))
    inertia = np.array([4e-3, 1e-4, 2e-4, 5e-3, -1e-4, 3e-3])
    com = Uncertain.exact(np.array([0.01, -0.02, 0.08]))
    body = RigidBody("body", Uncertain.exact(1.0), com, Uncertain.exact(inertia))
    bodies = tuple(PlacedBody(k + 1, np.eye(4), body) for k in range(dof))
    gravity = np.array(STANDARD_GRAVITY)
    return widened(Robot(f"chain-{dof}", joints, bodies, np.eye(4), gravity, Interval(np.zeros(dof))), 0.1)


def last_link_only(robot: Robot) -> Robot:
    """The robot with the boxes of its last body alone."""
    exact = widened(robot, 0.0)
    return replace(exact, bodies=(*exact.bodies[:-1], robot.bodies[-1]))


def compare(samples: int) -> None:
    """All methods on the 6-axis arm."""
    arm, modules = (load_robot(ASSEMBLIES / f"{name}.yaml").robot for name in ("lwa4p-table34", "lwa4p-6-tol5"))
    x = random_states(samples, arm.dof)
    last, every = link_boxes(arm), link_boxes(modules)
    reference = "pin.rnea in a Python loop"
    found = medians(
        {
            reference: pinocchio_loop(arm, x),
            "rnea": lambda: rnea(arm, *x),
            "exact bounds, uncertain last link": lambda: exact_bounds(arm, *x),
            "exact bounds, 15 modules with +-5 % each": lambda: exact_bounds(modules, *x),
            "IANEA*, uncertain last link": lambda: ianea(arm, *x, last),
            "IANEA*, all links from 15 modules": lambda: ianea(modules, *x, every),
        }
    )
    print(f"{f'{samples} samples, 6 joints':42} {'us/sample':>10} {'ratio':>6}")
    for name, seconds in found.items():
        print(f"{name:42} {1e6 * seconds / samples:10.2f} {seconds / found[reference]:6.2f}")


def over_joints(samples: int) -> None:
    """Cost over the number of joints, and the exponent of its growth."""
    cases: dict[str, Case] = {}
    for dof in JOINTS:
        cases |= {f"{dof} {name}": case for name, case in _chain_cases(chain(dof), samples).items()}
    found = np.reshape(list(medians(cases).values()), (len(JOINTS), -1)) * 1e6 / samples
    names = [name.partition(" ")[2] for name in cases][: found.shape[1]]
    print(f"\n{f'us/sample, {samples} samples':26}" + "".join(f"{name:>14}" for name in names))
    for dof, row in zip(JOINTS, found, strict=True):
        print(f"{f'{dof:3d} joints':26}" + "".join(f"{value:14.2f}" for value in row))
    for k, dof in enumerate(JOINTS[:-1]):
        slopes = np.log(found[k + 1] / found[k]) / np.log(JOINTS[k + 1] / dof)
        print(f"{f'exponent, {dof} to {JOINTS[k + 1]} joints':26}" + "".join(f"{slope:14.2f}" for slope in slopes))


def _chain_cases(robot: Robot, samples: int) -> dict[str, Case]:
    x = random_states(samples, robot.dof)
    last, links = last_link_only(robot), link_boxes(robot, np.tile(np.eye(4), (robot.dof, 1, 1)))
    return {
        "pin loop": pinocchio_loop(robot, x),
        "exact, last": lambda: exact_bounds(last, *x),
        "exact, all": lambda: exact_bounds(robot, *x),
        "IANEA*, all": lambda: ianea(robot, *x, links),
    }


def over_samples(most: int) -> None:
    """Time per sample over the number of samples."""
    arm = load_robot(ASSEMBLIES / "lwa4p-table34.yaml").robot
    print(f"\n{'us/sample, uncertain last link':30}{'exact':>10}{'IANEA*':>10}")
    count = 1
    while count <= most:
        found = medians(_two_bounds(arm, random_states(count, arm.dof)))
        print(f"{count:10d} samples{'':12}" + "".join(f"{1e6 * seconds / count:10.2f}" for seconds in found.values()))
        count *= 10


def _two_bounds(robot: Robot, x: States) -> dict[str, Case]:
    links = link_boxes(robot)
    return {"exact": lambda: exact_bounds(robot, *x), "IANEA*": lambda: ianea(robot, *x, links)}


def main() -> None:
    """Run and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=100_000, help="samples of the first table")
    samples = parser.parse_args().samples
    if any(os.environ.get(name) != "1" for name in THREADS):
        command = [sys.executable, "-m", "benchmarks.bounds_speed", *sys.argv[1:]]
        sys.exit(subprocess.run(command, env=os.environ | dict.fromkeys(THREADS, "1"), check=False).returncode)
    compare(samples)
    over_joints(max(samples // 10, 1))
    over_samples(10 * samples)


if __name__ == "__main__":
    main()
