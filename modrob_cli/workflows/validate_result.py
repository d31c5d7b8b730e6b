"""A validation as plain data for JSON, CSV and CI."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from modrob_cli.identify.regression_result import JointEstimate
from modrob_cli.io.junit import CheckCase, junit_text
from modrob_cli.model.joint import Joint
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.log_date import log_date
from modrob_cli.workflows.validate_judge import JudgedLog
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


def log_result(robot: Robot, source: str, log: JudgedLog, options: ValidateOptions) -> dict[str, Any]:
    """Everything about one log; ``source`` is its path or URL as it was given."""
    signals = log.run.signals
    return {
        "log": source,
        "date": log_date(log.item.log.start),
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
    width = float(np.mean((log.bounds.upper - log.bounds.lower)[log.used, j]))
    figures = {**asdict(log.errors[j]), "inside": float(log.inside[j]), "mean_width": width}
    estimate = None if log.estimates is None else log.estimates[j]
    return joint_entry(robot.joints[j], figures, estimate, log.fitted, options)


def joint_entry(
    joint: Joint, figures: dict[str, Any], estimate: JointEstimate | None, fitted: bool, options: ValidateOptions
) -> dict[str, Any]:
    """Everything about one joint of a log.

    Parameters
    ----------
    figures : its errors, ``inside`` and ``mean_width``
    estimate : friction that was fitted here; None if it comes from the file
    fitted : whether it was fitted to the samples that count
    """
    entry: dict[str, Any] = {"name": joint.name, **figures, "unit": "N m" if joint.type == "revolute" else "N"}
    judges = options.wants_verdict and (not fitted or options.accept_fitted)
    entry["passed"] = not failures(entry, options) if judges else None
    entry["notes"] = []
    if estimate is not None:
        entry["fit"] = {term: estimate.value(term) for term in TERMS}
        entry["notes"] += estimate.notes
        entry["notes"] += [f"{term}: {found.reason}" for term, found in estimate.estimates.items() if found.reason]
    return entry


def failures(joint: dict[str, Any], options: ValidateOptions) -> list[str]:
    """Conditions that a joint does not meet, in words."""
    found = []
    if options.max_nrmse is not None and not (joint["nrmse"] is not None and joint["nrmse"] <= options.max_nrmse):
        value = "no torque was recorded" if joint["nrmse"] is None else f"NRMSE {joint['nrmse']:.4g}"
        found.append(f"{value}, at most {options.max_nrmse:g} passes")
    if options.min_inside is not None and not joint["inside"] >= options.min_inside:
        found.append(f"{joint['inside']:.2%} inside the bounds, at least {options.min_inside:.2%} passes")
    return found


def passed(results: Sequence[dict[str, Any]], skipped: Sequence[object]) -> bool | None:
    """The verdict: None if nobody asked or nothing may judge; logs that were skipped cannot pass."""
    verdicts = [joint["passed"] for result in results for joint in result["joints"]]
    if all(verdict is None for verdict in verdicts):
        return None
    return not skipped and False not in verdicts


def junit(
    robot: Robot, results: Sequence[dict[str, Any]], skipped: Sequence[dict[str, Any]], options: ValidateOptions
) -> str:
    """One test for each joint of each log, and a failed one for each log that was skipped."""
    cases = []
    for result in results:
        for joint in result["joints"]:
            said = "; ".join(failures(joint, options)) or None
            ratio = "-" if joint["nrmse"] is None else f"{joint['nrmse']:.6g}"
            text = f"NRMSE {ratio}, RMSE {joint['rmse']:.6g} {joint['unit']}, inside {joint['inside']:.4f}"
            judged_here = joint["passed"] is not None
            cases.append(CheckCase(result["log"], joint["name"], said if judged_here else None, text, not judged_here))
    cases += [CheckCase(entry["log"], "readable", entry["reason"], entry["reason"]) for entry in skipped]
    return junit_text(f"modrob validate {robot.name}", cases)
