"""Bias and coverage of the estimates on simulated logs: ``python -m benchmarks.identify_coverage [--runs 500]``.

Each run: a random exciting motion of a three-joint arm, torques by Pinocchio, friction, torque noise that is correlated
over 0.1 s, encoder noise; identified as ``modrob identify`` does, cut-off included. Set OMP_NUM_THREADS=1.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.regression import JointPrior, RegressionOptions, fit_joint
from modrob_cli.identify.run import prepare_run
from modrob_cli.identify.signal_cutoff import choose_cutoff
from modrob_cli.io.urdf_reader import read_urdf
from modrob_cli.model.robot import Robot
from tests.identify_samples import TERMS, TRUTH, URDF, record


def arm() -> Robot:
    """The simulated arm."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "three.urdf"
        path.write_text(URDF)
        return read_urdf(path)


def main() -> None:
    """Run and print one line per joint and parameter."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--duration", type=float, default=30.0, help="seconds of each log")
    parser.add_argument("--noise", type=float, default=1.0, help="factor of the torque noise")
    arguments = parser.parse_args()
    robot, joints = arm(), len(TRUTH)
    found = np.full((arguments.runs, joints, len(TERMS), 4), np.nan)  # value, stderr, lower, upper
    start = time.perf_counter()
    for seed in range(arguments.runs):
        log = record(seed, duration=arguments.duration, noise=arguments.noise).log
        run = prepare_run(robot, log, "torque", choose_cutoff(log).cutoff)
        for j in range(joints):
            estimates = fit_joint([run], j, RegressionOptions(), JointPrior({}, 1.0)).estimates
            for k, term in enumerate(TERMS):
                estimate = estimates[term]
                if estimate.value is not None and estimate.interval is not None:
                    found[seed, j, k] = (estimate.value, estimate.stderr, *estimate.interval)
    seconds = (time.perf_counter() - start) / arguments.runs
    title = (
        f"{'joint':9} {'parameter':18} {'truth':>7} {'bias':>8} {'+-':>8} {'spread':>8} {'stderr':>8} {'coverage':>9}"
    )
    print(f"{arguments.runs} runs of {arguments.duration:g} s, {seconds:.2f} s each (simulation included)")
    print(f"{title} none")
    for j in range(joints):
        for k, term in enumerate(TERMS):
            _report(robot.joint_names[j], term, TRUTH[j, k], found[:, j, k])
    inside = (found[..., 2] <= TRUTH) & (found[..., 3] >= TRUTH)
    print(f"all intervals together: {float(np.mean(inside[np.isfinite(found[..., 0])])):.1%} hold the truth")


def _report(joint: str, term: str, truth: float, found: Array) -> None:
    known = found[np.isfinite(found[:, 0])]
    bias, spread = float(np.mean(known[:, 0]) - truth), float(np.std(known[:, 0]))
    inside = float(np.mean((known[:, 2] <= truth) & (truth <= known[:, 3])))
    chance = 2.0 * spread / np.sqrt(len(known))
    figures = f"{truth:7.3f} {bias:8.4f} {chance:8.4f} {spread:8.4f} {float(np.mean(known[:, 1])):8.4f}"
    print(f"{joint:9} {term:18} {figures} {inside:9.1%} {len(found) - len(known):4d}")


if __name__ == "__main__":
    main()
