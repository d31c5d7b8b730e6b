"""What happens in a simulated run: the true robot, its payload, contacts, sensors and controller."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array, frozen
from modrob_cli.model.body import RigidBody

Draw = Literal["nominal", "uniform", "vertices"]
ContactFrame = Literal["base", "link"]
ContactShape = Literal["constant", "half-sine"]
NoiseShape = Literal["gaussian", "uniform"]
SensedEffort = Literal["torque", "current", "motor-torque"]
SensedVelocity = Literal["measured", "differentiated"]
GainValue = float | tuple[float, ...]
FrictionFrom = Literal["measured", "desired", "none"]
BoundsMethod = Literal["exact", "ianea"]


@dataclass(frozen=True)
class Truth:
    """How the true parameters are chosen from the robot's intervals.

    Attributes
    ----------
    draw : nominal values; uniform over each interval; or one of its two ends each ("vertices")
    bodies : parameters of bodies by name of the body: mass (), com (3,), inertia (6,); they replace what is drawn
    joints : parameters of joints by name of the joint: viscous, coulomb, rotor_inertia, friction_offset, disturbance;
        they replace what is drawn
    breakaway : friction torque that holds a joint at rest, as a multiple of its Coulomb torque, >= 1
    """

    draw: Draw = "nominal"
    bodies: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    joints: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    breakaway: float = 1.0


@dataclass(frozen=True)
class Contact:
    """A force on a point of a link over a time window.

    Attributes
    ----------
    link : 0 is the base, i the link that joint i moves
    point : where, in the frame of the link, shape (3,), [m]
    force : at its largest, shape (3,), [N], in the base frame or turning with the link
    start, duration : [s]; the force is zero outside
    shape : constant (a push), or half a period of a sine (a hit)
    """

    name: str
    link: int
    point: Array
    force: Array
    start: float
    duration: float
    frame: ContactFrame = "base"
    shape: ContactShape = "constant"

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "point", frozen(self.point, (3,)))
        object.__setattr__(self, "force", frozen(self.force, (3,)))

    @property
    def end(self) -> float:
        """Time from which on the force is zero again, [s]."""
        return self.start + self.duration

    def size(self, t: Array) -> Array:
        """Force at times t, relative to its largest; 0 outside the window. Shape of t."""
        shape = np.ones_like(t) if self.shape == "constant" else np.sin(np.pi * (t - self.start) / self.duration)
        return np.where((t >= self.start) & (t < self.end), shape, 0.0)


@dataclass(frozen=True)
class Channel:
    """One kind of measurement; a number for all joints, or one for each.

    Attributes
    ----------
    noise : standard deviation ("gaussian") or half-width ("uniform", a bound that holds), in the unit of the channel
    resolution : step of the quantisation, 0 for none; what is measured is rounded to a multiple of it
    """

    noise: GainValue = 0.0
    resolution: GainValue = 0.0


@dataclass(frozen=True)
class Sensors:
    """How the state is measured, for the controller and for the log alike.

    Attributes
    ----------
    rate : samples per second; None for the rate of the controller, which must be a multiple of it
    position, velocity, effort : channels [rad] or [m], derivative, unit of the effort
    noise : distribution of all noise
    velocity_source : measured, or backward differences of the measured positions
    effort_kind : what the log calls effort: joint torque of the motor, torque before the gear, motor current
    delay : age of what the controller gets [s], rounded up to whole samples
    jitter : standard deviation or half-width (as ``noise``) of the error of the time stamps [s]; it never makes them go
        back
    """

    rate: float | None = None
    position: Channel = field(default_factory=Channel)
    velocity: Channel = field(default_factory=Channel)
    effort: Channel = field(default_factory=Channel)
    noise: NoiseShape = "gaussian"
    velocity_source: SensedVelocity = "measured"
    effort_kind: SensedEffort = "torque"
    delay: float = 0.0
    jitter: float = 0.0


@dataclass(frozen=True)
class Control:
    """The controller and its clock.

    Attributes
    ----------
    name : one of the shipped controllers; None where the user gives it on the command line
    gains : parameters of the controller by name, a number for all joints or one for each
    rate : torque commands per second, each held until the next one
    friction : velocity from which the controller computes the friction torque that it compensates; none: it does not
    friction_band : the sign of velocities up to this is replaced by a straight line [rad/s] or [m/s], so that Coulomb
        compensation does not chatter at rest; 0 for the sign itself
    bounds : how interval controllers bound their perturbation: exactly, or by the published algorithm
    """

    name: str | None = None
    gains: Mapping[str, GainValue] = field(default_factory=dict)
    rate: float = 1000.0
    friction: FrictionFrom = "measured"
    friction_band: float = 0.02
    bounds: BoundsMethod = "exact"


@dataclass(frozen=True)
class Scenario:
    """A simulated study.

    Attributes
    ----------
    payload : body at the end effector, in its frame, that the true robot carries and the controller does not know of
    input_disturbance : largest torque that is added to that of the motors, uniform between its negative and itself, a
        new one at each command; a number for all joints or one each
    sub_steps : integration steps per command
    end_stops : the position limits stop the joints (without rebound)
    saturation : the torque and current limits cut the commands
    initial_q, initial_dq : state at the start, shape (n,); None for that of the motion
    """

    name: str = "default"
    truth: Truth = field(default_factory=Truth)
    payload: RigidBody | None = None
    contacts: tuple[Contact, ...] = ()
    input_disturbance: GainValue = 0.0
    sensors: Sensors = field(default_factory=Sensors)
    control: Control = field(default_factory=Control)
    seed: int = 0
    sub_steps: int = 1
    end_stops: bool = True
    saturation: bool = True
    initial_q: Array | None = None
    initial_dq: Array | None = None
