"""What ``modrob collision`` is asked for."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.collision.acceleration import VelocityKnowledge
from modrob_cli.collision.bands import Method
from modrob_cli.collision.events import Rules
from modrob_cli.collision.filters import MOST_ORDER, SignalFilter
from modrob_cli.collision.sensitivity import LinkPoint
from modrob_cli.errors import UsageError
from modrob_cli.identify.effort import EffortKind
from modrob_cli.io.log_options import LogOptions
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.bounds_method import per_joint

Acceleration = Literal["desired", "measured", "smoothed"]
"""Where the middle of [ddq] comes from: the planned motion; backward differences of the measured velocity, with their
error bound; positions and velocities low-passed without phase shift, as for identification (not causal)."""

_FILTER = re.compile(r"(first-order|butterworth(\d+)):([0-9.eE+-]+?)(?:x(\d+))?$")


@dataclass(frozen=True)
class CollisionOptions:
    """How thresholds are made and judged.

    Attributes
    ----------
    effort : what the logs call effort
    desired : file of the planned motion; None: the controller's topic in the log
    desired_start : time of the log at which the planned motion starts [s]
    ddq_tolerance, q_noise, dq_noise : half-widths, one for all joints or one each; None for none
    effort_noise : half-width in the unit of the log
    jerk : largest jerk, for measured accelerations; None: the limits of the robot
    jump : largest sudden change of acceleration where a joint reverses, for measured accelerations
    still : speed below which a joint may reverse; None: the velocity bands of the robot's friction
    train : logs without contact that constant thresholds and the observer are learned from
    margin : part of the largest training residual that is added to these
    skip : seconds at the start of each log that are left out, while the arm and its controller settle
    merge, shortest : see :class:`modrob_cli.collision.events.Rules`, [s]
    settle : time behind a contact in which an event still belongs to it [s]
    points : where contact forces are looked at besides the end effector, as LINK:x,y,z
    rate : samples per second of planned motions [Hz]
    compare : also the other kind of bands, to compare with
    cutoff : of the low-pass of smoothed motions [Hz]; None: by the spectrum
    """

    effort: EffortKind = "torque"
    reading: LogOptions = field(default_factory=LogOptions)
    method: Method = "exact"
    filter: SignalFilter = field(default_factory=SignalFilter)
    acceleration: Acceleration | None = None
    desired: Path | None = None
    desired_start: float = 0.0
    ddq_tolerance: list[float] | None = None
    q_noise: list[float] | None = None
    dq_noise: list[float] | None = None
    effort_noise: list[float] | None = None
    jerk: list[float] | None = None
    jump: list[float] | None = None
    still: list[float] | None = None
    train: tuple[Path, ...] = ()
    margin: float = 0.2
    merge: float = 0.05
    shortest: float = 0.0
    settle: float = 0.3
    skip: float = 0.0
    points: tuple[str, ...] = ()
    rate: float = 250.0
    cutoff: float | None = None
    compare: bool = True

    def check(self, robot: Robot) -> None:
        """Refuse options that contradict each other or do not fit the robot.

        Raises
        ------
        UsageError
            Saying which.
        """
        source = self.acceleration
        if source in ("measured", "smoothed") and self.desired is not None:
            raise UsageError(f"--desired and --acceleration {source} contradict each other; leave one of them out")
        given = {"--jerk": self.jerk, "--reversal-jump": self.jump, "--reversal-speed": self.still}
        for option, values in given.items():
            if values is not None and source != "measured":
                raise UsageError(f"{option} is for --acceleration measured")
        if self.cutoff is not None and source != "smoothed":
            raise UsageError("--cutoff is for --acceleration smoothed")
        if self.ddq_tolerance is not None and source == "measured":
            raise UsageError("--ddq-tolerance: the error of measured accelerations follows from --dq-noise and --jerk")
        for value, option in (
            (self.margin, "--margin"),
            (self.settle, "--settle"),
            (self.skip, "--skip"),
            (self.merge, "--merge"),
        ):
            if not 0.0 <= value < np.inf:
                raise UsageError(f"{option}: found {value:g}, expected a number >= 0")
        if not 0.0 <= self.shortest < np.inf:
            raise UsageError(f"--min-duration: found {self.shortest:g}, expected a number >= 0")
        if not 0.0 < self.rate < np.inf:
            raise UsageError(f"--rate: found {self.rate:g}, expected a number > 0 [Hz]")
        self.radii(robot)
        self.link_points(robot)
        if source == "measured":
            self.velocity_knowledge(robot)

    @property
    def rules(self) -> Rules:
        """What counts as one event."""
        return Rules(self.merge, self.shortest)

    def radii(self, robot: Robot) -> dict[str, Array]:
        """Half-widths by name, shape (n,)."""
        given = {
            "q": (self.q_noise, "--q-noise"),
            "dq": (self.dq_noise, "--dq-noise"),
            "ddq": (self.ddq_tolerance, "--ddq-tolerance"),
            "effort": (self.effort_noise, "--effort-noise"),
        }
        return {key: per_joint(values, robot.dof, option) for key, (values, option) in given.items()}

    def velocity_knowledge(self, robot: Robot) -> VelocityKnowledge:
        """What measured accelerations are made from.

        Raises
        ------
        UsageError
            If neither the options nor the robot have one.
        """
        if self.jerk is not None:
            jerk = per_joint(self.jerk, robot.dof, "--jerk")
        else:
            limits = [joint.limits.jerk for joint in robot.joints]
            jerk = np.array([0.0 if limit is None else max(-limit[0], limit[1]) for limit in limits])
        if not jerk.all():
            message = "give the largest jerk of every joint [rad/s^3, m/s^3] with --jerk, or as limits of the robot"
            raise UsageError(f"--acceleration measured needs a bound of the jerk; {message}")
        jump = per_joint(self.jump, robot.dof, "--reversal-jump")
        bands = np.array([joint.friction.velocity_band for joint in robot.joints])
        still = bands if self.still is None else per_joint(self.still, robot.dof, "--reversal-speed")
        return VelocityKnowledge(self.radii(robot)["dq"], jerk, jump, still)

    def link_points(self, robot: Robot) -> list[LinkPoint]:
        """Points where contact forces are looked at; the end effector first.

        Raises
        ------
        UsageError
            If a point cannot be read.
        """
        return [LinkPoint("tool", robot.dof + 1, np.zeros(3)), *(_point(text, robot) for text in self.points)]

    @property
    def data(self) -> dict[str, Any]:
        """For the result."""
        return {
            "effort": self.effort,
            "topic": self.reading.topic,
            "method": self.method,
            "filter": str(self.filter),
            "acceleration": self.acceleration,
            "desired": None if self.desired is None else str(self.desired),
            "desired_start": self.desired_start,
            "ddq_tolerance": self.ddq_tolerance,
            "q_noise": self.q_noise,
            "dq_noise": self.dq_noise,
            "effort_noise": self.effort_noise,
            "jerk": self.jerk,
            "reversal_jump": self.jump,
            "reversal_speed": self.still,
            "train": [str(path) for path in self.train],
            "margin": self.margin,
            "merge": self.merge,
            "min_duration": self.shortest,
            "settle": self.settle,
            "skip": self.skip,
            "points": list(self.points),
            "rate": self.rate,
            "cutoff": self.cutoff,
        }


def parse_filter(text: str) -> SignalFilter:
    """Read ``none``, ``first-order:10``, ``first-order:10x2`` (two in a row) or ``butterworth2:20``.

    Raises
    ------
    UsageError
        If it is none of these.
    """
    if text == "none":
        return SignalFilter()
    found = _FILTER.match(text)
    wanted = "expected none, first-order:HZ, first-order:HZxN or butterworthN:HZ, such as butterworth2:20"
    try:
        cutoff = float(found[3]) if found else np.nan
    except ValueError:
        cutoff = np.nan
    if found is None or not 0.0 < cutoff < np.inf or (found[2] and found[4]):
        raise UsageError(f"--filter: found {text!r}, {wanted}")
    order = int(found[2] or found[4] or 1)
    if not 1 <= order <= MOST_ORDER:
        raise UsageError(f"--filter: found order {order}, expected 1 .. {MOST_ORDER}")
    return SignalFilter("butterworth" if found[2] else "first-order", order, cutoff)


def _point(text: str, robot: Robot) -> LinkPoint:
    name, _, rest = text.rpartition(":")
    numbers = rest.split(",")
    try:
        place = np.array([float(number) for number in numbers])
    except ValueError:
        place = np.full(3, np.nan)
    if not name or place.shape != (3,) or not np.isfinite(place).all():
        raise UsageError(f"--point: found {text!r}, expected LINK:x,y,z [m], such as elbow:0,0,0.1")
    links = {str(i): i for i in range(1, robot.dof + 1)} | {"tool": robot.dof + 1}
    links |= {joint: i for i, joint in enumerate(robot.joint_names, start=1)}
    if name not in links:
        known = f"tool, 1 .. {robot.dof}, {', '.join(robot.joint_names)}"
        raise UsageError(f"--point: found the link {name!r}, expected one of {known}")
    return LinkPoint(text, links[name], place)
