"""Parts of ``scenario/1`` documents: controller, contacts, sensors, initial state."""

import re
from typing import Annotated, Any

from pydantic import AfterValidator, Discriminator, Field, StringConstraints, Tag, field_validator
from pydantic_core import PydanticCustomError

from modrob_cli.model.scenario import (
    BoundsMethod,
    Channel,
    ContactFrame,
    ContactShape,
    Control,
    FrictionFrom,
    GainValue,
    NoiseShape,
    SensedEffort,
    SensedVelocity,
    Sensors,
)
from modrob_cli.schema.base import Angle, Document, Name

MOST_RATE = 1e6
"""No controller runs faster [Hz]."""
MOST_DELAY = 60.0
"""A longer delay is a slip in the unit [s]."""
MOST = 1e6
"""No simulation has larger forces, times, masses, noise, ... in SI units; keeps everything after within doubles."""
FASTEST = 1e3
"""No joint starts faster [rad/s] or [m/s]."""


def _form(value: Any) -> str:
    return "list" if isinstance(value, list) else "number"


_Many = Field(min_length=1, description="one value for each joint")
_Form = Discriminator(_form)

NonNegativeFloat = Annotated[float, Field(ge=0.0, le=MOST)]
NonNegativeAngle = Annotated[Angle, Field(ge=0.0, le=MOST)]
Moderate = Annotated[float, Field(ge=-MOST, le=MOST)]
ModeratePoint = Annotated[list[Moderate], Field(min_length=3, max_length=3)]
_GainNumber = Annotated[float, Field(ge=-(MOST**2), le=MOST**2)]
Gain = Annotated[Annotated[_GainNumber, Tag("number")] | Annotated[list[_GainNumber], _Many, Tag("list")], _Form]
"""A number for all joints, or a list with one for each."""
Size = Annotated[
    Annotated[NonNegativeFloat, Tag("number")] | Annotated[list[NonNegativeFloat], _Many, Tag("list")], _Form
]
AngleSize = Annotated[
    Annotated[NonNegativeAngle, Tag("number")] | Annotated[list[NonNegativeAngle], _Many, Tag("list")], _Form
]

_TOPIC = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}\Z", re.ASCII)


def _topic_name(value: str) -> str:
    """Refuse what cannot be part of the name of a topic."""
    if _TOPIC.match(value) is None:
        message = "Input should have letters, digits and _ only, at most 64, and start with a letter: it names a topic"
        raise PydanticCustomError("topic", message)
    return value


TopicName = Annotated[str, AfterValidator(_topic_name)]


def per_joint(value: float | list[float]) -> GainValue:
    """A number as it is, a list as a tuple."""
    return tuple(value) if isinstance(value, list) else value


class ControlSpec(Document):
    """The controller and its clock."""

    name: Annotated[str, StringConstraints(min_length=1, max_length=1000)] | None = Field(
        default=None, description="shipped controller, or a Python file FILE.py or FILE.py:NAME, relative to this file"
    )
    gains: dict[Name, Gain] = Field(default={}, description="parameters of the controller: numbers, or one per joint")
    rate: float = Field(default=1000.0, ge=1.0, le=MOST_RATE, description="commands per second [Hz]")
    friction: FrictionFrom = Field(
        default="measured", description="velocity from which friction is compensated; none: it is not"
    )
    friction_band: NonNegativeAngle = Field(
        default=0.02, description="up to this velocity the sign is a straight line [rad/s]"
    )
    bounds: BoundsMethod = Field(default="exact", description="how ia-id and ia-pb bound their perturbation")

    def to_model(self) -> Control:
        """Return controller, gains and clock."""
        gains = {name: per_joint(value) for name, value in self.gains.items()}
        return Control(self.name, gains, self.rate, self.friction, self.friction_band, self.bounds)


class ContactSpec(Document):
    """A force on a point of a link over a time window."""

    name: TopicName = Field(description="label in the log, in the topic /contacts/NAME")
    link: Annotated[
        Annotated[int, Field(ge=0), Tag("number")]
        | Annotated[str, StringConstraints(min_length=1, max_length=128), Tag("name")],
        Discriminator(lambda value: "name" if isinstance(value, str) else "number"),
    ] = Field(description="tool; base; name of the joint that moves the link; or its number, 0 for the base")
    point: ModeratePoint = Field(
        default=[0.0, 0.0, 0.0], description="where, in the frame of the link or of the tool [m]"
    )
    force: ModeratePoint = Field(description="at its largest [N]")
    start: float = Field(ge=0.0, le=MOST, description="[s]")
    duration: float = Field(gt=0.0, le=MOST, description="[s]")
    frame: ContactFrame = Field(default="base", description="axes of the force; link: it turns with the link")
    shape: ContactShape = Field(default="constant", description="a push, or half a period of a sine: a hit")

    @field_validator("duration")
    @classmethod
    def _lasts(cls, value: float, info: Any) -> float:
        start = info.data.get("start", 0.0)
        if not start + value > start:
            raise PydanticCustomError("short", "Input should be long enough to matter beside the start")
        return value


class ChannelSpec(Document):
    """Noise and quantisation of efforts."""

    noise: Size = Field(default=0.0, description="standard deviation (gaussian) or bound (uniform)")
    resolution: Size = Field(default=0.0, description="step of the quantisation, 0 for none")

    def to_model(self) -> Channel:
        """Return the channel."""
        return Channel(per_joint(self.noise), per_joint(self.resolution))


class AngleChannelSpec(ChannelSpec):
    """Noise and quantisation of positions and velocities; may be given as ``0.01 deg``."""

    noise: AngleSize = Field(default=0.0, description="standard deviation (gaussian) or bound (uniform)")
    resolution: AngleSize = Field(default=0.0, description="step of the quantisation, 0 for none")


class SensorsSpec(Document):
    """How the state is measured."""

    rate: float | None = Field(default=None, gt=0.0, le=MOST_RATE, description="samples per second [Hz]")
    noise: NoiseShape = Field(default="gaussian", description="distribution of all noise and of the jitter")
    position: AngleChannelSpec = AngleChannelSpec()
    velocity: AngleChannelSpec = AngleChannelSpec()
    effort: ChannelSpec = ChannelSpec()
    velocity_source: SensedVelocity = Field(
        default="measured", description="measured, or differences of the measured positions"
    )
    effort_kind: SensedEffort = Field(default="torque", description="what the log calls effort")
    delay: float = Field(default=0.0, ge=0.0, le=MOST_DELAY, description="age of what the controller gets [s]")
    jitter: NonNegativeFloat = Field(default=0.0, description="error of the time stamps [s]")

    def to_model(self) -> Sensors:
        """Return the sensors."""
        channels = {key: getattr(self, key).to_model() for key in ("position", "velocity", "effort")}
        same = ("rate", "noise", "velocity_source", "effort_kind", "delay", "jitter")
        return Sensors(**channels, **{key: getattr(self, key) for key in same})


_Position = Annotated[Angle, Field(ge=-MOST, le=MOST)]
_Velocity = Annotated[Angle, Field(ge=-FASTEST, le=FASTEST)]


class InitialSpec(Document):
    """State at the start; that of the motion where left out."""

    q: Annotated[list[_Position], Field(min_length=1)] | None = Field(default=None, description="[rad] or [m]")
    dq: Annotated[list[_Velocity], Field(min_length=1)] | None = Field(default=None, description="[rad/s] or [m/s]")
