"""``assembly/1``: modules bolted together."""

from collections import Counter
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, StringConstraints
from pydantic_core import PydanticCustomError

from modrob_cli.interval import Interval
from modrob_cli.model.module import Assembly, LimitOverride, Module, ModuleUse
from modrob_cli.model.robot import STANDARD_GRAVITY
from modrob_cli.schema.base import Bounds, Document, JointName, Name, Point, PoseSpec
from modrob_cli.schema.body import BodySpec
from modrob_cli.schema.joint import LimitsSpec


class UseSpec(Document):
    """One module of the chain and the connector by which it is left."""

    module: Name
    output: Name | None = Field(default=None, description="output connector; may be left out if there is one")


def _lift_use(value: Any) -> Any:
    return {"module": value} if isinstance(value, str) else value


Use = Annotated[UseSpec, BeforeValidator(_lift_use, json_schema_input_type=str | UseSpec)]


def _lift_list(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


FileList = Annotated[
    list[Annotated[str, StringConstraints(min_length=1, max_length=1000)]],
    Field(min_length=1, description="folders or files of modules, relative to this file"),
    BeforeValidator(_lift_list, json_schema_input_type=str | list[str]),
]


def _lift_disturbance(value: Any) -> Any:
    return [value] if isinstance(value, int | float) else value


def disturbance_interval(value: list[list[float]]) -> Interval:
    """Bounds of the disturbance: shape () for one entry, else one entry per joint."""
    ends = np.asarray(value, dtype=float)
    return Interval(ends[0, 0], ends[0, 1]) if len(value) == 1 else Interval(ends[:, 0], ends[:, 1])


Disturbance = Annotated[
    list[Bounds],
    Field(min_length=1, description="unknown torque: one number d for [-d, d], or a list with one entry per joint"),
    BeforeValidator(_lift_disturbance, json_schema_input_type=float | list[Bounds]),
]


def check_unique(names: list[str] | None) -> list[str] | None:
    """Refuse a list that names something twice."""
    repeated = sorted(name for name, count in Counter(names or []).items() if count > 1)
    if repeated:
        message = "Input should name each joint once, found again: {names}"
        raise PydanticCustomError("repeated", message, {"names": ", ".join(repeated)})
    return names


class AssemblyDocument(Document):
    """A list of modules, base to tip, and where the arm stands."""

    modrob: Literal["assembly/1"]
    name: Name
    source: str = ""
    description: str = ""
    catalogue: FileList
    base_pose: PoseSpec = Field(default=PoseSpec(), description="input connector of the first module, base frame")
    gravity: Point = Field(default=list(STANDARD_GRAVITY), description="free fall in the base frame [m/s^2]")
    modules: list[Use] = Field(min_length=1, description="base to tip")
    joint_names: Annotated[list[JointName] | None, AfterValidator(check_unique)] = None
    payload: BodySpec | None = Field(default=None, description="body at the end effector, in its output frame")
    disturbance: Disturbance = [[0.0, 0.0]]
    limits: dict[JointName, LimitsSpec] = Field(default={}, description="limits that replace those of a joint")

    def to_model(self, modules: list[Module]) -> Assembly:
        """Return the assembly; ``modules`` are those of the chain, in order, already looked up."""
        uses = []
        for use, module in zip(self.modules, modules, strict=True):
            only = next(iter(module.outputs)) if len(module.outputs) == 1 else None
            uses.append(ModuleUse(module, use.output or only))
        return Assembly(
            name=self.name,
            modules=tuple(uses),
            base_pose=self.base_pose.to_model(),
            gravity=np.asarray(self.gravity),
            payload=self.payload.to_model("payload") if self.payload else None,
            joint_names=tuple(self.joint_names) if self.joint_names else None,
            disturbance=disturbance_interval(self.disturbance),
            limit_overrides=tuple(LimitOverride(joint, spec.to_model()) for joint, spec in self.limits.items()),
        )
