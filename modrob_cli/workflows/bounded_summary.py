"""Figures of bounded-error identification: what JSON and tables say."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from modrob_cli.identify.bounded_error import MORE, JointBounds
from modrob_cli.identify.bounded_ranges import MotionNoise, RecordedMotion
from modrob_cli.identify.bounded_reliability import CONFIDENCE, independent_samples, outside_at_most
from modrob_cli.identify.bounded_robot import rotor_inertia
from modrob_cli.identify.bounded_samples import DISTURBANCE, PARAMETERS, JointSamples, Mask
from modrob_cli.identify.run import Run
from modrob_cli.io.csv_writer import csv_text
from modrob_cli.model.robot import Robot

NAMES = ("viscous", "coulomb", "reflected_inertia", "disturbance")
"""Names of the parameters in JSON and tables."""

APART = 0.1
"""Samples that were left out belong to one event if less than this lies between them, [s]."""

LARGE = 0.3
"""A disturbance with a half-width above this share of the RMS torque is worth a note."""

WIDE = 3.0
"""A parameter is hardly told if almost as good values differ by more than this factor."""

Json = dict[str, Any]


def unit(robot: Robot, j: int) -> str:
    """Unit of the torque of a joint."""
    return "N m" if robot.joints[j].type == "revolute" else "N"


def joint_result(
    robot: Robot,
    j: int,
    runs: Sequence[Run],
    motion: RecordedMotion,
    samples: JointSamples,
    found: JointBounds,
    inside: Mask,
) -> Json:
    """Figures of one joint."""
    joint = robot.joints[j]
    rotor = rotor_inertia(joint, found)
    noise_free = not found.left_out.size
    return {
        "name": joint.name,
        "unit": unit(robot, j),
        "spread": found.spread,
        **{name: _interval(found.nominal[k], found.ends[k]) for k, name in enumerate(NAMES)},
        "rotor_inertia": _interval(rotor.nominal, [rotor.interval.inf, rotor.interval.sup]),
        "gear_ratio": joint.drive.gear_ratio,
        "velocity_band": samples.velocity_band,
        "kept": [NAMES[PARAMETERS.index(name)] for name in found.kept],
        "agrees_with_noise": found.agrees,
        "least_disturbance": found.least_disturbance,
        "mean_width": found.mean_width,
        "mean_width_with_all": found.mean_width if noise_free else found.width_with_all,
        "mean_width_rigid": float(np.mean(samples.high - samples.low)),
        "widths": {key.replace("armature", "reflected_inertia"): width for key, width in found.widths.items()},
        "alternatives": {name: list(map(float, found.alternatives[k])) for k, name in enumerate(NAMES)},
        "inside": float(np.mean(inside)),
        "active": [
            {"log": _log(runs, motion, item.index), **_state(motion, j, item.index), "side": item.side}
            for item in found.active
        ],
        "left_out": list(_events(runs, motion, samples, found)),
        "reliability": _reliability(motion, samples, found),
        "notes": list(_notes(motion, j, samples, found)),
    }


def _interval(nominal: Any, ends: Any) -> Json:
    return {"nominal": float(nominal), "lower": float(ends[0]), "upper": float(ends[1])}


def _log(runs: Sequence[Run], motion: RecordedMotion, at: int) -> str:
    return runs[int(motion.run[at])].name


def _state(motion: RecordedMotion, j: int, at: int) -> Json:
    parts = {"dq": motion.dq, "ddq": motion.ddq, "torque": motion.tau}
    return {"t": float(motion.t[at]), **{key: float(values[at, j]) for key, values in parts.items()}}


def _events(runs: Sequence[Run], motion: RecordedMotion, samples: JointSamples, found: JointBounds) -> Iterator[Json]:
    """Samples that were left out, joined where they are close in time."""
    left = found.left_out
    if not len(left):
        return
    out = samples.outside(found.ends.ravel())
    new = (np.diff(motion.t[left]) > APART) | (np.diff(motion.run[left]) != 0.0)
    for group in np.split(left, np.flatnonzero(new) + 1):
        peak = int(group[np.argmax(out[group])])
        yield {
            "log": _log(runs, motion, peak),
            "start": float(motion.t[group[0]]),
            "end": float(motion.t[group[-1]]),
            "samples": len(group),
            "peak": float(out[peak]),
            "peak_time": float(motion.t[peak]),
        }


def _reliability(motion: RecordedMotion, samples: JointSamples, found: JointBounds) -> Json | None:
    """What theory promises for more of the same motion; None for intervals that follow from a stated noise."""
    if found.spread == "consistent":
        return None
    lower, upper = samples.edges(found.ends.ravel())
    rest = samples.tau - 0.5 * (samples.low + samples.high) - 0.5 * (lower + upper)
    independent = independent_samples([rest[motion.run == number] for number in np.unique(motion.run)])
    # Of a few samples left out next to each other, those that count as independent are fewer in proportion.
    left = int(np.ceil(len(found.left_out) * independent / len(samples)))
    return {
        "independent_samples": independent,
        "unknowns": found.unknowns,
        "confidence": CONFIDENCE,
        "outside_at_most": outside_at_most(independent, found.unknowns, left),
    }


def _notes(motion: RecordedMotion, j: int, samples: JointSamples, found: JointBounds) -> Iterator[str]:
    if found.kept:
        kept = ", ".join(NAMES[PARAMETERS.index(name)] for name in found.kept)
        why = "moves in one direction only" if found.kept == ("coulomb",) else "hardly moves, or has a gear ratio of 0"
        yield f"{why}: the robot's own values are kept for {kept}"
    if found.agrees is False:
        yield (
            "no constant friction explains the samples within the stated noise; it takes at least "
            f"+-{found.least_disturbance:.3g}, so the model errs, something was touched, or the noise is larger; what "
            "is given is the narrowest band"
        )
    size = float(np.sqrt(np.mean(motion.tau[:, j] ** 2)))
    if found.least_disturbance > LARGE * size > 0.0:
        share = found.least_disturbance / size
        yield f"the disturbance that no constant friction explains is {share:.0%} of the RMS torque"
    wide = [
        f"{NAMES[k]} {found.alternatives[k, 0]:.3g} .. {found.alternatives[k, 1]:.3g}"
        for k in range(DISTURBANCE)
        if PARAMETERS[k] not in found.kept and found.alternatives[k, 1] > WIDE * found.alternatives[k, 0]
    ]
    if wide:
        yield f"hardly told, as values of a wide range need at most {MORE:.0%} more disturbance: {', '.join(wide)}"


def held_out_result(robot: Robot, runs: Sequence[Run], filtered: bool, noise: MotionNoise) -> Json | None:
    """How many samples of runs that were not used lie inside the bounds of the written robot; None without runs."""
    motion = RecordedMotion.of(runs, filtered) if runs else None
    if motion is None or not len(motion):
        return None
    bounds = motion.bounds(robot, noise)
    out = np.maximum(bounds.lower - motion.tau, motion.tau - bounds.upper)
    joints = []
    for j, joint in enumerate(robot.joints):
        worst = int(np.argmax(out[:, j]))
        inside = float(np.mean(out[:, j] <= 0.0))
        far = max(float(out[worst, j]), 0.0)
        place = {"worst_time": float(motion.t[worst]), "worst_log": _log(runs, motion, worst)}
        joints.append({"name": joint.name, "inside": inside, "worst": far, **place})
    return {"samples": len(motion), "inside_all_joints": float(np.mean(np.all(out <= 0.0, axis=1))), "joints": joints}


def parameters_csv(robot: Robot, found: Sequence[JointBounds]) -> str:
    """Intervals of every parameter as CSV, link side."""
    rows = [
        (robot.joints[j].name, NAMES[k], float(bounds.nominal[k]), *map(float, bounds.ends[k]))
        for j, bounds in enumerate(found)
        for k in range(len(PARAMETERS))
    ]
    return csv_text(("joint", "quantity", "nominal", "lower", "upper"), rows)


def samples_csv(
    robot: Robot,
    runs: Sequence[Run],
    motion: RecordedMotion,
    samples: Sequence[JointSamples],
    found: Sequence[JointBounds],
) -> str:
    """Samples that decide and samples that were left out as CSV; ``outside``: how far outside the bounds."""
    rows = []
    for j, bounds in enumerate(found):
        out = samples[j].outside(bounds.ends.ravel())
        marked: list[tuple[str, int]] = [(item.side, item.index) for item in bounds.active]
        marked += [("left out", int(at)) for at in bounds.left_out]
        for kind, at in sorted(marked, key=lambda item: item[1]):
            state = _state(motion, j, at).values()
            rows.append((robot.joints[j].name, _log(runs, motion, at), *state, kind, max(float(out[at]), 0.0)))
    return csv_text(("joint", "log", "t", "dq", "ddq", "torque", "kind", "outside"), rows)
