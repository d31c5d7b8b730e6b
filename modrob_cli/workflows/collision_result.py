"""Results of ``modrob collision`` as plain data and tables."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.collision.events import Event
from modrob_cli.collision.sensitivity import AXES, ContactForces
from modrob_cli.collision.tables import UPPER
from modrob_cli.identify.effort import effort_factors
from modrob_cli.io.csv_writer import csv_text
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.bounds_summary import unit
from modrob_cli.workflows.collision_banding import Learned
from modrob_cli.workflows.collision_judge import JudgedRun, Method
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.log_date import log_date

METHODS = {
    "bands": "bands of this report",
    "ianea": "bands of the published algorithm (IANEA)",
    "exact": "exact bands",
    "constant": "constant thresholds",
    "observer": "momentum observer",
}
NOT_FELT = 1e5
"""A larger force [N] counts as one that no joint feels: it acts through the joints' axes but for rounding."""
SCOPE = (
    "Without contact no parameters that the robot file admits take the filtered torque out of its band, as long as the "
    "stated noise and tolerances hold. It says nothing about what the model leaves out, such as elasticity, nor about "
    "contacts smaller than the sensitivity below."
)


def effort_unit(robot: Robot, j: int, options: CollisionOptions) -> str:
    """Unit of what the log calls effort."""
    return {"current": "A", "motor-torque": "N m"}.get(options.effort, unit(robot, j))


def log_result(judged: JudgedRun, options: CollisionOptions) -> dict[str, Any]:
    """One log or planned motion."""
    about, survey = judged.about, judged.survey
    robot = about.robot
    events = judged.methods[0].events if judged.methods else []
    contacts, planned = about.contacts, about.tau is None
    return {
        "log": about.name,
        "date": None if planned else log_date(about.start),
        "planned": planned,
        "duration": survey.end - survey.start,
        "samples": survey.samples,
        "samples_used": survey.used,
        "rate": about.motion.rate,
        "acceleration": about.source,
        "ddq_tolerance": survey.most_rad.tolist(),
        "filter_gain": judged.filter.gain,
        "notes": [*about.notes, *_without_width(judged)],
        "events": [event_json(robot, event, options) for event in events],
        "closest": _closest_json(judged),
        "contacts": None if contacts is None else [_contact_json(judged, k) for k in range(len(contacts))],
        "methods": [_method_json(method, contacts is None) for method in judged.methods],
        "sensitivity": [_sensitivity(judged, j) for j in range(robot.dof)],
        "contact_forces": [
            {"point": point.label, **_forces_json(forces)}
            for point, forces in zip(options.link_points(robot), judged.forces, strict=True)
        ],
        "thresholds": {
            phase: {"samples": table.samples, "torque": table.torque.tolist(), "force": table.force.tolist()}
            for phase, table in (("acceleration", judged.table.acceleration), ("nominal", judged.table.nominal))
        },
    }


def _without_width(judged: JudgedRun) -> list[str]:
    """A warning where nothing is uncertain, because no real arm is known that well."""
    thin = judged.widths.median < 1e-6
    names = [name for name, bare in zip(judged.about.robot.joint_names, thin, strict=True) if bare]
    told = "nothing is uncertain and no noise was stated: the band is the allowance for rounding"
    return [f"{', '.join(names)}: {told}"] if names else []


def _closest_json(judged: JudgedRun) -> list[dict[str, Any]] | None:
    """How near each joint came to an end of its band: 0 in its middle, 1 at its end, more outside."""
    if judged.closest is None:
        return None
    found = zip(judged.about.robot.joint_names, judged.closest.share, judged.closest.time, strict=True)
    return [{"joint": name, "share": float(share), "time": float(time)} for name, share, time in found]


def event_json(robot: Robot, event: Event, options: CollisionOptions) -> dict[str, Any]:
    """One event; ``peak`` is joint torque, ``peak_effort`` in the unit of the log."""
    j = event.joint
    factor = float(effort_factors(robot, options.effort)[j])
    return {
        "start": event.start,
        "end": event.end,
        "joint": robot.joint_names[j],
        "side": event.side,
        "peak": event.peak,
        "unit": unit(robot, j),
        "peak_time": event.peak_time,
        "peak_effort": event.peak / factor,
        "effort_unit": effort_unit(robot, j, options),
    }


def _contact_json(judged: JudgedRun, k: int) -> dict[str, Any]:
    contact = (judged.about.contacts or ())[k]
    delays = {method.name: method.score.delays[k] for method in judged.methods}
    return {"name": contact.name, "start": contact.start, "end": contact.end, "delays": delays}


def _method_json(method: Method, unlabelled: bool) -> dict[str, Any]:
    score = method.score
    known = [delay for delay in score.delays if delay is not None]
    return {
        "method": method.name,
        "events": len(method.events),
        "false_alarms": None if unlabelled else score.false_alarms,
        "false_samples": None if unlabelled else score.false_samples,
        "contacts": len(score.delays),
        "detected": score.detected,
        "missed": len(score.delays) - score.detected,
        "median_delay": float(np.median(known)) if known else None,
    }


def _sensitivity(judged: JudgedRun, j: int) -> dict[str, Any]:
    robot, widths = judged.about.robot, judged.widths
    return {
        "joint": robot.joint_names[j],
        "unit": unit(robot, j),
        "min_detectable": float(widths.most[j]),
        "median": float(widths.median[j]),
        "least": float(widths.least[j]),
        "other_band_ratio": None if widths.other_ratio is None else float(widths.other_ratio[j]),
        "shares": [{"parameter": share.parameter, "share": share.share} for share in judged.shares[j][:5]],
    }


def _forces_json(forces: ContactForces) -> dict[str, Any]:
    parts = {axis: forces.axes[:, k] for k, axis in enumerate(AXES)}
    parts |= {"best_direction": forces.easiest, "worst_direction": forces.hardest}
    return {key: {"median": _finite(np.median(x)), "worst": _finite(x.max())} for key, x in parts.items()}


def _finite(value: float) -> float | None:
    """None stands for a force that no joint feels."""
    return float(value) if value < NOT_FELT else None


def learned_json(robot: Robot, learned: Learned | None, options: CollisionOptions) -> dict[str, Any] | None:
    """What the training runs taught."""
    if learned is None:
        return None
    return {
        "logs": [str(path) for path in options.train],
        "margin": options.margin,
        "constant": learned.constant.tolist(),
        "observer": {"gain": learned.observer.gain, "thresholds": learned.observer.thresholds.tolist()},
        "joints": list(robot.joint_names),
    }


def threshold_document(robot: Robot, results: Sequence[dict[str, Any]], options: CollisionOptions) -> dict[str, Any]:
    """Constant thresholds over all logs in the shape of franka_msgs/srv/SetFullCollisionBehavior."""
    request: dict[str, list[float]] = {}
    for kind in ("torque", "force"):
        for phase in ("acceleration", "nominal"):
            most = np.max([result["thresholds"][phase][kind] for result in results], axis=0)
            request[f"lower_{kind}_thresholds_{phase}"] = _rounded_up(most)
            request[f"upper_{kind}_thresholds_{phase}"] = _rounded_up(UPPER * most)
    return {
        "robot": robot.name,
        "description": "residual = measured - nominal torque, both after the filter; lower: no admissible parameter "
        "passes it without contact; upper: twice that; force: of the wrench pinv(J') residual at the end effector, in "
        "the base frame",
        "filter": str(options.filter),
        "motions": [result["log"] for result in results],
        "joints": list(robot.joint_names),
        "units": {"torque": [unit(robot, j) for j in range(robot.dof)], "force": ["N"] * 3 + ["N m"] * 3},
        "service": "franka_msgs/srv/SetFullCollisionBehavior",
        "request": request,
    }


def _rounded_up(values: Array) -> list[float]:
    """Four digits, never below the value."""
    out = []
    for value in values.tolist():
        short = float(f"{value:.4g}")
        out.append(short if short >= value else float(f"{value * 1.00051:.4g}"))
    return out


def events_csv(results: Sequence[dict[str, Any]]) -> str:
    """All events of all logs."""
    keys = ("start", "end", "joint", "side", "peak", "unit", "peak_time", "peak_effort", "effort_unit")
    rows = [[result["log"], *(event[key] for key in keys)] for result in results for event in result["events"]]
    return csv_text(["log", *keys], rows)
