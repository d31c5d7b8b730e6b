"""``robot/1``: an arm as a chain of joints and bodies; written by ``modrob assemble`` or by hand."""

from collections import Counter
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, StringConstraints, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from modrob_cli.arrays import Array
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody
from modrob_cli.model.joint import Joint
from modrob_cli.model.robot import STANDARD_GRAVITY, Robot
from modrob_cli.schema.assembly import Disturbance, disturbance_interval
from modrob_cli.schema.base import Angle, Document, JointName, Name, Point, PoseSpec
from modrob_cli.schema.body import BodySpec
from modrob_cli.schema.joint import DriveSpec
from modrob_cli.spatial import rotation, translation


class DhRowSpec(Document):
    """One row of a standard D-H table at q = 0: Rz(theta) Tz(d) Tx(a) Rx(alpha)."""

    a: float = Field(default=0.0, description="[m]")
    alpha: Angle = 0.0
    d: float = Field(default=0.0, description="[m]; a prismatic joint adds q")
    theta: Angle = Field(default=0.0, description="a revolute joint adds q")

    def fixed_part(self) -> Array:
        """D-H frame of the link in the link's joint frame: Tz(d) Tx(a) Rx(alpha), shape (4, 4)."""
        return np.asarray(translation("z", self.d) @ translation("x", self.a) @ rotation("x", self.alpha))


class RobotJointSpec(DriveSpec):
    """One joint: where it is, how it moves, what drives it."""

    name: JointName
    type: Literal["revolute", "prismatic"]
    dh: DhRowSpec | None = Field(default=None, description="D-H row of the link behind this joint")
    placement: PoseSpec | None = Field(default=None, description="joint frame (axis z) in the previous link's frame")
    offset: Angle = Field(default=0.0, description="with placement: rotation about the axis at q = 0")

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if (self.dh is None) == (self.placement is None):
            raise PydanticCustomError("form", "Input should have either dh or placement")
        if self.dh is not None and "offset" in self.model_fields_set:
            raise PydanticCustomError("form", "Input should have offset with placement only; use theta in dh")
        return self


class RobotBodySpec(BodySpec):
    """A body fixed to a link."""

    name: str = Field(default="", max_length=128)
    link: int = Field(ge=0, description="0: base; i: the link that joint i moves")
    pose: PoseSpec = Field(default=PoseSpec(), description="frame of the body in the frame of the link")


def _unique_names(joints: list[RobotJointSpec]) -> list[RobotJointSpec]:
    names = [joint.name for joint in joints]
    repeated = sorted(name for name, count in Counter(names).items() if count > 1)
    if repeated:
        message = "Input should name each joint once, found again: {names}"
        raise PydanticCustomError("repeated", message, {"names": ", ".join(repeated)})
    if len({joint.dh is None for joint in joints}) > 1:
        raise PydanticCustomError("form", "Input should give dh for all joints, or placement for all joints")
    return joints


class UsedLogSpec(Document):
    """A stretch of a log from which values of this file were identified."""

    log: str = Field(max_length=1000, description="name of the file")
    sha256: Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")] = Field(description="of the file")
    start: float = Field(default=0.0, ge=0.0, description="first sample that was used, after the start of the log [s]")
    end: float | None = Field(default=None, gt=0.0, description="last one; left out: to the end [s]")


class RobotDocument(Document):
    """A serial arm.

    With ``dh`` rows, the frame of link i is its D-H frame; with ``placement``, it is the joint's frame carried along
    by the motion. Body poses and the tool transform refer to it.
    """

    modrob: Literal["robot/1"]
    name: Name
    source: str = ""
    description: str = ""
    gravity: Point = Field(default=list(STANDARD_GRAVITY), description="free fall in the base frame [m/s^2]")
    base_transform: PoseSpec = Field(default=PoseSpec(), description="with dh: D-H frame 0 in the base frame")
    joints: Annotated[list[RobotJointSpec], Field(min_length=1), AfterValidator(_unique_names)]
    bodies: list[RobotBodySpec] = []
    tool_transform: PoseSpec = Field(default=PoseSpec(), description="end effector in the frame of the last link")
    payload: BodySpec | None = Field(default=None, description="body at the end effector, in the tool frame")
    disturbance: Disturbance = [[0.0, 0.0]]
    identified_from: list[UsedLogSpec] = Field(
        default=[], description="logs that values were fitted to, which therefore cannot validate them"
    )

    @field_validator("bodies")
    @classmethod
    def _links_exist(cls, bodies: list[RobotBodySpec], info: ValidationInfo) -> list[RobotBodySpec]:
        n = len(info.data.get("joints", ()))
        worst = max((body.link for body in bodies), default=0)
        if "joints" in info.data and worst > n:
            message = "Input should have bodies on links 0 to {n}, found link {worst}"
            raise PydanticCustomError("count", message, {"n": n, "worst": worst})
        return bodies

    @field_validator("disturbance")
    @classmethod
    def _one_or_each(cls, disturbance: list[list[float]], info: ValidationInfo) -> list[list[float]]:
        n = len(info.data.get("joints", ()))
        if "joints" in info.data and len(disturbance) not in (1, n):
            message = "Input should have one disturbance, or one for each of {n} joints"
            raise PydanticCustomError("count", message, {"n": n})
        return disturbance

    def to_model(self) -> Robot:
        """Return the robot; link frames are the joint frames carried along by the motion."""
        in_link = [np.eye(4)] + [joint.dh.fixed_part() if joint.dh else np.eye(4) for joint in self.joints]
        in_link[0] = self.base_transform.to_model()
        joints = tuple(self._joint(k, in_link[k]) for k in range(len(self.joints)))
        bodies = [
            PlacedBody(spec.link, in_link[spec.link] @ spec.pose.to_model(), spec.to_model(spec.name or f"body {k}"))
            for k, spec in enumerate(self.bodies, start=1)
        ]
        tool = in_link[-1] @ self.tool_transform.to_model()
        if self.payload is not None:
            bodies.append(PlacedBody(len(joints), tool, self.payload.to_model("payload")))
        disturbance = Interval(np.zeros(len(joints))) + disturbance_interval(self.disturbance)
        return Robot(self.name, joints, tuple(bodies), tool, np.asarray(self.gravity), disturbance)

    def _joint(self, k: int, before: Array) -> Joint:
        spec = self.joints[k]
        placement = before @ (spec.placement.to_model() if spec.placement else np.eye(4))
        offset = spec.dh.theta if spec.dh else spec.offset
        parts: dict[str, Any] = {"friction": spec.friction.to_model(), "limits": spec.limits.to_model()}
        return Joint(spec.name, spec.type, placement, offset, drive=spec.drive_to_model(), **parts)
