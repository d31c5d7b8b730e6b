"""What on-module storage holds: a module as parameters, not as transforms."""

from dataclasses import dataclass, field

from modrob_cli.model.body import RigidBody
from modrob_cli.model.joint import JointType
from modrob_cli.model.module import Actuation, ConnectionData, ModuleKind

JOINT_TYPES: tuple[JointType, ...] = ("revolute", "prismatic")
"""Joint types by the number that stands for them in storage."""

KINDS: tuple[ModuleKind, ...] = ("base", "link", "joint", "end-effector")
"""Module kinds by the number that stands for them in extended storage."""


@dataclass(frozen=True)
class StoredUnit:
    """A simple joint unit; ``joint.offset`` is delta_J, the parts have one delta each ([D] Table 2.1)."""

    proximal: ConnectionData
    proximal_body: RigidBody
    joint: Actuation
    distal: ConnectionData
    distal_body: RigidBody


@dataclass(frozen=True)
class StoredModule:
    """A module; ``outputs`` and ``body`` are those of link-like kinds, ``units`` those of joint modules."""

    name: str
    kind: ModuleKind
    source: str = ""
    description: str = ""
    outputs: dict[str, ConnectionData] = field(default_factory=dict)
    body: RigidBody | None = None
    units: tuple[StoredUnit, ...] = ()
