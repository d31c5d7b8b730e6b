"""Simulated study of collision detection: ``python -m benchmarks.collision_study [--runs 200]``.

Arms drawn from the box of ``assemblies/lwa4p-6-payload.yaml`` (a payload of 0.25 to 1 kg, centre of mass and inertia
unknown) follow random motions; sensors have noise within stated bounds. Runs without contact tell about false alarms,
runs with one push of 5 to 80 N at a random place, direction and time about what is found. All methods see the same
filtered signals; constant thresholds and the momentum observer are learned from runs of other arms without contact.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.collision.acceleration import measured_acceleration
from modrob_cli.collision.bands import UncertainMotion
from modrob_cli.collision.baselines import beyond
from modrob_cli.collision.events import Band, find_events, score
from modrob_cli.collision.events import Contact as Window
from modrob_cli.collision.observer import external_torque, momentum_terms
from modrob_cli.collision.sensitivity import LinkPoint, contact_forces
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Channel, Contact, Control, Scenario, Sensors, Truth
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import SineCurve
from modrob_cli.simulate.closed_loop import ClosedLoop
from modrob_cli.simulate.control_model import ControlModel
from modrob_cli.simulate.controllers.interface import ControlTask
from modrob_cli.simulate.controllers.shipped import make_controller
from modrob_cli.simulate.recording import Recording
from modrob_cli.simulate.truth import true_robot
from modrob_cli.workflows.collision_banding import Learned, filtered_band, learn
from modrob_cli.workflows.collision_options import CollisionOptions, parse_filter
from modrob_cli.workflows.collision_runs import CollisionRun
from modrob_cli.workflows.collision_stream import stream_of
from modrob_cli.workflows.robots import load_robot

ROBOT = Path(__file__).parents[1] / "assemblies" / "lwa4p-6-payload.yaml"
RATE, DURATION, SKIP, PUSH = 1000.0, 5.0, 0.5, 0.5
Q_NOISE, DQ_NOISE, EFFORT_NOISE = 1e-5, 1e-4, 0.2
JERK = 1000.0
"""Stated bound of the jerk away from reversals [rad/s^3]."""
JUMP, STILL = (6.0, 6.0, 6.0, 6.0, 10.0, 10.0), 0.03
"""Stated sudden changes of acceleration [rad/s^2] where any joint is slower than that [rad/s]."""
TRAINING = 5
SCALED = ("constant, scaled", "observer, scaled")
"""The same with thresholds scaled to no alarm in the runs without contact: the least ones, known only afterwards."""
METHODS = ("exact", "ianea", "constant", "observer", *SCALED)


@dataclass(frozen=True)
class StudyRun:
    """One simulated run: what a log tells, and what is known besides.

    Attributes
    ----------
    push : window of the push; None without one
    force : its size, [N]
    kept : part of the samples whose true acceleration lies within its stated bounds
    """

    run: CollisionRun
    push: Window | None
    force: float
    kept: float


@dataclass(frozen=True)
class Outcome:
    """What each method found: events outside the push, delay of the first one in it (None: missed); excess by method.

    ``certain``: smallest force at the tool that is certain to be found, median over the run, exact and IANEA bands.
    """

    force: float
    false_alarms: dict[str, int]
    delays: dict[str, float | None]
    ratios: dict[str, float]
    certain: tuple[float, float]


def study_options(filter_text: str = "butterworth2:20") -> CollisionOptions:
    """Stated bounds and the filter of the study."""
    return CollisionOptions(
        filter=parse_filter(filter_text),
        acceleration="measured",
        q_noise=[Q_NOISE],
        dq_noise=[DQ_NOISE],
        effort_noise=[EFFORT_NOISE],
        jerk=[JERK],
        jump=list(JUMP),
        still=[STILL],
    )


def simulate_run(robot: Robot, seed: int, pushed: bool) -> StudyRun:
    """One arm, motion and push by the seed."""
    rng = np.random.default_rng([77, seed])
    motion = _random_motion(robot.dof, rng)
    push, force = _random_push(robot, rng) if pushed else (None, 0.0)
    sensors = Sensors(
        position=Channel(Q_NOISE), velocity=Channel(DQ_NOISE), effort=Channel(EFFORT_NOISE), noise="uniform"
    )
    control = Control(name="feedforward-pd", friction="desired", rate=RATE)
    contacts = (push,) if push is not None else ()
    scenario = Scenario(
        truth=Truth(draw="uniform"), control=control, sensors=sensors, contacts=contacts, end_stops=False
    )
    controller = make_controller("feedforward-pd", ControlTask(ControlModel(robot), motion, 1.0 / RATE, control))
    truth = true_robot(robot, scenario.truth, rng)
    recording = ClosedLoop(robot, truth, motion, controller, scenario, np.ones(robot.dof), rng).run().recording
    values = recording.values
    knowledge = study_options().velocity_knowledge(robot)
    ddq, tolerance, window = measured_acceleration(recording.t, values["dq_measured"], knowledge)
    first = max(int(SKIP * RATE), window)
    radii = (np.full(robot.dof, Q_NOISE), np.full(robot.dof, DQ_NOISE), tolerance[first:])
    states = (values["q_measured"][first:], values["dq_measured"][first:], ddq[first:])
    known = UncertainMotion(recording.t[first:], *states, *radii)
    kept = _kept(recording, ddq, tolerance, first)
    pushing = None if push is None else Window("push", push.start, push.end)
    run = CollisionRun(
        ROBOT, f"run-{seed}", robot, 0, known, values["effort"][first:], np.full(robot.dof, EFFORT_NOISE),
        np.ones(len(known.t), dtype=bool), () if pushing is None else (pushing,), "measured", (),
    )  # fmt: skip
    return StudyRun(run, pushing, force, kept)


def _kept(recording: Recording, ddq: Array, tolerance: Array, first: int) -> float:
    """Part of the samples whose true acceleration, just before the sample, lies within the stated bounds.

    The acceleration just before is not recorded; that just after the sample before stands for the whole step.
    """
    before = recording.values["ddq"][first - 1 : -1]
    return float((np.abs(before - ddq[first:]) <= tolerance[first:]).mean())


def _random_motion(dof: int, rng: np.random.Generator) -> Trajectory:
    """Two sines per joint, up to about 1 rad/s."""
    curves = []
    for _ in range(dof):
        frequency = rng.uniform(0.6, 2.5, 2)
        amplitude = rng.uniform(0.15, 0.5, 2) / frequency
        curves.append(SineCurve(DURATION, float(rng.uniform(-1.0, 1.0)), amplitude, frequency, rng.uniform(0, 6.3, 2)))
    return Trajectory("sines", tuple(curves))


def _random_push(robot: Robot, rng: np.random.Generator) -> tuple[Contact, float]:
    force = float(rng.uniform(5.0, 80.0))
    direction = rng.normal(size=3)
    link = int(rng.integers(3, robot.dof + 1))
    start = float(np.round(rng.uniform(SKIP + 0.5, DURATION - PUSH - 0.5), 3))
    direction *= force / np.linalg.norm(direction)
    return Contact("push", link, rng.uniform(-0.1, 0.1, 3), direction, start, PUSH), force


def judge(study: StudyRun, options: CollisionOptions, learned: Learned, safe: Learned | None = None) -> Outcome:
    """What each method says of one run; ``safe``: thresholds of the scaled ones."""
    run = study.run
    exact, ianea, _ = filtered_band(run, options, compare=True)
    if ianea is None or run.tau is None:
        raise ValueError("expected both kinds of bands and a measurement")
    motion = run.motion
    estimate = external_torque(momentum_terms(run.robot, motion.t, motion.q, motion.dq, run.tau), learned.observer.gain)
    excess = {
        "exact": exact.excess,
        "ianea": ianea.excess,
        "constant": beyond(exact.residual, learned.constant),
        "observer": beyond(estimate, learned.observer.thresholds),
    }
    if safe is not None:
        excess[SCALED[0]] = beyond(exact.residual, safe.constant)
        excess[SCALED[1]] = beyond(estimate, safe.observer.thresholds)
    windows = () if study.push is None else (study.push,)
    alarms, delays = {}, {}
    for name, values in excess.items():
        found = score(motion.t, values, find_events(motion.t, values, options.rules), windows, options.settle)
        alarms[name] = found.false_alarms
        delays[name] = found.delays[0] if windows else None
    ratios = {
        "constant": float((np.abs(exact.residual) / learned.constant).max()),
        "observer": float((np.abs(estimate) / learned.observer.thresholds).max()),
    }
    return Outcome(study.force, alarms, delays, ratios, (_certain(run, exact), _certain(run, ianea)))


def _certain(run: CollisionRun, band: Band) -> float:
    tool, step = LinkPoint("tool", run.robot.dof + 1, np.zeros(3)), slice(None, None, 50)
    found = contact_forces(run.robot, run.motion.q[step], (band.upper - band.lower)[step], tool)
    return float(np.median(found.axes))


def scaled(learned: Learned, outcomes: list[Outcome]) -> Learned:
    """Thresholds that just raise no alarm in these runs without contact."""
    constant = learned.constant * max(1e-9, *(one.ratios["constant"] for one in outcomes))
    limits = learned.observer.thresholds * max(1e-9, *(one.ratios["observer"] for one in outcomes))
    return Learned(constant, replace(learned.observer, thresholds=limits))


def table(clean: list[Outcome], pushed: list[Outcome], edges: Array) -> list[str]:
    """Lines for people: false alarms, detection rate by force, delay."""
    bins = [f"{low:g}-{high:g} N" for low, high in zip(edges[:-1], edges[1:], strict=True)]
    lines = ["| method | clean runs with alarms | " + " | ".join(bins) + " | all | median delay |"]
    lines.append("|---" * (len(bins) + 4) + "|")
    for name in METHODS:
        rates = []
        for low, high in [*zip(edges[:-1], edges[1:], strict=True), (edges[0], edges[-1])]:
            some = [one for one in pushed if low <= one.force < high]
            rates.append(f"{np.mean([one.delays[name] is not None for one in some]):.0%}" if some else "-")
        delays = [delay for one in pushed if (delay := one.delays[name]) is not None]
        middle = f"{1e3 * float(np.median(delays)):.0f} ms" if delays else "-"
        alarms = sum(one.false_alarms.get(name, 0) > 0 for one in clean)
        lines.append(f"| {name} | {alarms} of {len(clean)} | {' | '.join(rates)} | {middle} |")
    return lines


def study(runs: int, filter_text: str) -> list[str]:
    """The whole study as lines for people."""
    robot, options = load_robot(ROBOT).robot, study_options(filter_text)
    learned = learn([stream_of(simulate_run(robot, 10_000 + k, False).run) for k in range(TRAINING)], options)
    if learned is None:
        raise ValueError("expected training runs")
    made = [simulate_run(robot, k, False) for k in range(runs)]
    pushes = [simulate_run(robot, 20_000 + k, True) for k in range(runs)]
    clean = [judge(one, options, learned) for one in made]
    safe = scaled(learned, clean)
    pushed = [judge(one, options, learned, safe) for one in pushes]
    edges = np.array([5.0, 15.0, 25.0, 40.0, 60.0, 80.0])
    kept = float(np.mean([one.kept for one in made]))
    exact, ianea = (float(np.median([one.certain[k] for one in clean])) for k in range(2))
    ratio = f"certain along x, y, z at the tool, median: exact {exact:.1f} N, IANEA {ianea:.1f} N ({ianea / exact:.2f})"
    return [
        f"{runs} runs without and {runs} with a push, filter {filter_text}",
        f"accelerations within their bounds: {kept:.4%} of the samples",
        f"{ratio}; gain of the observer {learned.observer.gain:g} 1/s",
        *table(clean, pushed, edges),
    ]


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200, help="of each kind")
    parser.add_argument("--filter", default="butterworth2:20")
    arguments = parser.parse_args()
    print("\n".join(study(arguments.runs, arguments.filter)))


if __name__ == "__main__":
    main()
