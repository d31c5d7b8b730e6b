"""Collision bands on recordings of real robots: ``python -m benchmarks.collision_recordings ROBOT LOG``.

``modrob identify --bounds`` finds intervals on the first part of the log; the rest, without contact as well, is judged.
Thresholds of every method are scaled so that none raises an alarm on the rest (equal false-alarm rate, zero). Then a
torque is added to the recorded one for half a second at many times: the smallest that is found at nine of ten times
is printed.
"""

import argparse
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.timing import MODROB
from modrob_cli.arrays import Array
from modrob_cli.collision.observer import external_torque, momentum_terms
from modrob_cli.workflows.collision_banding import filtered_band, learn
from modrob_cli.workflows.collision_load import load_run
from modrob_cli.workflows.collision_options import CollisionOptions, parse_filter
from modrob_cli.workflows.collision_runs import CollisionRun
from modrob_cli.workflows.collision_stream import stream_of
from modrob_cli.workflows.robots import load_robot

PUSH, PLACES, SHARE = 0.5, 40, 0.9


def part(run: CollisionRun, mask: Array) -> CollisionRun:
    """The samples of a run that count in one part of it."""
    return replace(run, used=run.used & mask.astype(bool))


def levels(
    run: CollisionRun, options: CollisionOptions, train: CollisionRun
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Signals of each method per unit of its thresholds, so that abs > 1 is an alarm, and these thresholds; (N, n)."""
    learned = learn([stream_of(train)], options)
    exact, ianea, _ = filtered_band(run, options, compare=True)
    if learned is None or ianea is None or run.tau is None:
        raise ValueError("expected a log")
    motion = run.motion
    r = external_torque(momentum_terms(run.robot, motion.t, motion.q, motion.dq, run.tau), learned.observer.gain)
    widths = {
        "exact": 0.5 * (exact.upper - exact.lower),
        "ianea": 0.5 * (ianea.upper - ianea.lower),
        "constant": np.broadcast_to(learned.constant, r.shape),
        "observer": np.broadcast_to(learned.observer.thresholds, r.shape),
    }
    signals = {
        "exact": exact.measured - 0.5 * (exact.upper + exact.lower),
        "ianea": ianea.measured - 0.5 * (ianea.upper + ianea.lower),
        "constant": exact.residual,
        "observer": r,
    }
    return {name: signals[name] / widths[name] for name in signals}, widths


def answers(
    run: CollisionRun, options: CollisionOptions, train: CollisionRun, start: int, length: int
) -> dict[str, Array]:
    """What a push of 1 N m does to each method's filtered signal, shape (length,): all are linear in the torque."""
    learned = learn([stream_of(train)], options)
    if learned is None:
        raise ValueError("expected a log")
    push = np.zeros((len(run.motion.t), 1))
    push[start : start + length] = 1.0
    filtered = options.filter.at(run.motion.rate).apply(push)[start : start + length, 0]
    gain = learned.observer.gain
    since = run.motion.t[start : start + length] - run.motion.t[start]
    return {"exact": filtered, "ianea": filtered, "constant": filtered, "observer": 1.0 - np.exp(-gain * since)}


def smallest(signal: Array, width: Array, scale: float, answer: Array, starts: Array) -> float:
    """Smallest torque of either sign that passes the threshold within the push at most times."""
    needed = []
    for start in starts.tolist():
        span = slice(start, start + len(answer))
        for sign in (-1.0, 1.0):
            gap = (scale - sign * signal[span]) * width[span]
            useful = answer > 1e-6
            needed.append(float((gap[useful] / answer[useful]).min()))
    return float(np.quantile(needed, SHARE))


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robot", type=Path)
    parser.add_argument("log", type=Path)
    parser.add_argument("--effort", default="torque")
    parser.add_argument("--filter", default="butterworth2:5")
    parser.add_argument("--holdout", type=float, default=0.4)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        command = [*MODROB, "identify", str(given.robot), str(given.log), "--effort", given.effort, "--bounds"]
        command += ["--holdout", str(given.holdout), "-o", folder]
        subprocess.run(command, check=True, capture_output=True)  # noqa: S603 - our own command
        robot = load_robot(next(Path(folder).glob("*.bounded.robot.yaml"))).robot
    options = CollisionOptions(effort=given.effort, filter=parse_filter(given.filter), acceleration="smoothed")
    run = load_run(robot, given.log, given.log.stem, options)
    t = run.motion.t
    split = t[0] + (1.0 - given.holdout) * (t[-1] - t[0])
    train, rest = part(run, t < split), part(run, t >= split)
    signals, widths = levels(run, options, train)
    length = max(2, int(PUSH * run.motion.rate))
    places = np.flatnonzero(rest.used[: len(t) - length])
    starts = np.random.default_rng(1).choice(places, PLACES)
    answer = answers(run, options, train, int(places[0]), length)
    print(f"| method | samples outside | scales of joints for no alarm | {' | '.join(robot.joint_names)} |")
    print("|---" * (3 + robot.dof) + "|")
    for name, signal in signals.items():
        outside = float((np.abs(signal[rest.used]) > 1.0).any(axis=1).mean())
        scale = np.maximum(1.0, np.abs(signal[rest.used]).max(axis=0))
        found = [
            smallest(signal[:, j], widths[name][:, j], float(scale[j]), answer[name], starts) for j in range(robot.dof)
        ]
        cells = " | ".join(f"{value:.3g}" for value in found)
        print(f"| {name} | {outside:.1%} | {scale.min():.2f} .. {scale.max():.2f} | {cells} |")


if __name__ == "__main__":
    main()
