"""Joints: where they are, how they move, what drives and brakes them."""

from dataclasses import dataclass, field
from typing import Literal

from modrob_cli.arrays import Array, frozen
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import rotation

JointType = Literal["revolute", "prismatic"]
Range = tuple[float, float]


def _zero() -> Uncertain:
    return Uncertain.exact(0.0)


@dataclass(frozen=True)
class Friction:
    """Link-side joint friction: viscous dq + coulomb sgn(dq + velocity_band) + coulomb_band. [S] eq. (21).

    viscous [N m s/rad] or [N s/m]; coulomb [N m] or [N]; the bands are half-widths: +-coulomb_band in torque,
    +-velocity_band in velocity (within it the sign is the interval [-1, 1]).
    """

    viscous: Uncertain = field(default_factory=_zero)
    coulomb: Uncertain = field(default_factory=_zero)
    coulomb_band: float = 0.0
    velocity_band: float = 0.0


@dataclass(frozen=True)
class Drive:
    """Motor and gear of a joint.

    rotor_inertia [kg m^2], motor side; gear_ratio [-], motor turns per joint turn (for a prismatic joint
    [rad/m]); torque_constant [N m/A], motor side; stiffness [N m/rad], link side, None for a rigid joint.
    """

    rotor_inertia: Uncertain = field(default_factory=_zero)
    gear_ratio: float = 1.0
    torque_constant: float | None = None
    stiffness: float | None = None


@dataclass(frozen=True)
class Limits:
    """Admissible ranges (lower, upper), link side; None where no limit is known.

    position [rad] or [m], velocity, acceleration, jerk its derivatives, torque [N m] or [N], current [A] (motor).
    """

    position: Range | None = None
    velocity: Range | None = None
    acceleration: Range | None = None
    jerk: Range | None = None
    torque: Range | None = None
    current: Range | None = None


@dataclass(frozen=True)
class Joint:
    """One joint axis, the z axis of its frame.

    The frame of link i is the frame of joint i carried along by the motion: ``placement`` times the motion
    Rz(offset + q) or Tz(q) Rz(offset).

    Attributes
    ----------
    placement : joint frame in the frame of the previous link (for the first joint: in the base frame), (4, 4)
    offset : delta_J of the module data, [rad]: rotation about z at q = 0
    """

    name: str
    type: JointType
    placement: Array
    offset: float = 0.0
    friction: Friction = field(default_factory=Friction)
    drive: Drive = field(default_factory=Drive)
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self) -> None:
        """Freeze the placement."""
        object.__setattr__(self, "placement", frozen(self.placement, (4, 4)))

    @property
    def zero_placement(self) -> Array:
        """Frame of the moved link at q = 0 in the previous link's frame, shape (4, 4)."""
        return self.placement if self.offset == 0.0 else self.placement @ rotation("z", self.offset)
