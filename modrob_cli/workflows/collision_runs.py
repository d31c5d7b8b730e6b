"""Logs and planned motions made ready for collision bands."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.collision.acceleration import measured_acceleration
from modrob_cli.collision.bands import UncertainMotion
from modrob_cli.collision.events import Contact
from modrob_cli.errors import Fault, InputFileError, NumericalError
from modrob_cli.identify.effort import effort_factors, holds_gravity
from modrob_cli.identify.run import prepare_run
from modrob_cli.identify.signal_cutoff import choose_cutoff
from modrob_cli.io.run_topics import RunTopics, TopicSeries, read_run
from modrob_cli.model.log import JointLog, Recording
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.trajectory_motion import TrajectoryMotion, load_trajectory

PLANNED = (".yaml", ".yml", ".json")
"""Files that hold planned motions; others are logs."""


@dataclass(frozen=True)
class CollisionRun:
    """One log or planned motion.

    Attributes
    ----------
    robot : as it counts for this log: without gravity where the effort is
    start : time of the first sample [ns since 1970]; 0 for a planned motion
    motion : with its half-widths; ``t`` counts from the first sample of the log
    tau : recorded joint torque, shape (N, n); None for a planned motion
    tau_noise : half-width of its noise, shape (n,)
    used : samples that count, shape (N,)
    contacts : known contacts; None if the log does not tell about any
    source : where accelerations come from, in words
    """

    path: Path
    name: str
    robot: Robot
    start: int
    motion: UncertainMotion
    tau: Array | None
    tau_noise: Array
    used: NDArray[np.bool_]
    contacts: tuple[Contact, ...] | None
    source: str
    notes: tuple[str, ...]


def load_run(robot: Robot, path: Path, name: str, options: CollisionOptions) -> CollisionRun:
    """Read one log or planned motion.

    Raises
    ------
    InputFileError
        If it cannot be read, or lacks what the options ask for.
    UsageError
        If the robot lacks constants that the effort needs, or options do not fit.
    NumericalError
        If the log is too short.
    """
    if path.suffix.lower() in PLANNED:
        return _planned(robot, path, name, options)
    recording, topics = read_run(path, robot.joint_names, options.reading)
    start, log = _complete(path, recording)
    model = robot if holds_gravity(options.effort) else replace(robot, gravity=np.zeros(3))
    factors = effort_factors(robot, options.effort)
    source = options.acceleration or ("desired" if options.desired is not None or topics.desired else None)
    common = (path, name, model, start)
    if source == "smoothed":
        run = _smoothed(common, log, options)
    elif source == "measured":
        run = _measured(common, log, factors, options)
    elif source == "desired":
        run = _desired(common, log, factors, options, topics)
    else:
        message = "the log has no topic of a controller with desired accelerations; give the planned motion with"
        message += " --desired, or say --acceleration measured or --acceleration smoothed"
        raise InputFileError(Fault(str(path), message))
    run = replace(run, contacts=_contacts(topics, start), notes=(*log.notes, *run.notes))
    return _without_start(run, options.skip) if options.skip else run


def _without_start(run: CollisionRun, skip: float) -> CollisionRun:
    """The run from ``skip`` seconds on."""
    motion, first = run.motion, int(np.searchsorted(run.motion.t, skip))
    if first >= len(motion.t):
        raise InputFileError(Fault(str(run.path), f"--skip {skip:g} leaves nothing of the log"))
    names = ("t", "q", "dq", "ddq", *(["ddq_rad"] if motion.ddq_rad.ndim == 2 else []))
    kept = {key: getattr(motion, key)[first:] for key in names}
    tau = None if run.tau is None else run.tau[first:]
    return replace(run, motion=replace(motion, **kept), tau=tau, used=run.used[first:])


def _complete(path: Path, recording: Recording) -> tuple[int, JointLog]:
    """Stamp of the first sample, and the samples with all positions and efforts."""
    if recording.effort is None:
        raise InputFileError(Fault(str(path), f"found no effort of {', '.join(recording.joint_names)}"))
    good = np.asarray(np.isfinite(recording.q).all(axis=1) & np.isfinite(recording.effort).all(axis=1))
    if np.count_nonzero(good) < 2:
        message = f"found {np.count_nonzero(good)} samples with positions and efforts of all joints, expected 2 or more"
        raise InputFileError(Fault(str(path), message))
    notes = list(recording.notes)
    if not good.all():
        notes.append(f"{np.count_nonzero(~good)} of {len(good)} samples lack a position or an effort and were left out")
    stamps = recording.stamps[good]
    dq = recording.dq[good] if recording.dq is not None else None
    if dq is not None and not np.isfinite(dq).all():
        notes.append("velocities are missing in some samples and count as not recorded")
        dq = None
    t = (stamps - stamps[0]) / 1e9
    arrays = (recording.q[good], dq, recording.effort[good])
    log = JointLog(recording.name, recording.joint_names, t, *arrays, recording.repeated, tuple(notes))
    steps = np.diff(t)
    if steps.max() > 1.5 * np.median(steps):
        gap = f"the longest step is {steps.max():.4g} s, the median one {np.median(steps):.4g} s"
        log = replace(log, notes=(*log.notes, f"{gap}; filters count samples, not seconds"))
    return int(stamps[0]), log


Common = tuple[Path, str, Robot, int]


def _run(
    common: Common,
    options: CollisionOptions,
    t: Array,
    states: Sequence[Array],
    ddq_rad: Array,
    tau: Array,
    source: str,
) -> CollisionRun:
    robot = common[2]
    radii = options.radii(robot)
    motion = UncertainMotion(t, states[0], states[1], states[2], radii["q"], radii["dq"], ddq_rad)
    noise = radii["effort"] * effort_factors(robot, options.effort)
    return CollisionRun(*common, motion, tau, noise, np.ones(len(t), dtype=bool), None, source, ())


def _smoothed(common: Common, log: JointLog, options: CollisionOptions) -> CollisionRun:
    robot = common[2]
    cutoff = options.cutoff or choose_cutoff(log).cutoff
    run = prepare_run(robot, log, options.effort, cutoff)
    joints = tuple(
        joint
        if joint.friction.velocity_band > 0.0
        else replace(joint, friction=replace(joint.friction, velocity_band=float(band)))
        for joint, band in zip(robot.joints, run.standstill, strict=True)
    )
    inside = np.flatnonzero(run.used)
    part = slice(inside[0], inside[-1] + 1)
    states = (run.q[part], run.dq[part], run.ddq[part])
    source = f"positions and velocities low-passed at {cutoff:.4g} Hz without phase shift (not causal)"
    common = (*common[:2], replace(robot, joints=joints), common[3])
    made = _run(common, options, run.t[part], states, options.radii(robot)["ddq"], run.tau[part], source)
    return replace(made, used=run.used[part])


def _velocities(path: Path, log: JointLog) -> Array:
    if log.dq is None:
        message = "the log has no velocities; say --acceleration smoothed, which derives them from the positions"
        raise InputFileError(Fault(str(path), message))
    return log.dq


def _measured(common: Common, log: JointLog, factors: Array, options: CollisionOptions) -> CollisionRun:
    robot, dq = common[2], _velocities(common[0], log)
    ddq, tolerance, first = measured_acceleration(log.t, dq, options.velocity_knowledge(robot))
    part = slice(first, None)
    states = (log.q[part], dq[part], ddq[part])
    widths = ", ".join(f"{value:.3g}" for value in np.median(tolerance[part], axis=0))
    source = f"backward differences of the measured velocity, known to +- {widths} (median)"
    return _run(common, options, log.t[part], states, tolerance[part], log.effort[part] * factors, source)


def _desired(
    common: Common, log: JointLog, factors: Array, options: CollisionOptions, topics: RunTopics
) -> CollisionRun:
    path, _, robot, start = common
    dq = _velocities(path, log)
    if options.ddq_tolerance is None:
        message = "how far real accelerations may be from the desired ones has to be said: --ddq-tolerance"
        raise InputFileError(Fault(str(path), f"{message} [rad/s^2, m/s^2] (0 for not at all)"))
    if options.desired is not None:
        ddq, inside = _from_file(options.desired, options.desired_start, robot, log.t)
        source = f"desired, from {options.desired.name}"
    else:
        series = _controller_topic(path, topics, robot)
        ddq, inside = _from_topic(path, series, robot, log.t, start)
        source = f"desired, from {series.topic}"
    where = np.flatnonzero(inside)
    if not len(where):
        raise InputFileError(Fault(str(path), "the desired motion and the log have no time in common"))
    part = slice(where[0], where[-1] + 1)
    states = (log.q[part], dq[part], ddq[part])
    tolerance = options.radii(robot)["ddq"]
    run = _run(common, options, log.t[part], states, tolerance, log.effort[part] * factors, source)
    left = len(log.t) - len(run.motion.t)
    return replace(run, notes=(f"{left} samples outside the desired motion were left out",)) if left else run


def _from_file(desired: Path, start: float, robot: Robot, t: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Desired accelerations at the times of the log, and where the motion reaches."""
    trajectory = load_trajectory(desired, robot).trajectory
    since = t - start
    # A sample that is late by rounding or jitter still belongs to the end.
    slack = 0.5 * float(np.median(np.diff(t)))
    inside = (since >= -slack) & (since <= trajectory.duration + slack)
    with np.errstate(all="ignore"):
        ddq = trajectory.sample(np.clip(since, 0.0, trajectory.duration), 2)[:, 2]
    if not np.isfinite(ddq).all():
        raise NumericalError("the desired motion has accelerations beyond the range of numbers")
    return ddq, np.asarray(inside)


def _controller_topic(path: Path, topics: RunTopics, robot: Robot) -> TopicSeries:
    fitting = [series for series in topics.desired if set(robot.joint_names) <= set(series.names)]
    if len(fitting) != 1:
        found = ", ".join(series.topic for series in topics.desired) or "none"
        message = f"found controller topics {found}, expected one with all joints of the robot"
        raise InputFileError(Fault(str(path), f"{message}; give the planned motion with --desired"))
    series = fitting[0]
    columns = [series.names.index(name) for name in robot.joint_names]
    if not np.isfinite(series.values[2][:, columns]).all():
        message = f"{series.topic} has no desired accelerations (or not in all messages)"
        raise InputFileError(Fault(str(path), f"{message}; give the planned motion with --desired"))
    return series


def _from_topic(path: Path, series: TopicSeries, robot: Robot, t: Array, start: int) -> tuple[Array, NDArray[np.bool_]]:
    """Desired accelerations at the times of the log, along straight lines between messages."""
    own = (series.stamps - start) / 1e9
    if len(own) < 2:
        raise InputFileError(Fault(str(path), f"{series.topic} has {len(own)} messages, expected 2 or more"))
    columns = [series.names.index(name) for name in robot.joint_names]
    ddq = np.stack([np.interp(t, own, series.values[2][:, k]) for k in columns], axis=1)
    slack = 0.5 * float(np.median(np.diff(own)))
    return ddq, np.asarray((t >= own[0] - slack) & (t <= own[-1] + slack))


def _planned(robot: Robot, path: Path, name: str, options: CollisionOptions) -> CollisionRun:
    loaded = load_trajectory(path, robot)
    pieces = list(TrajectoryMotion(loaded.trajectory, options.rate, loaded.warnings))
    t, *states = (np.concatenate([getattr(piece, key) for piece in pieces]) for key in ("t", "q", "dq", "ddq"))
    run = _run(
        (path, name, robot, 0), options, t, states, options.radii(robot)["ddq"], np.zeros_like(states[0]), "planned"
    )
    return replace(run, tau=None, notes=loaded.warnings)


def _contacts(topics: RunTopics, start: int) -> tuple[Contact, ...] | None:
    """Windows in which contacts push, by their topics; None if nothing tells."""
    if not topics.labelled:
        return None
    out = []
    for series in topics.contacts:
        t = (series.stamps - start) / 1e9
        step = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
        edges = np.flatnonzero(np.diff(np.concatenate([[False], series.active, [False]]).astype(int)))
        for first, after in edges.reshape(-1, 2):
            out.append(Contact(series.name, float(t[first]), float(t[after - 1]) + step))
    return tuple(sorted(out, key=lambda contact: contact.start))
