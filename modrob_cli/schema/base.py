"""What all documents share: strict fields, names, angles, ranges, poses."""

import math
import re
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints
from pydantic_core import PydanticCustomError

from modrob_cli.arrays import Array
from modrob_cli.spatial import from_xyz_rpy


class Document(BaseModel):
    """A mapping in a file: unknown keys, NaN, inf and values of another type are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


JOINT_NAME = r"^[A-Za-z0-9_][A-Za-z0-9_.#/+ -]{0,127}$"

Name = Annotated[
    str,
    StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_+-]{0,63}$"),
    Field(description="letters, digits, _ + and -, at most 64, starting with a letter or digit"),
]
"""Name of a module, assembly, robot or connector; safe in file names, tables, XML and code."""

JointName = Annotated[
    str,
    StringConstraints(pattern=JOINT_NAME),
    Field(description="letters, digits, _ . # / + - and spaces, at most 128"),
]

_LONGEST_ANGLE = 64
_ANGLE = re.compile(
    r"(?P<sign>[-+]?)\s*"
    r"(?:(?P<factor>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*\*?\s*)?"
    r"(?P<unit>pi|deg|rad)"
    r"(?:\s*/\s*(?P<divisor>[0-9]+\.?[0-9]*|\.[0-9]+))?\Z",
    re.ASCII,
)


def parse_angle(value: Any) -> Any:
    """Angle in rad from a number or from text such as ``pi/2``, ``-3*pi/4``, ``-90 deg``, ``1.2 rad``."""
    if not isinstance(value, str):
        return value
    match = _ANGLE.match(value.strip()) if len(value) <= _LONGEST_ANGLE else None
    divisor = float(match["divisor"] or 1) if match else 0.0
    if match is None or divisor == 0.0 or (match["unit"] != "pi" and match["factor"] is None):
        raise PydanticCustomError("angle", "Input should be an angle: a number [rad], 'pi/2' or '-90 deg'")
    factor = float(match["factor"] or 1)
    size = {"pi": factor * math.pi, "rad": factor, "deg": factor * (math.pi / 180.0)}[match["unit"]] / divisor
    if match["unit"] == "deg":
        size = math.radians(factor) / divisor
    return -size if match["sign"] == "-" else size


Angle = Annotated[
    float,
    BeforeValidator(parse_angle, json_schema_input_type=float | str),
    Field(description="angle [rad], or text such as 'pi/2' or '-90 deg'"),
]


Point = Annotated[list[float], Field(min_length=3, max_length=3)]
Angles3 = Annotated[list[Angle], Field(min_length=3, max_length=3)]


def _lift_range(value: Any) -> Any:
    """Turn a plain number r into [-r, r]."""
    return [-value, value] if isinstance(value, int | float) and not isinstance(value, bool) else value


def _lift_angle_range(value: Any) -> Any:
    """Turn a plain angle, such as 2.9 or ``170 deg``, into a range about 0."""
    return _lift_range(parse_angle(value))


def _ordered(value: list[float]) -> tuple[float, float]:
    if value[0] > value[1]:
        raise PydanticCustomError("order", "Input should be [lower, upper] with lower <= upper, or one number >= 0")
    return (value[0], value[1])


Bounds = Annotated[
    list[float],
    Field(min_length=2, max_length=2),
    AfterValidator(_ordered),
    BeforeValidator(_lift_range, json_schema_input_type=float | list[float]),
    Field(description="[lower, upper], or one number r for [-r, r]"),
]
AngleBounds = Annotated[
    list[Angle],
    Field(min_length=2, max_length=2),
    AfterValidator(_ordered),
    BeforeValidator(_lift_angle_range, json_schema_input_type=float | str | list[float | str]),
    Field(description="[lower, upper], or one number r for [-r, r]; [rad] or [m]"),
]


class PoseSpec(Document):
    """A rigid transform as in URDF: translation, then R = Rz(yaw) Ry(pitch) Rx(roll)."""

    xyz: Point = Field(default=[0.0, 0.0, 0.0], description="position [m]")
    rpy: Angles3 = Field(default=[0.0, 0.0, 0.0], description="roll, pitch, yaw")

    def to_model(self) -> Array:
        """Return the transform, shape (4, 4)."""
        return from_xyz_rpy(self.xyz, self.rpy)
