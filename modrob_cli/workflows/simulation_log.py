"""A simulated run as the log that a real robot would leave, with the truth beside it."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import controller_state, joint_perturbation, joint_state, joint_truth, wrench_stamped
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Contact, Scenario
from modrob_cli.simulate.recording import Recording, Run

START = 946_684_800 * 10**9
"""Time of the first sample, 2000-01-01T00:00:00Z [ns since 1970]: the same for all runs, so that equal runs are equal
files."""

JOINT_STATES, CONTROLLER_STATE, TRUTH, CONTACTS = "/joint_states", "/controller_state", "/truth", "/contacts"
PERTURBATION = "/perturbation"


def write_log(robot: Robot, run: Run, scenario: Scenario, notes: Mapping[str, str], path: Path) -> None:
    """Write the run as MCAP.

    ``/joint_states``: what the sensors gave; ``/controller_state``: desired, measured and the commanded torque;
    ``/truth``: what really happened; ``/contacts/NAME``: force of each contact in the base frame, zero outside its
    window; ``/perturbation``, where the controller bounds it: what its model lacks, and the bounds. ``notes`` become
    the metadata record ``modrob.simulation``, beside the labels of the contacts.

    Raises
    ------
    UsageError
        If the file cannot be written.
    """
    names, recording = robot.joint_names, run.recording
    values = recording.values
    stamps = START + np.round(recording.stamps * 1e9).astype(np.int64)
    measured = np.hstack([values["q_measured"], values["dq_measured"], values["effort"]])
    true = [values[key] for key in ("q", "dq", "ddq", "applied", "friction", "external")]
    series = [
        Series(JOINT_STATES, joint_state(names), stamps, measured),
        _controller_series(names, recording, stamps),
        Series(TRUTH, joint_truth(names), stamps, np.hstack(true)),
        *(_contact_series(robot, contact, recording, stamps) for contact in scenario.contacts),
    ]
    if "perturbation" in values:
        known = np.hstack([values[key] for key in ("perturbation", "phi_lower", "phi_upper")])
        series.append(Series(PERTURBATION, joint_perturbation(names), stamps, known))
    labels = [
        {"name": contact.name, "link": contact.link, "start": contact.start, "end": contact.end}
        for contact in scenario.contacts
    ]
    write_mcap(path, series, {"modrob.simulation": {**notes, "contacts": json.dumps(labels)}})


def _controller_series(names: tuple[str, ...], recording: Recording, stamps: Stamps) -> Series:
    values = recording.values
    desired, measured = recording.desired, (values["q_measured"], values["dq_measured"])
    error = [desired[:, k] - part for k, part in enumerate(measured)]
    parts = {
        "reference": ("positions", "velocities", "accelerations"),
        "feedback": ("positions", "velocities"),
        "error": ("positions", "velocities"),
        "output": ("effort",),
    }
    columns = [desired.reshape(-1, 3 * len(names)), *measured, *error, values["commanded"]]
    return Series(CONTROLLER_STATE, controller_state(names, parts), stamps, np.hstack(columns))


def _contact_series(robot: Robot, contact: Contact, recording: Recording, stamps: Stamps) -> Series:
    wrench = np.zeros((len(stamps), 6))
    wrench[:, :3] = contact_force(robot, contact, recording.t, recording.values["q"])
    return Series(f"{CONTACTS}/{contact.name}", wrench_stamped("base"), stamps, wrench)


def contact_force(robot: Robot, contact: Contact, t: Array, q: Array) -> Array:
    """Force of a contact in the base frame at times t (K,) and positions q (K, n), shape (K, 3), [N]."""
    size = contact.size(t)
    if contact.frame == "base" or contact.link == 0:
        return np.asarray(size[:, None] * contact.force)
    rotation = robot.link_frames(q)[:, contact.link - 1, :3, :3]
    return np.asarray(size[:, None] * (rotation @ contact.force))
