"""Random module chains, and a Pinocchio model built straight from the module data as an independent reference."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from modrob_cli.arrays import Array
from modrob_cli.model.body import RigidBody, tensor_entries
from modrob_cli.model.module import (
    Actuation,
    Assembly,
    ConnectionData,
    JointUnit,
    Module,
    ModuleUse,
    RigidPart,
)
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import parallel_axis

SPECIAL_ANGLES = (0.0, math.pi / 2, -math.pi / 2, math.pi, -math.pi, math.pi / 4)


@dataclass
class RawChain:
    """What the reference needs: a list of steps ("move", T), ("body", inertia) and ("joint", type)."""

    steps: list[tuple[str, Any]]


def raw_transform(data: ConnectionData) -> Any:
    """The formula of [D] (2.18), written with Pinocchio's elementary rotations."""

    def turn(axis: str, angle: float) -> Any:
        return pin.SE3(pin.utils.rotate(axis, angle), np.zeros(3))

    def shift(x: float, z: float) -> Any:
        return pin.SE3(np.eye(3), np.array([x, 0.0, z]))

    first = turn("z", -data.delta_in) * shift(data.a, -data.p) * turn("x", data.alpha)
    return first * shift(0.0, data.n) * turn("z", data.delta_out)


def random_data(rng: np.random.Generator) -> ConnectionData:
    """Module data with the special cases (overlapping, parallel, intersecting axes) as frequent as generic ones."""

    def angle() -> float:
        return float(rng.choice(SPECIAL_ANGLES)) if rng.random() < 0.6 else float(rng.uniform(-math.pi, math.pi))

    def length() -> float:
        return 0.0 if rng.random() < 0.5 else float(rng.uniform(-0.4, 0.4))

    return ConnectionData(length(), angle(), length(), length(), angle(), angle())


def random_body(rng: np.random.Generator, name: str) -> tuple[RigidBody, Any]:
    """A massless body in four of ten cases, else a physical one; with Pinocchio's inertia for it."""
    if rng.random() < 0.4:
        massless = RigidBody(name, Uncertain.exact(0.0), Uncertain.exact(np.zeros(3)), Uncertain.exact(np.zeros(6)))
        return massless, None
    mass, com = float(rng.uniform(0.05, 5.0)), rng.uniform(-0.2, 0.2, 3)
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    sides = rng.uniform(0.02, 0.2, 3) ** 2
    inertia_com = mass / 12.0 * Q @ np.diag(sides.sum() - sides) @ Q.T
    inertia_com = 0.5 * (inertia_com + inertia_com.T)
    reference = pin.Inertia(mass, com, inertia_com)
    if rng.random() < 0.5:
        about_frame = tensor_entries(inertia_com + mass * parallel_axis(com))
        exact = Uncertain.exact(mass), Uncertain.exact(com), Uncertain.exact(about_frame)
        return RigidBody(name, *exact, inertia_about="frame"), reference
    exact = Uncertain.exact(mass), Uncertain.exact(com), Uncertain.exact(tensor_entries(inertia_com))
    return RigidBody(name, *exact), reference


def random_chain(rng: np.random.Generator, most_joints: int = 12) -> tuple[Assembly, RawChain]:
    """An assembly of 1 to ``most_joints`` joints in simple and complex modules, links between, and its raw steps."""
    joints = int(rng.integers(1, most_joints + 1))
    raw = RawChain([])
    uses: list[ModuleUse] = []
    while joints > 0:
        for _ in range(int(rng.integers(0, 3))):
            uses.append(_link(rng, raw, f"L{len(uses)}"))
        count = min(joints, int(rng.integers(1, 3)))
        units = tuple(_unit(rng, raw, f"J{len(uses)}.{k}") for k in range(count))
        uses.append(ModuleUse(Module(f"J{len(uses)}", "joint", units=units)))
        joints -= count
    if rng.random() < 0.7:
        uses.append(_link(rng, raw, f"L{len(uses)}"))
    base, gravity = random_data(rng), rng.uniform(-9.81, 9.81, 3)
    raw.steps.insert(0, ("move", raw_transform(base)))
    return Assembly("random", tuple(uses), base.transform(), gravity), raw


def _link(rng: np.random.Generator, raw: RawChain, name: str) -> ModuleUse:
    """A link with up to three outputs, left through a random one."""
    body, reference = random_body(rng, name)
    data = [random_data(rng) for _ in range(int(rng.integers(1, 4)))]
    chosen = int(rng.integers(len(data)))
    raw.steps += [("body", reference), ("move", raw_transform(data[chosen]))]
    outputs = {f"out{k}": RigidPart(item.transform(), body) for k, item in enumerate(data)}
    return ModuleUse(Module(name, "link", outputs=outputs), f"out{chosen}")


def _unit(rng: np.random.Generator, raw: RawChain, name: str) -> JointUnit:
    """A joint unit; a proximal part has no output angle, a distal part no input angle ([D] Table 2.1)."""
    before, after = random_data(rng), random_data(rng)
    before = ConnectionData(before.a, before.alpha, before.p, before.n, before.delta_in, 0.0)
    after = ConnectionData(after.a, after.alpha, after.p, after.n, 0.0, after.delta_out)
    proximal, proximal_reference = random_body(rng, f"{name}.proximal")
    distal, distal_reference = random_body(rng, f"{name}.distal")
    prismatic, delta = rng.random() < 0.3, float(rng.choice([0.0, rng.uniform(-3.0, 3.0)]))
    raw.steps += [("body", proximal_reference), ("move", raw_transform(before))]
    raw.steps += [("move", pin.SE3(pin.utils.rotate("z", delta), np.zeros(3)))]
    raw.steps += [("joint", "prismatic" if prismatic else "revolute")]
    raw.steps += [("move", raw_transform(after)), ("body", distal_reference)]
    actuation = Actuation("prismatic" if prismatic else "revolute", delta)
    return JointUnit(RigidPart(before.transform(), proximal), actuation, RigidPart(after.transform(), distal))


def reference_model(raw: RawChain, gravity: Array) -> tuple[Any, Any]:
    """Pinocchio model and end-effector placement in its last joint, from the raw steps alone."""
    model = pin.Model()
    model.gravity = pin.Motion(gravity, np.zeros(3))
    joint, pose = 0, pin.SE3.Identity()
    for k, (what, content) in enumerate(raw.steps):
        if what == "move":
            pose = pose * content
        elif what == "body" and content is not None:
            model.appendBodyToJoint(joint, content, pose)
        elif what == "joint":
            kind = pin.JointModelPZ() if content == "prismatic" else pin.JointModelRZ()
            joint = model.addJoint(joint, kind, pose, f"joint {k}")
            pose = pin.SE3.Identity()
    return model, pose
