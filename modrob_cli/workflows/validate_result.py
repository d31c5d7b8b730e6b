"""A validation as plain data for JSON, CSV and CI."""

from dataclasses import asdict
from typing import Any

import numpy as np

from modrob_cli.io.junit import CheckCase, junit_text
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.validate_judge import Judged, JudgedLog
from modrob_cli.workflows.validate_options import ValidateOptions

TERMS = ("offset", "coulomb", "viscous", "reflected_inertia")

SCOPES = {
    "file": (
        "The robot file as it is, friction and rotors included, against every sample that it was not fitted to. It "
        "shows how well this file predicts these logs."
    ),
    "held-out": (
        "Offset, Coulomb and viscous friction and rotor inertia of each joint were fitted to the first part of each "
        "log on top of the rigid bodies of the file, and judged on the rest, which the fit did not see. It shows how "
        "well this model, once fitted, predicts motions like these."
    ),
    "in-sample": (
        "In-sample fit: offset, Coulomb and viscous friction and rotor inertia of each joint were fitted to the same "
        "samples that the errors count, on top of the rigid bodies of the file. It shows how well the model can "
        "explain a log, not how well it predicts another one."
    ),
}


def log_result(robot: Robot, log: JudgedLog, options: ValidateOptions) -> dict[str, Any]:
    """Everything about one log."""
    signals = log.run.signals
    return {
        "log": str(log.item.path),
        "joints": [_joint(robot, log, j, options) for j in range(robot.dof)],
        "duration": float(log.item.log.t[-1]),
        "samples": len(log.item.log.t),
        "samples_used": int(log.used.sum()),
        "fitted_to_these_samples": log.fitted,
        "seconds_left_out": log.excluded,
        "repeated_stamps": log.item.log.repeated,
        "notes": list(log.item.log.notes),
        "rate": signals.rate,
        "resampled": signals.resampled,
        "longest_gap": signals.gap,
        "cutoff": signals.cutoff,
        "velocity": "recorded" if log.item.log.dq is not None else "differentiated",
        "effort": options.effort,
    }


def _joint(robot: Robot, log: JudgedLog, j: int, options: ValidateOptions) -> dict[str, Any]:
    joint, error = robot.joints[j], log.errors[j]
    entry: dict[str, Any] = {"name": joint.name, **asdict(error), "inside": float(log.inside[j])}
    entry["unit"] = "N m" if joint.type == "revolute" else "N"
    entry["mean_width"] = float(np.mean((log.bounds.upper - log.bounds.lower)[log.used, j]))
    entry["passed"] = None if not judges(log, options) else not failures(entry, options)
    if log.estimates is not None:
        estimate = log.estimates[j]
        entry["fit"] = {term: estimate.value(term) for term in TERMS}
        entry["notes"] = list(estimate.notes)
        entry["notes"] += [f"{term}: {found.reason}" for term, found in estimate.estimates.items() if found.reason]
    else:
        entry["notes"] = []
    return entry


def judges(log: JudgedLog, options: ValidateOptions) -> bool:
    """Whether this log gives a verdict."""
    return options.wants_verdict and (not log.fitted or options.accept_fitted)


def failures(joint: dict[str, Any], options: ValidateOptions) -> list[str]:
    """Conditions that a joint does not meet, in words."""
    found = []
    if options.max_nrmse is not None and not (joint["nrmse"] is not None and joint["nrmse"] <= options.max_nrmse):
        value = "no torque was recorded" if joint["nrmse"] is None else f"NRMSE {joint['nrmse']:.4g}"
        found.append(f"{value}, at most {options.max_nrmse:g} passes")
    if options.min_inside is not None and not joint["inside"] >= options.min_inside:
        found.append(f"{joint['inside']:.2%} inside the bounds, at least {options.min_inside:.2%} passes")
    return found


def passed(judged: Judged, results: list[dict[str, Any]], options: ValidateOptions) -> bool | None:
    """The verdict: None if nobody asked or nothing may judge; logs that were skipped cannot pass."""
    if not any(judges(log, options) for log in judged.logs):
        return None
    joints = [joint for result in results for joint in result["joints"]]
    return not judged.skipped and all(joint["passed"] is not False for joint in joints)


def junit(robot: Robot, results: list[dict[str, Any]], judged: Judged, options: ValidateOptions) -> str:
    """One test for each joint of each log, and a failed one for each log that was skipped."""
    cases = []
    for result in results:
        for joint in result["joints"]:
            said = "; ".join(failures(joint, options)) or None
            ratio = "-" if joint["nrmse"] is None else f"{joint['nrmse']:.6g}"
            text = f"NRMSE {ratio}, RMSE {joint['rmse']:.6g} {joint['unit']}, inside {joint['inside']:.4f}"
            judged_here = joint["passed"] is not None
            cases.append(CheckCase(result["log"], joint["name"], said if judged_here else None, text, not judged_here))
    cases += [CheckCase(str(path), "readable", reason, reason) for path, reason in judged.skipped]
    return junit_text(f"modrob validate {robot.name}", cases)
