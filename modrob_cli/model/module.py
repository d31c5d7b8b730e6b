"""Modules and their assembly, as the module data describe them ([D] Tables 2.1, 2.2, 3.1)."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array, frozen
from modrob_cli.interval import Interval
from modrob_cli.model.body import RigidBody
from modrob_cli.model.joint import Drive, Friction, JointType, Limits
from modrob_cli.spatial import rotation, translation

ModuleKind = Literal["base", "link", "joint", "end-effector"]


@dataclass(frozen=True)
class ConnectionData:
    r"""Kinematic module data between an input and an output frame. [D] Table 2.1.

    .. math:: T = R_z(-\delta_{in}) T_z(-p) T_x(a) R_x(\alpha) T_z(n) R_z(\delta_{out})

    Lengths in m, angles in rad.
    """

    a: float = 0.0
    alpha: float = 0.0
    p: float = 0.0
    n: float = 0.0
    delta_in: float = 0.0
    delta_out: float = 0.0

    def transform(self) -> Array:
        """Output frame in the input frame, shape (4, 4). [D] (2.18)."""
        first = rotation("z", -self.delta_in) @ translation("z", -self.p) @ translation("x", self.a)
        return np.asarray(first @ rotation("x", self.alpha) @ translation("z", self.n) @ rotation("z", self.delta_out))


@dataclass(frozen=True)
class RigidPart:
    """The rigid piece between two frames, and the body it carries.

    Attributes
    ----------
    transform : output frame in the input frame, shape (4, 4)
    body : given in the input frame (link modules, proximal parts) or the output frame (distal parts)
    """

    transform: Array
    body: RigidBody

    def __post_init__(self) -> None:
        """Freeze the transform."""
        object.__setattr__(self, "transform", frozen(self.transform, (4, 4)))


@dataclass(frozen=True)
class Actuation:
    """The joint between a proximal and a distal part; ``offset`` is delta_J [rad]."""

    type: JointType
    offset: float = 0.0
    friction: Friction = field(default_factory=Friction)
    drive: Drive = field(default_factory=Drive)
    limits: Limits = field(default_factory=Limits)


@dataclass(frozen=True)
class JointUnit:
    """A simple joint unit: proximal part, joint, distal part."""

    proximal: RigidPart
    joint: Actuation
    distal: RigidPart


@dataclass(frozen=True)
class Module:
    """A module of a modular arm.

    Link-like modules (base, link, end effector) have ``outputs`` (output connector -> part) that share one body,
    given in the input frame; joint modules have one or more ``units`` in series.
    """

    name: str
    kind: ModuleKind
    source: str = ""
    outputs: dict[str, RigidPart] = field(default_factory=dict)
    units: tuple[JointUnit, ...] = ()


@dataclass(frozen=True)
class ModuleUse:
    """One module in an assembly, left through one of its output connectors (None for joint modules)."""

    module: Module
    output: str | None = None


@dataclass(frozen=True)
class LimitOverride:
    """Limits that replace those of one joint."""

    joint: str
    limits: Limits


@dataclass(frozen=True)
class Assembly:
    """Modules bolted together, base to tip.

    Attributes
    ----------
    base_pose : input connector of the first module in the base frame, shape (4, 4)
    gravity : acceleration of free fall in the base frame, shape (3,), [m/s^2]
    payload : body fixed to the end effector, in its output frame
    joint_names : names instead of ``<module>.<k>``
    disturbance : bounds of an unknown torque, one for all joints or one each
    """

    name: str
    modules: tuple[ModuleUse, ...]
    base_pose: Array
    gravity: Array
    payload: RigidBody | None = None
    joint_names: tuple[str, ...] | None = None
    disturbance: Interval = field(default_factory=lambda: Interval(0.0))
    limit_overrides: tuple[LimitOverride, ...] = ()
