"""The result of an identification as plain data for JSON and CSV."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from modrob_cli.identify.prediction_pooled import PooledError
from modrob_cli.identify.regression_result import JointEstimate
from modrob_cli.identify.run import Run
from modrob_cli.io.csv_writer import csv_text
from modrob_cli.model.joint import Joint
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.identify_fit import Fitted, reasons_against
from modrob_cli.workflows.identify_runs import Parts
from modrob_cli.workflows.log_date import log_date

UNITS = {
    "offset": ("N m", "N"),
    "coulomb": ("N m", "N"),
    "viscous": ("N m s/rad", "N s/m"),
    "reflected_inertia": ("kg m^2", "kg"),
    "rotor_inertia": ("kg m^2", "kg m^2"),
    "asymmetric": ("N m s/rad", "N s/m"),
    "coulomb_forward": ("N m", "N"),
    "coulomb_backward": ("N m", "N"),
    "viscous_forward": ("N m s/rad", "N s/m"),
    "viscous_backward": ("N m s/rad", "N s/m"),
    "load": ("-", "-"),
    "stribeck": ("N m", "N"),
    "stribeck_velocity": ("rad/s", "m/s"),
    "transition_width": ("rad/s", "m/s"),
    "drive_gain": ("N m/A", "N/A"),
}
"""Units of the parameters of revolute and prismatic joints."""

MAIN = ("viscous", "coulomb", "rotor_inertia", "offset")
"""Parameters that every joint's entry has, null where the motion does not tell them."""


def joint_entry(robot: Robot, j: int, fitted: Fitted, runs: Sequence[Run]) -> dict[str, Any]:
    """Everything about one joint."""
    joint, estimate = robot.joints[j], fitted.estimates[j]
    reasons = reasons_against(robot, fitted, j)
    partner = fitted.couplings[j]
    return {
        "name": joint.name,
        "type": joint.type,
        "unit": unit(joint, "offset"),
        **parameters(joint, estimate),
        "explained": not reasons,
        "reasons": reasons,
        "coupled_with": None if partner is None else robot.joints[partner.joint].name,
        "training": error_entry(fitted.train, j),
        "holdout": error_entry(fitted.test, j),
        "condition": estimate.condition,
        "correlation": {"terms": list(estimate.terms), "matrix": estimate.correlation.tolist()},
        "samples": estimate.samples,
        "effective_samples": estimate.effective_samples,
        "stderr_bandwidth": estimate.bandwidth,
        "outliers": estimate.outliers,
        "residual_rms": estimate.rms,
        "standstill": max(float(run.standstill[j]) for run in runs),
        "transition_width": estimate.width,
        "offsets": dict(estimate.offsets),
        "notes": list(estimate.notes),
    }


def parameters(joint: Joint, estimate: JointEstimate) -> dict[str, Any]:
    """Values, standard errors and intervals by name; the rotor at the motor and as the joint feels it."""
    values: dict[str, Any] = dict.fromkeys((*MAIN, "reflected_inertia"))
    stderr: dict[str, Any] = {}
    interval: dict[str, Any] = {}
    dof: dict[str, Any] = {}
    absent = {}
    for term, found in estimate.estimates.items():
        if found.value is None:
            absent[term] = found.reason
            continue
        for name, factor in _names(joint, term):
            values[name] = found.value * factor
            stderr[name] = None if found.stderr is None else found.stderr * factor
            interval[name] = None if found.interval is None else [end * factor for end in found.interval]
            dof[name] = found.dof
    if "reflected_inertia" in absent:
        absent["rotor_inertia"] = absent["reflected_inertia"]
    constrained = estimate.constrained
    if constrained is not None and "reflected_inertia" in constrained:
        names = _names(joint, "reflected_inertia")
        constrained = {**constrained, **{name: constrained["reflected_inertia"] * factor for name, factor in names}}
    return {
        **values,
        "gear_ratio": joint.drive.gear_ratio,
        "rotor_inertia_side": rotor_side(joint),
        "stderr": stderr,
        "interval": interval,
        "dof": dof,
        "not_excited": absent,
        "kept_from_robot": dict(estimate.held),
        "physical": constrained is None,
        "constrained": constrained,
    }


def rotor_side(joint: Joint) -> str:
    """Which side the key ``rotor_inertia`` refers to."""
    return "joint" if joint.drive.gear_ratio == 1.0 else "motor"


def unit(joint: Joint, name: str) -> str:
    """Unit of a parameter of a joint."""
    if name == "rotor_inertia" and joint.drive.gear_ratio == 1.0:
        name = "reflected_inertia"
    return UNITS[name][0 if joint.type == "revolute" else 1]


def _names(joint: Joint, term: str) -> list[tuple[str, float]]:
    """Names under which a term is reported, with the factor to each one's side."""
    if term != "reflected_inertia":
        return [(term, 1.0)]
    square = joint.drive.gear_ratio**2
    return [(term, 1.0), ("rotor_inertia", 1.0 / square)] if square > 0.0 else [(term, 1.0)]


def error_entry(errors: list[PooledError] | None, j: int) -> dict[str, Any] | None:
    """Errors of one joint; None if there is nothing to compare with."""
    if errors is None:
        return None
    found = errors[j]
    return {
        "rmse": found.error.rmse,
        "nrmse": found.error.nrmse,
        "nrmse_low_passed": found.error.nrmse_low_passed,
        "max_error": found.error.max_error,
        "worst_time": found.error.worst_time,
        "worst_log": found.worst_log,
        "samples": found.samples,
    }


def log_facts(log: JointLog) -> dict[str, Any]:
    """What a log is, as it was read."""
    return {
        "date": log_date(log.start),
        "duration": float(log.t[-1]),
        "samples": len(log.t),
        "rate": 1.0 / float(np.median(np.diff(log.t))),
        "velocity": "recorded" if log.dq is not None else "differentiated",
        "repeated_stamps": log.repeated,
        "notes": list(log.notes),
    }


def part_facts(parts: Parts) -> dict[str, Any]:
    """What of a log counts, made ready with some cut-off."""
    return {
        "samples_fitted": int(parts.train.used.sum()),
        "samples_held_out": int(parts.test.used.sum()),
        "resampled": parts.whole.signals.resampled,
        "longest_gap": parts.whole.signals.gap,
    }


def glitch_notes(run: Run) -> list[str]:
    """What was repaired, in words."""
    return [f"{run.glitches} single wild samples of position or velocity were replaced"] if run.glitches else []


def fit_entry(robot: Robot, fitted: Fitted) -> list[dict[str, Any]]:
    """Parameters and errors of a fit to one log, joint by joint."""
    return [
        {
            "name": joint.name,
            "type": joint.type,
            **parameters(joint, fitted.estimates[j]),
            "training": error_entry(fitted.train, j),
            "holdout": error_entry(fitted.test, j),
        }
        for j, joint in enumerate(robot.joints)
    ]


def prediction_entry(robot: Robot, errors: list[PooledError] | None) -> list[dict[str, Any]] | None:
    """How the pooled fit predicts one log, joint by joint; None without a sample to judge by."""
    if errors is None:
        return None
    return [{"name": joint.name, **(error_entry(errors, j) or {})} for j, joint in enumerate(robot.joints)]


def parameters_csv(robot: Robot, fits: Sequence[tuple[str, Sequence[dict[str, Any]]]]) -> str:
    """Table of all parameters of some fits, each with its name and entries of its joints."""
    header = ("log", "joint", "parameter", "unit", "side", "value", "stderr", "lower", "upper", "verdict")
    rows: list[tuple[object, ...]] = []
    for name, entries in fits:
        for joint, found in zip(robot.joints, entries, strict=True):
            rows += [(name, joint.name, *row) for row in _rows(joint, found)]
    return csv_text(header, rows)


def _rows(joint: Joint, found: dict[str, Any]) -> Iterator[tuple[object, ...]]:
    for name in UNITS:
        side = rotor_side(joint) if name == "rotor_inertia" else "joint"
        lower, upper = found["interval"].get(name) or (None, None)
        if found.get(name) is not None:
            figures = (found[name], found["stderr"].get(name), lower, upper, "estimated")
        elif name in found["not_excited"]:
            figures = (None, None, None, None, f"not excited: {found['not_excited'][name]}")
        else:
            continue
        yield name, unit(joint, name), side, *figures
