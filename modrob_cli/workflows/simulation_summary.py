"""What a simulated run amounts to, as plain data."""

import json
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Scenario
from modrob_cli.simulate.perturbation import violations
from modrob_cli.simulate.recording import Run
from modrob_cli.simulate.truth import TrueRobot


def run_summary(robot: Robot, run: Run, scenario: Scenario) -> dict[str, Any]:
    """Errors, torques and events of a run; see ``docs/simulate.md``."""
    recording = run.recording
    error = recording.values["q"] - recording.desired[:, 0]
    norm = np.linalg.norm(error, axis=1)
    return {
        "samples": len(recording.t),
        "diverged": run.diverged,
        "error_norm": {"rms": _rms(norm), "max": _largest(norm)},
        "joints": [_joint(robot, run, error, j) for j in range(robot.dof)],
        "end_stops": [{"joint": robot.joints[hit.joint].name, "time": hit.t, "speed": hit.speed} for hit in run.hits],
        "contacts": [_contact(robot, run, scenario, k) for k in range(len(scenario.contacts))],
        "energy_error": run.energy_error,
        "perturbation": _perturbation(robot, run, scenario),
        "truth": truth_summary(run.truth),
    }


def _joint(robot: Robot, run: Run, error: Array, j: int) -> dict[str, Any]:
    recording, joint = run.recording, robot.joints[j]
    applied = recording.values["applied"][:, j]
    revolute = joint.type == "revolute"
    return {
        "name": joint.name,
        "unit": "rad" if revolute else "m",
        "rms_error": _rms(error[:, j]),
        "max_error": _largest(error[:, j]),
        "max_error_time": float(recording.t[np.argmax(np.abs(error[:, j]))]) if len(error) else None,
        "torque_unit": "N m" if revolute else "N",
        "rms_torque": _rms(applied),
        "max_torque": _largest(applied),
        "saturated": float(run.saturated[j]),
    }


def _rms(values: Array) -> float | None:
    """Root of the mean square; None without samples or beyond the range of numbers."""
    return _finite(float(np.sqrt(np.mean(values**2)))) if len(values) else None


def _largest(values: Array) -> float | None:
    return _finite(float(np.abs(values).max())) if len(values) else None


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _contact(robot: Robot, run: Run, scenario: Scenario, k: int) -> dict[str, Any]:
    contact = scenario.contacts[k]
    t, external = run.recording.t, run.recording.values["external"]
    inside = (t >= contact.start) & (t < contact.end)
    largest = np.abs(external[inside]).max(axis=0) if inside.any() else np.zeros(robot.dof)
    return {
        "name": contact.name,
        "link": contact.link,
        "start": contact.start,
        "end": contact.end,
        "force": float(np.linalg.norm(contact.force)),
        "largest_torque": dict(zip(robot.joint_names, largest.tolist(), strict=True)),
    }


def _perturbation(robot: Robot, run: Run, scenario: Scenario) -> dict[str, Any] | None:
    """How the true perturbation lies in the controller's bounds; None for controllers without."""
    values = run.recording.values
    if "perturbation" not in values:
        return None
    w, lower, upper = (values[key] for key in ("perturbation", "phi_lower", "phi_upper"))
    counts, beyond = violations(w, lower, upper)
    joints = [
        {
            "name": joint.name,
            "mean_width": _finite(float((upper - lower)[:, j].mean())),
            "max_perturbation": _largest(w[:, j]),
            "violations": int(counts[j]),
            "largest_violation": _finite(float(beyond[j])),
        }
        for j, joint in enumerate(robot.joints)
    ]
    return {"bounds": scenario.control.bounds, "violations": int(counts.sum()), "joints": joints}


def truth_summary(truth: TrueRobot) -> dict[str, Any]:
    """True parameters by name of the body and of the joint."""
    bodies = [
        {
            "name": placed.body.name,
            "mass": float(placed.body.mass.nominal),
            "com": placed.body.com.nominal.tolist(),
            "inertia": placed.body.inertia.nominal.tolist(),
        }
        for placed in truth.robot.bodies
        if not placed.body.is_massless
    ]
    joints = [
        {
            "name": joint.name,
            "viscous": float(joint.friction.viscous.nominal),
            "coulomb": float(joint.friction.coulomb.nominal),
            "breakaway": float(truth.breakaway[j]),
            "rotor_inertia": float(joint.drive.rotor_inertia.nominal),
            "offset": float(truth.offset[j]),
        }
        for j, joint in enumerate(truth.robot.joints)
    ]
    return {"bodies": bodies, "joints": joints, "kept_nominal": list(truth.nominal_bodies)}


def truth_text(truth: TrueRobot) -> str:
    """The same as JSON text, for the log."""
    return json.dumps(truth_summary(truth), allow_nan=False)
