"""``module/1``: the data that a module carries."""

from typing import Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from modrob_cli.arrays import Array
from modrob_cli.model.module import Actuation, ConnectionData, JointUnit, Module, RigidPart
from modrob_cli.schema.base import Angle, Document, Name, PoseSpec
from modrob_cli.schema.body import MASSLESS, BodySpec
from modrob_cli.schema.joint import DriveSpec


class _Geometry(Document):
    """Kinematic parameters of [D] Table 2.1, or a plain pose instead of them."""

    a: float = Field(default=0.0, description="along the common normal [m]")
    alpha: Angle = 0.0
    p: float = Field(default=0.0, description="input point along the first axis [m]")
    n: float = Field(default=0.0, description="output point along the second axis [m]")
    pose: PoseSpec | None = Field(default=None, description="output frame in the input frame")

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        numbers = self.model_fields_set - {"pose", "body"}
        if self.pose is not None and numbers:
            raise PydanticCustomError(
                "geometry", "Input should have either pose or a, alpha, p, n and the deltas, it has pose and {keys}",
                {"keys": ", ".join(sorted(numbers))},
            )  # fmt: skip
        return self

    def _transform(self, delta_in: float, delta_out: float) -> Array:
        if self.pose is not None:
            return self.pose.to_model()
        return ConnectionData(self.a, self.alpha, self.p, self.n, delta_in, delta_out).transform()


class ConnectionSpec(_Geometry):
    """From the input frame to one output frame of a link-like module."""

    delta_in: Angle = 0.0
    delta_out: Angle = 0.0

    def to_model(self) -> Array:
        """Return the output frame in the input frame, shape (4, 4)."""
        return self._transform(self.delta_in, self.delta_out)


class PartSpec(_Geometry):
    """Proximal or distal part of a joint unit; a part without a body is massless."""

    delta: Angle = 0.0
    body: BodySpec = Field(default=MASSLESS, description="proximal: in the input frame; distal: in the output frame")

    def proximal_to_model(self, name: str) -> RigidPart:
        """Return the part from the input frame to the joint axis; body in the input frame."""
        return RigidPart(self._transform(self.delta, 0.0), self.body.to_model(name))

    def distal_to_model(self, name: str) -> RigidPart:
        """Return the part from the joint axis to the output frame; body in the output frame."""
        return RigidPart(self._transform(0.0, self.delta), self.body.to_model(name))


class JointSpec(DriveSpec):
    """The joint between the two parts."""

    type: Literal["revolute", "prismatic"]
    delta: Angle = Field(default=0.0, description="rotation about the axis at q = 0")

    def to_model(self) -> Actuation:
        """Return the joint."""
        friction, limits = self.friction.to_model(), self.limits.to_model()
        return Actuation(self.type, self.delta, friction, self.drive_to_model(), limits)


class UnitSpec(Document):
    """A simple joint unit."""

    proximal: PartSpec = PartSpec()
    joint: JointSpec
    distal: PartSpec = PartSpec()

    def to_model(self, name: str) -> JointUnit:
        """Return the unit under a name for reports."""
        proximal = self.proximal.proximal_to_model(f"{name}.proximal")
        return JointUnit(proximal, self.joint.to_model(), self.distal.distal_to_model(f"{name}.distal"))


class ModuleDocument(Document):
    """A module: geometry, bodies and joints between its connectors."""

    modrob: Literal["module/1"]
    name: Name
    kind: Literal["base", "link", "joint", "end-effector"]
    source: str = Field(default="", description="where the numbers come from")
    description: str = ""
    connections: dict[Name, ConnectionSpec] | None = Field(default=None, description="one per output connector")
    body: BodySpec | None = Field(default=None, description="in the input frame")
    units: list[UnitSpec] | None = Field(default=None, min_length=1, description="joint units, base to tip")

    @model_validator(mode="after")
    def _fits_kind(self) -> Self:
        if self.kind == "joint":
            if self.units is None or self.connections is not None or self.body is not None:
                raise PydanticCustomError("kind", "Input should have units, and neither connections nor body (a joint)")
        elif self.units is not None or not self.connections:
            message = "Input should have connections with at least one output, and no units (kind is {kind})"
            raise PydanticCustomError("kind", message, {"kind": self.kind})
        return self

    def to_model(self) -> Module:
        """Return the module."""
        if self.units is not None:
            units = tuple(unit.to_model(f"{self.name}.{k}") for k, unit in enumerate(self.units, start=1))
            return Module(self.name, self.kind, self.source, units=units)
        body = (self.body or MASSLESS).to_model(self.name)
        outputs = {key: RigidPart(spec.to_model(), body) for key, spec in (self.connections or {}).items()}
        return Module(self.name, self.kind, self.source, outputs=outputs)
