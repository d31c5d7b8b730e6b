"""From modules bolted together to a robot: placements, bodies, drives."""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import NumericalError
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, RigidBody
from modrob_cli.model.joint import Joint, Limits
from modrob_cli.model.module import Actuation, Assembly, JointUnit, Module, RigidPart
from modrob_cli.model.robot import Robot


@dataclass
class _Chain:
    """What has been bolted together so far; ``pose`` is the last connector in the frame of the last link."""

    pose: Array
    joints: list[Joint]
    bodies: list[PlacedBody]

    def carry(self, body: RigidBody) -> None:
        """Fix a body to the last link, its frame at the last connector."""
        self.bodies.append(PlacedBody(len(self.joints), self.pose, body))

    def pass_part(self, part: RigidPart) -> None:
        """Go from the input to the output frame of a rigid part."""
        self.pose = self.pose @ part.transform

    def turn(self, name: str, actuation: Actuation) -> None:
        """Add a joint at the last frame; what follows belongs to the next link."""
        friction, drive, limits = actuation.friction, actuation.drive, actuation.limits
        self.joints.append(Joint(name, actuation.type, self.pose, actuation.offset, friction, drive, limits))
        self.pose = np.eye(4)

    def add_link(self, module: Module, part: RigidPart, name: str) -> None:
        """Append a link-like module; its body is given in the input frame."""
        self.carry(replace(part.body, name=name))
        self.pass_part(part)

    def add_unit(self, unit: JointUnit, name: str) -> None:
        """Append a joint unit; proximal body in the input frame, distal body in the output frame."""
        self.carry(replace(unit.proximal.body, name=f"{name}.proximal"))
        self.pass_part(unit.proximal)
        self.turn(name, unit.joint)
        self.pass_part(unit.distal)
        self.carry(replace(unit.distal.body, name=f"{name}.distal"))


def instance_names(assembly: Assembly) -> list[str]:
    """Name of each module of the chain: the module's own, with ``#2`` and so on when it is used again."""
    seen: Counter[str] = Counter()
    names = []
    for use in assembly.modules:
        seen[use.module.name] += 1
        count = seen[use.module.name]
        names.append(use.module.name if count == 1 else f"{use.module.name}#{count}")
    return names


def default_joint_names(assembly: Assembly) -> list[str]:
    """Joint names ``<module>.<k>`` in the order of the chain, k counted from 1 within each module."""
    pairs = zip(instance_names(assembly), assembly.modules, strict=True)
    return [f"{name}.{k}" for name, use in pairs for k in range(1, len(use.module.units) + 1)]


def synthesize(assembly: Assembly) -> Robot:
    """Build the robot that an assembly describes.

    Joint placements are plain products of the modules' transforms, and every body keeps its own frame and box, so
    nothing is lost or widened here; D-H tables and link parameters are views computed from the result.

    Raises
    ------
    NumericalError
        If a link-like module is used without naming one of its outputs.
    ShapeError
        If the disturbance does not fit the number of joints.
    """
    chain = _Chain(assembly.base_pose, [], [])
    for use, name in zip(assembly.modules, instance_names(assembly), strict=True):
        if use.module.kind == "joint":
            for k, unit in enumerate(use.module.units, start=1):
                chain.add_unit(unit, f"{name}.{k}")
        elif use.output not in use.module.outputs:
            raise NumericalError(f"module {use.module.name} has no output {use.output!r}")
        else:
            chain.add_link(use.module, use.module.outputs[use.output], name)
    if assembly.payload is not None:
        chain.carry(assembly.payload)
    joints = _rename(chain.joints, assembly)
    disturbance = Interval(np.zeros(len(joints))) + assembly.disturbance
    return Robot(assembly.name, joints, tuple(chain.bodies), chain.pose, assembly.gravity, disturbance)


def _rename(joints: list[Joint], assembly: Assembly) -> tuple[Joint, ...]:
    """Apply the assembly's joint names and limits."""
    names = assembly.joint_names or tuple(joint.name for joint in joints)
    overrides = {item.joint: item.limits for item in assembly.limit_overrides}
    return tuple(
        replace(joint, name=name, limits=_merge(joint.limits, overrides.get(name)))
        for joint, name in zip(joints, names, strict=True)
    )


def _merge(limits: Limits, override: Limits | None) -> Limits:
    """Limits with those of the override that are set put in their place."""
    changes = {key: value for key, value in vars(override).items() if value is not None} if override else {}
    return replace(limits, **changes)
