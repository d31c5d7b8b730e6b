"""``scenario/1``: a simulated study, repeatable."""

import difflib
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from modrob_cli.arrays import Array
from modrob_cli.interval import Interval
from modrob_cli.model.body import INERTIA_ENTRIES
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Contact, Scenario
from modrob_cli.schema.base import Document, Name
from modrob_cli.schema.scenario_parts import ContactSpec, ControlSpec, InitialSpec, SensorsSpec, Size, per_joint
from modrob_cli.schema.scenario_truth import ExactBodySpec, TruthSpec

MOST_SEED = 2**63 - 1
MOST_SUB_STEPS = 1000

Where = tuple[str | int, ...]
RobotFault = tuple[Where, str]
"""Path in the document, and what was found, what was expected."""

_SAME = 1e-6
_CHANNELS = ("position", "velocity", "effort")


def _named_once(contacts: list[ContactSpec]) -> list[ContactSpec]:
    """Refuse two contacts of one name: their labels in the log could not be told apart."""
    repeated = sorted(name for name, count in Counter(contact.name for contact in contacts).items() if count > 1)
    if repeated:
        message = "Input should name each contact once, found again: {names}"
        raise PydanticCustomError("repeated", message, {"names": ", ".join(repeated)})
    return contacts


class ScenarioDocument(Document):
    """What happens in a simulated run: true robot, payload, contacts, sensors, controller."""

    modrob: Literal["scenario/1"]
    name: Name
    source: str = ""
    description: str = ""
    seed: int = Field(default=0, ge=0, le=MOST_SEED, description="of everything that is drawn")
    control: ControlSpec = ControlSpec()
    truth: TruthSpec = TruthSpec()
    payload: ExactBodySpec | None = Field(
        default=None, description="body at the end effector, in its frame, that the controller does not know of"
    )
    contacts: Annotated[list[ContactSpec], AfterValidator(_named_once)] = []
    input_disturbance: Size = Field(
        default=0.0, description="bound of a random torque beside that of the motors, new at each command [N m] or [N]"
    )
    sensors: SensorsSpec = SensorsSpec()
    sub_steps: int = Field(default=1, ge=1, le=MOST_SUB_STEPS, description="integration steps per command")
    end_stops: bool = Field(default=True, description="the position limits stop the joints")
    saturation: bool = Field(default=True, description="torque and current limits cut the commands")
    initial: InitialSpec = InitialSpec()

    @field_validator("sensors")
    @classmethod
    def _rates_fit(cls, sensors: SensorsSpec, info: ValidationInfo) -> SensorsSpec:
        control = info.data.get("control")
        if control is None or sensors.rate is None:
            return sensors
        ratio = control.rate / sensors.rate
        if round(ratio) < 1 or abs(ratio - round(ratio)) > _SAME * ratio:
            message = "Input should have a rate that divides that of the controller, {control} Hz; found {rate} Hz"
            values = {"control": f"{control.rate:g}", "rate": f"{sensors.rate:g}"}
            raise PydanticCustomError("rate", message, values)
        return sensors

    def robot_faults(self, robot: Robot) -> Iterator[RobotFault]:
        """Everything in the document that does not fit a robot."""
        yield from self._truth_faults(robot)
        for k, contact in enumerate(self.contacts):
            yield from _link_faults(contact, ("contacts", k, "link"), robot)
        lists: list[tuple[Where, object]] = [
            (("control", "gains", key), gain) for key, gain in self.control.gains.items()
        ]
        for key in _CHANNELS:
            channel = getattr(self.sensors, key)
            lists += [(("sensors", key, part), getattr(channel, part)) for part in ("noise", "resolution")]
        lists += [(("input_disturbance",), self.input_disturbance)]
        lists += [(("initial", "q"), self.initial.q), (("initial", "dq"), self.initial.dq)]
        for where, value in lists:
            if isinstance(value, list) and len(value) != robot.dof:
                yield where, f"found {len(value)} values, expected {robot.dof}: {', '.join(robot.joint_names)}"
        yield from self._start_faults(robot)
        without = [joint.name for joint in robot.joints if joint.drive.torque_constant is None]
        if self.sensors.effort_kind == "current" and without:
            message = f"found current, but the robot {robot.name} has no torque_constant for {', '.join(without)}"
            yield ("sensors", "effort_kind"), f"{message}; add it to its file, or say torque"

    def _truth_faults(self, robot: Robot) -> Iterator[RobotFault]:
        bodies, given = [placed.body for placed in robot.bodies], self.truth.to_model()
        yield from _unknown("body", given.bodies, [body.name for body in bodies], ("truth", "bodies"), robot)
        yield from _unknown("joint", given.joints, robot.joint_names, ("truth", "joints"), robot)
        for body in bodies:
            for key, value in given.bodies.get(body.name, {}).items():
                where = ("truth", "bodies", body.name, key)
                yield from _outside(value, getattr(body, key).interval, where)
        for i, joint in enumerate(robot.joints):
            band = joint.friction.coulomb_band
            admitted = {
                "viscous": joint.friction.viscous.interval,
                "coulomb": joint.friction.coulomb.interval,
                "rotor_inertia": joint.drive.rotor_inertia.interval,
                "friction_offset": Interval(-band, band),
                "disturbance": robot.disturbance[i],
            }
            for key, number in given.joints.get(joint.name, {}).items():
                yield from _outside(np.array(number), admitted[key], ("truth", "joints", joint.name, key))

    def _start_faults(self, robot: Robot) -> Iterator[RobotFault]:
        """Positions at the start that lie beyond end stops."""
        if not self.end_stops or self.initial.q is None or len(self.initial.q) != robot.dof:
            return
        for i, (value, joint) in enumerate(zip(self.initial.q, robot.joints, strict=True)):
            low, high = joint.limits.position or (-np.inf, np.inf)
            if not low <= value <= high:
                stops = f"the end stops of {joint.name} are at {low:g} and {high:g}"
                yield ("initial", "q", i), f"found {value:g}, {stops}; start between them, or set end_stops: false"

    def to_model(self, robot: Robot) -> Scenario:
        """Return the scenario of a robot for which :meth:`robot_faults` finds nothing."""
        initial = [None if value is None else np.array(value) for value in (self.initial.q, self.initial.dq)]
        return Scenario(
            name=self.name,
            truth=self.truth.to_model(),
            payload=self.payload.to_model("scenario payload") if self.payload else None,
            contacts=tuple(_contact(spec, robot) for spec in self.contacts),
            input_disturbance=per_joint(self.input_disturbance),
            sensors=self.sensors.to_model(),
            control=self.control.to_model(),
            seed=self.seed,
            sub_steps=self.sub_steps,
            end_stops=self.end_stops,
            saturation=self.saturation,
            initial_q=initial[0],
            initial_dq=initial[1],
        )


def _unknown(what: str, given: Iterable[str], known: Sequence[str], where: Where, robot: Robot) -> Iterator[RobotFault]:
    for name in given:
        if name not in known:
            yield (*where, name), f"found the {what} {ascii(name)}, {_known_names(name, known, robot)}"


def _known_names(name: str, known: Sequence[str], robot: Robot) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    hint = f"; did you mean {close[0]}?" if close else ""
    return f"expected one of the robot {robot.name}: {', '.join(dict.fromkeys(known))}{hint}"


def _outside(value: Array, admitted: Interval, where: Where) -> Iterator[RobotFault]:
    """Faults of the elements of a value that lie outside of their intervals."""
    steps: Sequence[str | int] = INERTIA_ENTRIES if value.shape == (6,) else range(value.size)
    low, high = np.ravel(admitted.inf), np.ravel(admitted.sup)
    for k, number in enumerate(np.ravel(value)):
        if not low[k] <= number <= high[k]:
            place = (*where, steps[k]) if value.ndim else where
            found = f"found {number:.9g}, the robot's file admits {low[k]:.9g} to {high[k]:.9g}"
            yield place, f"{found}; choose a value within, or widen the interval there"


def _link_faults(contact: ContactSpec, where: Where, robot: Robot) -> Iterator[RobotFault]:
    link = contact.link
    if isinstance(link, int):
        if link > robot.dof:
            yield where, f"found link {link}, the robot {robot.name} has links 0 (base) to {robot.dof}"
    elif link not in (*robot.joint_names, "tool", "base"):
        known = [*robot.joint_names, "tool", "base"]
        yield where, f"found the link {ascii(link)}, {_known_names(link, known, robot)}"


def _contact(spec: ContactSpec, robot: Robot) -> Contact:
    """A contact whose point and force are in the frame of the link; a joint's name goes before tool and base."""
    point, force = np.array(spec.point), np.array(spec.force)
    if isinstance(spec.link, int):
        link = spec.link
    elif spec.link in robot.joint_names:
        link = robot.joint_names.index(spec.link) + 1
    elif spec.link == "base":
        link = 0
    else:
        link, tool = robot.dof, robot.tool_transform
        point = tool[:3, :3] @ point + tool[:3, 3]
        force = tool[:3, :3] @ force if spec.frame == "link" else force
    return Contact(spec.name, link, point, force, spec.start, spec.duration, spec.frame, spec.shape)
