"""Planned motions as MCAP: joint states as samples, and the whole motion as one JointTrajectory message."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.errors import UsageError
from modrob_cli.io.given_motion import MOST_POINTS
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import joint_state, joint_trajectory
from modrob_cli.workflows.trajectory_motion import TrajectoryMotion

STATES_TOPIC, MOTION_TOPIC = "/desired/joint_states", "/joint_trajectory"
MOST_SAMPLES = 2_000_000
"""More would need gigabytes of memory."""

_LONGEST = 2.0**31
_NANOSECOND = 1e-9


def check_fits(motion: TrajectoryMotion) -> None:
    """Make sure before the work that an MCAP file can hold the motion.

    Raises
    ------
    UsageError
        If it has too many samples, or times that its messages cannot hold.
    """
    advice = "lower --rate, or choose --format csv"
    if motion.samples > MOST_SAMPLES:
        raise UsageError(f"found {motion.samples} samples, at most {MOST_SAMPLES} are possible in MCAP; {advice}")
    if not motion.trajectory.duration < _LONGEST or motion.rate * _NANOSECOND > 1.0:
        raise UsageError(f"the times of messages are whole nanoseconds up to {_LONGEST:.0f} s; {advice}")


def write_motion_mcap(
    path: Path, motion: TrajectoryMotion, joint_names: Sequence[str] | None, provenance: dict[str, Any]
) -> list[str]:
    """Write the samples; returns what a user has to know.

    Without names the states call the joints ``joint1`` and so on, and the trajectory names none: it is read by order.

    Raises
    ------
    NumericalError
        If a value is not finite.
    """
    pieces = list(motion)
    t = np.concatenate([piece.t for piece in pieces])
    values = np.hstack([np.concatenate([getattr(piece, key) for piece in pieces]) for key in ("q", "dq", "ddq")])
    n = motion.trajectory.dof
    stamps = np.rint(t / _NANOSECOND).astype(np.int64)
    names = joint_names or [f"joint{j + 1}" for j in range(n)]
    series = [Series(STATES_TOPIC, joint_state(names, effort=False), stamps, values[:, : 2 * n])]
    warnings = []
    if not (np.diff(stamps) > 0).all() or len(stamps) > MOST_POINTS:
        warnings.append(f"{MOTION_TOPIC} was left out: more than {MOST_POINTS} points, or less than 1 ns between two")
    else:
        layout = joint_trajectory(joint_names or (), stamps, joints=n)
        series.append(Series(MOTION_TOPIC, layout, stamps[:1], values.reshape(1, -1)))
    inputs: dict[str, str] = provenance["inputs"]
    write_mcap(path, series, {"modrob": {"version": provenance["modrob"]}, "inputs": inputs})
    return warnings
