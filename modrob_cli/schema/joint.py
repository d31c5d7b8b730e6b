"""Joint properties in documents."""

from typing import Any

from pydantic import Field

from modrob_cli.model.joint import Drive, Friction, Limits
from modrob_cli.schema.base import AngleBounds, Bounds, Document
from modrob_cli.schema.quantity import NonNegative, ScalarSpec

_ZERO = ScalarSpec(nominal=0.0)


class FrictionSpec(Document):
    """Link-side friction viscous dq + coulomb sgn(dq + velocity_band) + coulomb_band."""

    viscous: NonNegative = Field(default=_ZERO, description="[N m s/rad] or [N s/m]")
    coulomb: NonNegative = Field(default=_ZERO, description="[N m] or [N]")
    coulomb_band: float = Field(default=0.0, ge=0.0, description="half-width of an unknown torque [N m] or [N]")
    velocity_band: float = Field(default=0.0, ge=0.0, description="the sign is unknown below this speed [rad/s]")

    def to_model(self) -> Friction:
        """Return the friction model."""
        viscous, coulomb = self.viscous.to_model(), self.coulomb.to_model()
        return Friction(viscous, coulomb, self.coulomb_band, self.velocity_band)


class LimitsSpec(Document):
    """Admissible ranges, link side (current: motor)."""

    position: AngleBounds | None = Field(default=None, description="[rad] or [m]")
    velocity: Bounds | None = Field(default=None, description="[rad/s] or [m/s]")
    acceleration: Bounds | None = Field(default=None, description="[rad/s^2] or [m/s^2]")
    jerk: Bounds | None = Field(default=None, description="[rad/s^3] or [m/s^3]")
    torque: Bounds | None = Field(default=None, description="[N m] or [N]")
    current: Bounds | None = Field(default=None, description="[A], motor")

    def to_model(self, base: Limits | None = None) -> Limits:
        """Return the limits; those left out are taken from ``base``."""
        values: dict[str, Any] = {name: getattr(self, name) for name in type(self).model_fields}
        if base is not None:
            values = {name: value if value is not None else getattr(base, name) for name, value in values.items()}
        return Limits(**values)


class DriveSpec(Document):
    """Keys that joints in modules and robots share."""

    friction: FrictionSpec = FrictionSpec()
    rotor_inertia: NonNegative = Field(default=_ZERO, description="motor side [kg m^2]")
    gear_ratio: float = Field(default=1.0, description="motor turns per joint turn [-] or [rad/m]")
    torque_constant: float | None = Field(default=None, gt=0.0, description="motor side [N m/A]")
    stiffness: float | None = Field(default=None, gt=0.0, description="link side [N m/rad] or [N/m]")
    limits: LimitsSpec = LimitsSpec()

    def drive_to_model(self) -> Drive:
        """Return motor and gear."""
        return Drive(self.rotor_inertia.to_model(), self.gear_ratio, self.torque_constant, self.stiffness)
