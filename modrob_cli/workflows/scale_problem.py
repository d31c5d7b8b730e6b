"""What ``modrob scale`` is asked: robot, motion, limits, and how torques are bounded."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.interval_tight import tight_intervals
from modrob_cli.dynamics.drive_torque import torque_limits
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.dynamics.width_share import without_width
from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.model.robot import Robot
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import Curve
from modrob_cli.model.trajectory_extremes import extremes, violations
from modrob_cli.scaling.sampled import MakeRanges
from modrob_cli.scaling.scaled_torque import ScaledTorques, TorqueRanges
from modrob_cli.scaling.split_torque import SplitTorques
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.trajectory_motion import MOST_SAMPLES, LoadedTrajectory, load_trajectory

Method = Literal["exact", "ianea", "nominal"]
METHODS: tuple[Method, ...] = ("nominal", "exact", "ianea")
Range = tuple[float, float]
LimitList = tuple[Range | None, ...]
LIMITED = ("torque", "current", "velocity", "acceleration", "jerk")
JUMP = 1e-6
"""A jump of acceleration, relative to the largest acceleration of the joint, that is no rounding."""
_SHOWN = 3


@dataclass(frozen=True)
class ScaleOptions:
    """How a motion is to be scaled.

    Attributes
    ----------
    limits : by quantity of LIMITED, one range or one for each joint, which replace those of the robot's file; None in
        place of a range: no limit
    min_factor, max_factor : range of factors
    rate : samples per second
    gap : how far a proven factor may be below that at the samples, relative
    """

    method: Method = "exact"
    certify: bool = False
    gap: float = 1e-4
    min_factor: float = 0.01
    max_factor: float = 10.0
    rate: float = 1000.0
    limits: tuple[tuple[str, LimitList], ...] = ()

    def check(self) -> None:
        """Make sure that the numbers make sense.

        Raises
        ------
        UsageError
            If one does not, or options do not go together.
        """
        if not 0.0 < self.min_factor < self.max_factor or not np.isfinite(self.max_factor):
            found = f"found {self.min_factor:g} and {self.max_factor:g}"
            raise UsageError(f"--min-factor, --max-factor: {found}, expected 0 < smallest < largest")
        if not 0.0 < self.gap < 1.0:
            raise UsageError(f"--gap: found {self.gap:g}, expected a number between 0 and 1, such as 0.001")
        if not (self.rate > 0.0 and np.isfinite(self.rate)):
            raise UsageError(f"--rate: found {self.rate:g}, expected a number > 0 [Hz]")
        if self.certify and self.method != "exact":
            raise UsageError(f"--certify proves with --method exact, not with {self.method}")

    @property
    def data(self) -> dict[str, Any]:
        """As plain data."""
        limits = {name: None if ranges is None else list(map(_range_data, ranges)) for name, ranges in self.limits}
        return {**asdict(self), "limits": limits}


def _range_data(item: Range | None) -> list[float] | None:
    return None if item is None else list(item)


@dataclass(frozen=True)
class ScaleProblem:
    """Everything that the answer depends on.

    Attributes
    ----------
    robot : with the limits that count
    low, high : limits of the motor torque at the joints, shape (n,), infinite where there is none
    files : that robot and motion were read from
    """

    robot: Robot
    loaded: LoadedTrajectory
    options: ScaleOptions
    low: Array
    high: Array
    files: list[Path]

    @property
    def limits(self) -> tuple[Array, Array]:
        """Torque limits, lower and upper."""
        return self.low, self.high

    @property
    def trajectory(self) -> Trajectory:
        """The motion."""
        return self.loaded.trajectory


def read_problem(robot_path: Path, motion_path: Path, options: ScaleOptions, topic: str | None = None) -> ScaleProblem:
    """Read robot and motion, and put the limits together.

    Raises
    ------
    InputFileError
        If a file cannot be used, limits are missing or make no sense, or the joints do not match.
    UsageError
        If options make no sense.
    """
    options.check()
    loaded = load_robot(robot_path)
    motion = load_trajectory(motion_path, loaded.robot, topic)
    robot = _with_limits(loaded.robot, options)
    dropped = {name for name, ranges in options.limits if None in ranges}
    faults = [Fault(str(robot_path), message) for message in _limit_faults(robot, dropped)]
    if faults:
        raise InputFileError(faults)
    steps = motion.trajectory.duration * options.rate
    if not steps <= MOST_SAMPLES:
        raise UsageError(f"--rate: {steps:.3g} samples, at most {MOST_SAMPLES:.0e} are possible")
    return ScaleProblem(robot, motion, options, *torque_limits(robot), [*loaded.files, motion_path])


def _with_limits(robot: Robot, options: ScaleOptions) -> Robot:
    """Put limits of the command line in place of those of the file.

    Raises
    ------
    UsageError
        If their number does not fit, or one makes no sense.
    """
    joints = list(robot.joints)
    for name, ranges in options.limits:
        option = f"--{name}-limits"
        if len(ranges) not in (1, robot.dof):
            expected = f"expected one, or one for each of the {robot.dof} joints"
            raise UsageError(f"{option}: found {len(ranges)} limits, {expected}")
        for j, item in enumerate(ranges if len(ranges) == robot.dof else ranges * robot.dof):
            wrong = None if item is None else _fault_of(item)
            if wrong is not None:
                raise UsageError(f"{option}: {robot.joints[j].name}: {wrong}")
            joints[j] = replace(joints[j], limits=replace(joints[j].limits, **{name: item}))
    return replace(robot, joints=tuple(joints))


def _fault_of(item: Range) -> str | None:
    low, high = item
    if low > high or low > 0.0 or high < 0.0:
        return f"found {low:g} .. {high:g}, expected lower <= 0 <= upper (are signs or order swapped?)"
    if low == high:
        return "found a limit of zero, with which the joint cannot move; expected a range"
    return None


def _limit_faults(robot: Robot, dropped: set[str]) -> Iterator[str]:
    """What is wrong with limits of the robot; ``dropped``: quantities that the user wants without limits."""
    missing = []
    for joint in robot.joints:
        for name in LIMITED:
            item = getattr(joint.limits, name)
            wrong = None if item is None else _fault_of(item)
            if wrong is not None:
                yield f"{name} limit of {joint.name}: {wrong}"
        limits = joint.limits
        if limits.current is not None and joint.drive.torque_constant is None:
            yield f"{joint.name} has a current limit but no torque_constant; give it, or --current-limits none"
        if limits.torque is None and limits.current is None and not dropped & {"torque", "current"}:
            missing.append(joint.name)
    if missing:
        expected = "expected limits: {torque: ...} or {current: ...} in the file, or --torque-limits, --current-limits"
        yield f"no torque or current limit for {', '.join(missing)}; {expected} (none: there is no limit)"


def motion_warnings(problem: ScaleProblem) -> Iterator[str]:
    """Warnings of the file, jumps of acceleration unless these tell of them, and positions out of range."""
    loaded, robot = problem.loaded, problem.robot
    yield from loaded.warnings
    if not any("jumps" in text for text in loaded.warnings):
        yield from _jumps(loaded.trajectory, robot)
    for violation in violations(loaded.trajectory, robot):
        if violation.quantity == "position":
            name, (low, high) = robot.joints[violation.joint].name, violation.limit
            reached = f"{name} reaches {violation.value:.6g} at t = {violation.time:.6g} s"
            yield f"{reached}, outside of its position limits {low:.6g} .. {high:.6g}; no factor changes that"


def acceleration_jumps(curve: Curve) -> NDArray[np.bool_]:
    """At which inner knots the acceleration jumps, shape (m - 1,)."""
    knots = curve.knots[1:-1]
    most = extremes(curve, 2)
    jump = np.abs(curve.derivative(knots, 2) - curve.derivative(knots, 2, before=True))
    return np.asarray(jump > JUMP * max(abs(most.low), abs(most.high)))


def _jumps(trajectory: Trajectory, robot: Robot) -> Iterator[str]:
    for joint, curve in zip(robot.joints, trajectory.curves, strict=True):
        knots = curve.knots[1:-1]
        wrong = np.flatnonzero(acceleration_jumps(curve))
        if len(wrong):
            places = ", ".join(f"{knots[k]:.6g}" for k in wrong[:_SHOWN]) + (", ..." if len(wrong) > _SHOWN else "")
            yield (
                f"the acceleration of {joint.name} jumps at t = {places} s: torques are bounded on both sides of a "
                "jump, but an arm cannot follow one exactly"
            )


def sample_times(problem: ScaleProblem) -> Array:
    """Times of the samples, both ends included."""
    duration = problem.trajectory.duration
    return np.linspace(0.0, duration, max(int(np.ceil(duration * problem.options.rate)), 1) + 1)


def published_links(robot: Robot) -> LinkBoxes:
    """Interval parameters in the D-H frames, as published; the tight ones, so that only the algorithm is compared."""
    frames = dh_table(robot).frames
    tight = tight_intervals(robot, frames)
    return LinkBoxes(tight.mass, tight.com, tight.inertia_com, frames)


def ranges_by(robot: Robot, method: Method) -> MakeRanges:
    """The function that bounds torques of samples for all factors."""
    if method == "ianea":
        links = published_links(robot)
        return lambda q, dq, ddq: SplitTorques(robot, q, dq, ddq, links)
    arm = without_width(robot) if method == "nominal" else robot

    def exact(q: Array, dq: Array, ddq: Array) -> TorqueRanges:
        return ScaledTorques(arm, q, dq, ddq)

    return exact
