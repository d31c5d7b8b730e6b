"""``modrob validate`` on one long log: ``python -m benchmarks.long_log FOLDER [--gigabytes 2]``.

Makes a log of the shipped 6-axis arm at 1 kHz (positions, velocities, model torque with friction that slowly grows,
noise on all), judges it in a process of its own, and says what memory and time that took. The log goes into FOLDER and
is kept. Other options are those of the command (``--details 0``: no picture, no page).
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.io.mcap_writer import McapWriter, Series
from modrob_cli.io.ros_messages import joint_state
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.robots import load_robot

ROBOT = Path(__file__).parents[1] / "assemblies" / "lwa4p-6.yaml"
START = 1_767_225_600 * 10**9
RATE = 1000
PIECE = 50_000
SINES = 5
GROWTH = 0.05
"""Of Coulomb friction, per hour."""
NOISE = {"q": 1e-5, "dq": 1e-3, "effort": 0.2}


@dataclass(frozen=True)
class Motion:
    """A sum of sines for each joint: amplitude [rad], frequency [rad/s] and phase, shape (n, SINES)."""

    amplitude: Array
    frequency: Array
    phase: Array

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration, shape (T, n)."""
        angle = t[:, None, None] * self.frequency + self.phase
        sine, cosine = self.amplitude * np.sin(angle), self.amplitude * np.cos(angle)
        return sine.sum(-1), (self.frequency * cosine).sum(-1), -(self.frequency**2 * sine).sum(-1)


def random_motion(rng: np.random.Generator, n: int) -> Motion:
    """Up to 1 Hz and about 1 rad."""
    frequency = 2.0 * np.pi * rng.uniform(0.02, 1.0, (n, SINES))
    return Motion(rng.uniform(0.1, 0.5, (n, SINES)) / frequency, frequency, rng.uniform(0.0, 6.28, (n, SINES)))


def torque(robot: Robot, hours: Array, q: Array, dq: Array, ddq: Array) -> Array:
    """The nominal model, with friction that grows over the hours (T,)."""
    coulomb = np.array([float(joint.friction.coulomb.nominal) for joint in robot.joints])
    grown = GROWTH * hours[:, None] * coulomb * np.sign(dq)
    return np.asarray(exact_bounds(robot, q, dq, ddq).nominal + grown)


def write_log(robot: Robot, path: Path, size: float) -> int:
    """Write pieces until the file has ``size`` bytes; returns the number of samples."""
    rng = np.random.default_rng(1)
    motion, layout, count = random_motion(rng, robot.dof), joint_state(robot.joint_names), 0
    with McapWriter(path, [("/joint_states", layout)]) as writer:
        while path.stat().st_size < size:
            number = np.arange(count, count + PIECE)
            parts = motion.at(number / RATE)
            values = (parts[0], parts[1], torque(robot, number / RATE / 3600.0, *parts))
            noisy = [x + rng.normal(0.0, s, x.shape) for x, s in zip(values, NOISE.values(), strict=True)]
            stamps = START + number * (10**9 // RATE)
            writer.add([Series("/joint_states", layout, stamps, np.hstack(noisy))])
            count += PIECE
    return count


def validate(robot: Path, log: Path, arguments: list[str]) -> tuple[dict[str, object], float, float]:
    """Result, seconds and peak memory [MB] of the command."""
    command = [
        str(Path(sys.executable).with_name("modrob")),
        "validate",
        str(robot),
        str(log),
        "--effort",
        "torque",
        *arguments,
    ]
    with tempfile.TemporaryDirectory() as out:
        start = time.perf_counter()
        run = subprocess.run([*command, "-o", out, "--json"], capture_output=True, text=True, check=False)
        seconds = time.perf_counter() - start
    if run.returncode:
        raise SystemExit(run.stderr)
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0
    return json.loads(run.stdout)["logs"][0], seconds, peak


def main() -> None:
    """Make the log if it is not there, judge it, print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--gigabytes", type=float, default=2.0)
    parser.add_argument("--robot", type=Path, default=ROBOT)
    options, arguments = parser.parse_known_args()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    options.folder.mkdir(parents=True, exist_ok=True)
    path = options.folder / f"long-{options.gigabytes:g}.mcap"
    if not path.is_file():
        start = time.perf_counter()
        count = write_log(load_robot(options.robot).robot, path, options.gigabytes * 1e9)
        print(f"wrote {count} samples in {time.perf_counter() - start:.0f} s")
    result, seconds, peak = validate(options.robot, path, arguments)
    samples, size = int(str(result["samples"])), path.stat().st_size
    print(f"{size / 1e6:.0f} MB, {samples} samples of {float(str(result['duration'])) / 3600:.2f} h")
    print(f"{seconds:.1f} s: {size / 1e6 / seconds:.1f} MB/s, {samples / seconds:.0f} samples/s")
    print(f"peak memory {peak:.0f} MB")


if __name__ == "__main__":
    main()
