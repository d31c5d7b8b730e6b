"""True robots in ``scenario/1`` documents: what is carried, and how parameters are chosen."""

from collections.abc import Mapping
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, StringConstraints, field_validator, model_validator
from pydantic_core import PydanticCustomError

from modrob_cli.arrays import Array
from modrob_cli.model.realizable import realizability
from modrob_cli.model.scenario import Draw, Truth
from modrob_cli.schema.base import Document, JointName
from modrob_cli.schema.body import BodySpec
from modrob_cli.schema.quantity import Inertia, InertiaSpec, ScalarSpec
from modrob_cli.schema.scenario_parts import MOST, Moderate, ModeratePoint, NonNegativeFloat

Breakaway = Annotated[float, Field(ge=1.0, le=MOST)]


def _exact(spec: ScalarSpec | list[ScalarSpec] | InertiaSpec) -> None:
    """Refuse what has an interval; in a simulation the truth is one number.

    Raises
    ------
    PydanticCustomError
        If some part has a width.
    """
    parts = spec if isinstance(spec, list) else [spec] if isinstance(spec, ScalarSpec) else list(vars(spec).values())
    if any(part.bounds[0] != part.bounds[1] for part in parts):
        message = "Input should be exact: what is simulated has one true value; leave out min, max and tol"
        raise PydanticCustomError("exact", message)


class ExactBodySpec(BodySpec):
    """A real body without uncertainty."""

    @field_validator("mass", "com", "inertia")
    @classmethod
    def _no_width(cls, value: Any) -> Any:
        _exact(value)
        return value

    @model_validator(mode="after")
    def _is_real(self) -> Self:
        body = self.to_model("")
        size = max(float(abs(part.nominal).max()) for part in (body.mass, body.com, body.inertia))
        if size > MOST:
            raise PydanticCustomError(
                "size", "Input should have values up to {most} in SI units", {"most": f"{MOST:g}"}
            )
        if body.mass.nominal == 0.0 and not body.is_massless:
            raise PydanticCustomError("real", "Input should have a mass > 0, because it has an inertia")
        found = realizability(body)
        if not found.nominal:
            message = (
                "Input should be a real body: no principal moment about the centre of mass may exceed the sum of the "
                "two others, but they are {moments} kg m^2"
            )
            moments = ", ".join(f"{value:.4g}" for value in found.moments)
            raise PydanticCustomError("real", message, {"moments": moments})
        return self


class TrueBodySpec(Document):
    """True parameters of one body; those left out are drawn."""

    mass: NonNegativeFloat | None = Field(default=None, description="[kg]")
    com: ModeratePoint | None = Field(default=None, description="centre of mass in the frame of the body [m]")
    inertia: Inertia | None = Field(default=None, description="tensor about the point that the robot's file names")

    @field_validator("inertia")
    @classmethod
    def _no_width(cls, value: InertiaSpec | None) -> InertiaSpec | None:
        if value is not None:
            _exact(value)
        return value

    def to_model(self) -> dict[str, Array]:
        """Return what is given: mass (), com (3,), inertia (6,)."""
        inertia = None if self.inertia is None else self.inertia.to_model().nominal
        given = {"mass": self.mass, "com": self.com, "inertia": inertia}
        return {key: np.array(value, dtype=float) for key, value in given.items() if value is not None}


class TrueJointSpec(Document):
    """True parameters of one joint; those left out are drawn."""

    viscous: NonNegativeFloat | None = Field(default=None, description="[N m s/rad] or [N s/m]")
    coulomb: NonNegativeFloat | None = Field(default=None, description="[N m] or [N]")
    rotor_inertia: NonNegativeFloat | None = Field(default=None, description="motor side [kg m^2]")
    friction_offset: Moderate | None = Field(default=None, description="torque within the coulomb_band [N m] or [N]")
    disturbance: Moderate | None = Field(default=None, description="torque against the motor [N m] or [N]")

    def to_model(self) -> dict[str, float]:
        """Return what is given."""
        return {key: float(value) for key, value in vars(self).items() if value is not None}


class TruthSpec(Document):
    """How the true parameters are chosen from the intervals of the robot's file."""

    draw: Draw = Field(default="nominal", description="nominal values; uniform over intervals; or one of their ends")
    breakaway: Breakaway = Field(default=1.0, description="holding friction over Coulomb friction")
    bodies: dict[Annotated[str, StringConstraints(min_length=1, max_length=128)], TrueBodySpec] = Field(
        default={}, description="values of bodies by name"
    )
    joints: dict[JointName, TrueJointSpec] = Field(default={}, description="values of joints by name")

    def to_model(self) -> Truth:
        """Return how the truth is chosen."""
        bodies: Mapping[str, Mapping[str, Array]] = {name: spec.to_model() for name, spec in self.bodies.items()}
        joints = {name: spec.to_model() for name, spec in self.joints.items()}
        return Truth(self.draw, bodies, joints, self.breakaway)
