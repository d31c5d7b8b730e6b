"""Bodies in documents."""

from typing import Literal

from pydantic import Field

from modrob_cli.model.body import RigidBody
from modrob_cli.schema.base import Document
from modrob_cli.schema.quantity import Inertia, InertiaSpec, NonNegative, ScalarSpec, Vector, vector_to_model

_ZERO = ScalarSpec(nominal=0.0)


class BodySpec(Document):
    """Mass, centre of mass and inertia tensor in the frame that the document names."""

    mass: NonNegative = Field(description="[kg]")
    com: Vector = Field(default=[_ZERO, _ZERO, _ZERO], description="centre of mass [m]")
    inertia: Inertia = Field(default=InertiaSpec(), description="tensor [kg m^2]")
    inertia_about: Literal["com", "frame"] = Field(
        default="com", description="point of the tensor: centre of mass, or origin of the frame"
    )

    def to_model(self, name: str) -> RigidBody:
        """Return the body under a name for reports."""
        inertia = self.inertia.to_model()
        return RigidBody(name, self.mass.to_model(), vector_to_model(self.com), inertia, self.inertia_about)


MASSLESS = BodySpec(mass=_ZERO)
"""The body of a part that has none: half of a real joint module is fictitious."""
